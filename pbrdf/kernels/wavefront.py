"""Rays from the source to the bins in batches, for an intersector that answers for batches.

The same physics as `pbrdf.kernels.transport`, with the walk replaced by calls of Embree. A
ray keeps its exact place (cell, facet, u, v, height) in float64; only the copy handed to
Embree is float32 and lifted off its facet along the normal. A hit facet returns as a
number; where on its plane the ray arrives follows in float64.
"""

import math
from collections import namedtuple

from pbrdf.kernels import jit
from pbrdf.kernels.entry import entry_line, first_ray, line_beam, wrap_into
from pbrdf.kernels.heightfield import cell_counts, facet_slopes, facet_steps
from pbrdf.kernels.shading import (
    ABSORBED,
    COS_IN,
    COS_OUT,
    LABEL,
    N_ESCAPED,
    N_LEAKED,
    N_SEGMENTS,
    N_SELF,
    N_SIDE,
    N_TRUNCATED,
    SPECULAR,
    TURN_C,
    TURN_S,
    tally_path,
)
from pbrdf.kernels.transport import bounce, exit_turn

# Columns of a ray's state: place in cell, height, direction, s axis, azimuth of the source
U, V, Z, KX, KY, KZ, SX, SY, SZ, COS_PHI, SIN_PHI, N_STATE = (
    0,
    1,
    2,
    3,
    4,
    5,
    6,
    7,
    8,
    9,
    10,
    11,
)
# Columns of a ray's cell: i, j, facet (-1 in free space), face it left (-1: none), bounces
CELL_I, CELL_J, FACET, FACE, BOUNCES, N_CELL = 0, 1, 2, 3, 4, 5
ENTERING = -2  # face left by a ray that has met nothing yet


# How the mesh lies: centre in cells, cells and height, length of its unit, lift of a ray
# off its facet in units, cells of the guard band, and the lowest height
MeshFrame = namedtuple(
    "MeshFrame", "center_x center_y center_z unit offset guard_x guard_y z_bottom"
)


@jit(allocates=False)
def enter_rays(terrain, source, first, state, cell, active):
    """Put rays `first`, first + 1 ... of a batch at their entry points in the top plane."""
    launch = source.launch
    nx, ny = cell_counts(terrain)
    line = -1
    start = 0
    end = 0
    for k in range(active.shape[0]):
        if first + k >= end:
            line = ((first + k) * source.n_lines) // source.n_rays
            start = first_ray(line, source)
            end = first_ray(line + 1, source)
            start_x, start_y, speed_x, speed_y, length, _, offset, _, _ = entry_line(
                line, source, terrain.pitch_x, terrain.pitch_y
            )
            cos_phi, sin_phi, sin_t, cos_t, cos_b, sin_b, s_x, s_y, s_z = line_beam(
                line, source
            )
        s = length * ((first + k - start + offset) / (end - start))
        x = wrap_into(start_x + speed_x * s, launch[0], launch[2])
        y = wrap_into(start_y + speed_y * s, launch[1], launch[3])
        i = min(int(x), nx - 1)
        j = min(int(y), ny - 1)
        state[k, U] = x - i
        state[k, V] = y - j
        state[k, Z] = terrain.z_top
        state[k, COS_PHI] = cos_phi
        state[k, SIN_PHI] = sin_phi
        state[k, KX] = -sin_t * cos_b
        state[k, KY] = -sin_t * sin_b
        state[k, KZ] = -cos_t
        state[k, SX] = s_x
        state[k, SY] = s_y
        state[k, SZ] = s_z
        cell[k, CELL_I] = i
        cell[k, CELL_J] = j
        cell[k, FACET] = -1
        cell[k, FACE] = ENTERING
        cell[k, BOUNCES] = 0
        active[k] = k


@jit(allocates=False)
def emit_rays(terrain, frame, state, cell, active, origins, directions):
    """Write the active rays as Embree takes them: centred, in units of a cell, float32."""
    pitch_x, pitch_y, unit = terrain.pitch_x, terrain.pitch_y, frame.unit
    for a in range(active.shape[0]):
        k = active[a]
        i = cell[k, CELL_I]
        j = cell[k, CELL_J]
        x = (i + state[k, U] - frame.center_x) * pitch_x / unit
        y = (j + state[k, V] - frame.center_y) * pitch_y / unit
        z = (state[k, Z] - frame.center_z) / unit
        facet = cell[k, FACET]
        if facet >= 0:
            # Lift the ray off its facet along the normal
            slope_x, slope_y = facet_slopes(terrain, i, j, facet)
            lift = frame.offset / math.sqrt(1.0 + slope_x * slope_x + slope_y * slope_y)
            x -= slope_x * lift
            y -= slope_y * lift
            z += lift
        origins[a, 0] = x
        origins[a, 1] = y
        origins[a, 2] = z
        directions[a, 0] = state[k, KX]
        directions[a, 1] = state[k, KY]
        directions[a, 2] = state[k, KZ]


@jit(allocates=False)
def arrive_on_facet(terrain, i, j, facet, k, state, column, row):
    """Place (u, v, z) where a ray from cell (i, j) meets a facet of the cell (column, row).

    The cell is given without wrapping, so that it lies where the ray arrives.
    """
    heights = terrain.heights
    nx, ny = cell_counts(terrain)
    ci = column % nx
    cj = row % ny
    step_x, step_y = facet_steps(terrain, ci, cj, facet)
    speed_x = state[k, KX] / terrain.pitch_x
    speed_y = state[k, KY] / terrain.pitch_y
    # Clearance above the facet's plane, and how fast it shrinks
    u = i + state[k, U] - column
    v = j + state[k, V] - row
    clear = state[k, Z] - (heights[ci, cj] + step_x * u + step_y * v)
    rate = state[k, KZ] - step_x * speed_x - step_y * speed_y
    t = 0.0
    if rate < 0.0:
        t = max(-clear / rate, 0.0)
    # Rounding may put the place a hair outside its cell
    u = min(max(u + speed_x * t, 0.0), 1.0)
    v = min(max(v + speed_y * t, 0.0), 1.0)
    return ci, cj, u, v, heights[ci, cj] + step_x * u + step_y * v


@jit(allocates=False)
def leave_mesh(terrain, frame, i, j, k, state):
    """Time at which a ray that hits nothing leaves the rectangle of the mesh."""
    nx, ny = cell_counts(terrain)
    low_x, high_x = -frame.guard_x, nx + frame.guard_x
    low_y, high_y = -frame.guard_y, ny + frame.guard_y
    t = math.inf
    x = i + state[k, U]
    y = j + state[k, V]
    if state[k, KX] != 0.0:
        t = min(
            t,
            ((high_x if state[k, KX] > 0.0 else low_x) - x)
            * terrain.pitch_x
            / state[k, KX],
        )
    if state[k, KY] != 0.0:
        t = min(
            t,
            ((high_y if state[k, KY] > 0.0 else low_y) - y)
            * terrain.pitch_y
            / state[k, KY],
        )
    return max(t, 0.0)


@jit(allocates=False)
def advance_rays(terrain, frame, faces, state, cell, active, record, optics, tally):
    """Take the active rays through the answers of Embree, and tally those whose path ends.

    faces       face hit by each active ray, -1 for none
    record      records of the rays (bounces + 1, chunk, columns)

    Keeps the rays that travel on at the front of `active`, in their order, and returns
    their number.
    """
    labels, energy, counts = terrain.labels, tally.energy, tally.counts
    max_bounces = record.shape[0] - 1
    nx, ny = cell_counts(terrain)
    guard_x, guard_y = frame.guard_x, frame.guard_y
    mesh_ny = ny + 2 * guard_y
    kept = 0
    for a in range(active.shape[0]):
        k = active[a]
        bounces = cell[k, BOUNCES]
        end = -1
        if cell[k, BOUNCES] == 0 and cell[k, FACE] == ENTERING:
            for w in range(energy.shape[0]):
                energy[w, ABSORBED] += 1.0
            counts[N_SEGMENTS] += 1
            cell[k, FACE] = -1
        face = faces[a]
        if face >= 0 and face == cell[k, FACE]:
            counts[N_SELF] += 1
            end = N_LEAKED
        elif face >= 0 and bounces == max_bounces:
            end = N_TRUNCATED
        elif face >= 0:
            column = (face // 2) // mesh_ny - guard_x
            row = (face // 2) % mesh_ny - guard_y
            facet = face % 2
            i, j, u, v, z = arrive_on_facet(
                terrain, cell[k, CELL_I], cell[k, CELL_J], facet, k, state, column, row,
            )  # fmt: skip
            state[k, U] = u
            state[k, V] = v
            state[k, Z] = z
            cell[k, CELL_I] = i
            cell[k, CELL_J] = j
            cell[k, FACET] = facet
            cell[k, FACE] = 2 * ((i + guard_x) * mesh_ny + j + guard_y) + facet
            slope_x, slope_y = facet_slopes(terrain, i, j, facet)
            (
                state[k, KX], state[k, KY], state[k, KZ],
                state[k, SX], state[k, SY], state[k, SZ],
                _, record[bounces, k, COS_IN],
                record[bounces, k, TURN_C], record[bounces, k, TURN_S],
            ) = bounce(
                state[k, KX], state[k, KY], state[k, KZ],
                state[k, SX], state[k, SY], state[k, SZ],
                slope_x, slope_y,
            )  # fmt: skip
            record[bounces, k, COS_OUT] = SPECULAR
            record[bounces, k, LABEL] = labels[i, j] if labels.size > 0 else 0
            cell[k, BOUNCES] = bounces + 1
            counts[N_SEGMENTS] += 1
        else:
            # Nothing was hit: the ray rises above the surface, or leaves the mesh below it
            t = leave_mesh(terrain, frame, cell[k, CELL_I], cell[k, CELL_J], k, state)
            height = state[k, Z] + state[k, KZ] * t if state[k, KZ] != 0.0 else state[k, Z]
            level = math.sqrt(state[k, KX] ** 2 + state[k, KY] ** 2)
            steep = state[k, KZ] >= terrain.steepest * level
            if state[k, KZ] > 0.0 and (steep or height >= terrain.z_top):
                end = N_ESCAPED if bounces > 0 else N_LEAKED
            elif not terrain.periodic:
                end = N_SIDE
            elif height < frame.z_bottom:
                end = N_LEAKED
            else:
                # Onwards from the same place one period back
                x = (
                    cell[k, CELL_I] + state[k, U] + state[k, KX] * t / terrain.pitch_x
                ) % nx
                y = (
                    cell[k, CELL_J] + state[k, V] + state[k, KY] * t / terrain.pitch_y
                ) % ny
                cell[k, CELL_I] = min(int(x), nx - 1)
                cell[k, CELL_J] = min(int(y), ny - 1)
                cell[k, FACET] = -1
                cell[k, FACE] = -1
                state[k, U] = x - cell[k, CELL_I]
                state[k, V] = y - cell[k, CELL_J]
                state[k, Z] = height
        if end < 0:
            active[kept] = k
            kept += 1
            continue
        record[bounces, k, TURN_C], record[bounces, k, TURN_S] = exit_turn(
            state[k, KX], state[k, KY], state[k, KZ],
            state[k, SX], state[k, SY], state[k, SZ],
            state[k, COS_PHI], state[k, SIN_PHI],
        )  # fmt: skip
        tally_path(
            end, record, k, bounces, state[k, KX], state[k, KY], state[k, KZ],
            state[k, COS_PHI], state[k, SIN_PHI], optics, tally,
        )  # fmt: skip
    return kept

"""The next facet of a mesh that a ray meets.

The place of a ray is kept in float64, on its facet; Embree gets a float32 copy of it lifted
off the facet, and names a facet, on whose plane the place then follows in float64. A facet
met from behind, the facet just left or a fall through the ground tell that rounding has
misled Embree, as do no other outcomes; then `pbrdf.kernels.meshes.search` decides. Rays
that go through solids meet facets from either side: `pbrdf.kernels.meshes.sides`. Of these
the counts `within` are given, which are None for rays that never enter one; the compiler
sees it.

Images of a periodic mesh are instances of one tree. A ray that leaves the box in which all
images are at hand goes on from the same place some periods back.
"""

import math

from pbrdf.kernels import jit
from pbrdf.kernels.meshes.facets import (
    BODIES,
    GROUND,
    facet_normal,
    place_on_facet,
)
from pbrdf.kernels.meshes.packets import UNTOLD, put_ray
from pbrdf.kernels.meshes.shots import (
    BELOW,
    WRONG,
    ask_embree,
    is_delicate,
    lifted,
    search,
)
from pbrdf.kernels.meshes.sides import ask_either, is_caught, is_delicate_behind
from pbrdf.kernels.terrain.heightfield import ESCAPED, HIT, LOST, SIDE

MAX_PERIODS = 100_000
# How far back along a ray from its hit another facet makes the place delicate, in lifts: so
# far, and so many times what a lift of its start moves a hit on a slanting facet
BEFORE, SLANTING, LEAST_SLANT = 4.0, 2.0, 1e-3


@jit(forceinline=True)
def time_to_side(x, k_x, low, high):
    """Time at which a coordinate leaves its range."""
    if k_x > 0.0:
        return (high - x) / k_x
    if k_x < 0.0:
        return (low - x) / k_x
    return math.inf


@jit(forceinline=True)
def end_of_way(mesh, face, image, x, y, z):
    """Bring a place on an image of a facet onto the facet itself."""
    return place_on_facet(
        mesh, face, x - mesh.images[image, 0], y - mesh.images[image, 1], z
    )


@jit(forceinline=True)
def ask(mesh, within, face, x, y, z, k_x, k_y, k_z, t_end, delicate, told):
    """Find the next facet that lies no further than t_end."""
    answer = (ESCAPED, -1, 0, t_end)
    if within is None:
        answer = ask_embree(mesh, face, x, y, z, k_x, k_y, k_z, t_end, delicate, told)
    if within is not None:
        answer = ask_either(mesh, within, face, x, y, z, k_x, k_y, k_z, t_end, delicate)
    return answer


@jit(forceinline=True)
def may_leave(mesh, within, falls, is_out):
    """Whether a ray may leave the mesh, or has passed an edge or a vertex unseen."""
    allowed = mesh.frame.kind == BODIES or not falls
    if within is not None:
        allowed = allowed and not (is_out and is_caught(within))
    return allowed


@jit(forceinline=True)
def may_mislead(mesh, within, face, x, y, z, k_x, k_y, k_z, before):
    """Whether another facet is so near a place on a facet that float32 may err."""
    n_x, n_y, n_z = facet_normal(mesh, face)
    found = False
    if within is None:
        found = is_delicate(mesh, n_x, n_y, n_z, x, y, z, k_x, k_y, k_z, before)
    if within is not None:
        found = is_delicate_behind(mesh, n_x, n_y, n_z, x, y, z, k_x, k_y, k_z, before)
    return found


@jit(allocates=False)
def seek_facet(mesh, face, delicate, x, y, z, k_x, k_y, k_z):
    """Follow a ray that never enters a solid: (fate, facet, delicate, x, y, z)."""
    return seek_told(mesh, UNTOLD, face, delicate, x, y, z, k_x, k_y, k_z)


@jit(forceinline=True)
def seek_told(mesh, told, face, delicate, x, y, z, k_x, k_y, k_z):
    """`seek_facet` of a ray of which a packet may have told what Embree finds first."""
    fate, face, delicate, x, y, z, _ = follow_ray(
        mesh, None, told, face, delicate, x, y, z, k_x, k_y, k_z
    )
    return fate, face, delicate, x, y, z


@jit(forceinline=True)
def times_to_sides(frame, x, y, z, k_x, k_y, k_z):
    """Say when a ray leaves the box of images or its heights, and when its heights."""
    t_x = time_to_side(x, k_x, frame.low_x, frame.high_x)
    t_y = time_to_side(y, k_y, frame.low_y, frame.high_y)
    t_z = time_to_side(z, k_z, frame.z_bottom, frame.z_top)
    return max(min(t_x, t_y, t_z), 0.0), t_z


@jit(forceinline=True)
def rises_off(frame, face, k_x, k_y, k_z):
    """Whether a ray leaves a facet more steeply than any facet rises."""
    free = frame.free_slope
    return face >= 0 and k_z > 0.0 and k_z * k_z >= free * free * (k_x * k_x + k_y * k_y)


@jit(forceinline=True)
def foresee(mesh, member, face, x, y, z, k_x, k_y, k_z, told):
    """Put a ray into the packet, as `seek_told` would have it shot."""
    t_end, _ = times_to_sides(mesh.frame, x, y, z, k_x, k_y, k_z)
    x, y, z = lifted(mesh, face, x, y, z)
    put_ray(mesh, member, x, y, z, k_x, k_y, k_z, t_end + mesh.frame.lift, told)


@jit(allocates=False, forceinline=True)
def follow_ray(mesh, within, told, face, delicate, x, y, z, k_x, k_y, k_z):
    """Follow a ray along the unit vector k to its end.

    Returns (fate, facet, delicate, x, y, z) there, and its way [um]. It starts on a facet,
    or in free space where that is -1. `delicate` is 1 at a place on a facet near which
    another crosses it, else 0. `told` is what a packet has told, or UNTOLD.
    """
    frame = mesh.frame
    way = 0.0
    if rises_off(frame, face, k_x, k_y, k_z):
        return ESCAPED, -1, 0, x, y, z, way
    for _ in range(MAX_PERIODS):
        t_end, t_z = times_to_sides(frame, x, y, z, k_x, k_y, k_z)
        fate, found, image, time = ask(
            mesh, within, face, x, y, z, k_x, k_y, k_z, t_end + frame.lift, delicate, told
        )
        told = UNTOLD
        is_out = t_z <= t_end or not frame.periodic
        falls = t_z <= t_end and k_z < 0.0
        if fate == ESCAPED and not may_leave(mesh, within, falls, is_out):
            fate, found, image, time = search(
                mesh, face, x, y, z, k_x, k_y, k_z, t_end + frame.lift, delicate
            )
        if fate == HIT:
            end_x, end_y, end_z = end_of_way(
                mesh, found, image, x + time * k_x, y + time * k_y, z + time * k_z
            )
            close = 0
            if frame.crossing:
                n_x, n_y, n_z = facet_normal(mesh, found)
                slant = max(abs(k_x * n_x + k_y * n_y + k_z * n_z), LEAST_SLANT)
                before = frame.lift * (BEFORE + SLANTING / slant)
                # So is the end of a way so short that its start is as near
                if time < before or may_mislead(
                    mesh, within, found, end_x, end_y, end_z, k_x, k_y, k_z, before
                ):
                    close = 1
            if close:
                # Which of the facets there comes first, float64 has to say
                fate, other, there, sooner = search(
                    mesh, face, x, y, z, k_x, k_y, k_z, time + before, delicate
                )
                if fate == HIT:
                    found, image, time = other, there, sooner
                    end_x, end_y, end_z = end_of_way(
                        mesh, found, image, x + time * k_x, y + time * k_y, z + time * k_z
                    )
            return HIT, found, close, end_x, end_y, end_z, way + time
        if fate == WRONG:
            return WRONG, -1, 0, x, y, z, way
        way += t_end
        x += t_end * k_x
        y += t_end * k_y
        z += t_end * k_z
        if t_z <= t_end:
            if k_z > 0.0:
                return ESCAPED, -1, 0, x, y, z, way
            if frame.kind == GROUND:
                return LOST, -1, 0, x, y, z, way
            return BELOW if frame.kind == BODIES else SIDE, -1, 0, x, y, z, way
        if not frame.periodic:
            if frame.kind == BODIES:
                # Nothing lies beyond the box of the bodies
                return ESCAPED if k_z > 0.0 else BELOW, -1, 0, x, y, z, way
            return SIDE, -1, 0, x, y, z, way
        # The same place, as many periods back as bring it into the middle image
        x -= frame.period_x * math.floor((x - frame.cell_x) / frame.period_x)
        y -= frame.period_y * math.floor((y - frame.cell_y) / frame.period_y)
        face = -1
        delicate = 0
    return LOST, -1, 0, x, y, z, way

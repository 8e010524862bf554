"""Where the rays of a line first meet a periodic height field: one pass for all of them.

The rays of a line travel in one vertical plane. There a ray is the line of constant
s + (z - z_start) tan(theta_i) / unit; the first point of the surface, in the direction of
the light, at which this lag reaches the ray's value is where the ray arrives. One pass
along the surface thus serves all rays of the line in their order.
"""

from pbrdf.kernels import jit
from pbrdf.kernels.terrain.entry import entry_line, first_ray, line_beam
from pbrdf.kernels.terrain.heightfield import (
    FACET_HIGH,
    FACET_LOW,
    NEVER,
    corner_heights,
    plane_height,
)

# Columns of a first meeting: cell, facet, place in the cell and height
F_I, F_J, F_FACET, F_U, F_V, F_Z, N_FIRST = 0, 1, 2, 3, 4, 5, 6


@jit(part=True, allocates=False)
def sweep_line(terrain, line, source, z_start, meetings):
    """Find the first facet of every ray of a line that starts at the height z_start.

    Writes `meetings` (rays of the line, N_FIRST).
    """
    nx, ny = terrain.heights.shape
    start_x, start_y, speed_x, speed_y, length, unit, offset, _, _ = entry_line(
        line, source, terrain.pitch_x, terrain.pitch_y
    )
    beam = line_beam(line, source)
    rays = first_ray(line + 1, source) - first_ray(line, source)
    drift = beam.sin_t / beam.cos_t / unit  # in s per height
    forward_x = speed_x >= 0.0
    forward_y = speed_y >= 0.0
    per_x = 1.0 / speed_x if speed_x != 0.0 else NEVER
    per_y = 1.0 / speed_y if speed_y != 0.0 else NEVER
    x0 = start_x
    y0 = start_y
    i = min(int(x0), nx - 1)
    j = min(int(y0), ny - 1)
    s = 0.0
    ray = 0
    lag = length * (offset / max(rays, 1))
    while ray < rays:
        t_x = (i + (1 if forward_x else 0) - x0) * per_x
        t_y = (j + (1 if forward_y else 0) - y0) * per_y
        s_out = max(min(t_x, t_y), s)
        z00, z10, z01, z11 = corner_heights(terrain.heights, i, j, True)
        highest = max(max(z00, z10), max(z01, z11))
        if s_out + (highest - z_start) * drift >= lag:
            # The light reaches into this cell: through its one or two facets
            u_in = x0 + speed_x * s - i
            v_in = y0 + speed_y * s - j
            u_out = x0 + speed_x * s_out - i
            v_out = y0 + speed_y * s_out - j
            side_in = u_in - v_in
            side_out = u_out - v_out
            split = side_in * side_out < 0.0
            side = side_in if split else side_in + side_out
            facet = FACET_LOW if side > 0.0 else FACET_HIGH
            s_a = s
            u_a = u_in
            v_a = v_in
            for part in range(2):
                s_b = s_out
                if split and part == 0:
                    s_b = s + (s_out - s) * (side_in / (side_in - side_out))
                u_b = x0 + speed_x * s_b - i
                v_b = y0 + speed_y * s_b - j
                z_a = plane_height(z00, z10, z01, z11, facet, u_a, v_a)
                z_b = plane_height(z00, z10, z01, z11, facet, u_b, v_b)
                lag_a = s_a + (z_a - z_start) * drift
                lag_b = s_b + (z_b - z_start) * drift
                while ray < rays and lag <= lag_b:
                    share = 0.0
                    if lag_b > lag_a:
                        share = min(max((lag - lag_a) / (lag_b - lag_a), 0.0), 1.0)
                    meetings[ray, F_I] = i
                    meetings[ray, F_J] = j
                    meetings[ray, F_FACET] = facet
                    meetings[ray, F_U] = u_a + share * (u_b - u_a)
                    meetings[ray, F_V] = v_a + share * (v_b - v_a)
                    meetings[ray, F_Z] = z_a + share * (z_b - z_a)
                    ray += 1
                    lag = length * ((ray + offset) / rays)
                if not split:
                    break
                facet = 1 - facet
                s_a = s_b
                u_a = u_b
                v_a = v_b

        # Into the next cell, round the period
        if t_x <= t_y:
            i += 1 if forward_x else -1
            if i == nx:
                i = 0
                x0 -= nx
            elif i < 0:
                i = nx - 1
                x0 += nx
        else:
            j += 1 if forward_y else -1
            if j == ny:
                j = 0
                y0 -= ny
            elif j < 0:
                j = ny - 1
                y0 += ny
        s = s_out

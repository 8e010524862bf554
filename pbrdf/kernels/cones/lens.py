"""Cones of directions: what two of them share, after one was mirrored by flat facets.

A cone is a cap on the unit sphere about its axis. A flat facet mirrors directions rigidly,
so its image is a cap of the same size, and what it shares with another cap is a lens
between two arcs. The flux through a lens needs no solid angle but the integral of the
directions themselves: half the integral of r x dr along its edge, in closed form.
"""

import math

from pbrdf.kernels import jit
from pbrdf.kernels.optics.frames import PARALLEL
from pbrdf.kernels.paths.random import uniform_pair
from pbrdf.kernels.paths.transport import next_facet

TWO_PI = 2.0 * math.pi
# At least two thirds of the box about a lens are lens
MAX_TRIES = 200


@jit(inline="always")
def cap_flux(along_axis, sin_half):
    """Integral of (w . direction) over a cap, from the component of w along its axis."""
    return math.pi * sin_half * sin_half * along_axis


@jit
def lens_flux(cos_between, along_1, along_2, cos_1, sin_1, cos_2, sin_2):
    """Integral of (w . direction) over what two caps share.

    along_1, along_2    components along the two axes of any vector w
    cos_1 ... sin_2     of the half-angles of the caps
    """
    if cos_between <= cos_1 * cos_2 - sin_1 * sin_2:
        return 0.0
    if cos_between >= cos_1 * cos_2 + sin_1 * sin_2:
        # The smaller cap lies inside the other
        if cos_1 >= cos_2:
            return cap_flux(along_1, sin_1)
        return cap_flux(along_2, sin_2)

    sin_between = math.sqrt((1.0 - cos_between) * (1.0 + cos_between))
    # Half widths of the arcs about the direction to the other axis
    cos_a = (cos_2 - cos_1 * cos_between) / (sin_1 * sin_between)
    cos_b = (cos_1 - cos_2 * cos_between) / (sin_2 * sin_between)
    arc_1 = math.acos(min(max(cos_a, -1.0), 1.0))
    arc_2 = math.acos(min(max(cos_b, -1.0), 1.0))
    half_chord = sin_1 * math.sin(arc_1)
    # Components of w along those directions, across each axis
    across_1 = (along_2 - cos_between * along_1) / sin_between
    across_2 = (along_1 - cos_between * along_2) / sin_between
    return (
        arc_1 * sin_1 * sin_1 * along_1
        - cos_1 * half_chord * across_1
        + arc_2 * sin_2 * sin_2 * along_2
        - cos_2 * half_chord * across_2
    )


@jit(inline="always")
def carried_axis(a_x, a_y, a_z, s_x, s_y, k_x, k_y, k_z):
    """Horizontal axis s of a beam along a, carried to the direction k on the shortest way.

    So the polarisers of an instrument serve every ray of its cone, also about the zenith,
    where the meridian frame spins. The same for the beams along -a and -k.
    """
    share = (s_x * k_x + s_y * k_y) / (1.0 + a_x * k_x + a_y * k_y + a_z * k_z)
    return s_x - share * (a_x + k_x), s_y - share * (a_y + k_y), -share * (a_z + k_z)


@jit(inline="always")
def cap_direction(a_x, a_y, a_z, s_x, s_y, cos_half, draw_a, draw_b):
    """Direction spread evenly over a cap about a with the horizontal unit vector s."""
    lift = draw_a * (1.0 - cos_half)
    sine = math.sqrt(lift * (2.0 - lift))
    c = sine * math.cos(TWO_PI * draw_b)
    d = sine * math.sin(TWO_PI * draw_b)
    # The third axis is a x s
    return (
        (1.0 - lift) * a_x + c * s_x - d * a_z * s_y,
        (1.0 - lift) * a_y + c * s_y + d * a_z * s_x,
        (1.0 - lift) * a_z + d * (a_x * s_y - a_y * s_x),
    )


@jit
def lens_box(between, half_1, half_2):
    """Lens on the plane of the stereographic projection from the axis of the first cap.

    Circles stay circles there. Returns the radius of the first disc, the centre of the
    second on the x axis and its radius, and the box (x from, to; half height).
    """
    radius_1 = 2.0 * math.tan(0.5 * half_1)
    low = 2.0 * math.tan(0.5 * (between - half_2))
    high = 2.0 * math.tan(0.5 * (between + half_2))
    center = 0.5 * (low + high)
    radius_2 = 0.5 * (high - low)
    left = max(low, -radius_1)
    right = min(high, radius_1)
    half = min(radius_1, radius_2)
    if center > 0.0:
        # Where the circles cross; the lens bulges on if that is not between the centres
        x = 0.5 * (center + (radius_1 - radius_2) * (radius_1 + radius_2) / center)
        if 0.0 < x < center and x < radius_1:
            half = math.sqrt((radius_1 - x) * (radius_1 + x))
    return radius_1, center, radius_2, left, right, half


@jit
def lens_direction(
    a_x, a_y, a_z, b_x, b_y, b_z, half_1, half_2, n_x, n_y, n_z, stream, name
):  # fmt: skip
    """Direction in the lens of the caps about a and b, spread as its cosine to n.

    Directions below the plane across n are left out.
    """
    c_x = a_y * b_z - a_z * b_y
    c_y = a_z * b_x - a_x * b_z
    c_z = a_x * b_y - a_y * b_x
    sine = math.sqrt(c_x * c_x + c_y * c_y + c_z * c_z)
    between = math.atan2(sine, a_x * b_x + a_y * b_y + a_z * b_z)
    if sine * sine > PARALLEL:
        # v across both axes, u = v x a towards b
        v_x, v_y, v_z = c_x / sine, c_y / sine, c_z / sine
    else:
        # Both about one axis: any direction across it
        c_x, c_y, c_z = (1.0 - a_x * a_x, -a_x * a_y, -a_x * a_z)
        if abs(a_x) > 0.7:
            c_x, c_y, c_z = (-a_y * a_x, 1.0 - a_y * a_y, -a_y * a_z)
        scale = 1.0 / math.sqrt(c_x * c_x + c_y * c_y + c_z * c_z)
        v_x, v_y, v_z = c_x * scale, c_y * scale, c_z * scale
    u_x = v_y * a_z - v_z * a_y
    u_y = v_z * a_x - v_x * a_z
    u_z = v_x * a_y - v_y * a_x

    radius_1, center, radius_2, left, right, half = lens_box(between, half_1, half_2)
    highest = min(1.0, n_x * a_x + n_y * a_y + n_z * a_z + math.sin(half_1))
    k_x, k_y, k_z = a_x, a_y, a_z
    for attempt in range(MAX_TRIES):
        draw_x, draw_y = uniform_pair(stream, name, 2 * attempt)
        x = left + (right - left) * draw_x
        y = half * (2.0 * draw_y - 1.0)
        outside = (x - center) * (x - center) + y * y > radius_2 * radius_2
        if outside or x * x + y * y > radius_1 * radius_1:
            continue
        quarter = 0.25 * (x * x + y * y)
        scale = 1.0 / (1.0 + quarter)
        k_x = ((1.0 - quarter) * a_x + x * u_x + y * v_x) * scale
        k_y = ((1.0 - quarter) * a_y + x * u_y + y * v_y) * scale
        k_z = ((1.0 - quarter) * a_z + x * u_z + y * v_z) * scale
        # As the solid angle of the plane's element, and as the cosine
        chance, _ = uniform_pair(stream, name, 2 * attempt + 1)
        cosine = n_x * k_x + n_y * k_y + n_z * k_z
        if chance * highest < scale * scale * cosine:
            break
    return k_x, k_y, k_z


@jit(allocates=False)
def leave(terrain, mesh, i, j, facet, u, v, z, k_x, k_y, k_z, leave_rate):
    """`next_facet` as a function of its own: rays are sent from several places."""
    return next_facet(terrain, None, mesh, i, j, facet, u, v, z, k_x, k_y, k_z, leave_rate)

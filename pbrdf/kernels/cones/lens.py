"""Cones of directions: what two of them share, after one was mirrored by flat facets.

A cone is a cap on the unit sphere about its axis. A flat facet mirrors directions rigidly,
so its image is a cap of the same size, and what it shares with another cap is a lens
between two arcs. The flux through a lens needs no solid angle but the integral of the
directions themselves: half the integral of r x dr along its edge, in closed form.
"""

import math

from pbrdf.kernels import jit
from pbrdf.kernels.optics.frames import PARALLEL
from pbrdf.kernels.optics.vectors import Vec, combined, cross, dot, scaled
from pbrdf.kernels.paths.ground import next_facet
from pbrdf.kernels.paths.random import uniform_pair

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


@jit(forceinline=True)
def cap_direction(a, s, cos_half, draw_a, draw_b):
    """Direction spread evenly over a cap about a with the unit vector s across it."""
    lift = draw_a * (1.0 - cos_half)
    sine = math.sqrt(lift * (2.0 - lift))
    azimuth = math.tau * draw_b
    return combined(
        1.0 - lift, a, sine * math.cos(azimuth), s, sine * math.sin(azimuth), cross(a, s)
    )


@jit(part=True)
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


@jit(forceinline=True)
def axes_of_pair(a, b):
    """Axes u towards b and v across both of two caps about a and b, and their distance."""
    c = cross(a, b)
    sine = math.sqrt(dot(c, c))
    between = math.atan2(sine, dot(a, b))
    if sine * sine > PARALLEL:
        v = Vec(c.x / sine, c.y / sine, c.z / sine)
    else:
        # Both about one axis: any direction across it
        c = Vec(1.0 - a.x * a.x, -a.x * a.y, -a.x * a.z)
        if abs(a.x) > 0.7:
            c = Vec(-a.y * a.x, 1.0 - a.y * a.y, -a.y * a.z)
        v = scaled(c, 1.0 / math.sqrt(dot(c, c)))
    return cross(v, a), v, between


@jit
def lens_direction(a, b, half_1, half_2, normal, stream, name):
    """Direction in the lens of the caps about a and b, spread as its cosine to a normal.

    Directions below the plane across the normal are left out.
    """
    u, v, between = axes_of_pair(a, b)
    radius_1, center, radius_2, left, right, half = lens_box(between, half_1, half_2)
    highest = min(1.0, dot(normal, a) + math.sin(half_1))
    k = a
    for attempt in range(MAX_TRIES):
        draw_x, draw_y = uniform_pair(stream, name, 2 * attempt)
        x = left + (right - left) * draw_x
        y = half * (2.0 * draw_y - 1.0)
        outside = (x - center) * (x - center) + y * y > radius_2 * radius_2
        if outside or x * x + y * y > radius_1 * radius_1:
            continue
        quarter = 0.25 * (x * x + y * y)
        scale = 1.0 / (1.0 + quarter)
        k = scaled(combined(1.0 - quarter, a, x, u, y, v), scale)
        # As the solid angle of the plane's element, and as the cosine
        chance, _ = uniform_pair(stream, name, 2 * attempt + 1)
        if chance * highest < scale * scale * dot(normal, k):
            break
    return k


@jit(allocates=False)
def leave(terrain, mesh, place, k, leave_rate):
    """`next_facet` as a function of its own: rays are sent from several places."""
    return next_facet(terrain, None, mesh, place, k, leave_rate)

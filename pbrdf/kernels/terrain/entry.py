"""Where rays enter: on parallel lines over the surface, along the azimuth of the source.

Ray after ray advances along a line, and line after line across it, so that successive rays
stay near each other. Lines are evenly spaced from a random start, and so are the rays of a
line: every point of the entry rectangle is equally likely, and none is far from a ray.
"""

import math
from collections import namedtuple

from pbrdf.kernels import jit
from pbrdf.kernels.optics.frames import carried_axis
from pbrdf.kernels.optics.vectors import Vec

# Irrational strides: successive lines take evenly spread offsets and azimuths for any count
STRIDE_OFFSET = 0.6180339887498949
STRIDE_PHI = 0.7548776662466927
STRIDE_RADIUS = 0.5698402909980532
STRIDE_ANGLE = 0.8191725133961645


# Rays of one incident direction: zenith and azimuth of the source (uniform: any azimuth),
# the entry rectangle (corner x, y and lengths [cells]), lines and rays, three random shifts
# in [0, 1) (lines, offsets, azimuths) and with a spread two more, the stream of random
# numbers of a diffuse base, and the sine of the half-angle of the source
Source = namedtuple(
    "Source",
    "sin_theta cos_theta phi uniform_phi launch n_lines n_rays shifts stream spread",
    defaults=(0.0,),
)
# Light of a line: cosine and sine of the azimuth from which dphi counts, sine and cosine of
# its zenith angle, cosine and sine of its own azimuth, and its s axis
Beam = namedtuple("Beam", "cos_phi sin_phi sin_t cos_t cos_b sin_b s")


@jit(forceinline=True)
def fraction(x):
    """Part of x after the point."""
    return x - math.floor(x)


@jit(forceinline=True)
def line_beam(line, source):
    """Light of one line: where it comes from, and its frame.

    The source is a disc of uniform radiance: directions spread over its cone so that equal
    parts of the flux through the mean surface, equal areas of the ellipse into which the
    plane sees it, get equally many lines. A polariser in front of it is carried along the
    great circle from the axis of the cone.
    """
    shifts = source.shifts
    phi = source.phi
    if source.uniform_phi:
        phi = math.tau * fraction(line * STRIDE_PHI + shifts[2])
    cos_phi = math.cos(phi)
    sin_phi = math.sin(phi)
    sin_t, cos_t = source.sin_theta, source.cos_theta
    if source.spread == 0.0:
        return Beam(
            cos_phi, sin_phi, sin_t, cos_t, cos_phi, sin_phi, Vec(sin_phi, -cos_phi, 0.0)
        )

    # The axis and two directions across it; `along` lies in its meridian plane
    radius = source.spread * math.sqrt(fraction(line * STRIDE_RADIUS + shifts[3]))
    angle = math.tau * fraction(line * STRIDE_ANGLE + shifts[4])
    along = radius * math.cos(angle)
    across = radius * math.sin(angle)
    middle = math.sqrt(1.0 - source.spread * source.spread)
    forward = middle * sin_t + along * cos_t
    x = forward * cos_phi - across * sin_phi
    y = forward * sin_phi + across * cos_phi
    level = math.sqrt(x * x + y * y)
    z = math.sqrt(max(1.0 - level * level, 0.0))
    axis = Vec(sin_t * cos_phi, sin_t * sin_phi, cos_t)
    s = carried_axis(axis, Vec(sin_phi, -cos_phi, 0.0), Vec(x, y, z))
    if level == 0.0:
        return Beam(cos_phi, sin_phi, 0.0, 1.0, cos_phi, sin_phi, s)
    return Beam(cos_phi, sin_phi, level, z, x / level, y / level, s)


@jit(forceinline=True)
def way_of(beam):
    """Direction in which the light of a line travels, away from the source."""
    return Vec(-beam.sin_t * beam.cos_b, -beam.sin_t * beam.sin_b, -beam.cos_t)


@jit(forceinline=True)
def entry_line(line, source, pitch_x, pitch_y):
    """One line of entry points, followed in the direction in which the light travels.

    Returns the start (x, y), the speed per unit of s [cells], of which one component is +1
    or -1, the range of s, the length of a unit of s [um], the offset of the first ray in
    units of the ray spacing, and cos and sin of the azimuth of the source.
    """
    launch, shifts = source.launch, source.shifts
    cos_phi, sin_phi, _, _, cos_b, sin_b, _ = line_beam(line, source)
    across = (line + shifts[0]) / source.n_lines
    offset = fraction(line * STRIDE_OFFSET + shifts[1])
    down_x = -cos_b / pitch_x
    down_y = -sin_b / pitch_y
    if abs(down_x) >= abs(down_y):
        unit = 1.0 / abs(down_x)
        start_x = launch[0] if down_x > 0.0 else launch[0] + launch[2]
        start_y = launch[1] + launch[3] * across
        length = launch[2]
    else:
        unit = 1.0 / abs(down_y)
        start_x = launch[0] + launch[2] * across
        start_y = launch[1] if down_y > 0.0 else launch[1] + launch[3]
        length = launch[3]
    return (
        start_x, start_y, down_x * unit, down_y * unit, length, unit, offset,
        cos_phi, sin_phi,
    )  # fmt: skip


@jit(forceinline=True)
def first_ray(line, source):
    """First ray of a line; the rays are dealt evenly to the lines."""
    return -((-line * source.n_rays) // source.n_lines)


@jit(forceinline=True)
def wrap_into(x, low, length):
    """Place x, brought into [low, low + length) by whole lengths."""
    return low + length * fraction((x - low) / length)


@jit(forceinline=True)
def rays_of_line(line, source, pitch_x, pitch_y):
    """Light of a line, its first ray, how many rays it has, and its entry points."""
    start_x, start_y, speed_x, speed_y, length, _, offset, _, _ = entry_line(
        line, source, pitch_x, pitch_y
    )
    first = first_ray(line, source)
    return (
        line_beam(line, source), first, first_ray(line + 1, source) - first,
        (start_x, start_y, speed_x, speed_y, length, offset),
    )  # fmt: skip


@jit(forceinline=True)
def entry_point(points, ray, rays, launch):
    """Entry point (x, y) of a ray of a line [cells]."""
    start_x, start_y, speed_x, speed_y, length, offset = points
    s = length * ((ray + offset) / rays)
    return (
        wrap_into(start_x + speed_x * s, launch[0], launch[2]),
        wrap_into(start_y + speed_y * s, launch[1], launch[3]),
    )

"""Profile of a drop that sits on a plane under gravity: the Young-Laplace equation.

Lengths in units of the capillary length. From the apex down, with the arc length s, the
inclination φ and the depth z,

    dφ/ds = 2/b + z - sin φ / x,   dx/ds = cos φ,   dz/ds = sin φ,

b being the radius of curvature at the apex (Hartland & Hartley, Axisymmetric Fluid-Liquid
Interfaces, 1976, chapter 1).
"""

import math

from pbrdf.kernels import jit

# Radius, depth, inclination and volume of a point of the profile
X, Z, PHI, VOLUME, N_POINT = 0, 1, 2, 3, 4


@jit(inline="always")
def bending(b, x, z, phi):
    """Rate dφ/ds; at the apex both curvatures are 1/b."""
    if x == 0.0:
        return 1.0 / b
    return 2.0 / b + z - math.sin(phi) / x


@jit(inline="always")
def rates(b, x, z, phi, by_angle):
    """Change of (x, z, φ, V) with φ, or with a measure that suits flat and curved parts."""
    bend = bending(b, x, z, phi)
    length = 1.0 / bend if by_angle else 1.0 / (bend + 1.0)
    rise = math.sin(phi) * length
    return math.cos(phi) * length, rise, bend * length, math.pi * x * x * rise


@jit(inline="always")
def step_on(b, x, z, phi, volume, h, by_angle):
    """One step of the classical Runge-Kutta rule."""
    x1, z1, p1, v1 = rates(b, x, z, phi, by_angle)
    x2, z2, p2, v2 = rates(
        b, x + 0.5 * h * x1, z + 0.5 * h * z1, phi + 0.5 * h * p1, by_angle
    )
    x3, z3, p3, v3 = rates(
        b, x + 0.5 * h * x2, z + 0.5 * h * z2, phi + 0.5 * h * p2, by_angle
    )
    x4, z4, p4, v4 = rates(b, x + h * x3, z + h * z3, phi + h * p3, by_angle)
    sixth = h / 6.0
    return (
        x + sixth * (x1 + 2.0 * (x2 + x3) + x4),
        z + sixth * (z1 + 2.0 * (z2 + z3) + z4),
        phi + sixth * (p1 + 2.0 * (p2 + p3) + p4),
        volume + sixth * (v1 + 2.0 * (v2 + v3) + v4),
    )


@jit(allocates=False)
def trace_profile(b, contact_angle, step, points):
    """Follow the profile from the apex to the contact angle.

    Writes the points that have room in `points` (rows, N_POINT), the last one always, and
    returns their number and the volume.
    """
    x, z, phi, volume = 0.0, 0.0, 0.0, 0.0
    rows = points.shape[0]
    count = 0
    while True:
        if count < rows:
            points[count, X] = x
            points[count, Z] = z
            points[count, PHI] = phi
            points[count, VOLUME] = volume
        count += 1
        if phi >= contact_angle:
            return count, volume
        ahead = step_on(b, x, z, phi, volume, step, False)
        if ahead[2] >= contact_angle:
            # End exactly at the contact angle
            ahead = step_on(b, x, z, phi, volume, contact_angle - phi, True)
            x, z, _, volume = ahead
            phi = contact_angle
        else:
            x, z, phi, volume = ahead

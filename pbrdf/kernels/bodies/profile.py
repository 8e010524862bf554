"""Profile of a body of revolution: a stack of slabs, in each r² = a + b s + c s².

s is the height above the reference height of the body. Places on a straight line in the
half-plane (r, s) are shares of the way from its first to its second end.
"""

import math

from pbrdf.kernels import jit

LOW, HIGH, CONSTANT, LINEAR, SQUARE = 0, 1, 2, 3, 4
FAR = 1e300
ROOT_STEPS = 100


@jit(inline="always")
def radius_squared(slabs, s):
    """Square of the radius at height s; below 0 beyond either end."""
    index = 0
    while index + 1 < slabs.shape[0] and s > slabs[index, HIGH]:
        index += 1
    return slabs[index, CONSTANT] + s * (slabs[index, LINEAR] + s * slabs[index, SQUARE])


@jit(allocates=False)
def moment_between(slabs, s_low, s_high):
    """Integral of r²/2 over the heights of the body in between: its volume over 2 π."""
    total = 0.0
    for index in range(slabs.shape[0]):
        low = max(slabs[index, LOW], s_low)
        high = min(slabs[index, HIGH], s_high)
        if high <= low:
            continue
        # About the lower end, so that small parts keep their digits
        slope = slabs[index, LINEAR] + 2.0 * low * slabs[index, SQUARE]
        squared = slabs[index, CONSTANT] + low * (
            slabs[index, LINEAR] + low * slabs[index, SQUARE]
        )
        h = high - low
        total += 0.5 * h * (squared + h * (slope / 2.0 + h * slabs[index, SQUARE] / 3.0))
    return total


@jit(allocates=False)
def widest_above(slabs, s):
    """Largest radius of the body at heights of at least s."""
    largest = 0.0
    for index in range(slabs.shape[0]):
        high = slabs[index, HIGH]
        if high <= s:
            continue
        low = max(slabs[index, LOW], s)
        a = slabs[index, CONSTANT]
        b = slabs[index, LINEAR]
        c = slabs[index, SQUARE]
        middle = low
        if c < 0.0:
            middle = min(max(-0.5 * b / c, low), high)
        for t in (low, middle, high):
            largest = max(largest, a + t * (b + c * t))
    return math.sqrt(largest)


@jit(part=True, allocates=False)
def profile_crossing(slabs, r_a, s_a, r_b, s_b):
    """Place on a segment, between one end inside and one outside, where it leaves."""
    inside_a = radius_squared(slabs, s_a) - r_a * r_a > 0.0
    low, high = 0.0, 1.0
    f_low = radius_squared(slabs, s_a) - r_a * r_a
    f_high = radius_squared(slabs, s_b) - r_b * r_b
    side = 0
    share = 0.5
    for _ in range(ROOT_STEPS):
        # Regula falsi in the Illinois form: safe, and nearly as quick as the secant
        share = (low * f_high - high * f_low) / (f_high - f_low)
        share = min(max(share, low), high)
        r = r_a + (r_b - r_a) * share
        s = s_a + (s_b - s_a) * share
        f = radius_squared(slabs, s) - r * r
        if f == 0.0 or high - low < 1e-15:
            break
        if (f > 0.0) == inside_a:
            low, f_low = share, f
            if side == 1:
                f_high *= 0.5
            side = 1
        else:
            high, f_high = share, f
            if side == 2:
                f_low *= 0.5
            side = 2
        if abs(f) < 1e-15 * (r * r + 1e-300):
            break
    return share


@jit(part=True, allocates=False)
def deepest_inside(slabs, r_a, s_a, r_b, s_b):
    """Place on a segment with both ends outside where it is inside, or -1."""
    slope = (s_b - s_a) / (r_b - r_a)
    s_0 = s_a - slope * r_a
    for index in range(slabs.shape[0]):
        b = slabs[index, LINEAR]
        c = slabs[index, SQUARE]
        square = c * slope * slope - 1.0
        if square >= 0.0:
            continue
        r = -0.5 * slope * (b + 2.0 * c * s_0) / square
        s = s_0 + slope * r
        in_slab = slabs[index, LOW] <= s <= slabs[index, HIGH]
        if in_slab and r_a < r < r_b and slabs[index, CONSTANT] + s * (b + c * s) > r * r:
            return (r - r_a) / (r_b - r_a)
    return -1.0

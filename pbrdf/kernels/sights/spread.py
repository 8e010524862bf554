"""Uniform numbers turned into those of a density that grows exponentially over a cell."""

from math import exp, expm1, log1p

from pbrdf.kernels import jit


@jit(forceinline=True)
def tilted(x, change):
    """Turn a uniform number in [0, 1) into one of a density that grows by exp(change)."""
    if abs(change) < 1e-6:
        return x
    return log1p(x * expm1(change)) / change


@jit(forceinline=True)
def tilted_density(x, change):
    """Density at x in [0, 1) that grows by exp(change) and has the mean 1."""
    if abs(change) < 1e-6:
        return 1.0
    return change * exp(change * x) / expm1(change)

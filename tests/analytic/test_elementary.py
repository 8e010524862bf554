"""The vectorising functions against 40-digit arithmetic, at their awkward arguments too."""

import mpmath
import numba
import numpy as np
import pytest

from pbrdf.analytic.symbolic import rebind
from pbrdf.kernels.optics import elementary

HALF_TURNS = np.pi / 2 * np.arange(-7, 8)


def evaluate(name, x):
    """Values of one function in a loop of its own, which then is a vector loop."""
    function = getattr(elementary, name)

    @numba.njit(nogil=True, error_model="numpy")
    def fill(x, out):
        for k in range(x.size):
            out[k] = function(x[k])

    out = np.empty_like(x)
    fill(x, out)
    return out


def worst(values, function, x, relative=True):
    """Largest deviation from the same function in 40 digits."""
    with mpmath.workdps(40):
        exact = [function(mpmath.mpf(float(v))) for v in x]
        gaps = [
            abs(mpmath.mpf(float(v)) - e) / (abs(e) if relative and e else 1)
            for v, e in zip(values, exact, strict=True)
        ]
    return float(max(gaps))


def angles():
    rng = np.random.default_rng(8)
    around = np.concatenate([HALF_TURNS, *(np.nextafter(HALF_TURNS, s) for s in (-9, 9))])
    return np.concatenate(
        [rng.uniform(-11, 11, 2000), around, 10.0 ** -np.arange(1, 300, 20)]
    )


def test_sine_and_cosine_keep_their_digits_at_every_zero():
    x = angles()
    assert worst(evaluate("sin", x), mpmath.sin, x) < 5e-16
    assert worst(evaluate("cos", x), mpmath.cos, x) < 5e-16


def test_exponential_down_to_the_smallest_normal_number():
    x = np.concatenate([np.random.default_rng(3).uniform(-708, 11, 2000), [0.0, -1e-300]])
    assert worst(evaluate("exp", x), mpmath.exp, x) < 5e-16


def test_exponential_below_the_normal_numbers():
    x = np.array([-720.0, -740.0, -745.2, -746.0, -1e5, -1e300, -np.inf])
    np.testing.assert_array_almost_equal_nulp(evaluate("exp", x), np.exp(x), nulp=1)


def test_error_function():
    x = np.concatenate(
        [np.random.default_rng(4).uniform(0, 7, 2000), [0.0, 1e-20, 1e3, 1e30]]
    )
    assert worst(evaluate("erf", x), mpmath.erf, x, relative=False) < 6e-16


@pytest.mark.parametrize("name", ["sin", "cos", "exp", "erf"])
def test_python_source_gives_the_compiled_numbers(name):
    x = np.linspace(0.01, 6.0, 200)
    source = rebind(getattr(elementary, name), {})
    plain = [source(v) for v in x]
    np.testing.assert_allclose(plain, evaluate(name, x), rtol=4e-16)

"""Sine, cosine, exponential and error function without branches, calls or tables.

A loop over a function of the C library is one call for each element; a loop over these LLVM
turns into vector instructions. Each is accurate to a few units in the last place over the
range that its docstring names, which is all that the callers need.
"""

from math import factorial, log, pi

import numpy as np

from pbrdf.kernels import jit

__all__ = ["cos", "erf", "exp", "sin"]

# Adding it rounds a small number to an integer, which then lies in the lowest bits
ROUND = 1.5 * 2.0**52
ROUND_BITS = int(np.float64(ROUND).view(np.int64))

# pi/2 and log(2) in two parts, the first with enough zero bits that its multiples are exact
HALF_PI_HIGH, HALF_PI_LOW = 0.5 * pi, 6.123233995736766e-17
LN_2_HIGH, LN_2_LOW = float.fromhex("0x1.62e42fefa0000p-1"), 1.6465949582897082e-12

# Coefficients of Taylor's series in x², from the highest
SINE = tuple((-1.0) ** k / float(factorial(2 * k + 1)) for k in range(8, 0, -1))
COSINE = tuple((-1.0) ** k / float(factorial(2 * k)) for k in range(8, 1, -1))
EXPONENTIAL = tuple(1.0 / float(factorial(k)) for k in range(13, -1, -1))

# (1 + 2 x) exp(x²) erfc(x) as a polynomial in (x - 3.75)/(x + 3.75), from the highest:
# its Chebyshev series, which falls below 1e-18 after these; M. Shepherd, J. Laframboise,
# Math. Comp. 36, 249 (1981) chose the form
SCALED_ERFC = (
    4.2514714447963895e-10,
    3.1114333809799254e-10,
    -5.1739902140113095e-09,
    -3.744210080962018e-09,
    3.8675334242222354e-08,
    2.3263508708859124e-08,
    -2.5866850716155884e-07,
    -5.7218230603224086e-08,
    1.751637648849062e-06,
    -9.73559896736775e-07,
    -1.1444146237700524e-05,
    2.238423915508223e-05,
    5.164909889268241e-05,
    -0.0002901540805408417,
    0.0002937136655913448,
    0.0017556258528952954,
    -0.009746579558029276,
    0.028362277418956406,
    -0.05869339858963677,
    0.09230432116037748,
    -0.10880393014174886,
    0.0822767384901452,
    0.0035854154854644293,
    -0.14024059858554697,
    1.2375126308378275,
)
SCALED_ERFC_EVEN, SCALED_ERFC_ODD = SCALED_ERFC[::2], SCALED_ERFC[1::2]


@jit(forceinline=True)
def horner(coefficients, x):
    """Value of a polynomial, highest coefficient first."""
    total = coefficients[0]
    for k in range(1, len(coefficients)):
        total = total * x + coefficients[k]
    return total


@jit(forceinline=True)
def sine_of_rest(rest):
    """Sine for arguments within pi/4."""
    x2 = rest * rest
    return rest + rest * x2 * horner(SINE, x2)


@jit(forceinline=True)
def cosine_of_rest(rest):
    """Cosine for arguments within pi/4."""
    x2 = rest * rest
    return 1.0 + (x2 * x2 * horner(COSINE, x2) - 0.5 * x2)


@jit(forceinline=True)
def quarter_turns(x):
    """Argument less the nearest multiple of pi/2, and which: in the two lowest bits."""
    rounded = x * (2.0 / pi) + ROUND
    turns = rounded - ROUND
    rest = (x - turns * HALF_PI_HIGH) - turns * HALF_PI_LOW
    return rest, np.float64(rounded).view(np.int64)


@jit(forceinline=True)
def sin(x):
    """Sine of an angle within 11 rad."""
    rest, turns = quarter_turns(x)
    value = cosine_of_rest(rest) if turns & 1 else sine_of_rest(rest)
    return -value if turns & 2 else value


@jit(forceinline=True)
def cos(x):
    """Cosine of an angle within 11 rad."""
    rest, turns = quarter_turns(x)
    value = sine_of_rest(rest) if turns & 1 else cosine_of_rest(rest)
    return -value if (turns + 1) & 2 else value


@jit(forceinline=True)
def power_of_two(exponent):
    """2 to a power within the normal range: the exponent's bits shifted to their place."""
    return np.int64((exponent + 1023) << 52).view(np.float64)


@jit(forceinline=True)
def exp(x):
    """Exponential for arguments up to 700; below -745 it is zero."""
    bounded = -750.0 if x < -750.0 else x
    rounded = bounded * (1.0 / log(2.0)) + ROUND
    twos = rounded - ROUND
    rest = (bounded - twos * LN_2_HIGH) - twos * LN_2_LOW
    # In two factors, since results below 1e-308 have no exponent of their own
    exponent = np.float64(rounded).view(np.int64) - ROUND_BITS
    half = exponent >> 1
    scale = power_of_two(half)
    return horner(EXPONENTIAL, rest) * scale * power_of_two(exponent - half)


@jit(forceinline=True)
def erf(x):
    """Error function for x >= 0, to 1e-16 absolute."""
    t = (x - 3.75) / (x + 3.75)
    t2 = t * t
    scaled = horner(SCALED_ERFC_EVEN, t2) + t * horner(SCALED_ERFC_ODD, t2)
    return 1.0 - exp(-x * x) * scaled / (1.0 + 2.0 * x)

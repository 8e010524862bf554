"""The two rules that every complex index N = n + i kappa must keep."""

import numpy as np
import numpy.typing as npt

from pbrdf.errors import require

__all__ = ["checked_kappa", "checked_n"]

# Beyond it a squared modulus overflows; a perfect mirror is said by infinity instead
LARGEST = 1e70


def checked_n(n: npt.ArrayLike) -> np.ndarray:
    """Real part as an array, all positive; infinity is a perfect mirror. [1]"""
    return require(
        "n", n, lambda v: (v > 0) & ((v <= LARGEST) | np.isinf(v)),
        "be > 0 and at most 1e70, or inf [1]", "A perfect mirror is n = inf.",
    )  # fmt: skip


def checked_kappa(kappa: npt.ArrayLike) -> np.ndarray:
    """Imaginary part as an array, none negative. [1]"""
    return require(
        "kappa", kappa, lambda v: (v >= 0) & (v <= LARGEST), "be >= 0 [1]",
        "The index is n + i kappa; kappa >= 0 absorbs.",
    )  # fmt: skip

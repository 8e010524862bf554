"""Whether an index that came without kappa can be that of a transparent medium."""

import re
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

from pbrdf.errors import AccuracyWarning

__all__ = ["TRANSPARENT", "doubt_of", "warn_if_absorbing"]

TRANSPARENT = "n alone: kappa = 0"
# X-rays, where every n is below 1 [um]
_X_RAYS = 0.05
# Rise of n with the wavelength that rounding and noise do not make [1]
_RISE = 0.05
# No medium that is clear in the visible refracts more [1], [um]
_HIGHEST, _VISIBLE = 3.2, 0.65
_METALS = {
    "aluminium", "aluminum", "al", "silver", "ag", "gold", "au", "copper", "cu", "iron",
    "fe", "steel", "inox", "chromium", "chrome", "cr", "nickel", "ni", "titanium", "ti",
    "tungsten", "platinum", "pt", "zinc", "zn", "brass", "bronze", "pb",
    "molybdenum", "mo", "metal", "carbon", "graphite", "soot", "silicon", "si", "ge",
    "germanium", "ito",
}  # fmt: skip


def doubt_of(name: str, n: Any) -> str:
    """Say why an index without kappa cannot, or may not, be a transparent medium's.

    Where light is not absorbed n is above 1 and falls with the wavelength.

    Parameters
    ----------
    name : str
        Of the file or material, whose words may name a metal.
    n : float or Dispersion
        Index.

    Examples
    --------
    >>> doubt_of("paint", 1.5), doubt_of("paint", 0.4)
    ('', 'n is 0.4, below 1')
    >>> doubt_of("Al-film", 1.5)
    "'al' absorbs"
    """
    waves, index = _sampled(n)
    low = np.where(waves > _X_RAYS, index, 1.0)
    if low.min() < 1.0:
        return f"n is {low.min():.4g}, below 1{_at(waves, int(low.argmin()))}"
    rise = index - np.minimum.accumulate(index)
    if rise.max() > _RISE:
        k = int(rise.argmax())
        return f"n rises by {rise[k]:.3g} towards {waves[k]:.4g} um"
    high = np.where(waves < _VISIBLE, index, 0.0)
    if high.max() > _HIGHEST:
        return f"n is {high.max():.4g}{_at(waves, int(high.argmax()))}"
    words = re.split(r"[^a-z]+", name.lower())
    return next((f"{word!r} absorbs" for word in words if word in _METALS), "")


def warn_if_absorbing(name: str, n: Any, *, stacklevel: int = 3) -> None:
    """Warn where an index without kappa is not that of a transparent medium.

    Warns
    -----
    AccuracyWarning
        With what speaks against it, and how to give kappa.
    """
    doubt = doubt_of(name, n)
    if doubt:
        msg = (
            f"{name} gives n and no kappa, so that it is transparent (kappa = 0), but "
            f"{doubt}. Give a column kappa (or k), or the number kappa beside it, 0 for "
            "a medium that is clear."
        )
        warnings.warn(msg, AccuracyWarning, stacklevel=stacklevel)


def _sampled(n: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return wavelengths and index at them; a number has NaN for a wavelength."""
    if not callable(n):
        return np.array([np.inf]), np.array([float(n)])
    law: Callable[[np.ndarray], np.ndarray] = n
    low, high = law.valid_range  # type: ignore[attr-defined]
    waves = np.geomspace(low, high, 200).clip(low, high)
    return waves, np.asarray(law(waves), float)


def _at(waves: np.ndarray, k: int) -> str:
    return f" at {waves[k]:.4g} um" if np.isfinite(waves[k]) else ""

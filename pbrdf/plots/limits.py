"""Colours and limits of an element: linear, logarithmic, logarithmic with sign."""

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.colors import Normalize

__all__ = ["SCALES", "look_of", "reach_of"]

SCALES = ("auto", "linear", "log", "symlog")
# So many decades below the largest value are shown
DECADES = 4.0
# A value is trusted with the scale when its error is at most this part of it
_TRUSTED = 0.2


def reach_of(
    values: np.ndarray, stderr: np.ndarray | None, bright: np.ndarray | None = None
) -> float:
    """Return the largest magnitude that is known; one noisy cell does not set it.

    Parameters
    ----------
    values, stderr : ndarray, one shape
    bright : ndarray of bool, that shape, optional
        Cells that carry the light: their values count whatever their errors.

    Examples
    --------
    A cell that one ray lit has an error as large as itself:

    >>> reach_of(np.array([0.5, 1.0, 9.0]), np.array([0.01, 0.02, 9.0]))
    1.0
    """
    size = np.abs(values)
    known = np.isfinite(size) & (size > 0)
    if not known.any():
        return 1.0
    if stderr is None:
        return float(np.percentile(size[known], 99.5))
    sure = known & (stderr <= _TRUSTED * size)
    counts = sure if bright is None else sure | (known & bright)
    if sure.any():
        return float(size[counts].max())
    # Nothing is sure: what stands out, one cell in twenty left out, no less than errors
    out = size[known & (size >= 2 * stderr)]
    errors = stderr[known & np.isfinite(stderr)]
    tops = [
        float(np.percentile(out, 95)) if out.size else 0.0,
        2.0 * float(np.median(errors)) if errors.size else 0.0,
        float(size[counts].max()) if counts.any() else 0.0,
    ]
    return max(tops) or float(np.percentile(size[known], 90))


def look_of(
    name: str,
    values: np.ndarray,
    stderr: np.ndarray | None,
    scale: str = "auto",
    *,
    bright: np.ndarray | None = None,
) -> "tuple[Normalize, str, dict[str, Any]]":
    """Return norm, colour map and options of the colour bar; `bright` as of `reach_of`.

    Raises
    ------
    ValueError
        If the scale is unknown, or cannot show values below zero.
    """
    from matplotlib.colors import LogNorm, Normalize, SymLogNorm

    if scale not in SCALES:
        msg = f"scale must be one of {', '.join(SCALES)}, got {scale!r}."
        raise ValueError(msg)
    if name == "AOLP":
        return Normalize(-90.0, 90.0), "twilight", {"ticks": [-90, 0, 90]}
    top = reach_of(values, stderr, bright)
    signed = name not in ("M00", "DOLP") and not name.startswith("error")
    size = np.abs(values[np.isfinite(values)])
    if scale == "auto":
        lit = size[size > 0]
        wide = (
            not name.endswith(("DOLP", "difference of AOLP"))
            and lit.size > 0
            and top > 30 * np.median(lit)
        )
        scale = ("symlog" if signed else "log") if wide else "linear"
    if scale == "log" and signed:
        if np.nanmin(values) < 0:
            scale = "symlog"
        else:
            signed = False
    over = bool((size > top * 1.001).any())
    extend = ("both" if signed else "max") if over else "neither"
    colours = "RdBu_r" if signed else "cividis"
    if scale == "log":
        extend = {"max": "both", "neither": "min"}.get(extend, extend)
        return LogNorm(top / 10**DECADES, top), colours, {"extend": extend}
    if scale == "symlog":
        low = top / 10 ** (DECADES - 1)
        whole = 10.0 ** np.arange(np.ceil(np.log10(low) + 1e-9), np.log10(top) + 1e-9)
        ticks = [*(-whole[::-1] if signed else ()), 0.0, *whole]
        norm = SymLogNorm(low, linscale=0.5, vmin=-top if signed else 0.0, vmax=top)
        return norm, colours, {"extend": extend, "ticks": ticks}
    return Normalize(-top if signed else 0.0, top), colours, {"extend": extend}

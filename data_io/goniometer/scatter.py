"""Standard errors of readings where a file states none, from their scatter."""

import numpy as np

__all__ = ["curve_keys", "standard_errors"]

# Readings with two neighbours that are enough to tell a noise by their median
_ENOUGH = 12
# Standard deviation of a normal number over the median of its size
_MEDIAN = 1.4826


def curve_keys(
    theta_i: np.ndarray,
    theta_s: np.ndarray,
    dphi: np.ndarray,
    *others: np.ndarray | None,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the curve that each reading lies on, and its place along it.

    A curve is a cut through the normal at one incidence, with its other half; `others` are
    further coordinates that tell curves apart, as azimuth of the source and wavelength.

    Parameters
    ----------
    theta_i, theta_s, dphi : ndarray, shape (n,)
        [deg]
    others : ndarray, shape (n,), or None

    Returns
    -------
    curve : ndarray of int, shape (n,)
    view : ndarray, shape (n,)
        Zenith of the detector, negative on one half. [deg]

    Examples
    --------
    >>> curve, view = curve_keys(*np.array([[30, 10, 0], [30, 20, 180], [40, 20, 0.0]]).T)
    >>> curve.tolist(), view.tolist()
    ([0, 0, 1], [-10.0, 20.0, -20.0])
    """
    turn = np.mod(np.rint(1e4 * np.mod(dphi, 360.0)) / 1e4, 360.0)
    half = np.where(turn < 180.0, -1.0, 1.0)
    columns = [theta_i, np.mod(turn, 180.0)]
    columns += [np.nan_to_num(other, nan=-1.0) for other in others if other is not None]
    keys = np.column_stack([np.rint(1e6 * column) for column in columns])
    _, curve = np.unique(keys, axis=0, return_inverse=True)
    return curve.ravel(), half * theta_s


def standard_errors(
    value: np.ndarray,
    stated: np.ndarray | None,
    curve: np.ndarray,
    view: np.ndarray,
    *,
    brightness: np.ndarray | None = None,
) -> np.ndarray:
    """Return the standard errors stated, else those that the scatter tells, else NaN.

    The noise is taken as a floor and a part of each reading: the first from how far the
    darker half lies off the lines through its neighbours, the second from the others and
    from the brightest, whichever is more. Curvature and what scales with the reading add to
    it, so that it errs upwards.

    Parameters
    ----------
    value : ndarray, shape (n,)
        Readings, NaN where nothing was measured.
    stated : ndarray, shape (n,), or None
        Standard errors; NaN and 0 are none.
    curve, view : ndarray, shape (n,)
        As `curve_keys` returns them.
    brightness : ndarray, shape (n,), optional
        What tells dark readings from bright ones, M00; the readings themselves.

    Returns
    -------
    ndarray, shape (n,)
        In the unit of the readings.
    """
    found = np.full(value.size, np.nan)
    off, level = _off_the_line(value, value if brightness is None else brightness,
                               curve, view)  # fmt: skip
    if off.size >= _ENOUGH:
        dark = level <= np.sort(level)[(level.size - 1) // 2]
        floor = _MEDIAN * float(np.median(np.abs(off[dark])))
        rest = np.sqrt(np.maximum(off**2 - floor**2, 0.0)) / np.maximum(level, 1e-300)
        # A floor hides what scales with the reading in all but the brightest
        brightest = np.argsort(level)[-_ENOUGH:]
        # Readings of one level have no brighter half
        groups = [rest[group] for group in (~dark, brightest)]
        part = _MEDIAN * max(np.median(group) for group in groups if group.size)
        lit = np.nan_to_num(value if brightness is None else brightness)
        found = np.hypot(floor, part * np.maximum(lit, 0.0))
    if stated is None:
        return found
    return np.where(np.isfinite(stated) & (stated > 0.0), stated, found)


def _off_the_line(
    value: np.ndarray, brightness: np.ndarray, curve: np.ndarray, view: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return how far readings lie off the line through their neighbours, and their level.

    The first in units of one reading, for the line has noise of its own; the second is the
    mean brightness of the three, which noise moves independently of the first.
    """
    finite = np.flatnonzero(np.isfinite(value) & np.isfinite(brightness))
    order = finite[np.lexsort((view[finite], curve[finite]))]
    before, middle, after = order[:-2], order[1:-1], order[2:]
    width = view[after] - view[before]
    inside = (curve[before] == curve[after]) & (width > 0.0)
    before, middle, after = before[inside], middle[inside], after[inside]
    share = (view[middle] - view[before]) / width[inside]
    line = (1.0 - share) * value[before] + share * value[after]
    off = (value[middle] - line) / np.sqrt(1.0 + share**2 + (1.0 - share) ** 2)
    level = (brightness[before] + brightness[middle] + brightness[after]) / 3.0
    return off, np.abs(level)

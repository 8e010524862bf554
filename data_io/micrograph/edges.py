"""Locate an edge to a fraction of a pixel, by the amount of material in every column.

Everything here works on pictures whose edges run along the columns' index; `phase` is 1 in
the material and 0 outside.
"""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage, optimize, special

from data_io.micrograph.bodies import Body

# Half-height of the window around an edge, in blurs; beyond lie 0.02 % of a Gaussian
WINDOW_BLURS = 3.5
MAX_HALF_WINDOW = 48


@dataclass(frozen=True, kw_only=True)
class Trace:
    """An edge located in every column.

    Parameters
    ----------
    columns : ndarray of int, shape (n,)
        Consecutive picture columns.
    height : ndarray, shape (n,)
        Height of the edge, towards the outside; its origin is the picture's border on the
        material's side. [pixels]
    quality : ndarray, shape (n,)
        Part of the window's variance that a blurred step explains, grain apart; 1 is a
        perfect step. [1]
    overhang : ndarray of bool, shape (n,)
        True where the material overhangs and its outermost border was taken.
    grain : ndarray, shape (2, n)
        What the same sums give where there is no edge, outside and inside: the noise of
        `height`, which is half of the one and half of the other. [pixels]
    step_width : float
        Standard deviation of the mean step along the columns. [pixels]
    upside_down : bool
        True if outside is at the bottom of the picture.
    """

    columns: np.ndarray
    height: np.ndarray
    quality: np.ndarray
    overhang: np.ndarray
    grain: np.ndarray
    step_width: float
    upside_down: bool


def trace(phase: np.ndarray, body: Body, clearance: np.ndarray) -> Trace:
    """Locate one edge by the amount of material in a window around it, column by column.

    The height of a column of material is the sum of its pixels' coverage. A picture blurred
    by a kernel of width σ holds the same sum of the heights blurred along the edge,
    whatever their slope: no curvature shift as a threshold has, and grain adds linearly, so
    that sums beside the edge measure its noise.

    Parameters
    ----------
    phase : ndarray, shape (rows, columns)
        1 in the material, 0 outside.
    body : Body
        The side to locate.
    clearance : ndarray, shape (n,)
        Largest half-height of the window that other edges allow.
    """
    image = phase[::-1] if body.upside_down else phase
    border = body.border
    slope = np.abs(np.gradient(ndimage.gaussian_filter1d(border.astype(float), 2.0)))
    width = 3.0
    for _ in range(3):
        half = np.ceil(WINDOW_BLURS * width * np.sqrt(1 + slope**2) + 2 * slope + 2)
        half = np.clip(np.minimum(half, clearance), 3, MAX_HALF_WINDOW).astype(int)
        window, offset, inside = _gather(image, body.columns, border, half)
        # Levels along the edge, where slow errors of the flattening remain
        outside_level, material_level = (
            ndimage.gaussian_filter1d(level, max(20.0, level.size / 30), mode="nearest")
            for level in inside
        )
        scaled = (window - outside_level) / (material_level - outside_level)
        within = (offset >= -half) & (offset < half)
        amount = np.where(within, scaled, 0).sum(axis=0)
        depth = half - amount  # of the edge below the row of the border
        step_width, quality = _step(scaled, offset + 0.5 - depth, within, slope)
        if abs(step_width - width) < 0.05:
            break
        width = step_width
    contrast = material_level - outside_level
    grain = np.stack(
        [
            (inside[0] - outside_level) / contrast * 2 * half,
            (inside[1] - material_level) / contrast * 2 * half,
        ]
    )
    return Trace(
        columns=body.columns,
        height=image.shape[0] - (border + depth),
        quality=quality,
        overhang=body.overhang,
        grain=grain,
        step_width=step_width,
        upside_down=body.upside_down,
    )


def _gather(
    image: np.ndarray, columns: np.ndarray, border: np.ndarray, half: np.ndarray
) -> tuple[np.ndarray, np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Return rows around the border, their offsets, and the mean levels on either side."""
    reach = 3 * int(half.max())  # a window and two of its half-heights on either side
    offset = np.arange(-reach, reach)[:, None]
    row = border + offset
    exists = (row >= 0) & (row < image.shape[0])
    window = image[np.clip(row, 0, image.shape[0] - 1), columns]
    levels = []
    for zone, fallback in (
        ((offset >= -3 * half) & (offset < -half), 0.0),
        ((offset >= half) & (offset < 3 * half), 1.0),
    ):
        weight = (zone & exists).astype(float)
        count = weight.sum(axis=0)
        total = (weight * window).sum(axis=0)
        levels.append(np.where(count >= half, total / np.maximum(count, 1), fallback))
    return window, offset, (levels[0], levels[1])


def _step(
    scaled: np.ndarray, distance: np.ndarray, within: np.ndarray, slope: np.ndarray
) -> tuple[float, np.ndarray]:
    """Return the width of the mean step, and each column's likeness to it."""
    half = within.sum(axis=0) / 2
    # Dust narrows single windows
    gentle = (slope < np.quantile(slope, 0.9) + 1e-9) & (half >= np.quantile(half, 0.1))
    # A pixel's grain shifts the edge by as much: at the window's ends, where no neighbour
    # makes up for it, the bright bins are too bright and the dark ones too dark
    reach = max(float(half[gentle].min()) - 2, 2.0)
    bins = np.arange(-reach, reach + 0.01, 0.25)
    d, s = distance[:, gentle], scaled[:, gentle]
    count = np.histogram(d, bins)[0]
    total = np.histogram(d, bins, weights=s)[0]
    filled = count > 0.02 * count.max()
    if np.count_nonzero(filled) < 8:
        # The border is nowhere near the amount of material: no step at all
        return 1.0, np.zeros(slope.size)
    centre, mean = (bins[:-1] + 0.125)[filled], total[filled] / count[filled]
    try:
        (_, width, _, _), _ = optimize.curve_fit(
            lambda d, shift, w, low, high: (
                low + (high - low) * special.ndtr((d - shift) / w)
            ),
            centre,
            mean,
            p0=(0.0, 1.5, 0.0, 1.0),
            bounds=([-2, 0.1, -0.5, 0.5], [2, 15, 0.5, 1.5]),
        )
    except RuntimeError:
        # The fit goes round without an end: the mean is like no step
        return 1.0, np.zeros(slope.size)
    model = special.ndtr(distance / (width * np.sqrt(1 + slope**2)))
    residual = (scaled - model) ** 2
    # Beyond the window there is grain alone; the median leaves specks out
    beyond = np.where(within, 0, residual).sum(axis=0) / (~within).sum(axis=0)
    grain = float(np.median(beyond))
    # Strong grain needs more columns for a verdict, and is not the same everywhere
    columns = int(np.clip(np.ceil(grain / 0.004), 1, 61))
    local = np.minimum(ndimage.uniform_filter1d(beyond, max(columns, 9)), 2 * grain)
    n = 2 * half
    excess = np.where(within, residual, 0).sum(axis=0) - n * local
    mean_model = np.where(within, model, 0).sum(axis=0) / n
    spread = np.where(within, (model - mean_model) ** 2, 0).sum(axis=0)
    unlike = ndimage.uniform_filter1d(excess / np.maximum(spread, 1e-9), columns)
    return float(width), np.clip(1 - unlike, 0, 1)


def picture_pixels(
    trace: Trace, rows: int, upright: bool, origin: tuple[int, int]
) -> np.ndarray:
    """Return row and column of the located edge in the file's picture."""
    distance = trace.height if trace.upside_down else rows - trace.height
    across, along = distance - 0.5, trace.columns.astype(float)
    pair = (along, across) if upright else (across, along)
    return np.stack(pair, axis=1) + np.asarray(origin)

"""Find the edges of a flattened picture and locate them to a fraction of a pixel.

Everything here works on pictures whose edges run along the columns' index; `phase` is 1 in
the material and 0 outside.
"""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage, optimize, special

# Half-height of the window around an edge, in blurs; beyond lie 0.02 % of a Gaussian
WINDOW_BLURS = 3.5
MAX_HALF_WINDOW = 48


@dataclass(frozen=True, kw_only=True)
class Body:
    """One side of a connected piece of material.

    Parameters
    ----------
    columns : ndarray of int, shape (n,)
        Consecutive picture columns.
    border : ndarray of int, shape (n,)
        First row of material in each, counted from the outside.
    overhang : ndarray of bool, shape (n,)
        True where there is a cavity under the outermost material.
    upside_down : bool
        True for the lower side, whose rows are counted from the picture's bottom.
    """

    columns: np.ndarray
    border: np.ndarray
    overhang: np.ndarray
    upside_down: bool


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


def segment(phase: np.ndarray, noise: float) -> np.ndarray:
    """Return the mask of the bright phase, smoothed just enough to quench the grain."""
    # Smoothing by s pixels divides white noise by 2 sqrt(pi) s; 10 % of the step is safe
    width = float(np.clip(noise / (0.1 * 2 * np.sqrt(np.pi)), 1.0, 6.0))
    return ndimage.gaussian_filter(phase, width) > 0.5


def drop_dust(mask: np.ndarray, min_span: float) -> np.ndarray:
    """Fill pieces and holes that span less than this part of rows and of columns."""
    rows, columns = mask.shape
    cleaned = mask.copy()
    for value in (True, False):
        labels, count = ndimage.label(cleaned == value)
        small = np.zeros(count + 1, dtype=bool)
        for index, box in enumerate(ndimage.find_objects(labels), start=1):
            height, width = (side.stop - side.start for side in box)
            small[index] = height < min_span * rows and width < min_span * columns
        cleaned[small[labels]] = not value
    return cleaned


def erase_dust(phase: np.ndarray, mask: np.ndarray, cleaned: np.ndarray) -> np.ndarray:
    """Set dropped dust and its blurred rim to the level of the phase around it."""
    dust = ndimage.binary_dilation(mask != cleaned, iterations=4)
    # Near the edge itself the rim cannot be told from the edge
    share = ndimage.gaussian_filter(cleaned.astype(np.float32), 2.0)
    dust &= np.abs(share - 0.5) > 0.499
    return np.where(dust, cleaned.astype(float), phase)


def find_bodies(material: np.ndarray, min_columns: int) -> list[Body]:
    """Return the sides of all pieces that span `min_columns` inside the picture."""
    bodies = []
    labels, count = ndimage.label(material)
    for label in range(1, count + 1):
        piece = labels == label
        for upside_down in (False, True):
            body = _side(piece[::-1] if upside_down else piece, min_columns, upside_down)
            if body is not None:
                bodies.append(body)
    return bodies


def _side(piece: np.ndarray, min_columns: int, upside_down: bool) -> Body | None:
    """Return the upper side of one piece, or None if it is not in the picture."""
    rows, columns = piece.shape
    present = piece.any(axis=0)
    border = piece.argmax(axis=0)
    # Where the piece touches the frame its border is the frame's, not the sample's
    usable = present & (border > 1)
    runs, count = ndimage.label(usable)
    if count == 0:
        return None
    lengths = np.bincount(runs)[1:]
    span = np.flatnonzero(runs == 1 + int(lengths.argmax()))
    if span.size < min_columns:
        return None
    border = border[span]
    start, stop = _trim_ends(border, span[0] == 0, span[-1] == columns - 1)
    if stop - start < min_columns:
        return None
    # Cavities nearer to this side than to the other
    column = piece[:, span]
    lowest = rows - 1 - column[::-1].argmax(axis=0)
    index = np.arange(rows)[:, None]
    upper_half = (index > border) & (index < (border + lowest) / 2)
    overhang = (upper_half & ~column).any(axis=0)
    part = slice(start, stop)
    return Body(
        columns=span[part],
        border=border[part],
        overhang=overhang[part],
        upside_down=upside_down,
    )


def _trim_ends(
    border: np.ndarray, starts_at_frame: bool, ends_at_frame: bool
) -> tuple[int, int]:
    """Return the part of a side before its rounded ends, if it ends inside the picture."""
    n = border.size
    if starts_at_frame and ends_at_frame:
        return 0, n
    index = np.arange(n)
    core = slice(n // 10, n - n // 10)
    line = np.polyfit(index[core], border[core], 1)
    distance = np.abs(border - np.polyval(line, index))
    limit = 4 * 1.4826 * np.median(distance) + 2
    good = np.flatnonzero(distance <= limit)
    margin = max(4, n // 30)
    start = 0 if starts_at_frame else int(good[0]) + margin
    stop = n if ends_at_frame else int(good[-1]) + 1 - margin
    return start, stop


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
    gentle = within & (slope < np.quantile(slope, 0.9) + 1e-9)
    d, s = distance[gentle], scaled[gentle]
    bins = np.arange(-20, 20.01, 0.25)
    count = np.histogram(d, bins)[0]
    total = np.histogram(d, bins, weights=s)[0]
    filled = count > 0.02 * count.max()
    centre, mean = (bins[:-1] + 0.125)[filled], total[filled] / count[filled]
    (_, width, _, _), _ = optimize.curve_fit(
        lambda d, shift, w, low, high: low + (high - low) * special.ndtr((d - shift) / w),
        centre,
        mean,
        p0=(0.0, 1.5, 0.0, 1.0),
        bounds=([-2, 0.1, -0.5, 0.5], [2, 15, 0.5, 1.5]),
    )
    model = special.ndtr(distance / (width * np.sqrt(1 + slope**2)))
    residual = (scaled - model) ** 2
    # Beyond the window there is grain alone; the median leaves specks out
    beyond = np.where(within, 0, residual).sum(axis=0) / (~within).sum(axis=0)
    grain = float(np.median(beyond))
    # Strong grain needs more columns for a verdict, and is not the same everywhere
    columns = int(np.clip(np.ceil(grain / 0.004), 1, 61))
    local = np.minimum(ndimage.uniform_filter1d(beyond, max(columns, 9)), 2 * grain)
    n = within.sum(axis=0)
    excess = np.where(within, residual, 0).sum(axis=0) - n * local
    mean_model = np.where(within, model, 0).sum(axis=0) / n
    spread = np.where(within, (model - mean_model) ** 2, 0).sum(axis=0)
    unlike = ndimage.uniform_filter1d(excess / np.maximum(spread, 1e-9), columns)
    return float(width), np.clip(1 - unlike, 0, 1)

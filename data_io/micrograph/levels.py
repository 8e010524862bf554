"""From an image file to flattened intensities: 0 in the dark phase, 1 in the bright one."""

import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy import ndimage

from pbrdf.errors import DataFileError
from pbrdf.files import file_size

# Smallest picture that can hold an edge worth statistics. [pixels]
MIN_COLUMNS, MIN_ROWS = 32, 16
# Pixels nearer to the border than this tell no level; beyond lie 0.02 % of a Gaussian
RIM_BLURS = 3.5
# Largest picture, and most pixels that a byte of a compressed one may become
MOST_PIXELS, MOST_PER_BYTE = 100_000_000, 1000


@dataclass(frozen=True, kw_only=True)
class Levels:
    """A flattened picture of two phases.

    Parameters
    ----------
    phase : ndarray, shape (rows, columns)
        0 at the local dark level, 1 at the local bright level.
    threshold : float
        Mean grey level midway between the two, where the edge is. [fraction of white]
    contrast : float
        Mean difference of the two levels. [fraction of white]
    unevenness : float
        Largest over smallest local contrast, less one. [1]
    noise : float
        Standard deviation of the grain over the contrast, robustly. [1]
    explained : float
        Part of the variance of the smoothed picture that the two levels explain. [1]
    """

    phase: np.ndarray
    threshold: float
    contrast: float
    unevenness: float
    noise: float
    explained: float


def load_grey(path: str | Path) -> tuple[np.ndarray, str]:
    """Read an image file; return grey levels in [0, 1] and the name of the channel used.

    Of a colour picture the channel (grey, red, green or blue) is taken whose histogram
    falls most clearly into two classes.
    """
    from skimage import color, util

    image = _decode(Path(path))
    if image.dtype.kind == "f":
        low, high = float(image.min()), float(image.max())
        image = (image - low) / (high - low) if high > low else np.zeros_like(image)
    image = util.img_as_float64(image)
    if image.ndim == 2:
        return image, "grey"
    if image.shape[-1] == 4:
        image = color.rgba2rgb(image)
    channels = {
        "grey": color.rgb2gray(image),
        "red": image[..., 0],
        "green": image[..., 1],
        "blue": image[..., 2],
    }
    # Grey has less noise than one channel: it wins a near draw
    score = {name: _separability(channel) for name, channel in channels.items()}
    score["grey"] += 0.02
    best = max(score, key=lambda name: score[name])
    return channels[best], best


def _decode(path: Path) -> np.ndarray:
    """Return the samples of a single picture that is large enough."""
    check_pixels(path, file_size(path))
    try:
        image = decoded(path)
    except Exception as error:  # each decoder behind imread has its own family of errors
        problem = (
            "expected a picture (PNG, TIFF, JPEG, BMP), got a file that none can decode"
        )
        raise DataFileError(path, problem, "Check the file or save it as PNG.") from error
    if image.ndim == 3 and image.shape[-1] == 2:
        image = image[..., 0]  # grey with transparency
    if image.ndim not in (2, 3) or (image.ndim == 3 and image.shape[-1] not in (3, 4)):
        problem = (
            f"expected one grey or colour picture, got an array of shape {image.shape}"
        )
        raise DataFileError(path, problem, "Save a single frame.")
    rows, columns = image.shape[:2]
    if min(rows, columns) < MIN_ROWS or max(rows, columns) < MIN_COLUMNS:
        problem = (
            f"expected at least {MIN_COLUMNS} x {MIN_ROWS} pixels, got {columns} x {rows}"
        )
        raise DataFileError(path, problem, "Use the original picture, not a thumbnail.")
    if image.dtype.kind == "f" and not np.isfinite(image).all():
        problem = "expected finite grey levels, got NaN or infinity"
        raise DataFileError(path, problem, "Fill or cut the missing pixels.")
    return image


def decoded(path: Path) -> np.ndarray:
    """Return the samples of a picture; what a decoder raises comes as it is."""
    from skimage import io

    # A decoder that refuses a file leaves it open; this closes it
    with path.open("rb") as stream, unheard():
        return np.asarray(io.imread(stream))


@contextmanager
def unheard() -> Iterator[None]:
    """Keep what tifffile logs of a damaged picture from standard error."""
    log = logging.getLogger("tifffile")
    earlier, log.disabled = log.disabled, True
    try:
        yield
    finally:
        log.disabled = earlier


def check_pixels(path: Path, size: int) -> None:
    """Refuse a picture that would fill the memory, by what its header says."""
    from PIL import Image, UnidentifiedImageError

    try:
        with (
            warnings.catch_warnings(action="ignore"),
            path.open("rb") as stream,
            Image.open(stream) as header,
        ):
            columns, rows = header.size
    except Image.DecompressionBombError as error:
        cure = "The file is damaged or hostile; cut the edge out of it."
        raise DataFileError(path, f"expected a picture: {error}"[:200], cure) from error
    except (UnidentifiedImageError, ValueError, OSError, SyntaxError):
        # The decoder says what is wrong
        return
    if columns * rows > min(MOST_PIXELS, MOST_PER_BYTE * size):
        problem = f"expected a picture, got {columns} x {rows} pixels in {size} bytes"
        cure = "The file is damaged or hostile; cut the edge out of it."
        raise DataFileError(path, problem, cure)


def _separability(channel: np.ndarray) -> float:
    """Return Otsu's part of the variance between the two classes of a histogram."""
    from skimage.filters import threshold_otsu

    step = max(1, min(channel.shape) // 512)
    sample = channel[::step, ::step]
    if np.ptp(sample) == 0:
        return 0.0
    upper = sample > threshold_otsu(sample)
    share = upper.mean()
    gap = sample[upper].mean() - sample[~upper].mean()
    return float(share * (1 - share) * gap**2 / sample.var())


def find_annotation_band(grey: np.ndarray) -> tuple[int, int]:
    """Return (first, last) row of the picture without a text band at top or bottom.

    Electron microscopes add a band of uniform ground with text. Its border is straight to
    the pixel, and it holds writing of high contrast; a silhouette has neither.
    """
    rows = grey.shape[0]
    for flipped in (False, True):
        image = grey[::-1] if flipped else grey
        ground = np.median(image[-1])
        share = np.mean(np.abs(image - ground) < 0.05, axis=1)
        in_band = share > 0.3
        height = int(np.argmin(in_band[::-1])) if not in_band.all() else rows
        if not 0.01 * rows < height < 0.25 * rows:
            continue
        writing = np.mean(np.abs(image[rows - height :] - ground) > 0.3)
        if (
            writing > 0.002
            and share[rows - height] > 0.9
            and share[rows - height - 1] < 0.1
        ):
            return (height, rows) if flipped else (0, rows - height)
    return 0, rows


def flatten(grey: np.ndarray) -> Levels | None:
    """Fit smooth dark and bright levels to a picture of two phases and scale by them.

    Both levels are quadratic polynomials of the position, fitted to the pixels of their
    class away from the border; classes and levels are found in turn, as by Ridler and
    Calvard,
    from a threshold of the whole picture and from one for each strip of columns, and the
    better result is kept. Returns None for a picture without contrast.

    References
    ----------
    .. [1] T. W. Ridler, S. Calvard, Picture thresholding using an iterative selection
    method,
       IEEE Trans. Syst. Man Cybern. 8 (1978) 630.
    """
    from skimage.filters import threshold_otsu

    # Smooth levels are fitted to a sample of the pixels
    step = max(1, int(np.sqrt(grey.size / 60_000)))
    sample = np.s_[step // 2 :: step, step // 2 :: step]
    few, smooth = grey[sample], ndimage.gaussian_filter(grey, 2.0)[sample]
    if np.ptp(smooth) < 1e-6:
        return None
    starts = [np.full(few.shape, threshold_otsu(smooth)), _strip_thresholds(smooth)]
    v, u = (np.linspace(-1, 1, n) for n in grey.shape)
    basis = _quadratics(v[sample[0]], u[sample[1]])
    fits = [
        fit
        for start in starts
        if (fit := _fit_levels(few, smooth, start, basis, step)) is not None
    ]
    if not fits:
        return None
    dark_terms, bright_terms, explained = max(fits, key=lambda fit: fit[2])
    dark, bright = _level(dark_terms, v, u), _level(bright_terms, v, u)
    if (bright <= dark).any():
        return None
    contrast = bright - dark
    phase = (grey - dark) / contrast
    # Differences of neighbours hold the grain alone; their median absolute value ignores
    # edges
    noise = np.median(np.abs(np.diff(phase[::2], axis=1))) / (0.6745 * np.sqrt(2))
    return Levels(
        phase=phase,
        threshold=float(np.mean((bright + dark) / 2)),
        contrast=float(contrast.mean()),
        unevenness=float(contrast.max() / contrast.min() - 1),
        noise=float(noise),
        explained=explained,
    )


def _strip_thresholds(smooth: np.ndarray) -> np.ndarray:
    """Threshold of each strip of columns, interpolated between their centres."""
    from skimage.filters import threshold_otsu

    columns = smooth.shape[1]
    edges = np.linspace(0, columns, 13).astype(int)
    centres = (edges[1:] + edges[:-1]) / 2
    values = [threshold_otsu(smooth[:, a:b]) for a, b in pairwise(edges)]
    return np.broadcast_to(np.interp(np.arange(columns), centres, values), smooth.shape)


def _quadratics(v: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Return 1, u, v, u², uv and v² on a grid of rows v and columns u."""
    terms = np.broadcast_arrays(np.ones((1, 1)), u[None, :], v[:, None])
    one, u, v = terms
    return np.stack([one, u, v, u * u, u * v, v * v], axis=-1)


def _level(terms: np.ndarray, v: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Evaluate a quadratic without its six terms in memory."""
    a, b, c, d, e, f = terms
    return (
        (a + b * u + d * u * u)[None, :] + (c * v + f * v * v)[:, None] + np.outer(v, e * u)
    )


def _fit_levels(
    grey: np.ndarray,
    smooth: np.ndarray,
    threshold: np.ndarray,
    basis: np.ndarray,
    step: int,
) -> tuple[np.ndarray, np.ndarray, float] | None:
    """Return terms of the dark and the bright level, and how much they explain."""
    terms = [np.zeros(basis.shape[-1])] * 2
    dark = bright = np.zeros_like(grey)
    previous = None
    for _ in range(12):
        mask = smooth > threshold
        classes = _classes(mask, smooth, step)
        if min(np.count_nonzero(c) for c in classes) < 30:
            return None
        terms = [_robust_fit(basis[c], grey[c]) for c in classes]
        dark, bright = (basis @ level for level in terms)
        if (bright - dark).min() < 0.1 * (bright - dark).mean() or (bright <= dark).any():
            return None
        threshold = (dark + bright) / 2
        if previous is not None and not np.any(mask != previous):
            break
        previous = mask
    model = np.where(smooth > threshold, bright, dark)
    explained = 1 - np.mean((smooth - model) ** 2) / np.var(smooth)
    return terms[0], terms[1], float(explained)


def _classes(mask: np.ndarray, smooth: np.ndarray, step: int) -> list[np.ndarray]:
    """Return the dark and the bright pixels that the blurred border does not reach.

    What it leaves in them, 2 % at two blurs, bends a level and with it the scale of
    heights. Where phases are too thin to keep so far away, six pixels must do.
    """
    rims = [max(RIM_BLURS * _border_width(mask, smooth), 6.0 / step), 6.0 / step]
    for rim in rims:
        # A Gaussian cut at two widths ends as a whole at the rim
        inside = ndimage.gaussian_filter(
            mask.astype(float), max(rim / 2, 0.7), truncate=2.0
        )
        classes = [inside < 0.02, inside > 0.98]
        if min(np.count_nonzero(c) for c in classes) > 0.1 * mask.size:
            break
    return classes


def _border_width(mask: np.ndarray, smooth: np.ndarray) -> float:
    """Return the width of the step across the border, smoothing included. [samples]"""
    border = mask ^ ndimage.binary_erosion(mask, border_value=1)
    if not border.any():
        return 0.0
    contrast = np.median(smooth[mask]) - np.median(smooth[~mask])
    steepness = np.median(np.hypot(*np.gradient(smooth))[border])
    # A Gaussian step of width s has the steepest slope contrast / (s sqrt(2 pi)); a border
    # between equal levels has none, and no step is wider than the picture
    width = contrast / np.sqrt(2 * np.pi) / max(steepness, 1e-9)
    return float(min(width, max(mask.shape)))


def _robust_fit(basis: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Least squares that leaves out what lies beyond four robust standard deviations."""
    keep = np.ones(values.size, dtype=bool)
    coefficients = np.zeros(basis.shape[1])
    for _ in range(3):
        # Six terms of order 1: the normal equations are well enough, and five times faster
        kept = basis[keep]
        coefficients = np.linalg.lstsq(kept.T @ kept, kept.T @ values[keep], rcond=1e-13)[0]
        residual = values - basis @ coefficients
        spread = 1.4826 * np.median(np.abs(residual[keep] - np.median(residual[keep])))
        keep = np.abs(residual) <= 4 * spread + 1e-9
        if np.count_nonzero(keep) < 2 * basis.shape[1]:
            break
    return coefficients

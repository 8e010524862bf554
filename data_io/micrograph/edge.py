"""From a located edge to a profile in micrometres, and what is known of its making."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline
from scipy.ndimage import binary_erosion, label

from data_io.micrograph.edges import Trace
from data_io.micrograph.restoration import Restored, restore
from data_io.topography.profile import Profile

# Columns less like a step than this are left out
MIN_QUALITY = 0.4
# So many times less like a step than the usual worst, a column shows something else
OUTLYING = 12.0


@dataclass(frozen=True, eq=False, repr=False, init=False)
class LocatedEdge(Profile):
    """An edge as it was located, with blur and grain in it.

    Parameters
    ----------
    x, z : ndarray, shape (m,)
        Positions, one a clear column, and heights, tilt removed. [um]
    blur : float
        Standard deviation of the camera's blur along x. [um]
    grain : ndarray, shape (k,)
        Autocorrelation of the heights' noise at 0, 1, 2 ... columns, up to where it cannot
        be told from none. [1]
    """

    blur: float
    grain: np.ndarray

    def __init__(
        self, x: npt.ArrayLike, z: npt.ArrayLike, blur: float, grain: np.ndarray
    ) -> None:
        super().__init__(x, z)
        object.__setattr__(self, "blur", blur)
        object.__setattr__(self, "grain", grain)


@dataclass(frozen=True, eq=False, repr=False, init=False)
class EdgeProfile(Profile):
    """A profile read from a picture, with what is known of its making.

    Parameters
    ----------
    x, z : ndarray, shape (n,)
        Positions and heights, tilt removed; z points from the material outwards. [um]
    quality : ndarray, shape (n,)
        Likeness of each column to a blurred step, 0 to 1. [1]
    overhang : ndarray of bool, shape (n,)
        True where the material overhangs: the outermost border is taken there, as seen
        along the normal.
    located : LocatedEdge or None
        The edge before restoration, for statistics; None with restoring=False.
    pixels : ndarray, shape (m, 2)
        Row and column of the edge in the picture before restoration; pixel centres are
        whole numbers. [pixels]
    um_per_pixel : float
        Scale. [um]
    threshold : float
        Mean grey level of the edge, midway between the phases. [fraction of white]
    contrast, grain : float
        Difference of the phases [fraction of white], and noise of a pixel over it. [1]
    blur : float
        Standard deviation of the camera's blur, which is undone unless restore=False. [um]
    noise_rms : float
        Noise of the located edge, of which the restored profile is freed. [um]
    cutoff : float
        Shortest wavelength in the profile. [um]
    slope_gain : float
        Slope rms with over without the blur divided out: how much rests on that. [1]
    tilt : float
        Angle of the mean line that was removed, counter-clockwise. [rad]
    channel : str
        Colour channel used.
    warnings : tuple of str
        What may matter to the profile.
    """

    quality: np.ndarray
    overhang: np.ndarray
    located: LocatedEdge | None
    pixels: np.ndarray
    um_per_pixel: float
    threshold: float
    contrast: float
    grain: float
    blur: float
    noise_rms: float
    cutoff: float
    slope_gain: float
    tilt: float
    channel: str
    warnings: tuple[str, ...] = field(default=())

    def __init__(self, x: npt.ArrayLike, z: npt.ArrayLike, **details: Any) -> None:
        super().__init__(x, z)
        for name, value in details.items():
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        return (
            f"EdgeProfile({self.size} points, length {self.length:.6g} um, "
            f"blur {self.blur:.3g} um, noise {self.noise_rms:.3g} um, "
            f"quality {self.quality.mean():.2f})"
        )


def edge_profile(
    trace: Trace,
    scale: float,
    restoring: bool,
    pixels: np.ndarray,
    details: dict[str, Any],
) -> EdgeProfile:
    """Remove gaps, blur, grain and tilt from a trace and give it its scale."""
    good = clear_columns(trace.quality)
    column = trace.columns.astype(float)
    height = np.interp(column, column[good], trace.height[good])
    slope, level = np.polyfit(column, height, 1)
    tilt = float(np.arctan(slope))
    restored = restore(height - (slope * column + level), trace.grain, trace.step_width)
    located = _located(trace, good, tilt, restored.blur, scale) if restoring else None
    if restoring:
        height = restored.height + slope * column + level
    # Turn the points about the first one; then read them at even steps
    along = column * np.cos(tilt) + height * np.sin(tilt)
    normal = height * np.cos(tilt) - column * np.sin(tilt)
    forward = along > np.concatenate([[-np.inf], np.maximum.accumulate(along)[:-1]])
    x = np.arange(np.floor(along[-1] - along[0]) + 1.0)
    z = CubicSpline(along[forward] - along[0], normal[forward])(x)
    nearest = np.searchsorted(along[forward] - along[0], x).clip(0, forward.sum() - 1)
    quality = trace.quality[forward][nearest]
    keep = ~_long_gaps(good[forward][nearest], int(np.ceil(2 * restored.blur)) + 2)
    return EdgeProfile(
        x[keep] * scale,
        (z[keep] - z[keep].mean()) * scale,
        quality=quality[keep],
        overhang=trace.overhang[forward][nearest][keep],
        located=located,
        pixels=pixels,
        blur=restored.blur * scale,
        noise_rms=restored.noise_rms * scale,
        cutoff=(restored.cutoff if restoring else 2.0) * scale,
        slope_gain=restored.slope_gain,
        tilt=-tilt if trace.upside_down else tilt,
        warnings=_remarks(trace, restored, restoring, good),
        **details,
    )


def _located(
    trace: Trace, good: np.ndarray, tilt: float, blur: float, scale: float
) -> LocatedEdge:
    """Turn the clear columns by shearing, which leaves them even and their noise alone.

    A turned edge differs by a displacement of its heights' own size times sin(tilt): at 5
    degrees and a slope rms of 0.25 that is 0.1 % of the slope.
    """
    column = trace.columns[good].astype(float)
    slope, level = np.polyfit(column, trace.height[good], 1)
    normal = (trace.height[good] - slope * column - level) * np.cos(tilt)
    step = scale / np.cos(tilt)
    return LocatedEdge(
        (column - column[0]) * step, normal * scale, blur * step, _grain_correlation(trace)
    )


def _grain_correlation(trace: Trace) -> np.ndarray:
    """Autocorrelation of the noise beside the edge, up to where it is lost in its own."""
    grain = trace.grain - trace.grain.mean(axis=1, keepdims=True)
    n = grain.shape[1]
    power = (np.abs(np.fft.rfft(grain, 2 * n, axis=1)) ** 2).sum(axis=0)
    found = np.fft.irfft(power)[: n // 4]
    if not found[0] > 0:
        # No grain at all, as of a drawing
        return found[:0]
    found = found / found[0]
    # Of white noise it scatters by 1 / sqrt(2 n)
    small = np.flatnonzero(found < 2 / np.sqrt(2 * n))
    return found[: int(small[0]) if small.size else found.size]


def clear_columns(quality: np.ndarray) -> np.ndarray:
    """Return False for columns unlike a step, and for those unlike their neighbours.

    Dust on the edge itself leaves a step, only a worse one than everywhere else, and moves
    it by pixels: one speck can hold more slope than the whole edge.
    """
    usual = 1 - float(np.quantile(quality, 0.1))
    clear = quality >= max(MIN_QUALITY, 1 - OUTLYING * max(usual, 0.005))
    # The rim of a speck is worse than it looks
    return binary_erosion(clear, iterations=3, border_value=1)


def _long_gaps(good: np.ndarray, longest: int) -> np.ndarray:
    """Return True for columns in runs of bad ones that are too long to bridge."""
    runs, _ = label(~good)
    return (runs > 0) & (np.bincount(runs.ravel())[runs] > longest)


def _remarks(
    trace: Trace, restored: Restored, restoring: bool, good: np.ndarray
) -> tuple[str, ...]:
    """Say in words what may matter to the statistics of this profile."""
    remarks = []
    overhang = float(trace.overhang.mean())
    if overhang > 0.002:
        remarks.append(
            f"{overhang:.1%} of the columns overhang: the outermost border is taken"
        )
    if good.mean() < 0.98:
        remarks.append(
            f"{1 - good.mean():.1%} of the columns are unclear and left out or bridged"
        )
    if restoring and restored.slope_gain > 1.15:
        remarks.append(
            f"undoing the blur raised the slope by a factor {restored.slope_gain:.2f}: "
            "use a sharper picture or a larger scale"
        )
    rms = float(np.std(restored.height))
    if restored.noise_rms > rms:
        remarks.append(
            f"the grain's noise ({restored.noise_rms:.2g} px) exceeds the height rms"
        )
    return tuple(remarks)

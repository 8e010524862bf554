"""Surface profiles from micrographs of an edge, with blur and grain undone."""

import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline

from data_io import micrograph_edges as edges
from data_io.micrograph_levels import Levels, find_annotation_band, flatten, load_grey
from data_io.micrograph_overlay import draw_edge, find_scale_bar
from data_io.micrograph_restore import Restored, restore
from data_io.profile import Profile
from pbrdf.errors import DataFileError, require

Material = Literal["auto", "dark", "bright"]
Direction = Literal["auto", "horizontal", "vertical"]

# A picture that two grey levels explain to less than this shows something else than an edge
MIN_EXPLAINED = 0.6
# Columns less like a step than this are left out
MIN_QUALITY = 0.4
# An edge with more of those, or with more overhanging columns, is no graph z(x)
MAX_UNCLEAR, MAX_OVERHANG = 0.3, 0.1
# So many times less like a step than the usual worst, a column shows something else
OUTLYING = 12.0
# Beyond this angle the columns cut the surface too obliquely. [rad]
MAX_TILT = np.deg2rad(25)


class MicrographWarning(UserWarning):
    """A picture was read, but something about it may matter to the profile."""


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


def read_profile_image(
    path: str | Path,
    um_per_pixel: float | None = None,
    *,
    edge: int | None = None,
    overlay_path: str | Path | None = None,
    **options: Any,
) -> EdgeProfile:
    """Read the profile of one edge from a micrograph that shows the sample from the side.

    Parameters
    ----------
    path, um_per_pixel, **options
        As of `read_profile_images`.
    overlay_path : str or Path, optional
        Write the picture with the edges drawn in, to check by eye.
    edge : int, optional
        Which edge, in the order of `read_profile_images`, if the picture shows several;
        else the longest is taken, with a warning.

    Returns
    -------
    EdgeProfile
        A Profile (x, z in um) with quality figures.

    Raises
    ------
    DataFileError
        If the file is no picture, shows no such edge, or has no scale.
    ValueError
        If an argument is out of range.

    Warns
    -----
    MicrographWarning
        If the edge was chosen among several or its profile needs a second look.
    """
    found = read_profile_images(path, um_per_pixel, **options)
    if overlay_path is not None:
        write_profile_overlay(overlay_path, path, found)
    if edge is not None:
        if not -len(found) <= edge < len(found):
            msg = (
                f"edge must lie in [0, {len(found) - 1}], got {edge}. "
                f"{Path(path).name} shows {len(found)} edges."
            )
            raise ValueError(msg)
        return found[edge]
    if len(found) > 1:
        msg = (
            f"{Path(path).name} shows {len(found)} edges and the longest is taken. "
            f"Give edge=0..{len(found) - 1}, or use read_profile_images."
        )
        warnings.warn(msg, MicrographWarning, stacklevel=2)
    return max(found, key=lambda profile: profile.length)


def read_profile_images(
    path: str | Path,
    um_per_pixel: float | None = None,
    *,
    scale_bar_um: float | None = None,
    material: Material = "auto",
    direction: Direction = "auto",
    crop: tuple[int, int, int, int] | None = None,
    min_span: float = 0.3,
    restoring: bool = True,
) -> list[EdgeProfile]:
    """Read the profiles of all edges in a micrograph.

    Light is flattened by two smooth levels, dust and pieces that span little of the picture
    are dropped, each edge is located in every column by the amount of material around it
    (linear in the intensities, so sub-pixel and free of curvature bias), grain and blur are
    taken out of its spectrum with the noise measured beside the edge and the blur measured
    across it, and the mean line is rotated to horizontal.

    Parameters
    ----------
    path : str or Path
        Grey or colour picture; a text band at top or bottom is left out.
    um_per_pixel : float
        Scale, unless `scale_bar_um` is given. [um]
    scale_bar_um : float, optional
        Length written at the scale bar; the bar is then searched and measured. [um]
    material : {"auto", "dark", "bright"}
        Which phase is the sample. It decides the sign of z and which side overhangs. "auto"
        takes the phase that the picture's ground surrounds, else the lower (of upright
        edges the right) one.
    direction : {"auto", "horizontal", "vertical"}
        How the edges run.
    crop : (top, bottom, left, right), optional
        Part of the picture to use. [pixels]
    min_span : float
        Part of the picture that an edge must span; what spans less is dust. [1]
    restoring : bool
        False leaves blur and grain in the profile, for other programs to treat.

    Returns
    -------
    list of EdgeProfile
        From top to bottom, or from left to right.

    Raises
    ------
    DataFileError
        If the file is no picture, shows no such edge, or has no scale.
    ValueError
        If an argument is out of range.
    """
    grey, channel = load_grey(path)
    scale = _scale(path, grey, um_per_pixel, scale_bar_um)
    require(
        "min_span",
        min_span,
        lambda v: (v > 0) & (v <= 1),
        "lie in (0, 1] [1]",
        "Give the part of the picture that an edge must span.",
    )
    for name, value, known in (
        ("material", material, ("auto", "dark", "bright")),
        ("direction", direction, ("auto", "horizontal", "vertical")),
    ):
        if value not in known:
            msg = f"{name} must be {', '.join(known)}, got {value!r}. Use one of these."
            raise ValueError(msg)
    box = _box(path, grey, crop)
    part = grey[box[0] : box[1], box[2] : box[3]]
    levels = _levels(path, part)
    mask = edges.segment(levels.phase, levels.noise)
    cleaned = edges.drop_dust(mask, min_span)
    _refuse_other_pictures(path, levels, cleaned)
    phase = edges.erase_dust(levels.phase, mask, cleaned)
    upright = direction == "vertical" or (direction == "auto" and _runs_upright(cleaned))
    if upright:
        phase, cleaned = phase.T, cleaned.T
    min_columns = max(int(min_span * cleaned.shape[1]), 32)
    if not _bright_is_material(cleaned, material):
        phase, cleaned = 1 - phase, ~cleaned
    profiles, faults = [], []
    for body in edges.find_bodies(cleaned, min_columns):
        clearance = _clearance(cleaned, body)
        trace = edges.trace(phase, body, clearance)
        fault = _fault(trace)
        if fault:
            faults.append(fault)
            continue
        pixels = _pixels(trace, cleaned.shape[0], upright, (box[0], box[2]))
        details = {
            "um_per_pixel": scale,
            "threshold": levels.threshold,
            "contrast": levels.contrast,
            "grain": levels.noise,
            "channel": channel,
        }
        profiles.append(_profile(trace, scale, restoring, pixels, details))
    if not profiles:
        found = faults[0] if faults else "found none"
        problem = f"expected a clear edge across {min_span:.0%} of the picture, {found}"
        cure = "Crop to the edge (crop=), say how it runs (direction=), or lower min_span."
        raise DataFileError(path, problem, cure)
    profiles.sort(key=lambda p: float(np.nanmean(p.pixels[:, 1 if upright else 0])))
    return profiles


def write_profile_overlay(
    overlay_path: str | Path, path: str | Path, profiles: list[EdgeProfile]
) -> None:
    """Write the picture as PNG with its edges drawn in, to check by eye.

    Green where the quality is good, red where it is poor, magenta where the edge overhangs.

    Parameters
    ----------
    overlay_path : str or Path
        The PNG to write.
    path : str or Path
        The picture that was read.
    profiles : list of EdgeProfile
        What `read_profile_images` made of it.
    """
    from skimage import io

    grey, _ = load_grey(path)
    picture = np.repeat(grey[..., None], 3, axis=-1)
    for profile in profiles:
        at = np.linspace(0, profile.size - 1, len(profile.pixels)).round().astype(int)
        draw_edge(picture, profile.pixels, profile.quality[at], profile.overhang[at])
    image = (picture * 255).round().astype(np.uint8)
    io.imsave(Path(overlay_path), image, check_contrast=False)


def _scale(
    path: str | Path,
    grey: np.ndarray,
    um_per_pixel: float | None,
    scale_bar_um: float | None,
) -> float:
    """Return the size of a pixel from the caller or from the scale bar. [um]"""
    cure = "Give the size of a pixel in um: 0.05 to 5 for light, less for electrons."
    if um_per_pixel is not None:
        rule = "lie in [1e-05, 1000] um"
        return float(
            require(
                "um_per_pixel", um_per_pixel, lambda v: (v >= 1e-5) & (v <= 1e3), rule, cure
            )
        )
    if scale_bar_um is None:
        problem = "expected a scale, got neither um_per_pixel nor scale_bar_um"
        raise DataFileError(path, problem, cure)
    length = float(
        require(
            "scale_bar_um",
            scale_bar_um,
            lambda v: (v > 0) & (v < 1e6),
            "be positive [um]",
            cure,
        )
    )
    return length / find_scale_bar(path, grey)


def _box(
    path: str | Path, grey: np.ndarray, crop: tuple[int, int, int, int] | None
) -> tuple[int, int, int, int]:
    """Return (top, bottom, left, right) of the part to use."""
    rows, columns = grey.shape
    if crop is None:
        top, bottom = find_annotation_band(grey)
        return top, bottom, 0, columns
    top, bottom, left, right = crop
    if not (0 <= top < bottom <= rows and 0 <= left < right <= columns):
        problem = f"expected crop inside {rows} rows and {columns} columns, got {crop}"
        raise DataFileError(path, problem, "Give (top, bottom, left, right) in pixels.")
    return crop


def _runs_upright(mask: np.ndarray) -> bool:
    """Return True if the phases change more often along the rows than along the columns."""
    return bool(np.sum(np.diff(mask, axis=1)) > np.sum(np.diff(mask, axis=0)))


def _fault(trace: edges.Trace) -> str | None:
    """Say why a border of two phases is no edge to take a profile from, or None."""
    unclear = float(np.mean(trace.quality < MIN_QUALITY))
    if unclear > MAX_UNCLEAR:
        return f"found one of which {unclear:.0%} is unlike a blurred step"
    overhang = float(trace.overhang.mean())
    if overhang > MAX_OVERHANG:
        return f"found one that overhangs along {overhang:.0%} of its length"
    tilt = np.arctan(np.polyfit(trace.columns, trace.height, 1)[0])
    if abs(tilt) > MAX_TILT:
        degrees = np.rad2deg(abs(tilt))
        return f"found one turned by {degrees:.0f} degrees: turn the picture first"
    return None


def _levels(path: str | Path, grey: np.ndarray) -> Levels:
    """Flatten, or say why the picture cannot be."""
    levels = flatten(grey)
    cure = "Give a picture of the sample's edge, seen from the side, on contrasting ground."
    if levels is None:
        problem = (
            "expected a bright and a dark phase with an edge between, found no two levels"
        )
        raise DataFileError(path, problem, cure)
    if levels.contrast < 0.02:
        problem = f"expected a contrast of at least 2 % of white, got {levels.contrast:.1%}"
        raise DataFileError(path, problem, "Stretch or retake the picture.")
    return levels


def _refuse_other_pictures(path: str | Path, levels: Levels, cleaned: np.ndarray) -> None:
    """Raise unless two levels parted by long edges explain the picture."""
    from scipy.ndimage import gaussian_filter

    smooth = gaussian_filter(levels.phase, 3.0)
    model = gaussian_filter(cleaned.astype(float), 3.0)
    variance = float(np.var(smooth))
    explained = (
        1 - float(np.mean((smooth - model) ** 2)) / variance if variance > 0 else 0.0
    )
    if explained < MIN_EXPLAINED:
        problem = (
            f"expected two phases parted by an edge, but they explain only "
            f"{max(explained, 0):.0%} of the picture's contrast"
        )
        cure = "Give a side view of an edge, or crop to it (crop=)."
        raise DataFileError(path, problem, cure)


def _bright_is_material(mask: np.ndarray, material: Material) -> bool:
    """Decide which phase is the sample."""
    if material != "auto":
        return material == "bright"
    frame = np.concatenate([mask[0], mask[-1], mask[:, 0], mask[:, -1]]).mean()
    if min(frame, 1 - frame) < 0.1:
        return bool(frame < 0.5)
    return bool(mask[-1].mean() > 0.5)


def _clearance(material: np.ndarray, body: edges.Body) -> np.ndarray:
    """Rows around a border that hold no other edge, a third of them for each window."""
    from scipy.ndimage import minimum_filter1d

    image = (material[::-1] if body.upside_down else material)[:, body.columns]
    index = np.arange(image.shape[0])[:, None]
    far = 10 * image.shape[0]
    below = ~image & (index > body.border)
    above = image & (index < body.border)
    thickness = np.where(below.any(axis=0), below.argmax(axis=0) - body.border, far)
    last_above = image.shape[0] - 1 - above[::-1].argmax(axis=0)
    gap = np.where(above.any(axis=0), body.border - last_above, far)
    return minimum_filter1d(np.minimum(thickness, gap), 9) // 3


def _pixels(
    trace: edges.Trace, rows: int, upright: bool, origin: tuple[int, int]
) -> np.ndarray:
    """Return row and column of the located edge in the file's picture."""
    distance = trace.height if trace.upside_down else rows - trace.height
    across, along = distance - 0.5, trace.columns.astype(float)
    pair = (along, across) if upright else (across, along)
    return np.stack(pair, axis=1) + np.asarray(origin)


def _profile(
    trace: edges.Trace,
    scale: float,
    restoring: bool,
    pixels: np.ndarray,
    details: dict[str, Any],
) -> EdgeProfile:
    """Remove gaps, blur, grain and tilt from a trace and give it its scale."""
    good = _clear(trace.quality)
    column = trace.columns.astype(float)
    height = np.interp(column, column[good], trace.height[good])
    slope, level = np.polyfit(column, height, 1)
    tilt = float(np.arctan(slope))
    restored = restore(height - (slope * column + level), trace.grain, trace.step_width)
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
        pixels=pixels,
        blur=restored.blur * scale,
        noise_rms=restored.noise_rms * scale,
        cutoff=restored.cutoff * scale,
        slope_gain=restored.slope_gain,
        tilt=-tilt if trace.upside_down else tilt,
        warnings=_remarks(trace, restored, restoring, good),
        **details,
    )


def _clear(quality: np.ndarray) -> np.ndarray:
    """Return False for columns unlike a step, and for those unlike their neighbours.

    Dust on the edge itself leaves a step, only a worse one than everywhere else, and moves
    it by pixels: one speck can hold more slope than the whole edge.
    """
    from scipy.ndimage import binary_erosion

    usual = 1 - float(np.quantile(quality, 0.1))
    clear = quality >= max(MIN_QUALITY, 1 - OUTLYING * max(usual, 0.005))
    # The rim of a speck is worse than it looks
    return binary_erosion(clear, iterations=3, border_value=1)


def _long_gaps(good: np.ndarray, longest: int) -> np.ndarray:
    """Return True for columns in runs of bad ones that are too long to bridge."""
    from scipy.ndimage import label

    runs, _ = label(~good)
    return (runs > 0) & (np.bincount(runs.ravel())[runs] > longest)


def _remarks(
    trace: edges.Trace, restored: Restored, restoring: bool, good: np.ndarray
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

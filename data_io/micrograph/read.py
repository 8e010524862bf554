"""Surface profiles from micrographs of an edge, with blur and grain undone."""

import warnings
from pathlib import Path
from typing import Any, Literal

import numpy as np

from data_io.micrograph import bodies
from data_io.micrograph.edge import EdgeProfile, edge_profile
from data_io.micrograph.edges import picture_pixels, trace
from data_io.micrograph.levels import find_annotation_band, load_grey
from data_io.micrograph.overlay import write_profile_overlay
from data_io.micrograph.refusals import fault_of, refuse_other_pictures, two_levels
from data_io.micrograph.scale import pixel_size
from pbrdf.errors import DataFileError, require

__all__ = [
    "EdgeProfile",
    "MicrographWarning",
    "read_profile_image",
    "read_profile_images",
    "write_profile_overlay",
]

Material = Literal["auto", "dark", "bright"]
Direction = Literal["auto", "horizontal", "vertical"]


class MicrographWarning(UserWarning):
    """A picture was read, but something about it may matter to the profile."""


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
    scale = pixel_size(path, grey, um_per_pixel, scale_bar_um)
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
    levels = two_levels(path, part)
    mask = bodies.segment(levels.phase, levels.noise)
    cleaned = bodies.drop_dust(mask, min_span)
    refuse_other_pictures(path, levels, cleaned)
    phase = bodies.erase_dust(levels.phase, mask, cleaned)
    upright = direction == "vertical" or (direction == "auto" and _runs_upright(cleaned))
    if upright:
        phase, cleaned = phase.T, cleaned.T
    min_columns = max(int(min_span * cleaned.shape[1]), 32)
    if not _bright_is_material(cleaned, material):
        phase, cleaned = 1 - phase, ~cleaned
    profiles, faults = [], []
    for body in bodies.find_bodies(cleaned, min_columns):
        clearance = bodies.clearance_of(cleaned, body)
        located = trace(phase, body, clearance)
        fault = fault_of(located)
        if fault:
            faults.append(fault)
            continue
        pixels = picture_pixels(located, cleaned.shape[0], upright, (box[0], box[2]))
        details = {
            "um_per_pixel": scale,
            "threshold": levels.threshold,
            "contrast": levels.contrast,
            "grain": levels.noise,
            "channel": channel,
        }
        profiles.append(edge_profile(located, scale, restoring, pixels, details))
    if not profiles:
        found = faults[0] if faults else "found none"
        problem = f"expected a clear edge across {min_span:.0%} of the picture, {found}"
        cure = "Crop to the edge (crop=), say how it runs (direction=), or lower min_span."
        raise DataFileError(path, problem, cure)
    profiles.sort(key=lambda p: float(np.nanmean(p.pixels[:, 1 if upright else 0])))
    return profiles


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


def _bright_is_material(mask: np.ndarray, material: Material) -> bool:
    """Decide which phase is the sample."""
    if material != "auto":
        return material == "bright"
    frame = np.concatenate([mask[0], mask[-1], mask[:, 0], mask[:, -1]]).mean()
    if min(frame, 1 - frame) < 0.1:
        return bool(frame < 0.5)
    return bool(mask[-1].mean() > 0.5)

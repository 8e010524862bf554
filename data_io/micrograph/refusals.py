"""Whether a picture shows an edge at all: clear refusals of everything else."""

from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter, gaussian_filter1d

from data_io.micrograph.edge import MIN_QUALITY, clear_columns
from data_io.micrograph.edges import Trace
from data_io.micrograph.levels import Levels, flatten
from pbrdf.errors import DataFileError

# A picture that two grey levels explain to less than this shows something else than an
# edge. Edges reach 0.996 to 1, 0.96 with strong structure inside the material; parts of
# portraits, cats and tissue 0.6 to 0.95
MIN_EXPLAINED = 0.93
# Levels that rise to more than six times their contrast somewhere else bend to follow
# a scene, unless they explain it all: so does light that falls off by five sixths
MAX_UNEVEN, EXPLAINED_UNEVEN = 5.0, 0.95
# An edge with more unclear columns, or with more overhanging ones, is no graph z(x)
MAX_UNCLEAR, MAX_OVERHANG = 0.3, 0.1
# Columns apart from unclear ones, between which the others are interpolated
MIN_CLEAR = 0.1
# Beyond this angle the columns cut the surface too obliquely. [rad]
MAX_TILT = np.deg2rad(25)
# The same holds for an edge that, smoothed over this part of its length, is steeper than
# that in more than so many columns: the outline of a thing, such as a disc, which has 0.5
FORM_PART, MAX_BENT = 0.05, 0.25


def two_levels(path: str | Path, grey: np.ndarray) -> Levels:
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


def refuse_other_pictures(path: str | Path, levels: Levels, cleaned: np.ndarray) -> None:
    """Raise unless two levels parted by long edges explain the picture."""
    smooth = gaussian_filter(levels.phase, 3.0)
    model = gaussian_filter(cleaned.astype(float), 3.0)
    variance = float(np.var(smooth))
    explained = (
        1 - float(np.mean((smooth - model) ** 2)) / variance if variance > 0 else 0.0
    )
    least = EXPLAINED_UNEVEN if levels.unevenness > MAX_UNEVEN else MIN_EXPLAINED
    if explained < least:
        problem = (
            f"expected two phases parted by an edge, but they explain only "
            f"{max(explained, 0):.0%} of the picture's contrast"
        )
        cure = "Give a side view of an edge, or crop to it (crop=)."
        raise DataFileError(path, problem, cure)


def fault_of(trace: Trace) -> str | None:
    """Say why a border of two phases is no edge to take a profile from, or None."""
    unclear = float(np.mean(trace.quality < MIN_QUALITY))
    if unclear > MAX_UNCLEAR:
        return f"found one of which {unclear:.0%} is unlike a blurred step"
    if clear_columns(trace.quality).mean() < MIN_CLEAR:
        return "found one with something on it every few columns"
    overhang = float(trace.overhang.mean())
    if overhang > MAX_OVERHANG:
        return f"found one that overhangs along {overhang:.0%} of its length"
    tilt = np.arctan(np.polyfit(trace.columns, trace.height, 1)[0])
    if abs(tilt) > MAX_TILT:
        degrees = np.rad2deg(abs(tilt))
        return f"found one turned by {degrees:.0f} degrees: turn the picture first"
    form = gaussian_filter1d(trace.height, FORM_PART * trace.height.size)
    bent = float(np.mean(np.abs(np.gradient(form)) > np.tan(MAX_TILT)))
    if bent > MAX_BENT:
        return (
            f"found the outline of something bent: {bent:.0%} of it steeper than 25 degrees"
        )
    return None

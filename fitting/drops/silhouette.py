"""Contact angles of a drop from its silhouette."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from data_io.micrograph.levels import load_grey
from fitting.drops.baseline import most_hidden, with_hidden_foot
from fitting.drops.contour import find_drops, narrowed
from fitting.drops.on_line import DropContour
from fitting.drops.refusal import NO_DROP_CURE, check_kink, check_shape, why_no_drop
from fitting.drops.shapes import ShapeFit, fit_arc, fit_laplace
from fitting.estimate import Estimate
from pbrdf.errors import DataFileError, require

# Points nearer to the baseline are left out: the blurred corner rounds them. [blurs]
CORNER_BLURS = 3.0
# Fewer points say little of three lengths and a Bond number
LEAST_POINTS = 30
# A side that Young-Laplace misses by more than this gets the local arc. [pixels]
MAX_LAPLACE_RMS = 0.35


@dataclass(frozen=True, kw_only=True)
class ContactAngle:
    """Contact angles of a sessile drop.

    Parameters
    ----------
    left, right : Estimate
        Angles through the liquid, with standard error and 95 % interval. [degrees]
    baseline : ndarray, shape (2, 2)
        Row and column of the left and the right contact point. [pixels]
    lean : float
        Counter-clockwise angle of the baseline with the rows. [degrees]
    base_width, height : float
        Of the drop, along the baseline and above it. [pixels]
    bond_number : float
        Gravity over surface tension from the shape; NaN if it did not follow Young-Laplace.
    model : tuple of str
        "laplace" or "arc": what was fitted on the left and on the right.
    rms : tuple of float
        Root mean square distance of the contour from each curve. [pixels]
    blur : float
        Standard deviation of the contour's blur. [pixels]
    contour : ndarray, shape (n, 2)
        Row and column of the drop's contour from left to right. [pixels]
    per_pixel : tuple of float
        Change of the left and of the right angle for a baseline one pixel lower, as where a
        substrate's front edge hides the foot; a silhouette does not show it. [degrees]
    warnings : tuple of str
        What may matter to the angles.
    """

    left: Estimate
    right: Estimate
    baseline: np.ndarray
    lean: float
    base_width: float
    height: float
    bond_number: float
    model: tuple[str, str]
    rms: tuple[float, float]
    blur: float
    contour: np.ndarray
    per_pixel: tuple[float, float]
    warnings: tuple[str, ...] = field(default=())

    @property
    def mean(self) -> float:
        """Mean of both sides. [degrees]"""
        return (self.left.value + self.right.value) / 2

    def to_dict(self) -> dict[str, Any]:
        """Give all numbers but the contour by name, for reports and files."""
        return {
            "left_deg": self.left.as_dict(),
            "right_deg": self.right.as_dict(),
            "baseline_row_column": self.baseline.tolist(),
            "lean_deg": self.lean,
            "base_width_pixels": self.base_width,
            "height_pixels": self.height,
            "bond_number": self.bond_number if np.isfinite(self.bond_number) else None,
            "model": list(self.model),
            "rms_pixels": list(self.rms),
            "blur_pixels": self.blur,
            "deg_per_pixel_lower": list(self.per_pixel),
            "warnings": list(self.warnings),
        }


def contact_angle(
    image: str | Path | npt.ArrayLike,
    *,
    baseline: npt.ArrayLike | None = None,
    crop: tuple[int, int, int, int] | None = None,
    which: int | None = None,
) -> ContactAngle:
    """Measure the contact angles of a drop on a flat substrate, seen from the side.

    The contour is taken at the middle grey level. The baseline is the line, or slightly
    bent curve, that most of the contour beside the drop lies on, or else the line that
    mirrors the drop onto its image. Each side is fitted by the Young-Laplace
    equation (apex, radius, Bond number and axis free, so the sides may differ) and, near
    the contact only, by an arc with a tangent angle quadratic in its length. The first is
    taken unless it misses the contour; the difference of both counts in the standard error,
    with the scatter of the contour and with the baseline's height and lean.

    A silhouette does not show a foot that the front edge of its substrate hides. Unless a
    mirror image or a given baseline shows the contact, the interval (not the standard
    error) holds a foot hidden by up to 6 % of the drop's width, or a tenth of its height,
    with a chance of 30 %.

    Parameters
    ----------
    image : str, Path or array_like, shape (rows, columns[, 3])
        Drop and substrate dark on bright ground, or bright on dark.
    baseline : array_like, shape (2, 2), optional
        Row and column of two points of the baseline, each right to half a pixel. Where the
        border of the substrate agrees with it, that is taken; where it does not, as where a
        front edge hides the foot, the given one. [pixels]
    crop : (top, bottom, left, right), optional
        Part of the picture to use. [pixels]
    which : int, optional
        Which of several drops, counted from 1 at the left; the widest if not given, with
        a warning.

    Returns
    -------
    ContactAngle
        Angles in degrees.

    Raises
    ------
    DataFileError
        If the file is no picture or shows no drop.
    ValueError
        If an array is no picture or shows no drop.
    """
    if isinstance(image, str | Path):
        grey, name = load_grey(image)[0], image
    else:
        grey, name = _grey_array(image), "image"
    rows, columns = grey.shape
    top, bottom, left, right = crop or (0, rows, 0, columns)
    if not (0 <= top < bottom <= rows and 0 <= left < right <= columns):
        msg = (
            f"crop must lie inside {rows} rows and {columns} columns, got {crop}. "
            "Give (top, bottom, left, right) in pixels."
        )
        raise ValueError(msg)
    origin = np.array([top, left])
    given = None
    if baseline is not None:
        cure = "Give row and column of two points in pixels."
        given = require("baseline", baseline, np.isfinite, "be finite [pixels]", cure)
        if given.shape != (2, 2):
            msg = f"baseline must have shape (2, 2), got {given.shape}. {cure}"
            raise ValueError(msg)
        given = given - origin
    part = grey[top:bottom, left:right]
    remarks = []
    drops = find_drops(part, given)
    if not drops and (drops := find_drops(part.max() - part, given)):
        remarks.append("drop and substrate are brighter than the ground")
    if not drops:
        raise DataFileError(name, *why_no_drop(part, given))
    drop, remark = _chosen(drops, which)
    if given is not None:
        remark += _off_the_silhouette(drop)
    return _fit_sides(drop, origin, name, remarks + remark)


def _chosen(drops: list[DropContour], which: int | None) -> tuple[DropContour, list[str]]:
    """Return the drop that was asked for, or the widest and that there are others."""
    if which is not None:
        if not 1 <= which <= len(drops):
            msg = (
                f"which must be 1 to {len(drops)}, got {which}. Drops are counted from the "
                "left."
            )
            raise ValueError(msg)
        return drops[which - 1], []
    widths = [np.ptp(drop.points[:, 0]) for drop in drops]
    widest = int(np.argmax(widths))
    if len(drops) == 1:
        return drops[0], []
    return drops[widest], [
        f"the picture shows {len(drops)} drops; measured is number {widest + 1} from the "
        "left, the widest (which= chooses another)"
    ]


def _off_the_silhouette(drop: DropContour) -> list[str]:
    """Say where the picture shows another baseline than the one that was given."""
    if abs(drop.off) <= 2:
        return []
    where = "above" if drop.off > 0 else "below"
    return [
        f"the border of the substrate lies {abs(drop.off):.1f} pixels {where} the given "
        "baseline"
    ]


def _grey_array(image: npt.ArrayLike) -> np.ndarray:
    """Return grey levels in [0, 1] of an array."""
    from skimage import color, util

    if np.ma.is_masked(image):
        msg = "image must not be masked, got masked pixels. Crop to the drop (crop=)."
        raise ValueError(msg)
    if np.iscomplexobj(image):
        msg = "image must be real, got complex values. Give grey levels."
        raise TypeError(msg)
    array = np.asarray(image)
    if array.ndim == 3 and array.shape[-1] in (3, 4):
        array = color.rgb2gray(array[..., :3])
    if array.ndim != 2 or min(array.shape) < 16:
        msg = (
            f"image must be a picture of at least 16 x 16 pixels, got shape {array.shape}. "
            "Give a path, or an array of grey levels."
        )
        raise ValueError(msg)
    if array.dtype.kind in "ui" or array.dtype == bool:
        return util.img_as_float64(array)
    if not np.isfinite(array).all() or np.ptp(array) == 0:
        msg = "image must hold finite grey levels with contrast. Check how it was read."
        raise ValueError(msg)
    return (array - array.min()) / np.ptp(array)


def _fit_sides(
    drop: DropContour, origin: np.ndarray, name: str | Path, remarks: list[str]
) -> ContactAngle:
    """Fit both sides and put the result together."""
    clear, whole, results = _curves(drop, name)
    if drop.bend:
        left, right = -results[0][0].contact, results[1][0].contact
        drop = narrowed(drop, right - left)
        clear, whole, results = _curves(drop, name)
    check_shape(name, clear, whole, [(fit, other) for fit, other, _ in results])
    if drop.mirrored:
        check_kink(name, [fit for fit, _, _ in results])
    remarks = list(remarks)
    if abs(drop.bend) > drop.lean_stderr:
        remarks.append(
            "the substrate is curved: angles are those with its tangents, "
            f"{np.rad2deg(drop.bend):+.2f} degrees from the line between the contacts"
        )
    for name, (fit, other, _) in zip(("left", "right"), results, strict=True):
        if abs(fit.angle - other.angle) > np.deg2rad(3):
            remarks.append(
                f"Young-Laplace fit and local arc differ on the {name} by "
                f"{np.rad2deg(abs(fit.angle - other.angle)):.1f} degrees"
            )
    models = tuple(model for _, _, model in results)
    if "arc" in models:
        remarks.append(
            "the contour is no axisymmetric drop under gravity (pinned, moving or uneven)"
        )
    left, right = -results[0][0].contact, results[1][0].contact
    contour, contacts = _in_picture(drop, (left, right))
    return ContactAngle(
        left=_estimate(drop, *results[0][:2]),
        right=_estimate(drop, *results[1][:2]),
        baseline=contacts + origin,
        lean=float(np.rad2deg(drop.lean)),
        base_width=float(right - left),
        # A needle hides the top
        height=float(
            whole.parameters[1] if models == ("laplace",) * 2 else clear[:, 1].max()
        ),
        bond_number=whole.bond_number if "arc" not in models else float("nan"),
        model=(models[0], models[1]),
        rms=(results[0][0].rms, results[1][0].rms),
        blur=drop.blur,
        contour=contour + origin,
        per_pixel=(
            -float(np.rad2deg(results[0][0].slope_by_height)),
            -float(np.rad2deg(results[1][0].slope_by_height)),
        ),
        warnings=tuple(remarks),
    )


def _curves(
    drop: DropContour, name: str | Path
) -> tuple[np.ndarray, ShapeFit, list[tuple[ShapeFit, ShapeFit, str]]]:
    """Return the points clear of the corners, the curve through all, and both sides'."""
    clear = drop.points[_clear_of_corners(drop)]
    if len(clear) < LEAST_POINTS:
        problem = (
            f"expected a drop of at least {LEAST_POINTS} contour points clear of the "
            f"blurred corners, got {len(clear)}"
        )
        raise DataFileError(name, problem, "Take the picture closer, or sharper.")
    whole = fit_laplace(_thin(clear))
    apex = int(np.argmax(clear[:, 1]))
    sides = [clear[: apex + 1] * [-1, 1], clear[apex:][::-1]]
    for side, points in zip(("left", "right"), sides, strict=True):
        if len(points) < LEAST_POINTS / 3:
            problem = (
                "expected a drop whose top is between its ends, found "
                f"{len(points)} points of its outline on the {side}"
            )
            raise DataFileError(name, problem, NO_DROP_CURE)
    results = [
        _fit_side(side, whole, mirror) for side, mirror in zip(sides, (-1, 1), strict=True)
    ]
    return clear, whole, results


def _estimate(drop: DropContour, fit: ShapeFit, other: ShapeFit) -> Estimate:
    """Return the angle of one side, whose other model tells what the choice of it adds."""
    error = np.sqrt(
        fit.stderr**2
        + _model_variance(fit, other)
        + (fit.slope_by_height * drop.offset_stderr) ** 2
        + drop.lean_stderr**2
    )
    depth = most_hidden(float(np.ptp(drop.points[:, 0])), float(drop.points[:, 1].max()))
    degrees = float(np.rad2deg(fit.angle + drop.bend))
    ends = np.rad2deg(
        with_hidden_foot(
            fit.centre + drop.bend, error, -fit.slope_by_height, depth, drop.hidden
        )
    )
    low, high = np.clip([min(ends[0], degrees), max(ends[1], degrees)], 0, 180)
    stderr = float(np.rad2deg(np.hypot(error, fit.centre - fit.angle)))
    return Estimate(degrees, stderr, float(low), float(high))


def _in_picture(
    drop: DropContour, contacts: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Return contour and contact points in rows and columns of what was cut out."""
    cos, sin = np.cos(drop.lean), np.sin(drop.lean)
    middle = drop.baseline.mean(axis=0)
    start = drop.baseline[0]
    along = drop.points[:, 0] - drop.points[0, 0]
    contour = np.stack(
        [
            start[0] - along * sin - drop.points[:, 1] * cos,
            start[1] + along * cos - drop.points[:, 1] * sin,
        ],
        axis=1,
    )
    mid_along = (drop.points[0, 0] + drop.points[-1, 0]) / 2
    ends = np.array(
        [
            [middle[0] - (a - mid_along) * sin, middle[1] + (a - mid_along) * cos]
            for a in contacts
        ]
    )
    return contour, ends


def _clear_of_corners(drop: DropContour) -> np.ndarray:
    """Where the substrate's border, which ends at the contact, is too far to matter."""
    x, height = drop.points.T
    # A hidden foot has its corners where the substrate's front edge begins
    height = height - max(drop.off, 0.0)
    ends = min(x[0], x[-1]), max(x[0], x[-1])
    inside = np.minimum(x - ends[0], ends[1] - x).clip(min=0)
    return np.hypot(inside, height) > CORNER_BLURS * drop.blur + 1


def _model_variance(fit: ShapeFit, other: ShapeFit) -> float:
    """Variance for the choice of the curve: both's difference beyond their scatter. [rad²]

    A third of the difference counts as standard deviation. The arc rests on few points, so
    most of a difference is its own scatter and says nothing about the curve that was taken.
    """
    scatter = fit.stderr**2 + other.stderr**2
    return max((fit.angle - other.angle) ** 2 - scatter, 0.0) / 9


def _fit_side(
    points: np.ndarray, whole: ShapeFit, mirror: int
) -> tuple[ShapeFit, ShapeFit, str]:
    """Return the fit to trust for one side, the other one, and the name of the first."""
    start = whole.parameters * np.array([mirror, 1, 1, 1])
    laplace = fit_laplace(_thin(points), start)
    arc_length = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    reach = max(0.4 * arc_length[-1], min(20.0, arc_length[-1]))
    arc = fit_arc(_thin(points[arc_length <= reach]))
    if laplace.rms <= max(MAX_LAPLACE_RMS, 1.5 * arc.rms):
        return laplace, arc, "laplace"
    return arc, laplace, "arc"


def _thin(points: np.ndarray, most: int = 1200) -> np.ndarray[Any, Any]:
    """Return at most so many points, evenly."""
    return points[:: max(1, -(-len(points) // most))]

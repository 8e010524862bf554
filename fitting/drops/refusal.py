"""Why a picture gives no contact angle, in the words of who took it."""

from pathlib import Path

import numpy as np

from fitting.drops.contour import find_drops
from fitting.drops.shapes import ShapeFit, laplace_profile
from pbrdf.errors import DataFileError

# A drop, however uneven, is nearer than this to a Young-Laplace curve: of its whole
# outline, and of each side with an axis of its own. [of the root of height times width]
WHOLE_MISFIT = 0.06
SIDE_MISFIT = 0.025
# An interval wider than this says nothing. [rad]
WIDEST = np.deg2rad(60)
# Sides that meet at the top at more than this are those of a triangle. [rad]
WIDEST_TOP = np.deg2rad(15)

# Drop and image that turn less into each other may be one floating body. [rad]
LEAST_KINK = np.deg2rad(12)

NO_DROP_CURE = "Crop to the drop (crop=), or give two points of its baseline (baseline=)."


def why_no_drop(grey: np.ndarray, baseline: np.ndarray | None) -> tuple[str, str]:
    """Return what is wrong with a picture in which no drop was found, and the cure."""
    expected = "expected a drop on a straight substrate, found"
    if baseline is not None and _stands(grey):
        cure = "Check row and column of its two points, or leave baseline= out."
        return "expected a drop on the given baseline, found none there", cure
    if _stands(np.rot90(grey, 2)):
        cure = "Turn the picture if it is upside down; hanging drops are not measured."
        where = "above it (a pendant drop, or a picture upside down)"
        return f"{expected} one with its substrate {where}", cure
    if (side := _cut_side(grey)) is not None:
        problem = f"{expected} one cut by the {side} side of the frame"
        return problem, "Take a picture, or a crop, that shows both contacts."
    for dark in (grey, grey.max() - grey):
        for side, margin, tone in (
            ("top", (30, 0), dark.max()),
            ("bottom", (0, 30), dark.min()),
        ):
            if find_drops(np.pad(dark, (margin, (0, 0)), constant_values=tone), None):
                problem = f"{expected} one cut by the {side} of the frame"
                cure = "Take a picture that shows the whole drop and its substrate."
                return problem, cure
    for where, quarters in (("left", 1), ("right", 3)):
        if _stands(np.rot90(grey, quarters)):
            problem = f"{expected} one with its substrate on its {where}"
            return problem, "Turn the picture until the substrate is below the drop."
    return f"{expected} none", NO_DROP_CURE


def _stands(grey: np.ndarray) -> bool:
    """Whether a drop, dark or bright, stands in a picture."""
    return bool(find_drops(grey, None) or find_drops(grey.max() - grey, None))


def _cut_side(grey: np.ndarray) -> str | None:
    """Return which side of the frame cuts a drop: it becomes a plane of symmetry."""
    mirrored = grey[:, ::-1]
    seam = grey.shape[1]
    for side, pair in (("left", (mirrored, grey)), ("right", (grey, mirrored))):
        doubled = np.concatenate(pair, axis=1)
        for tone in (doubled, doubled.max() - doubled):
            for drop in find_drops(tone, None):
                left, right = drop.baseline[:, 1]
                if left < seam - 5 and right > seam + 5:
                    return side
    return None


def check_shape(
    name: str | Path,
    points: np.ndarray,
    whole: ShapeFit,
    sides: list[tuple[ShapeFit, ShapeFit]],
) -> None:
    """Refuse an outline that is no drop's.

    Parameters
    ----------
    name : str or Path
        Of the picture.
    points : ndarray, shape (n, 2)
        Of the outline, along the baseline and above it. [pixels]
    whole : ShapeFit
        Young-Laplace curve through all points.
    sides : list of (ShapeFit, ShapeFit)
        The curve to trust and the other one, of each side.

    Raises
    ------
    DataFileError
        If no smooth drop comes near the outline, or its angle is none or not known.
    """
    scale = float(np.sqrt(np.ptp(points[:, 0]) * points[:, 1].max()))
    misfit = whole.rms / scale / WHOLE_MISFIT
    for pair in sides:
        laplace = next(fit for fit in pair if np.isfinite(fit.bond_number))
        misfit = max(misfit, (laplace.rms - 0.5) / scale / SIDE_MISFIT)
    if misfit > 1:
        problem = (
            "expected the smooth outline of a drop, found one that misses every drop by "
            f"{max(whole.rms, *(fit.rms for pair in sides for fit in pair)):.1f} pixels"
        )
        raise DataFileError(name, problem, NO_DROP_CURE)
    corner = _corner_at_top(points, sides)
    if corner > WIDEST_TOP:
        problem = (
            "expected the smooth outline of a drop, found a corner of "
            f"{np.rad2deg(corner):.0f} degrees at its top"
        )
        raise DataFileError(name, problem, NO_DROP_CURE)
    for side, (fit, _) in zip(("left", "right"), sides, strict=True):
        if not 0 <= fit.angle <= np.pi or 2 * 1.96 * fit.stderr > WIDEST:
            angle, error = np.rad2deg([fit.angle, fit.stderr])
            problem = (
                f"expected a contact angle of 0 to 180 degrees, got {angle:.0f} "
                f"± {error:.0f} on the {side}"
            )
            raise DataFileError(name, problem, NO_DROP_CURE)


def _corner_at_top(points: np.ndarray, sides: list[tuple[ShapeFit, ShapeFit]]) -> float:
    """Return the angle that both sides' Young-Laplace curves turn by where they meet. [rad]

    A needle leaves a gap there; its middle counts.
    """
    top = int(np.argmax(points[:, 1]))
    middle = float(points[top, 0])
    if 0 < top < len(points) - 1:
        gaps = np.diff(points[top - 1 : top + 2, 0])
        middle += float(gaps[1] if gaps[1] > gaps[0] else -gaps[0]) / 2
    turn = 0.0
    for pair, mirror in zip(sides, (-1, 1), strict=True):
        p = next(fit for fit in pair if np.isfinite(fit.bond_number)).parameters
        x, _, angle = laplace_profile(p[3]).T
        widest = int(np.argmax(x))
        outward = (mirror * middle - p[0]) / p[2]
        fall = np.interp(abs(outward), x[: widest + 1], angle[: widest + 1])
        turn += float(np.sign(outward) * fall)
    return turn


def check_kink(name: str | Path, sides: list[ShapeFit]) -> None:
    """Refuse a body and its mirror image that meet without a kink: it may float.

    Raises
    ------
    DataFileError
        If the angle is 90 degrees within its error and a little more.
    """
    for side, fit in zip(("left", "right"), sides, strict=True):
        if abs(fit.angle - np.pi / 2) < LEAST_KINK / 2 + 3 * fit.stderr:
            problem = (
                "expected a border of the substrate, or a kink of drop and image; they "
                f"meet at {np.rad2deg(fit.angle):.0f} degrees on the {side}, as a drop of "
                "90 degrees and a floating body do"
            )
            raise DataFileError(
                name, problem, "Give two points of its baseline (baseline=)."
            )

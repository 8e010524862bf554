"""Drops on a line: baselines found in a contour, and the bulges over them."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from fitting.drops.baseline import GIVEN_ERROR
from fitting.drops.ground import fit_ground

# A baseline leans less than this against the rows. [rad]
MAX_LEAN = np.deg2rad(20)
# A curved one turns less than this from end to end: one of a fibre or a ball. [rad]
MAX_TURN = np.deg2rad(80)
# Pixels of finite size, and grey levels known to a hundredth of the contrast, each for drop
# and substrate, leave a baseline no better known. [pixels], [blurs]
OFFSET_FLOOR, LEVEL_ERROR = 0.03, 0.035


@dataclass(frozen=True, kw_only=True)
class DropContour:
    """The border of a drop above its baseline.

    Parameters
    ----------
    points : ndarray, shape (n, 2)
        Along the baseline from the left contact, and above it; from left to right along the
        contour. [pixels]
    baseline : ndarray, shape (2, 2)
        Row and column of the left and of the right contact point. [pixels]
    lean : float
        Counter-clockwise angle of the baseline with the rows. [rad]
    lean_stderr : float
        Its standard error. [rad]
    offset_stderr : float
        Standard error of the baseline's height. [pixels]
    blur : float
        Standard deviation of the border's blur. [pixels]
    bend : float
        Angle of the substrate's tangents with the line between the contacts, positive where
        it rises beside the drop. [rad]
    hidden : float
        Chance that a foot out of sight reaches below the baseline. [1]
    mirrored : bool
        Whether a mirror image alone shows the baseline.
    off : float
        Height of the border that is seen above the baseline that was given. [pixels]
    """

    points: np.ndarray
    baseline: np.ndarray
    lean: float
    lean_stderr: float
    offset_stderr: float
    blur: float
    bend: float = 0.0
    hidden: float = 0.0
    mirrored: bool = False
    off: float = 0.0


def drops_on_line(
    xy: np.ndarray, normal: np.ndarray, contrast: float, given: np.ndarray | None
) -> list[DropContour]:
    """Find a baseline in one contour, and the bulges over it."""
    steepness = np.hypot(*normal.T)
    upward = normal[:, 1] > np.cos(MAX_LEAN) * steepness
    candidates = upward.copy()
    for _ in range(4):
        if given is None:
            line = _straightest_line(xy[candidates])
        else:
            direction = given[1] - given[0]
            line = (given[0], direction * np.sign(direction[0]) / np.hypot(*direction))
        if line is None:
            return []
        origin, direction = line
        along = (xy - origin) @ direction
        above = (xy - origin) @ np.array([-direction[1], direction[0]])
        order = 1
        if given is None:
            bow = _parabola(along[candidates], above[candidates])
            if bow is not None:
                order, above = 2, above - np.polyval(bow, along)
        flank = upward & (np.abs(above) < 2.5) if given is None else np.abs(above) < 2.5
        # Nothing but the contacts need lie on a given baseline
        least = 20 if given is None else 4
        if np.count_nonzero(flank) < least:
            runs = []
        else:
            runs = _bulges(along, above, flank, normal[:, 1] > 0)
        found = [
            _measure(xy, flank, run, steepness, contrast, given, order) for run in runs
        ]
        if runs or given is not None:
            return [drop for drop in found if drop is not None]
        # The straightest part was not a baseline with a drop on it, so look elsewhere
        candidates &= np.abs(above) > 4
        if np.count_nonzero(candidates) < 40:
            return []
    return []


def _straightest_line(xy: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Return a point and the direction of the line near most points (RANSAC)."""
    if len(xy) < 40:
        return None
    rng = np.random.default_rng(0)
    pairs = rng.integers(0, len(xy), (600, 2))
    span = np.ptp(xy[:, 0])
    best: tuple[np.ndarray, np.ndarray] | None = None
    best_count = 0
    sample = xy[:: max(1, len(xy) // 3000)]
    for i, j in pairs:
        step = xy[j] - xy[i]
        if abs(step[0]) < 0.1 * span or abs(np.arctan2(step[1], abs(step[0]))) > MAX_LEAN:
            continue
        direction = step * np.sign(step[0]) / np.hypot(*step)
        distance = np.abs((sample - xy[i]) @ np.array([-direction[1], direction[0]]))
        count = int(np.count_nonzero(distance < 1.5))
        if count > best_count:
            best, best_count = (xy[i], direction), count
    if best is None:
        return None
    origin, direction = best
    for _ in range(3):
        near = np.abs((xy - origin) @ np.array([-direction[1], direction[0]])) < 2.0
        origin = xy[near].mean(axis=0)
        direction = np.linalg.svd(xy[near] - origin, full_matrices=False)[2][0]
        direction = direction * np.sign(direction[0])
    return origin, direction


def _parabola(along: np.ndarray, above: np.ndarray) -> np.ndarray | None:
    """Coefficients of a parabola near many more points than the line above = 0 (RANSAC)."""
    rng = np.random.default_rng(1)
    step = max(1, len(along) // 2000)
    x, y = along[::step], above[::step]
    span = np.ptp(x)
    best = None
    best_count = 1.1 * float(np.count_nonzero(np.abs(y) < 1.5)) + 40 / step
    for _ in range(400):
        chosen = rng.integers(0, len(x), 3)
        a, b, c = np.sort(x[chosen])
        if min(b - a, c - b) < 0.05 * span:
            continue
        curve = np.polyfit(x[chosen], y[chosen], 2)
        if abs(2 * curve[0] * span) > MAX_TURN:
            continue
        count = float(np.count_nonzero(np.abs(y - np.polyval(curve, x)) < 1.5))
        if count > best_count:
            best, best_count = curve, count
    if best is None:
        return None
    for _ in range(4):
        near = np.abs(y - np.polyval(best, x)) < 2.0
        best = np.polyfit(x[near], y[near], 2)
    return best


def _bulges(
    along: np.ndarray, above: np.ndarray, flank: np.ndarray, bright_above: np.ndarray
) -> list[np.ndarray]:
    """Return the indices of each high run between two flanks with brightness over it."""
    start = int(np.argmax(flank))
    order = np.roll(np.arange(along.size), -start)
    closed = np.hypot(along[0] - along[-1], above[0] - above[-1]) < 1.5
    labels, _ = ndimage.label(~flank[order])
    runs = []
    for box in ndimage.find_objects(labels):
        part = order[box[0]]
        top = int(part[np.argmax(above[part])])
        # The run through the ends of an open contour has no second flank
        open_ended = box[0].stop == order.size and not closed
        large = above[top] >= 5 and np.ptp(along[part]) >= 15
        if large and bright_above[top] and not open_ended and np.median(above[part]) > 0:
            runs.append(part)
    return runs


def _measure(
    xy: np.ndarray,
    flank: np.ndarray,
    run: np.ndarray,
    steepness: np.ndarray,
    contrast: float,
    given: np.ndarray | None,
    order: int,
) -> DropContour | None:
    """Fit the baseline to the flanks beside the drop and give its points in that frame."""
    first, last = xy[run[0]], xy[run[-1]]
    if first[0] > last[0]:
        run, first, last = run[::-1], last, first
    width = last[0] - first[0]
    # The substrate next to the drop counts; far away it may end or bend
    near = flank & (xy[:, 0] > first[0] - 1.5 * width) & (xy[:, 0] < last[0] + 1.5 * width)
    # A Gaussian blur of width s has the steepest slope contrast / (s sqrt(2 pi)); the
    # smoothing before the contour was found is part of it
    blur = contrast / np.sqrt(2 * np.pi) / np.median(steepness[run])
    # Next to the contact the drop's blur lifts the substrate's contour
    gap = min(6 * blur, 0.2 * width)
    # ... and so does a belly that hangs over it
    belly = (min(first[0], xy[run, 0].min()), max(last[0], xy[run, 0].max()))
    for left, right in (belly, (first[0], last[0])):
        sides = [near & (xy[:, 0] < left - gap), near & (xy[:, 0] > right + gap)]
        if min(np.count_nonzero(side) for side in sides) >= 20:
            break
    middle = (first[0] + last[0]) / 2
    if given is None:
        if min(np.count_nonzero(side) for side in sides) < 8:
            return None
        ground = xy[sides[0] | sides[1]]
        line = fit_ground(ground, middle, width, order)
        slope, level, bend = line.slope, line.level, line.bend
        lean_stderr = line.slope_error
        offset_stderr = line.level_error + OFFSET_FLOOR + LEVEL_ERROR * blur
    else:
        slope = (given[1, 1] - given[0, 1]) / (given[1, 0] - given[0, 0])
        level = given[0, 1] + slope * (middle - given[0, 0])
        reach = abs(given[1, 0] - given[0, 0])
        lean_stderr, offset_stderr = np.sqrt(2) * GIVEN_ERROR / reach, GIVEN_ERROR
        bend = 0.0
    lean = float(np.arctan(slope))
    direction = np.array([np.cos(lean), np.sin(lean)])
    origin = np.array([middle, level])
    along = (xy[run] - origin) @ direction
    above = (xy[run] - origin) @ np.array([-direction[1], direction[0]])
    contacts = origin + np.outer([along[0], along[-1]], direction)
    return DropContour(
        points=np.stack([along, above], axis=1),
        baseline=np.stack([-contacts[:, 1], contacts[:, 0]], axis=1),
        lean=lean,
        lean_stderr=float(lean_stderr),
        offset_stderr=float(offset_stderr),
        blur=float(blur),
        bend=bend,
    )

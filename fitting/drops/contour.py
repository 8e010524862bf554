"""Contour and baseline of a drop in a silhouette, to a fraction of a pixel."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from fitting.drops.needle import Needle, erase_needle
from fitting.drops.scene import Scene, scale_by_light, thresholds_of

# A baseline leans less than this against the rows. [rad]
MAX_LEAN = np.deg2rad(20)
# Pixels of finite size, and grey levels known to a hundredth of the contrast, each for drop
# and substrate, leave a baseline no better known. [pixels], [blurs]
OFFSET_FLOOR, LEVEL_ERROR = 0.03, 0.035
# Tones that differ less than this between dark (0) and ground (1) count as one
LEAST_TONE = 0.03
# Narrower than this, against the widest drop, is dust
LEAST_WIDTH = 0.2


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
    """

    points: np.ndarray
    baseline: np.ndarray
    lean: float
    lean_stderr: float
    offset_stderr: float
    blur: float


def find_drops(grey: np.ndarray, baseline: np.ndarray | None) -> list[DropContour]:
    """Return the dark drops that stand on a straight darker line, from left to right.

    Each border is taken midway between its own two tones, those of the ground and of the
    drop, or of the ground and of the substrate. A needle that enters from the top is left
    out.
    """
    given = None if baseline is None else np.stack([baseline[:, 1], -baseline[:, 0]], 1)
    step = max(1, min(grey.shape) // 800)
    few = ndimage.gaussian_filter(grey[::step, ::step], 1.0)
    if np.ptp(few) < 0.02:
        return []
    thresholds = thresholds_of(few)
    grey, needle = erase_needle(grey, thresholds[0])
    bare: list[DropContour] = []
    for threshold in thresholds:
        scene = scale_by_light(grey, step, threshold)
        if scene is None:
            continue
        drops = _drops_at(scene, scene.level, given)
        tones = [_substrate_tone(scene, drop) for drop in drops]
        tone = float(np.median(tones)) if tones else 1.0
        if not tone < scene.level:
            # The contour is the drop's and its image's, and no border of the substrate
            bare = bare or [_at_own_level(scene, drop, scene.level) for drop in drops]
            continue
        if abs(tone) > LEAST_TONE:
            drops = _drops_at(scene, (1 + tone) / 2, given) or drops
        drops = [_at_own_level(scene, drop, (1 + tone) / 2) for drop in drops]
        return [_outside(drop, needle) for drop in drops]
    # A given baseline needs no border
    return [_outside(drop, needle) for drop in bare] if given is not None else []


def _drops_at(scene: Scene, level: float, given: np.ndarray | None) -> list[DropContour]:
    """Return the drops whose border and baseline are contours at one level."""
    drops = []
    for xy in scene.contours(level):
        drops += _drops_on_line(xy, scene.normals(xy), 1.0, given)
    # Dust on the substrate is no second drop
    widest = max((np.ptp(drop.points[:, 0]) for drop in drops), default=0.0)
    drops = [drop for drop in drops if np.ptp(drop.points[:, 0]) > LEAST_WIDTH * widest]
    return sorted(drops, key=lambda drop: drop.baseline[:, 1].mean())


def _frame(drop: DropContour) -> tuple[np.ndarray, np.ndarray]:
    """Return origin and axes along and above the baseline, x to the right and y up."""
    cos, sin = np.cos(drop.lean), np.sin(drop.lean)
    axes = np.array([[cos, sin], [-sin, cos]])
    row, column = drop.baseline[0]
    return np.array([column, -row]) - drop.points[0, 0] * axes[0], axes


def _substrate_tone(scene: Scene, drop: DropContour) -> float:
    """Median of the substrate beside the drop, just below the baseline; 0 out of sight."""
    origin, axes = _frame(drop)
    left, right = drop.points[:, 0].min(), drop.points[:, 0].max()
    reach = np.arange(6 * drop.blur + 3, 0.75 * (right - left) + 30)
    below = np.arange(3 * drop.blur + 2, 6 * drop.blur + 8)
    along = np.concatenate([left - reach, right + reach])
    grid = np.stack(np.meshgrid(along, -below), axis=-1).reshape(-1, 2)
    tones = scene.at(scene.part, origin + grid @ axes)
    return float(np.nanmedian(tones)) if np.isfinite(tones).any() else 0.0


def _at_own_level(scene: Scene, drop: DropContour, level: float) -> DropContour:
    """Move the border from the substrate's level to that midway from ground to drop."""
    origin, axes = _frame(drop)
    xy = origin + drop.points @ axes
    normal = scene.normals(xy)
    normal /= np.maximum(np.hypot(*normal.T), 1e-9)[:, None]
    depth = 3 * max(drop.blur, 1.0) + 2
    tones = scene.at(scene.part, xy - depth * normal)[drop.points[:, 1] > depth]
    tone = float(np.nanmedian(tones)) if np.isfinite(tones).any() else float("nan")
    if not np.isfinite(tone) or abs((1 + tone) / 2 - level) < LEAST_TONE / 2:
        return drop
    best = np.empty((0, 2))
    for contour in scene.contours((1 + tone) / 2):
        points = (contour - origin) @ axes.T
        inside = (points[:, 1] > 2.5) & (
            np.abs(points[:, 0] - drop.points[:, 0].mean())
            < np.ptp(drop.points[:, 0]) / 2 + 10
        )
        if inside.all():
            continue
        order = np.roll(np.arange(len(points)), -int(np.argmin(inside)))
        for box in ndimage.find_objects(ndimage.label(inside[order])[0]):
            run = points[order[box[0]]]
            if len(run) > len(best):
                best = run
    # What lies elsewhere is no border of this drop
    if len(best) < 20 or abs(best[:, 1].max() - drop.points[:, 1].max()) > 3 * depth:
        return drop
    if best[0, 0] > best[-1, 0]:
        best = best[::-1]
    steepness = np.hypot(*scene.normals(origin + best @ axes).T)
    contacts = origin + np.outer([best[0, 0], best[-1, 0]], axes[0])
    blur = float((1 - tone) / np.sqrt(2 * np.pi) / np.median(steepness))
    return replace(
        drop,
        points=best,
        baseline=np.stack([-contacts[:, 1], contacts[:, 0]], axis=1),
        blur=blur,
    )


def _outside(drop: DropContour, needle: Needle | None) -> DropContour:
    """Leave out the points that a needle touches."""
    if needle is None:
        return drop
    origin, axes = _frame(drop)
    column = (origin + drop.points @ axes)[:, 0]
    upper = drop.points[:, 1] > 0.5 * drop.points[:, 1].max()
    touched = upper & (column > needle.left) & (column < needle.right)
    return replace(drop, points=drop.points[~touched])


def _drops_on_line(
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
        flank = upward & (np.abs(above) < 2.5) if given is None else np.abs(above) < 2.5
        # Nothing but the contacts need lie on a given baseline
        least = 20 if given is None else 4
        if np.count_nonzero(flank) < least:
            runs = []
        else:
            runs = _bulges(along, above, flank, normal[:, 1] > 0)
        found = [_measure(xy, flank, run, steepness, contrast, given) for run in runs]
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
        for _ in range(3):
            slope, level = np.polyfit(ground[:, 0] - middle, ground[:, 1], 1)
            residual = ground[:, 1] - slope * (ground[:, 0] - middle) - level
            spread = 1.4826 * np.median(np.abs(residual)) + 0.02
            ground = ground[np.abs(residual) < 3.5 * spread]
        # Neighbouring points share blur and roughness: one in ten is independent
        count = max(len(ground) / 10, 3)
        lean_stderr = spread / np.sqrt(count) / np.std(ground[:, 0])
        offset_stderr = spread / np.sqrt(count) + OFFSET_FLOOR + LEVEL_ERROR * blur
    else:
        slope = (given[1, 1] - given[0, 1]) / (given[1, 0] - given[0, 0])
        level = given[0, 1] + slope * (middle - given[0, 0])
        lean_stderr, offset_stderr = 0.0, 0.5
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
    )

"""Contour and baseline of a drop in a silhouette, to a fraction of a pixel."""

from dataclasses import replace

import numpy as np
from scipy import ndimage

from fitting.drops.baseline import HIDDEN, SEEN, Line, combine, mirror_line
from fitting.drops.needle import Needle, erase_needle
from fitting.drops.on_line import DropContour, drops_on_line
from fitting.drops.scene import Scene, scale_by_light, thresholds_of

# Tones that differ less than this between dark (0) and ground (1) count as one
LEAST_TONE = 0.03
# Narrower than this, against the widest drop, is dust
LEAST_WIDTH = 0.2


def find_drops(grey: np.ndarray, baseline: np.ndarray | None) -> list[DropContour]:
    """Return the dark drops that stand on a darker line, from left to right.

    Each border is taken midway between its own two tones, those of the ground and of the
    drop, or of the ground and of the substrate. A needle that enters from the top is left
    out. A given baseline is put together with the border that is seen; where there is none,
    the line that mirrors a drop onto its image is the baseline.
    """
    step = max(1, min(grey.shape) // 800)
    few = ndimage.gaussian_filter(grey[::step, ::step], 1.0)
    if np.ptp(few) < 0.02:
        return []
    thresholds = thresholds_of(few)
    grey, needle = erase_needle(grey, thresholds[0])
    drops = _drops_seen(grey, step, thresholds, None)
    if baseline is not None:
        given = np.stack([baseline[:, 1], -baseline[:, 0]], 1)
        moved = [moved_to(drop, given) for drop in drops]
        drops = [drop for drop in moved if drop is not None]
        drops = drops or _drops_seen(grey, step, thresholds, given)
    elif not drops:
        drops = _drops_with_image(grey, step, thresholds[0])
    return [_outside(drop, needle) for drop in drops]


def _drops_seen(
    grey: np.ndarray, step: int, thresholds: list[float], given: np.ndarray | None
) -> list[DropContour]:
    """Return the drops on a border of the substrate, or on a given line."""
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
        if given is None:
            drops = [replace(drop, hidden=_hidden_chance(scene, drop)) for drop in drops]
        return [_at_own_level(scene, drop, (1 + tone) / 2) for drop in drops]
    # A given baseline needs no border
    return bare if given is not None else []


def _drops_with_image(grey: np.ndarray, step: int, threshold: float) -> list[DropContour]:
    """Return the drops on a substrate as bright as the ground, by their mirror images."""
    scene = scale_by_light(grey, step, threshold)
    if scene is None:
        return []
    columns = scene.part.shape[1]
    found = []
    for xy in sorted(scene.contours(scene.level), key=len)[-3:]:
        row, column = -xy[:, 1] - scene.corner[0], xy[:, 0] - scene.corner[1]
        # The frame may cut the image, and nothing else
        if row.min() < 3 or column.min() < 3 or column.max() > columns - 4:
            continue
        line = mirror_line(xy)
        if line is None:
            continue
        ends = np.array([[x, line.at(x)] for x in (xy[:, 0].min(), xy[:, 0].max())])
        for drop in drops_on_line(xy, scene.normals(xy), 1.0, ends):
            found.append(
                replace(
                    _at_own_level(scene, drop, scene.level),
                    mirrored=True,
                    offset_stderr=line.level_error,
                    lean_stderr=line.slope_error,
                )
            )
    return sorted(found, key=lambda drop: drop.baseline[:, 1].mean())


def _hidden_chance(scene: Scene, drop: DropContour) -> float:
    """Chance that a foot is hidden: none where a mirror image shows the contact."""
    origin, axes = _frame(drop)
    left, right = drop.points[0, 0], drop.points[-1, 0]
    along = np.arange(left + 0.2 * (right - left), right - 0.2 * (right - left))
    below = np.arange(3 * drop.blur + 2, 6 * drop.blur + 8)
    grid = np.stack(np.meshgrid(along, -below), axis=-1).reshape(-1, 2)
    tones = scene.at(scene.part, origin + grid @ axes)
    if not np.isfinite(tones).any():
        return HIDDEN
    apart = float(np.nanmedian(tones)) - _substrate_tone(scene, drop)
    return float(HIDDEN * np.exp(-((apart / SEEN) ** 2)))


def _drops_at(scene: Scene, level: float, given: np.ndarray | None) -> list[DropContour]:
    """Return the drops whose border and baseline are contours at one level."""
    drops = []
    for xy in scene.contours(level):
        drops += drops_on_line(xy, scene.normals(xy), 1.0, given)
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


def moved_to(drop: DropContour, given: np.ndarray) -> DropContour | None:
    """Put a drop on the baseline that a given line and its own make; None if far from it.

    Where the given line is below the border, the front edge of the substrate hides the foot
    and the curves go on to the line.
    """
    origin, axes = _frame(drop)
    xy = origin + drop.points @ axes
    contacts = [(float(column), -float(row)) for row, column in drop.baseline]
    (x0, y0), (x1, y1) = contacts
    middle, height = (x0 + x1) / 2, float(drop.points[:, 1].max())
    named = Line.through(given, middle)
    seen = Line(
        middle, (y0 + y1) / 2, (y1 - y0) / (x1 - x0), drop.offset_stderr, drop.lean_stderr
    )
    off = seen.level - named.level
    if not -0.6 * height < off < 0.5 * height:
        return None
    off = max((seen.at(x) - named.at(x) for x in (x0, x1)), key=abs)
    line = combine(named, seen, (x0, x1))
    lean = float(np.arctan(line.slope))
    axes = np.array([[np.cos(lean), np.sin(lean)], [-np.sin(lean), np.cos(lean)]])
    start = np.array([middle, line.level])
    points = (xy - start) @ axes.T
    points = points[points[:, 1] > 0]
    if len(points) < 2:
        return None
    ends = start + np.outer([points[0, 0], points[-1, 0]], axes[0])
    return replace(
        drop, points=points, baseline=np.stack([-ends[:, 1], ends[:, 0]], axis=1),
        lean=lean, lean_stderr=line.slope_error, offset_stderr=line.level_error,
        hidden=0.0, off=off,
    )  # fmt: skip


def narrowed(drop: DropContour, width: float) -> DropContour:
    """Put a drop on a curved substrate on the chord of a base of another width.

    The contour ends in the blurred corners, and its chord with it; the curves that are
    fitted to the drop meet the substrate elsewhere.
    """
    old = float(drop.points[-1, 0] - drop.points[0, 0])
    curvature = 2 * np.sin(drop.bend) / old
    bend = float(np.arcsin(np.clip(curvature * width / 2, -0.9, 0.9)))
    rise = float((np.cos(drop.bend) - np.cos(bend)) / curvature)
    points = drop.points - [0, rise]
    inside = points[:, 1] > 0
    if np.count_nonzero(inside) < 2:
        return drop
    points = points[inside]
    # Of the first and last points that are left
    origin, axes = _frame(drop)
    ends = origin + points[[0, -1], :1] * axes[0] + rise * axes[1]
    baseline = np.stack([-ends[:, 1], ends[:, 0]], axis=1)
    return replace(drop, points=points, baseline=baseline, bend=bend)


def _substrate_tone(scene: Scene, drop: DropContour) -> float:
    """Median of the substrate beside the drop, just below the baseline; 0 out of sight."""
    origin, axes = _frame(drop)
    left, right = drop.points[:, 0].min(), drop.points[:, 0].max()
    reach = np.arange(6 * drop.blur + 3, 0.75 * (right - left) + 30)
    below = np.arange(3 * drop.blur + 2, 6 * drop.blur + 8)
    along = np.concatenate([left - reach, right + reach])
    grid = np.stack(np.meshgrid(along, -below), axis=-1).reshape(-1, 2)
    # A curved substrate falls or rises from the line between the contacts
    ends = drop.points[[0, -1], 0]
    apart = (grid[:, 0] - ends[0]) * (grid[:, 0] - ends[1])
    grid[:, 1] += np.sin(drop.bend) / (ends[1] - ends[0]) * apart
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

"""Where a drop ends: baselines given and seen, mirror images, and feet out of sight."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import ndimage, optimize, special
from scipy.spatial import cKDTree

# A point of the baseline that a person names is right to this. [pixels]
GIVEN_ERROR = 0.5
# Chance that the border of the substrate is not where the drop ends, and how far off it
# may then be. [1], [pixels]
OTHER_BORDER = 0.1
OTHER_REACH = 10.0
# A foot that the front edge of a substrate hides, where nothing shows the contact: its
# chance, and its most. A substrate that reaches two widths of the drop to the front, seen
# from 1.7 degrees below its plane, hides 0.06 of the width. A chance of 0.3 makes intervals
# of 95 % hold nine of ten such feet. [1], [widths], [heights], [heights]
HIDDEN = 0.3
HIDDEN_OF_WIDTH, HIDDEN_OF_HIGH_DROPS = 0.06, 0.1
HIDDEN_OF_HEIGHT = 0.2
# Depths at which the angle of a hidden foot is taken
_DEPTHS = 48
# An image is known to this against its drop, and may be inside it by so much where it is
# weaker. [pixels]
IMAGE_OPTICS, IMAGE_INSET = 0.3, 0.5
# Tones of a mirror image and of the substrate that differ so much show the contact
SEEN = 0.05


@dataclass(frozen=True)
class Line:
    """A baseline y = level + slope (x - middle), x to the right and y up. [pixels]"""

    middle: float
    level: float
    slope: float
    level_error: float
    slope_error: float

    def at(self, x: float) -> float:
        """Height of the line at x. [pixels]"""
        return self.level + self.slope * (x - self.middle)

    @classmethod
    def through(
        cls, points: np.ndarray, middle: float, error: float = GIVEN_ERROR
    ) -> "Line":
        """Line through two points, each right to an error."""
        (x0, y0), (x1, y1) = points
        slope = (y1 - y0) / (x1 - x0)
        level = y0 + slope * (middle - x0)
        return cls(middle, level, slope, error, float(np.sqrt(2) * error / abs(x1 - x0)))


def combine(given: Line, seen: Line, contacts: tuple[float, float]) -> Line:
    """Return the baseline by a line that was given and one that the picture shows.

    Where both agree to what a person can name, the border of the substrate is meant, whose
    place is known better. It may be another border: of the front edge that hides the foot,
    or of what is on the substrate. Both readings count by their likelihood.
    """
    apart = max(abs(given.at(x) - seen.at(x)) for x in contacts)
    error = np.hypot(given.level_error, seen.level_error)
    same = (1 - OTHER_BORDER) * np.exp(-((apart / error) ** 2) / 2)
    same /= np.sqrt(2 * np.pi) * error
    share = same / (same + OTHER_BORDER / (2 * OTHER_REACH))

    def mixed(name: str) -> tuple[float, float]:
        a, b = getattr(seen, name), getattr(given, name)
        errors = getattr(seen, f"{name}_error"), getattr(given, f"{name}_error")
        value = share * a + (1 - share) * b
        spread = share * errors[0] ** 2 + (1 - share) * errors[1] ** 2
        return value, float(np.sqrt(spread + share * (1 - share) * (a - b) ** 2))

    level, level_error = mixed("level")
    slope, slope_error = mixed("slope")
    return Line(given.middle, level, slope, level_error, slope_error)


def most_hidden(width: float, height: float) -> float:
    """Return how deep a foot may be hidden under a drop of a width and height. [pixels]"""
    usual = max(HIDDEN_OF_WIDTH * width, HIDDEN_OF_HIGH_DROPS * height)
    return min(usual, HIDDEN_OF_HEIGHT * height)


def with_hidden_foot(
    centre: float, error: float, rise: float, depth: float, chance: float
) -> tuple[float, float]:
    """95 % interval of an angle whose foot may be hidden.

    Below the baseline the outline is continued by its circle: cos θ falls evenly with the
    depth, to -1 at most, where the drop has its lowest point.

    Parameters
    ----------
    centre, error : float
        The normal distribution of the angle by what is seen. [rad]
    rise : float
        Change of the angle for a baseline one pixel lower. [rad / pixel]
    depth : float
        Most that may be hidden; less is as likely. [pixels]
    chance : float
        That anything is hidden. [1]
    """
    error = max(error, 1e-9)
    seen = float(np.clip(centre, 1e-3, np.pi - 1e-3))
    depths = depth * (np.arange(_DEPTHS) + 0.5) / _DEPTHS
    cosine = np.cos(seen) - rise * np.sin(seen) * depths
    feet = centre - seen + np.arccos(np.clip(cosine, -1, 1))

    def below(angle: float) -> float:
        shares = special.ndtr((angle - np.append(feet, centre)) / error)
        return float((1 - chance) * shares[-1] + chance * shares[:-1].mean())

    ends = min(centre, feet.min()) - 6 * error, max(centre, feet.max()) + 6 * error
    low, high = (
        optimize.brentq(lambda a, p=p: below(a) - p, *ends) for p in (0.025, 0.975)
    )
    return low, high


def mirror_line(outline: np.ndarray) -> Line | None:
    """Return the line that mirrors an outline onto itself, of a drop and its image.

    The image may be weaker than the drop, so that its contour lies inside that of the drop
    by a common distance, which is fitted too.

    Parameters
    ----------
    outline : ndarray, shape (n, 2)
        Of both, closed or cut below by the frame; x to the right and y up. [pixels]
    """
    x, y = outline.T
    span = float(np.ptp(y))
    middle = float((x.min() + x.max()) / 2)
    tree = cKDTree(outline)
    few = outline[:: max(1, len(outline) // 400)]
    normals = _outward(outline)

    def mirrored(level: float, slope: float) -> tuple[np.ndarray, np.ndarray]:
        direction = np.array([1.0, slope]) / np.hypot(1.0, slope)
        normal = np.array([-direction[1], direction[0]])
        origin = np.array([middle, level])
        below = few[(few - origin) @ normal < 0]
        image = below - 2 * np.outer((below - origin) @ normal, normal)
        return image, tree.query(image)[1]

    def apart(level: float) -> float:
        image, nearest = mirrored(level, 0.0)
        return float(np.mean(np.hypot(*(image - outline[nearest]).T)))

    # The image may be cut, and the drop may not: the line is in the lower half or middle
    levels = np.arange(y.min() + 0.2 * span, y.max() - 0.3 * span, 1.0)
    if not levels.size:
        return None
    start = np.array([levels[np.argmin([apart(at) for at in levels])], 0.0, 0.0])

    def misses(level: float, slope: float) -> tuple[np.ndarray, np.ndarray]:
        image, nearest = mirrored(level, slope)
        n = normals[nearest]
        turn = (image[:, 0] - middle) * n[:, 1] - (image[:, 1] - level) * n[:, 0]
        moves = np.stack([2 * n[:, 1], 2 * turn, np.ones(len(n))], axis=1)
        return np.sum((image - outline[nearest]) * n, axis=1), moves

    found = _settle(misses, start)
    if found is None or found[2] > 0.02 * span + 0.5:
        return None
    (level, slope, _), errors, _ = found
    return Line(middle, float(level), float(slope), float(errors[0]), float(errors[1]))


def _settle(
    misses: Callable[[float, float], tuple[np.ndarray, np.ndarray]], start: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float] | None:
    """Return level, slope and inset of a mirror image, their errors, and the rms left."""
    found = start
    # An image that is inside by no more than a blur: a flat drop's line hangs on it
    prior = np.diag([0.0, 0.0, 1 / IMAGE_INSET**2])
    for _ in range(20):
        rest, moves = misses(found[0], found[1])
        rest = rest + found[2]
        apart = np.abs(rest - np.median(rest))
        scatter = 1.4826 * np.median(apart) + 0.05
        # The frame and the blurred kink bend the ends of the image
        kept = apart < 3.5 * scatter
        if np.count_nonzero(kept) < 20:
            return None
        # One point in ten is independent; a drop's image is no better than its optics
        weight = 1 / (10 * (scatter + IMAGE_OPTICS) ** 2)
        covariance = np.linalg.inv(weight * moves[kept].T @ moves[kept] + prior)
        step = covariance @ (weight * moves[kept].T @ rest[kept] + prior @ found)
        found = found - step
        if abs(step[0]) < 1e-4:
            break
    return found, np.sqrt(np.diag(covariance)), float(np.sqrt(np.mean(rest**2)))


def _outward(outline: np.ndarray) -> np.ndarray:
    """Return the normals of a contour, away from its middle."""
    along = np.gradient(ndimage.gaussian_filter1d(outline, 2.0, axis=0), axis=0)
    normals = np.stack([-along[:, 1], along[:, 0]], axis=1)
    normals /= np.maximum(np.hypot(*normals.T), 1e-9)[:, None]
    return normals * np.sign(np.sum((outline - outline.mean(axis=0)) * normals))

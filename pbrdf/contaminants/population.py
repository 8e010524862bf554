"""How many bodies, how large, and where: random placement without overlap."""

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from pbrdf.contaminants.ground import Ground

# Places that are tried for one body; random placing of equal discs jams at 0.547
TRIES = 20_000


def counted(number_density: float, area: float) -> int:
    """Whole number of bodies nearest to a density [1/um²] on an area [um²], at least 1."""
    return max(1, round(number_density * area))


def relative_radii(number: int, spread: float, rng: np.random.Generator) -> np.ndarray:
    """Radii up to a common factor, log-normal; all 1 where ln(radius) has no spread."""
    if spread == 0.0:
        return np.ones(number)
    return np.exp(spread * rng.standard_normal(number))


def scatter(
    ground: Ground,
    radii: np.ndarray,
    rng: np.random.Generator,
    reach: Callable[[int, float, float], float],
) -> tuple[np.ndarray, np.ndarray]:
    """Throw bodies on a surface one after another, the largest first, where there is room.

    Parameters
    ----------
    ground : Ground
        The surface.
    radii : ndarray, shape (N,)
        Least distance of each body from others, without their own. [um]
    rng : Generator
        Random numbers.
    reach : callable
        (body, x, y) -> how far the body really extends there, at least its radius. [um]

    Returns
    -------
    x, y : ndarray, shape (N,)
        Axes. Circles of what `reach` gave do not overlap. [um]

    Raises
    ------
    ValueError
        If a body finds no room.
    """
    if 2 * radii.max() > min(ground.size):
        msg = (
            f"bodies must be narrower than the surface of {min(ground.size):g} um, "
            f"got {2 * radii.max():.4g} um. Take a larger surface, or more and smaller "
            "bodies."
        )
        raise ValueError(msg)
    number = len(radii)
    places, extent = np.empty((number, 2)), np.empty(number)
    span = np.asarray(ground.size)
    order = np.argsort(-radii, kind="stable")
    for count, body in enumerate(order):
        taken = order[:count]
        margin = 0.0 if ground.periodic else radii[body]
        for _ in range(TRIES):
            x, y = margin + (span - 2 * margin) * rng.random(2)
            off = ground.nearest(places[taken] - (x, y))
            room = np.hypot(*off.T) - extent[taken]
            if (room < radii[body]).any():
                continue
            full = reach(int(body), float(x), float(y))
            if 2 * full > span.min() or (room < full).any():
                continue
            if not ground.periodic and (
                min(x, y) < full or x + full > span[0] or y + full > span[1]
            ):
                continue
            places[body], extent[body] = (x, y), full
            break
        else:
            share = np.pi * np.sum(radii**2) / ground.area
            msg = (
                f"bodies must find room on the surface, got {count} of {number} placed "
                f"at a coverage of {share:.3g}. Random placing without overlap jams near "
                "0.55, and earlier on a small surface: take less, a larger surface, or a "
                "breath figure, whose drops merge."
            )
            raise ValueError(msg)
    return places[:, 0], places[:, 1]


def overlapping(ground: Ground, axes: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """Pairs of circles that overlap on the surface, shape (pairs, 2), the deepest first."""
    box = ground.size if ground.periodic else None
    points = ground.wrapped(axes)
    tree = cKDTree(points, boxsize=box)
    pairs = tree.query_pairs(2 * float(reach.max()), output_type="ndarray")
    off = ground.nearest(points[pairs[:, 1]] - points[pairs[:, 0]])
    depth = np.hypot(*off.T) / (reach[pairs[:, 0]] + reach[pairs[:, 1]])
    order = np.lexsort((pairs[:, 1], pairs[:, 0], depth))
    hit: np.ndarray = pairs[order][depth[order] < 1.0]
    return hit

"""Breath figures: dew that nucleates, grows and coalesces.

Beysens & Knobler, Phys. Rev. Lett. 57, 1433 (1986): drops first grow alone, then mostly by
merging, and the share of the surface they cover stays the same.
"""

import numpy as np
from scipy.spatial import cKDTree

from pbrdf.contaminants.shapes import cap_radius, cap_volume
from pbrdf.surface.periodic import nearest, wrapped

# Growth of R² between two looks for contacts: 2 % of the radius of a drop never merged
STEP = 0.04
# Least share of the final R² at which to look first
EARLIEST = 1e-9


def breath_figure(
    *,
    nuclei: np.ndarray,
    period: tuple[float, float],
    contact_angle: float,
    volume: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Grow drops from nuclei until they hold a given volume.

    Parameters
    ----------
    nuclei : ndarray, shape (N, 2)
        Where drops start, all at once and without size. [um]
    period : (float, float)
        Periods of the surface. [um]
    contact_angle : float
        The same for all drops, in (0, π]. [rad]
    volume : float
        Volume of all drops at the end. [um³]

    Returns
    -------
    positions : ndarray, shape (M, 2)
        Axes of the drops that are left. [um]
    volumes : ndarray, shape (M,)
        Their volumes; the sum is `volume` to rounding. [um³]

    Notes
    -----
    Vapour that diffuses to a drop lets its volume grow in proportion to its radius, so R²
    of every drop grows alike. Drops merge when their bases touch, above 90 degrees when
    their spheres do; volume is conserved and the new drop has its axis at the centre of
    volume. No new nuclei form in the gaps.
    """
    places, volumes = np.asarray(nuclei, dtype=np.float64), np.zeros(len(nuclei))
    unit = float(cap_volume(1.0, contact_angle))
    # Alone, N equal drops would hold the volume at this R²; nothing can happen before the
    # two nearest nuclei touch
    final = float(cap_radius(volume / len(nuclei), contact_angle)) ** 2
    grown = min(_first_contact(places, period, contact_angle), final)
    grown = max(grown, EARLIEST * final)
    step = grown
    while True:
        squared = cap_radius(volumes, contact_angle) ** 2
        rest = _growth_to(squared, volume / unit)
        last = rest <= step
        volumes = unit * (squared + min(step, rest)) ** 1.5
        if last:
            # Take out the rounding of the root, before drops are merged
            volumes *= volume / volumes.sum()
        places, volumes = coalesce(places, volumes, period, contact_angle)
        if last:
            return places, volumes
        grown += step
        step = STEP * grown


def coalesce(
    places: np.ndarray,
    volumes: np.ndarray,
    period: tuple[float, float],
    contact_angle: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Merge drops that touch, and those that the merged ones touch, until none do."""
    while True:
        radii = cap_radius(volumes, contact_angle)
        pairs = touching(places, radii, period, contact_angle)
        if len(pairs) == 0:
            return places, volumes
        places, volumes = merge(places, volumes, pairs, period)


def merge(
    places: np.ndarray, volumes: np.ndarray, pairs: np.ndarray, period: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Merge pairs (N, 2) of drops in their order, each drop once."""
    places, volumes = places.copy(), volumes.copy()
    kept = np.ones(len(volumes), dtype=bool)
    merged = np.zeros(len(volumes), dtype=bool)
    lengths = np.asarray(period)
    for one, other in pairs:
        if merged[one] or merged[other]:
            continue
        merged[[one, other]] = True
        total = volumes[one] + volumes[other]
        off = nearest(places[other] - places[one], lengths)
        places[one] = wrapped(places[one] + off * (volumes[other] / total), lengths)
        volumes[one] = total
        kept[other] = False
    return places[kept], volumes[kept]


def touching(
    places: np.ndarray, radii: np.ndarray, period: tuple[float, float], contact_angle: float
) -> np.ndarray:
    """Pairs of drops that touch, shape (pairs, 2), those that overlap most first."""
    lengths = np.asarray(period)
    found, depths = [], []
    seen = radii * (np.sin(contact_angle) if contact_angle < np.pi / 2 else 1.0)
    points = wrapped(places, lengths)
    # Size by size, halving: pairs of large drops reach further than those of small ones
    high = float(seen.max())
    while True:
        here = np.flatnonzero((seen <= high) & (seen > high / 2))
        smaller = np.flatnonzero(seen <= high)
        if here.size:
            near = cKDTree(points[here], boxsize=lengths).sparse_distance_matrix(
                cKDTree(points[smaller], boxsize=lengths), 2 * high, output_type="ndarray"
            )
            one, other, distance = here[near["i"]], smaller[near["j"]], near["v"]
            reach = contact_distance(radii[one], radii[other], contact_angle)
            # Each pair once: the larger drop first, equal ones by number
            equal = seen[one] == seen[other]
            first = (seen[one] > seen[other]) | (equal & (one < other))
            hit = first & (distance < reach)
            found.append(np.column_stack([one[hit], other[hit]]))
            depths.append((distance / reach)[hit])
        if smaller.size == here.size:
            break
        high = min(high / 2, float(seen[seen <= high / 2].max()))
    pairs = np.concatenate(found)
    order = np.lexsort((pairs[:, 1], pairs[:, 0], np.concatenate(depths)))
    touching_pairs: np.ndarray = pairs[order]
    return touching_pairs


def contact_distance(
    one: np.ndarray, other: np.ndarray, contact_angle: float
) -> np.ndarray:
    """Distance of the axes of two caps with these sphere radii when they touch. [um]"""
    together = one + other
    if contact_angle <= np.pi / 2:
        return together * np.sin(contact_angle)
    # Centres lie at the heights -R cos θ
    apart = (one - other) * np.cos(contact_angle)
    return np.sqrt(together**2 - apart**2)


def _first_contact(
    places: np.ndarray, period: tuple[float, float], contact_angle: float
) -> float:
    """R² at which the two nearest of equal drops touch; inf for a single one."""
    if len(places) < 2:
        return np.inf
    lengths = np.asarray(period)
    points = wrapped(places, lengths)
    distances, _ = cKDTree(points, boxsize=lengths).query(points, k=2)
    sine = np.sin(contact_angle) if contact_angle < np.pi / 2 else 1.0
    return float(0.5 * distances[:, 1].min() / sine) ** 2


def _growth_to(squared: np.ndarray, total: float) -> float:
    """Growth of all R² after which the sum of R³ is `total`."""
    growth = float(np.cbrt(total / len(squared)) ** 2)
    # The sum is convex in the growth and the start is not below the root: Newton descends
    for _ in range(200):
        radii = np.sqrt(squared + growth)
        change = (np.sum(radii**3) - total) / (1.5 * np.sum(radii))
        growth -= float(change)
        if abs(change) <= 1e-15 * growth:
            break
    return growth

"""Drops laid on a surface: at given places, thrown, or grown as a breath figure."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pbrdf.contaminants import population
from pbrdf.contaminants.condensation import breath_figure, merge
from pbrdf.contaminants.ground import Ground, Rest
from pbrdf.contaminants.sessile import ShapeMaker
from pbrdf.contaminants.shapes import Shape, contact_depth


@dataclass(frozen=True, eq=False, kw_only=True)
class Laid:
    """Drops at rest: axes [um], volumes [um³], shapes and how each rests.

    `overlaps` counts the pairs that overlap.
    """

    x: np.ndarray
    y: np.ndarray
    volumes: np.ndarray
    shapes: Sequence[Shape]
    rests: Sequence[Rest]
    pairs: np.ndarray

    @property
    def overlaps(self) -> int:
        """Number of pairs that overlap."""
        return len(self.pairs)


def lay(
    ground: Ground,
    maker: ShapeMaker,
    x: np.ndarray,
    y: np.ndarray,
    volumes: np.ndarray,
    rests: Sequence[Rest] | None = None,
) -> Laid:
    """Lay drops of these volumes [um³] at these axes [um], where `rests` does not yet."""
    shapes = maker.shapes(volumes)
    if rests is None:
        rests = [ground.settle(*drop) for drop in zip(shapes, x, y, strict=True)]
    reach = np.array(
        [max(s.radius, rest.rim) for s, rest in zip(shapes, rests, strict=True)]
    )
    pairs = population.overlapping(ground, np.column_stack([x, y]), reach)
    if maker.contact_angle > np.pi / 2:
        # Seen from above their rims cross; a small drop may still fit under a large one
        pairs = _touching_in_space(ground, x, y, shapes, rests, pairs)
    return Laid(x=x, y=y, volumes=volumes, shapes=shapes, rests=rests, pairs=pairs)


def thrown(
    ground: Ground,
    maker: ShapeMaker,
    thickness: float | None,
    coverage: float | None,
    number_density: float | None,
    spread: float,
    rng: np.random.Generator,
) -> Laid:
    """Throw drops on the surface where there is room.

    Parameters
    ----------
    ground, maker
        The surface, and who knows the shapes.
    thickness, coverage, number_density : float or None
        Volume per area [um], share of area seen from above [1] and drops per area [1/um²];
        two of them.
    spread : float
        Standard deviation of ln(radius); 0 for equal drops.
    rng : Generator
        Random numbers.
    """
    if number_density is None:
        assert coverage is not None  # two of three are given
        assert thickness is not None
        # Means of R³ and R² of a log-normal radius of median 1
        cubes, squares = np.exp(4.5 * spread**2), np.exp(2.0 * spread**2)
        size = maker.radius_for(thickness / coverage * squares / cubes)
        number_density = coverage / (np.pi * size**2 * squares)
    number = population.counted(number_density, ground.area)
    radii = population.relative_radii(number, spread, rng)
    if thickness is not None:
        volumes = radii**3 * (thickness * ground.area / np.sum(radii**3))
    else:
        assert coverage is not None
        volumes = maker.volumes_covering(radii, coverage * ground.area)
    shapes = maker.shapes(volumes)
    rests: dict[int, Rest] = {}

    def reach(k: int, x: float, y: float) -> float:
        rests[k] = ground.settle(shapes[k], x, y)
        return max(shapes[k].radius, rests[k].rim)

    radii = np.array([shape.radius for shape in shapes])
    x, y = population.scatter(ground, radii, rng, reach)
    return lay(ground, maker, x, y, volumes, [rests[k] for k in range(number)])


def grown(
    ground: Ground,
    maker: ShapeMaker,
    number_density: float,
    thickness: float,
    rng: np.random.Generator,
) -> Laid:
    """Grow a breath figure from nuclei of a density [1/um²] to a volume per area [um].

    Raises
    ------
    ValueError
        If the surface does not repeat.
    """
    if not ground.periodic:
        msg = (
            "surface must be periodic for a breath figure, got a finite map. Make it so "
            "with HeightMap.mirrored()."
        )
        raise ValueError(msg)
    period = ground.size
    nuclei = population.counted(number_density, ground.area)
    axes, volumes = breath_figure(
        nuclei=rng.random((nuclei, 2)) * period,
        period=period,
        contact_angle=maker.contact_angle,
        volume=thickness * ground.area,
    )
    # On the rough surface some of those that were near to each other touch
    while True:
        laid = lay(ground, maker, axes[:, 0], axes[:, 1], volumes)
        if not laid.overlaps:
            return laid
        axes, volumes = merge(axes, volumes, laid.pairs, period)


def _touching_in_space(
    ground: Ground,
    x: np.ndarray,
    y: np.ndarray,
    shapes: Sequence[Shape],
    rests: Sequence[Rest],
    pairs: np.ndarray,
) -> np.ndarray:
    """Keep the pairs whose bodies overlap at some height."""
    kept = []
    for one, other in pairs:
        off = ground.nearest(np.array([x[other] - x[one], y[other] - y[one]]))
        rise = rests[other].z - rests[one].z
        reach = contact_depth(shapes[one], shapes[other], rise)
        kept.append(float(np.hypot(*off)) < reach)
    found: np.ndarray = pairs[np.array(kept, dtype=bool)]
    return found

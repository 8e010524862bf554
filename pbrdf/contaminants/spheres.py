"""Spheres on the surface: dust, pollen, droplets that float on a texture."""

from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from pbrdf.contaminants import population
from pbrdf.contaminants.arguments import (
    choice,
    fraction,
    material_of,
    per_body,
    places,
    positive,
)
from pbrdf.contaminants.bodies import Settled
from pbrdf.contaminants.ground import Ground
from pbrdf.contaminants.shapes import Shape, sphere
from pbrdf.errors import check_seed
from pbrdf.optics.materials import Material


@dataclass(frozen=True, kw_only=True, eq=False)
class Spheres:
    """Spheres of any material, thrown at random; opaque or transparent as its index says.

    Parameters
    ----------
    radius : float
        Radius; of log-normal sizes the median. [um]
    material : Material or str
        What they consist of.
    number_density : float, optional
        Spheres on a unit of area. Give this or coverage. [1/um²]
    coverage : float, optional
        Share of the area under spheres, seen from above, on average. [1]
    sizes : {"equal", "lognormal"}
        How radii are distributed.
    width : float
        Standard deviation of ln(radius) of log-normal sizes. [1]
    sink : float
        A sphere rests on the surface, touching it from above, and is then lowered by this
        fraction of its diameter. [1]
    seed : int, optional
        Gives every sample of a random surface the same spheres; without it they are drawn
        anew for each, from the seed of the simulation.
    positions : array_like, optional
        Explicit spheres: use `Spheres.at`.

    Raises
    ------
    ValueError
        If the amount is not given in one way, or a value is out of its range.

    Examples
    --------
    Pollen on a hundredth of the area:

    >>> pollen = Spheres(radius=12.0, coverage=0.01, material=Material(1.45, 0.02))
    """

    radius: float | np.ndarray
    material: Material | str
    number_density: float | None = None
    coverage: float | None = None
    sizes: Literal["equal", "lognormal"] = "equal"
    width: float = 0.2
    sink: float = 0.0
    seed: int | None = None
    positions: np.ndarray | None = field(default=None, repr=False)

    @classmethod
    def at(
        cls,
        positions: npt.ArrayLike,
        *,
        radius: npt.ArrayLike,
        material: Material | str,
        sink: float = 0.0,
    ) -> "Spheres":
        """Lay spheres at given places.

        Parameters
        ----------
        positions : array_like, shape (N, 2) or (N, 3)
            x and y of spheres that rest on the surface; or their centres x, y, z. [um]
        radius : float or array_like, shape (N,)
            Radius. [um]
        material : Material or str
            What they consist of.
        sink : float
            Fraction of the diameter by which resting spheres are lowered. [1]
        """
        return cls(radius=radius, material=material, sink=sink, positions=positions)  # type: ignore[arg-type]

    def __post_init__(self) -> None:
        set_field = object.__setattr__
        set_field(self, "material", material_of(self.material))
        set_field(self, "sink", fraction("sink", self.sink))
        set_field(self, "width", fraction("width", self.width, 2.0))
        choice("sizes", self.sizes, ("equal", "lognormal"))
        check_seed(self.seed)
        given = [
            name
            for name in ("number_density", "coverage", "positions")
            if getattr(self, name) is not None
        ]
        if len(given) != 1:
            msg = (
                "amount must be number_density or coverage, got "
                f"{', '.join(given) or 'none'}. Or lay spheres with Spheres.at."
            )
            raise ValueError(msg)
        if self.number_density is not None:
            number_density = positive("number_density", self.number_density, "1/um²")
            set_field(self, "number_density", number_density)
        if self.coverage is not None:
            set_field(self, "coverage", fraction("coverage", self.coverage))
            positive("coverage", self.coverage, "1")
        if self.positions is None:
            set_field(self, "radius", positive("radius", self.radius))
            return
        set_field(self, "positions", places(self.positions, (2, 3)))
        if self.sink > 0.0 and self.positions.shape[1] == 3:
            msg = (
                f"sink must be 0 where centres are given [1], got {self.sink:g}. Lower "
                "the centres, or give x and y alone."
            )
            raise ValueError(msg)
        radius = per_body("radius", self.radius, len(self.positions), "um")
        set_field(self, "radius", radius)

    @property
    def random(self) -> bool:
        """Whether they are drawn anew for every sample."""
        return self.positions is None and self.seed is None

    def settle(self, ground: Ground, seed: np.random.SeedSequence) -> Settled:
        """Lay them on a surface; `seed` is used where they have none of their own."""
        if self.seed is not None:
            seed = np.random.SeedSequence(self.seed)
        if self.positions is None:
            x, y, radius = self._thrown(ground, np.random.default_rng(seed))
        else:
            x, y, radius = *self.positions[:, :2].T, np.asarray(self.radius)
        if self.positions is not None and self.positions.shape[1] == 3:
            z = self.positions[:, 2]
        else:
            rest = [ground.rest(*place) for place in zip(x, y, radius, strict=True)]
            z = np.array(rest) - 2 * self.sink * radius
        shapes = [sphere(float(one), 0.0) for one in radius]
        report = _report(ground, shapes, x, y, z)
        return Settled(shapes=shapes, x=x, y=y, z=z, report=report)

    def _thrown(
        self, ground: Ground, rng: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Places and radii of random spheres."""
        spread = self.width if self.sizes == "lognormal" else 0.0
        density = self.number_density
        if density is None:
            assert self.coverage is not None  # one of the two is given
            mean_square = float(self.radius) ** 2 * np.exp(2 * spread**2)
            density = self.coverage / (np.pi * mean_square)
        number = population.counted(density, ground.area)
        radius = population.relative_radii(number, spread, rng) * self.radius
        x, y = population.scatter(ground, radius, rng, lambda k, x, y: float(radius[k]))
        return x, y, radius


def _report(
    ground: Ground, shapes: list[Shape], x: np.ndarray, y: np.ndarray, z: np.ndarray
) -> dict[str, Any]:
    """Say what became of the spheres."""
    above = [ground.volume_above(*one) for one in zip(shapes, x, y, z, strict=True)]
    buried = [k for k, rest in enumerate(above) if rest.volume <= 0.0]
    if buried:
        k = buried[0]
        msg = (
            f"positions must leave a part of every sphere above the surface, got centre "
            f"z {z[k]:.4g} um and radius {0.5 * (shapes[k].height - shapes[k].bottom):.4g} "
            f"um for sphere {k}. Raise it, or sink it less."
        )
        raise ValueError(msg)
    whole = sum(shape.whole_volume for shape in shapes)
    seen = sum(np.pi * shape.radius**2 for shape in shapes)
    return {
        "kind": "spheres",
        "number": len(shapes),
        "volume": whole,
        "volume_placed": sum(rest.volume for rest in above),
        "coverage_wetted": sum(rest.wetted for rest in above) / ground.area,
        "coverage_projected": seen / ground.area,
        "contact_angle": None,
        "curvature_radius": float(np.median([shape.curvature for shape in shapes])),
        "notes": (),
    }

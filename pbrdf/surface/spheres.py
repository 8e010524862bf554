"""Spheres on the surface: dust, pollen, droplets that float on a texture."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from pbrdf.optics.materials import Material
from pbrdf.surface.arguments import fraction, material_of, per_body, places
from pbrdf.surface.bodies import Settled
from pbrdf.surface.ground import Ground
from pbrdf.surface.shapes import Shape, sphere


@dataclass(frozen=True, kw_only=True, eq=False)
class Spheres:
    """Spheres of any material; opaque or transparent as its index says."""

    radius: np.ndarray
    material: Material | str
    sink: float = 0.0
    positions: np.ndarray = field(repr=False)

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
            x and y of spheres that rest on the surface, touching it from above; or their
            centres x, y, z. [um]
        radius : float or array_like, shape (N,)
            Radius. [um]
        material : Material or str
            What they consist of.
        sink : float
            Fraction of the diameter by which resting spheres are then lowered. [1]
        """
        return cls(radius=radius, material=material, sink=sink, positions=positions)  # type: ignore[arg-type]

    def __post_init__(self) -> None:
        object.__setattr__(self, "positions", places(self.positions, (2, 3)))
        radius = per_body("radius", self.radius, len(self.positions), "um")
        object.__setattr__(self, "radius", radius)
        object.__setattr__(self, "material", material_of(self.material))
        object.__setattr__(self, "sink", fraction("sink", self.sink))

    def settle(self, ground: Ground, seed: np.random.SeedSequence) -> Settled:
        """Lay them on a surface."""
        del seed
        x, y = self.positions[:, 0], self.positions[:, 1]
        if self.positions.shape[1] == 3:
            z = self.positions[:, 2]
        else:
            rest = np.array(
                [ground.rest(*place) for place in zip(x, y, self.radius, strict=True)]
            )
            z = rest - 2 * self.sink * self.radius
        shapes = [sphere(float(radius), 0.0) for radius in self.radius]
        return Settled(
            shapes=shapes, x=x, y=y, z=z, report=_report(ground, shapes, x, y, z)
        )


def _report(
    ground: Ground, shapes: list[Shape], x: np.ndarray, y: np.ndarray, z: np.ndarray
) -> dict[str, Any]:
    """Say what became of the spheres."""
    above = [ground.volume_above(*one) for one in zip(shapes, x, y, z, strict=True)]
    buried = [k for k, (volume, _) in enumerate(above) if volume <= 0.0]
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
        "volume_placed": sum(volume for volume, _ in above),
        "coverage_wetted": sum(wetted for _, wetted in above) / ground.area,
        "coverage_projected": seen / ground.area,
        "contact_angle": None,
        "notes": (),
    }

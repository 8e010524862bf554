"""Drops of liquid on the surface."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from pbrdf.optics.materials import Material
from pbrdf.surface.arguments import angle, material_of, per_body, places
from pbrdf.surface.bodies import Settled
from pbrdf.surface.ground import Ground
from pbrdf.surface.shapes import cap


@dataclass(frozen=True, kw_only=True, eq=False)
class Drops:
    """Drops of liquid of one contact angle."""

    contact_angle: float
    material: Material | str = "water"
    positions: np.ndarray = field(repr=False)
    volume: np.ndarray = field(repr=False)

    @classmethod
    def at(
        cls,
        positions: npt.ArrayLike,
        *,
        volume: npt.ArrayLike,
        contact_angle: float,
        material: Material | str = "water",
    ) -> "Drops":
        """Lay drops at given places.

        Parameters
        ----------
        positions : array_like, shape (N, 2)
            x and y of each drop; on a periodic surface they repeat with it. [um]
        volume : float or array_like, shape (N,)
            Volume of each. [um³]
        contact_angle : float
            Angle at which the liquid meets the mean surface, in (0, π]. [rad]
        material : Material or str
            The liquid.
        """
        return cls(
            positions=positions,  # type: ignore[arg-type]
            volume=volume,  # type: ignore[arg-type]
            contact_angle=contact_angle,
            material=material,
        )

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "contact_angle", angle("contact_angle", self.contact_angle)
        )
        object.__setattr__(self, "material", material_of(self.material))
        object.__setattr__(self, "positions", places(self.positions, (2,)))
        volume = per_body("volume", self.volume, len(self.positions), "um³")
        object.__setattr__(self, "volume", volume)

    def settle(self, ground: Ground, seed: np.random.SeedSequence) -> Settled:
        """Lay them on a surface."""
        del seed
        x, y = self.positions[:, 0], self.positions[:, 1]
        of_volume = {v: cap(float(v), self.contact_angle) for v in np.unique(self.volume)}
        shapes = [of_volume[v] for v in self.volume]
        settled = [ground.settle(*drop) for drop in zip(shapes, x, y, strict=True)]
        z, placed, wetted = np.array(settled).T
        report: dict[str, Any] = {
            "kind": "drops",
            "number": len(shapes),
            "volume": float(self.volume.sum()),
            "volume_placed": float(placed.sum()),
            "coverage_wetted": float(wetted.sum() / ground.area),
            "coverage_projected": sum(np.pi * s.radius**2 for s in shapes) / ground.area,
            "contact_angle": self.contact_angle,
            "notes": (),
        }
        return Settled(shapes=shapes, x=x, y=y, z=z, report=report)

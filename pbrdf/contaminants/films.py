"""Films of liquid: of one thickness, or filling the valleys to one level."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from pbrdf.contaminants.arguments import choice, material_of, positive
from pbrdf.contaminants.bodies import Settled
from pbrdf.contaminants.ground import Ground
from pbrdf.optics.materials import Material


@dataclass(frozen=True, kw_only=True)
class Film:
    """A continuous layer on the surface.

    Parameters
    ----------
    thickness : float
        Height of the layer above the surface, along z; of a level film its mean over the
        surface, that is its volume per area. [um]
    material : Material or str
        What it consists of.
    level : bool
        False: the upper side repeats the surface. True: it is a horizontal plane, the
        valleys are filled and peaks may stand out.

    Examples
    --------
    >>> Film(thickness=5.0, material="water").material.name
    'water'
    """

    thickness: float
    material: Material | str = "water"
    level: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "thickness", positive("thickness", self.thickness))
        object.__setattr__(self, "material", material_of(self.material))
        choice("level", self.level, (False, True))

    def settle(self, ground: Ground, seed: np.random.SeedSequence) -> Settled:
        """Lay it on a surface; the seed is not used."""
        del seed
        value, wetted = self.thickness, 1.0
        if self.level:
            value, wetted = ground.fill_level(self.thickness)
        report: dict[str, Any] = {
            "kind": "film",
            "number": 1,
            "volume": self.thickness * ground.area,
            "volume_placed": self.thickness * ground.area,
            "coverage_wetted": wetted,
            "coverage_projected": wetted,
            "contact_angle": None,
            "thickness": self.thickness,
            "notes": (),
        }
        return Settled(film=(self.level, value), report=report)

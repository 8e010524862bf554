"""Drops of liquid on the surface, such as dew."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from pbrdf.contaminants.arguments import (
    angle,
    choice,
    fraction,
    material_of,
    per_body,
    places,
    positive,
)
from pbrdf.contaminants.bodies import Settled
from pbrdf.contaminants.ground import Ground
from pbrdf.contaminants.laying import grown, lay, thrown
from pbrdf.contaminants.sessile import ShapeMaker
from pbrdf.contaminants.wetting import WATER_CAPILLARY_LENGTH, effective_contact_angle
from pbrdf.errors import check_seed
from pbrdf.optics.materials import Material

SIZES = ("equal", "lognormal", "breath-figure")


@dataclass(frozen=True, kw_only=True, eq=False)
class Drops:
    """Drops of one contact angle, thrown at random or grown as a breath figure.

    Parameters
    ----------
    contact_angle : float
        Angle at which the liquid meets the mean surface, in [0, π]; at 0 it spreads to a
        film. [rad]
    volume_per_area : float, optional
        Volume of liquid on a unit of area, true after the surface has cut the drops. [um]
    coverage : float, optional
        Share of the area under drops, seen from above: other than volume_per_area, exact
        on a plane only. [1]
    number_density : float, optional
        Drops on a unit of area; of a breath figure the nuclei. Give two of the three, for
        a breath figure the first and the last. [1/um²]
    material : Material or str
        The liquid.
    seed : int, optional
        Gives every sample of a random surface the same sizes and axes of drops; without it
        they are drawn anew for each, from the seed of the simulation.
    sizes : {"equal", "lognormal", "breath-figure"}
        How volumes are distributed.
    width : float
        Standard deviation of ln(radius) of log-normal drops. [1]
    gravity : "auto", True or False
        Flatten drops by the Young-Laplace equation: where it matters, always, or never.
    capillary_length : float
        √(γ/ρg) of the liquid; that of water at 20 °C by default. [um]
    roughness : {"warn", "wenzel", "ignore"}
        Warn where roughness contradicts the contact angle; or take `contact_angle` as that
        of the smooth material and apply Wenzel's law; or say nothing.
    positions, volume : array_like, optional
        Explicit drops: use `Drops.at`.

    Raises
    ------
    ValueError
        If the amount is not given in one way, or a value is out of its range.

    Notes
    -----
    A drop keeps the size that it has on a plane, and with it the volume that the plane cuts
    off; it is moved up or down until the surface cuts off as much. Bodies do not overlap:
    random ones are placed by what they really cover, and those of a breath figure that
    touch on the rough surface merge.

    Examples
    --------
    A hundredth of a millimetre of dew, forty drops on a square millimetre:

    >>> dew = Drops(contact_angle=np.deg2rad(90), volume_per_area=10.0,
    ...             number_density=40e-6, sizes="breath-figure", seed=1)
    """

    contact_angle: float
    volume_per_area: float | None = None
    coverage: float | None = None
    number_density: float | None = None
    material: Material | str = "water"
    seed: int | None = None
    sizes: Literal["equal", "lognormal", "breath-figure"] = "equal"
    width: float = 0.2
    gravity: bool | Literal["auto"] = "auto"
    capillary_length: float = WATER_CAPILLARY_LENGTH
    roughness: Literal["warn", "wenzel", "ignore"] = "warn"
    positions: np.ndarray | None = field(default=None, repr=False)
    volume: np.ndarray | None = field(default=None, repr=False)

    @classmethod
    def at(
        cls,
        positions: npt.ArrayLike,
        *,
        volume: npt.ArrayLike,
        contact_angle: float,
        material: Material | str = "water",
        **options: Any,
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
        **options
            gravity, capillary_length and roughness of `Drops`.
        """
        return cls(
            positions=positions,  # type: ignore[arg-type]
            volume=volume,  # type: ignore[arg-type]
            contact_angle=contact_angle,
            material=material,
            **options,
        )

    def __post_init__(self) -> None:
        set_field = object.__setattr__
        set_field(self, "contact_angle", angle("contact_angle", self.contact_angle))
        set_field(self, "material", material_of(self.material))
        length = positive("capillary_length", self.capillary_length)
        set_field(self, "capillary_length", length)
        choice("gravity", self.gravity, ("auto", True, False))
        choice("roughness", self.roughness, ("warn", "wenzel", "ignore"))
        choice("sizes", self.sizes, SIZES)
        set_field(self, "width", fraction("width", self.width, 2.0))
        for name, unit in (("volume_per_area", "um"), ("number_density", "1/um²")):
            if getattr(self, name) is not None:
                set_field(self, name, positive(name, getattr(self, name), unit))
        if self.coverage is not None:
            positive("coverage", self.coverage, "1")
            set_field(self, "coverage", fraction("coverage", self.coverage))
        check_seed(self.seed)
        if self.positions is None and self.volume is None:
            self._check_amount()
            return
        self._check_explicit()
        axes = places(self.positions, (2,))  # type: ignore[arg-type]
        set_field(self, "positions", axes)
        volume = per_body("volume", self.volume, len(axes), "um³")  # type: ignore[arg-type]
        set_field(self, "volume", volume)

    def _check_amount(self) -> None:
        """Refuse amounts that say too little or too much."""
        given = tuple(
            name
            for name in ("volume_per_area", "coverage", "number_density")
            if getattr(self, name) is not None
        )
        if self.contact_angle == 0.0 and "volume_per_area" in given:
            return
        if self.sizes == "breath-figure" and given != ("volume_per_area", "number_density"):
            rule = "be volume_per_area and number_density (of nuclei) for a breath figure"
        elif len(given) != 2:
            rule = "be two of volume_per_area, coverage and number_density"
        elif self.contact_angle == 0.0:
            rule = "hold volume_per_area where the liquid spreads to a film"
        else:
            return
        msg = (
            f"amount must {rule}, got {', '.join(given) or 'none'}. Or lay drops at given "
            "places with Drops.at."
        )
        raise ValueError(msg)

    def _check_explicit(self) -> None:
        """Refuse explicit drops that are also random, incomplete, or spread."""
        for name in ("volume_per_area", "coverage", "number_density", "seed"):
            if getattr(self, name) is not None:
                msg = (
                    f"{name} must be left out beside positions, got {getattr(self, name)}. "
                    "Explicit drops have their volumes."
                )
                raise ValueError(msg)
        if self.positions is None or self.volume is None:
            msg = "positions and volume must both be given, got one. Use Drops.at."
            raise ValueError(msg)
        if self.contact_angle == 0.0:
            msg = (
                "contact_angle must be positive for drops at given places [rad], got 0. "
                "What spreads is a Film."
            )
            raise ValueError(msg)

    @property
    def random(self) -> bool:
        """Whether they are drawn anew for every sample."""
        return self.positions is None and self.seed is None and self.contact_angle > 0.0

    def settle(self, ground: Ground, seed: np.random.SeedSequence) -> Settled:
        """Lay them on a surface; `seed` is used where they have none of their own."""
        if self.seed is not None:
            seed = np.random.SeedSequence(self.seed)
        rng = np.random.default_rng(seed)
        contact_angle, notes = effective_contact_angle(
            self.contact_angle, ground, self.roughness
        )
        if contact_angle == 0.0:
            return self._spread(ground, notes)
        maker = ShapeMaker(contact_angle, self.gravity, self.capillary_length)
        if self.positions is not None and self.volume is not None:
            x, y = self.positions.T
            drops = lay(ground, maker, x, y, self.volume)
        elif self.sizes == "breath-figure":
            assert self.number_density is not None  # both are checked
            assert self.volume_per_area is not None
            drops = grown(ground, maker, self.number_density, self.volume_per_area, rng)
        else:
            drops = thrown(
                ground, maker, self.volume_per_area, self.coverage, self.number_density,
                self.width if self.sizes == "lognormal" else 0.0, rng,
            )  # fmt: skip
        shapes, rests = drops.shapes, drops.rests
        if drops.overlaps:
            notes.append(
                f"{drops.overlaps} pairs of drops overlap; together they hold less than "
                "the sum of their volumes."
            )
        seen = sum(np.pi * shape.radius**2 for shape in shapes)
        report: dict[str, Any] = {
            "kind": "drops",
            "number": len(shapes),
            "volume": float(np.sum(drops.volumes)),
            "volume_placed": float(sum(rest.volume for rest in rests)),
            "coverage_wetted": float(sum(rest.wetted for rest in rests) / ground.area),
            "coverage_projected": float(seen / ground.area),
            "contact_angle": maker.contact_angle,
            "curvature_radius": float(np.median([shape.curvature for shape in shapes])),
            "largest_radius": max(shape.radius for shape in shapes),
            "flattened": sum(len(shape.slabs) > 1 for shape in shapes),
            "notes": tuple(notes),
        }
        z = np.array([rest.z for rest in rests])
        placed = zip(shapes, drops.x, drops.y, z, strict=True)
        shapes = [ground.trimmed(*one) for one in placed]
        return Settled(shapes=shapes, x=drops.x, y=drops.y, z=z, report=report)

    def _spread(self, ground: Ground, notes: Sequence[str]) -> Settled:
        """Lay a film of the same volume, where the liquid wets completely."""
        if self.volume_per_area is None:
            msg = (
                "volume_per_area must be given where the liquid wets completely [um], got "
                "none. Wenzel's law leaves no contact angle on this surface."
            )
            raise ValueError(msg)
        volume = self.volume_per_area * ground.area
        report = {
            "kind": "drops", "number": 0, "volume": volume, "volume_placed": volume,
            "coverage_wetted": 1.0, "coverage_projected": 1.0, "contact_angle": 0.0,
            "thickness": self.volume_per_area, "notes": tuple(notes),
        }  # fmt: skip
        return Settled(film=(False, self.volume_per_area), report=report)

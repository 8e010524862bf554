"""Scenes of the bench: one for each class of what users simulate."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from pbrdf import Drops, GaussianSurface, Material, MicrofacetModel, Scene


@dataclass(frozen=True, kw_only=True)
class Case:
    """A scene, its direction and options, and its analytical model if there is one."""

    name: str
    scene: Callable[[int], Scene]
    theta_i: float
    options: dict[str, Any] = field(default_factory=dict)
    model: MicrofacetModel | None = None


def _rough(slope: float, material: Material, *contaminants: Any) -> Callable[[int], Scene]:
    def scene(side: int) -> Scene:
        surface = GaussianSurface(
            shape=(side, side), spacing=1.0, corr_length=16.0, slope_rms=slope
        )
        return Scene(surface, material, contaminants)

    return scene


def _map(side: int) -> Scene:
    """One fixed height map, as if it had been measured."""
    surface = GaussianSurface(
        shape=(side, side), spacing=1.0, corr_length=16.0, slope_rms=0.2
    )
    return Scene(surface.sample(7), Material(1.5))


GLASS, METAL = Material(1.5), Material(1.0, 7.0)
WAVES = np.linspace(0.4, 0.7, 20)
_SELLMEIER = Material.from_table(
    wavelength=WAVES, n=1.5 + 0.004 / WAVES**2, kappa=np.zeros(20)
)
# Flat, half-round and nearly whole drops
DEWS = {
    angle: Drops(contact_angle=np.deg2rad(angle), coverage=0.15, number_density=1e-4)
    for angle in (15, 90, 179)
}

CASES = (
    Case(
        name="smooth", scene=_rough(0.05, GLASS), theta_i=np.deg2rad(41.4),
        model=MicrofacetModel(GLASS, slope_rms=0.05),
    ),
    Case(
        name="gentle", scene=_rough(0.15, GLASS), theta_i=np.deg2rad(41.4),
        model=MicrofacetModel(GLASS, slope_rms=0.15),
    ),
    Case(
        name="rough", scene=_rough(0.30, GLASS), theta_i=np.deg2rad(60.0),
        model=MicrofacetModel(GLASS, slope_rms=0.30),
    ),
    Case(
        name="multi-bounce", scene=_rough(0.47, GLASS), theta_i=np.deg2rad(75.0),
        model=MicrofacetModel(GLASS, slope_rms=0.47),
    ),
    Case(
        name="metal", scene=_rough(0.30, METAL), theta_i=np.deg2rad(60.0),
        model=MicrofacetModel(METAL, slope_rms=0.30),
    ),
    Case(
        name="20 wavelengths", scene=_rough(0.30, _SELLMEIER), theta_i=np.deg2rad(60.0),
        options={"wavelength": WAVES},
    ),
    *(
        Case(
            name=f"dew {angle}", scene=_rough(0.05, GLASS, drops), theta_i=np.deg2rad(41.4),
            options={"wavelength": 0.55},
        )
        for angle, drops in DEWS.items()
    ),
    Case(
        name="dew all around", scene=_rough(0.05, GLASS, DEWS[90]),
        theta_i=np.deg2rad(41.4), options={"wavelength": 0.55, "phi_i": "uniform"},
    ),
    Case(name="map", scene=_map, theta_i=np.deg2rad(41.4)),
)  # fmt: skip

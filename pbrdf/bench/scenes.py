"""Scenes of the bench: one for each class of what users simulate."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from pbrdf import Drops, GaussianSurface, Material, MicrofacetModel, Scene

N_THETA, N_DPHI = 18, 36


@dataclass(frozen=True, kw_only=True)
class Case:
    """A scene, its direction and options, and its analytical model if there is one.

    Attributes
    ----------
    scene : callable
        Scene with so many nodes a side, of unit spacing.
    theta_i : float
        Zenith angle of the source. [rad]
    model : MicrofacetModel, optional
        Its bias is the floor of what a closed form gives.
    index : complex, optional
        n - i kappa, where the plain programs know the scene.
    readings : pair of ndarray, optional
        theta_s and dphi of a goniometer, which `observe` looks at instead of bins. [rad]
    """

    name: str
    scene: Callable[[int], Scene]
    theta_i: float
    options: dict[str, Any] = field(default_factory=dict)
    model: MicrofacetModel | None = None
    index: complex | None = None
    readings: tuple[np.ndarray, np.ndarray] | None = None


def _rough(slope: float, material: Material, *contaminants: Any) -> Callable[[int], Scene]:
    def scene(side: int) -> Scene:
        surface = GaussianSurface(
            shape=(side, side), spacing=1.0, corr_length=16.0, slope_rms=slope
        )
        return Scene(surface, material, contaminants)

    return scene


def _clean(
    name: str, slope: float, theta_deg: float, material: Material, index: complex
) -> Case:
    return Case(
        name=name, scene=_rough(slope, material), theta_i=np.deg2rad(theta_deg),
        model=MicrofacetModel(material, slope_rms=slope), index=index,
    )  # fmt: skip


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
# A scan in the plane of incidence and one beside it
_ARC = np.deg2rad(np.linspace(5.0, 75.0, 15))

CASES = (
    _clean("smooth", 0.05, 41.4, GLASS, 1.5),
    _clean("gentle", 0.15, 41.4, GLASS, 1.5),
    _clean("rough", 0.30, 60.0, GLASS, 1.5),
    _clean("multi-bounce", 0.47, 75.0, GLASS, 1.5),
    _clean("metal", 0.30, 60.0, METAL, 1.0 - 7.0j),
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
    Case(name="map", scene=_map, theta_i=np.deg2rad(41.4), index=1.5),
    Case(
        name="goniometer", scene=_rough(0.30, GLASS), theta_i=np.deg2rad(60.0),
        readings=(np.tile(_ARC, 2), np.repeat([np.pi, 0.75 * np.pi], len(_ARC))),
        options={"source_half_angle": 0.02, "detector_half_angle": 0.05},
    ),
)  # fmt: skip

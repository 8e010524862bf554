"""What a simulated model needs to know of its scene, and what has been traced of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from fitting.models.index_grid import IndexGrid, Range
from fitting.models.simulated_trace import Trace, trace
from pbrdf import HeightMap, Material, MeshSurface, MicrofacetModel, Scene

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Run", "facet_slope", "middle_index", "opaque_material", "range_around"]

# Up to this kappa a material is taken for a dielectric
_WEAK = 1.0
_DIELECTRIC: tuple[Range, Range] = ((1.15, 2.6), (0.0, 1.5))

Key = tuple[float, float | None]


@dataclass(frozen=True, kw_only=True, eq=False)
class Run:
    """How to trace, and what has been traced: shared by all models of one surface."""

    scene: Scene
    grid: IndexGrid
    index: tuple[float, float]
    companion: MicrofacetModel
    options: Mapping[str, Any]
    traces: dict[Key, Trace] = field(default_factory=dict)
    datasets: "dict[Key, xr.Dataset]" = field(default_factory=dict)

    def keys(self, theta_i: Sequence[float], phi_i: Sequence[float]) -> list[Key]:
        """Return what tells source directions apart on this surface."""
        if getattr(self.scene.surface, "isotropic", False):
            return [(round(theta, 9), None) for theta in theta_i]
        both = zip(theta_i, phi_i, strict=True)
        return [(round(theta, 9), round(phi, 9)) for theta, phi in both]

    def of(self, keys: Sequence[Key]) -> list[Trace]:
        """Return the traces of these source directions; run what is missing."""
        missing = [key for key in dict.fromkeys(keys) if key not in self.traces]
        for phi_i in dict.fromkeys(phi_i for _, phi_i in missing):
            here = [key for key in missing if key[1] == phi_i]
            traces, dataset = trace(
                self.scene,
                [theta_i for theta_i, _ in here],
                self.grid,
                index=self.index,
                companion=self.companion,
                phi_i=phi_i,
                **self.options,
            )
            for position, (key, found) in enumerate(zip(here, traces, strict=True)):
                self.traces[key] = found
                self.datasets[key] = dataset.isel(theta_i=[position])
        return [self.traces[key] for key in keys]


def opaque_material(scene: Scene) -> Material:
    """Return the material of a scene whose paths do not depend on its index."""
    if not isinstance(scene, Scene):
        msg = (
            f"scene must be a Scene, got {type(scene).__name__}. Use Scene(surface, index)."
        )
        raise TypeError(msg)
    material = scene.materials[0]
    reason = ""
    if len(scene.materials) > 1:
        reason = "several materials"
    elif isinstance(scene.surface, MeshSurface):
        reason = "a mesh"
    elif scene.contaminants:
        reason = "contaminants"
    elif material.has_base:
        reason = "a diffuse base under the interface"
    if reason:
        msg = (
            f"scene must be a clean opaque surface of one material, got {reason}. Diffuse "
            "light can be fitted as diffuse_albedo or volume_albedo."
        )
        raise ValueError(msg)
    return material


def facet_slope(scene: Scene) -> float | tuple[float, float]:
    """Return the rms slope of the facets, one number where the surface is isotropic."""
    surface = scene.surface
    assert not isinstance(surface, MeshSurface)  # refused by `opaque_material`
    if isinstance(surface, HeightMap):
        x, y = (float(np.sqrt(np.mean(slope**2))) for slope in surface.slopes())
    else:
        x, y = surface.facet_slope_rms
    if min(x, y) <= 0.0:
        msg = "scene must have a rough surface to be fitted, got a flat one."
        raise ValueError(msg)
    return x if getattr(surface, "isotropic", False) else (x, y)


def middle_index(material: Material) -> tuple[float, float]:
    """Return the index, of a tabulated material that in the middle of its range."""
    if not material.dispersive:
        return material.index()
    return material.index(0.5 * sum(material.valid_range))


def range_around(index: tuple[float, float]) -> tuple[Range, Range]:
    """Return the indices to be ready for."""
    n, kappa = index
    (low, high), absorbing = _DIELECTRIC
    if kappa <= _WEAK:
        return (min(low, n), max(high, n)), absorbing
    return (0.4 * n, 2.5 * n), (0.5 * kappa, 1.7 * kappa)

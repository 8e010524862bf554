"""The analytical model as the fit sees it: every number of it may be free."""

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from functools import lru_cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from fitting.readings.observations import Geometry

if TYPE_CHECKING:
    import casadi

    from pbrdf import MicrofacetModel

__all__ = ["AnalyticModel"]

# Names of rules, which no fit can vary
_RULES = ("shadowing", "slope_distribution", "volume_form", "grazing_form")


class AnalyticModel:
    """Adapter of a `MicrofacetModel`, with exact derivatives of any order.

    Parameters
    ----------
    model : MicrofacetModel
        Its present values hold for whatever is not free.
    split_slope : bool
        True if slope_rms_x and slope_rms_y are to be told apart. Their axes may then be
        turned: `orientation` is the azimuth of the x axis, 0 in the model itself. [rad]
    """

    bounds: Mapping[str, tuple[float, float]] = MappingProxyType({})
    replicas: tuple["AnalyticModel", ...] = ()

    def __init__(self, model: "MicrofacetModel", *, split_slope: bool = False) -> None:
        self.model = model
        self._split = split_slope or isinstance(model.slope_rms, tuple)

    def values(self, geometry: Geometry) -> dict[str, np.ndarray]:
        """Return every parameter at each geometry, shape (N,)."""
        known = np.isfinite(geometry.wavelength)
        wavelength = geometry.wavelength if known.all() else None
        material = self.model.material
        spectral = material.dispersive or callable(material.diffuse_albedo)
        if spectral and wavelength is None:
            msg = (
                "measurement must hold every wavelength where the material's constants "
                "depend on it, got none. Add wavelength_um or give them as numbers."
            )
            raise ValueError(msg)
        n, kappa = material.indices(wavelength)
        base = self.model.volume_albedo or material.albedo(wavelength)
        numbers = self._numbers() | {"volume_albedo": base}
        values = {"n": n, "kappa": kappa, **self._slopes(), **numbers}
        if self._split:
            values["orientation"] = 0.0
        return {
            name: np.broadcast_to(np.asarray(value, dtype=float), geometry.theta_i.shape)
            for name, value in values.items()
        }

    def mueller(
        self, values: Mapping[str, Any], geometry: Geometry, elements: Sequence[int]
    ) -> "casadi.MX":
        """Return elements of the BRDF, shape (E, N), numbered along the rows. [1/sr]"""
        import casadi

        albedo = values["volume_albedo"]
        # The term costs more than all the rest: without it no one should pay
        absent = isinstance(albedo, casadi.DM) and not albedo.full().any()
        names = tuple(n for n in values if not (absent and n == "volume_albedo"))
        rules = tuple(getattr(self.model, rule) for rule in _RULES)
        function = _one_geometry(names, tuple(elements), rules)
        angles = np.stack(
            [geometry.theta_i, geometry.theta_s, geometry.dphi, geometry.phi_i]
        )
        mapped = function.map(geometry.size)
        return mapped(casadi.vertcat(*(values[name] for name in names)), casadi.DM(angles))

    def updated(self, values: Mapping[str, float]) -> "MicrofacetModel":
        """Return the model with these values."""
        changes: dict[str, Any] = {k: v for k, v in values.items() if k != "orientation"}
        index: dict[str, Any] = {
            name: changes.pop(name) for name in ("n", "kappa") if name in changes
        }
        if "volume_albedo" in changes:
            # One base under the interface, under one name
            index["diffuse_albedo"] = 0.0
        if index:
            changes["material"] = replace(self.model.material, **index)
        pair = self._slopes()
        axes = [
            changes.pop(axis, pair.get(axis)) for axis in ("slope_rms_x", "slope_rms_y")
        ]
        if self._split:
            changes["slope_rms"] = tuple(axes)
        return replace(self.model, **changes)

    def _slopes(self) -> dict[str, float]:
        slope = self.model.slope_rms
        x, y = slope if isinstance(slope, tuple) else (slope, slope)
        if not self._split:
            return {"slope_rms": x}
        return {"slope_rms_x": x, "slope_rms_y": y}

    def _numbers(self) -> dict[str, float]:
        """Return the model's other numbers."""
        skip = {"material", "slope_rms", "height_rms", *_RULES}
        return {
            field.name: getattr(self.model, field.name)
            for field in fields(self.model)
            if field.name not in skip
        }


@lru_cache(maxsize=64)
def _one_geometry(
    names: tuple[str, ...], elements: tuple[int, ...], rules: tuple[str, ...]
) -> "casadi.Function":
    """Return (parameters, angles) -> elements, built once."""
    import casadi

    from pbrdf.analytic.symbolic import brdf_expression

    p, angles = casadi.SX.sym("p", len(names)), casadi.SX.sym("angles", 4)
    numbers = {name: p[i] for i, name in enumerate(names)}
    turned = numbers.pop("orientation", 0.0)
    matrix = brdf_expression(
        numbers,
        angles[0],
        angles[1],
        angles[2],
        phi_i=angles[3] - turned,
        **dict(zip(_RULES, rules, strict=True)),
    )
    rows = casadi.vec(matrix.T)
    return casadi.Function("mueller", [p, angles], [rows[list(elements)]])

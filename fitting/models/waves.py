"""A surface seen by waves as the fit sees it: height and correlation length may be free."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from fitting.models.index_grid import Range
from fitting.models.simulated_scene import middle_index, range_around
from fitting.models.wave_curve import HEIGHTS, WaveCurve
from fitting.readings.observations import Geometry
from pbrdf.errors import one_number

if TYPE_CHECKING:
    import casadi

    from pbrdf import WaveModel

__all__ = ["WaveSurface"]

# How near to the specular direction a detector sees its beam, if nothing is known of it
_BEAM, _SEEN = np.deg2rad(0.5), 1e-2
# Error of the interpolation that is worth a word
_ROUGH = 5e-3


@dataclass(frozen=True, eq=False)
class WaveSurface:
    """Incoherent Mueller BRDF of a `pbrdf.WaveModel` with gain and a Lambertian term.

    `fitting.fit` makes one of every `WaveModel`; make it yourself for other ranges.

    Parameters
    ----------
    model : WaveModel
        Start values of height_rms, corr_length and the index, and the kind of
        autocorrelation. One given as a spectrum or a table, or by two lengths, keeps its
        shape: its height and length are held.
    reach : float
        Height and length may go up and down by this factor from the start. [1]
    index_range : ((n, n), (kappa, kappa)), optional
        Lowest and highest index that a fit may ask for; default as for `SimulatedModel`.
    specular_gain, diffuse_albedo : float
        Factor on the model, and albedo of an unpolarised Lambertian term beside it. [1]

    Raises
    ------
    ValueError
        If the reach is not above 1 or the index lies outside its range.
    """

    # What a fit asks for that wonders which element to measure next: none of U and V, which
    # take their time
    candidates = ("M00", "M10")

    model: "WaveModel"
    reach: float = 2.0
    index_range: tuple[Range, Range] | None = None
    specular_gain: float = 1.0
    diffuse_albedo: float = 0.0
    ranges: Mapping[str, Range] = field(default_factory=dict)
    asked: list[tuple[Geometry, float]] = field(default_factory=list)
    replicas: tuple["WaveSurface", ...] = ()

    def __post_init__(self) -> None:
        one_number("reach", self.reach, lambda v: v > 1.0, "be above 1", "It is a factor.")
        if not self.ranges:
            given = {name: getattr(self.model, name) for name in HEIGHTS}
            ranges = {
                name: (value / self.reach, value * self.reach)
                for name, value in given.items()
                if self._parametric and value is not None
            }
            index = middle_index(self.model.material)
            around = range_around(index)
            pair = dict(zip(("n", "kappa"), self.index_range or around, strict=True))
            for value, (name, (low, high)) in zip(index, pair.items(), strict=True):
                if not low <= value <= high:
                    msg = (
                        f"index_range must hold the model's {name} {value:g}, got {low:g} "
                        f".. {high:g}. Widen it."
                    )
                    raise ValueError(msg)
            object.__setattr__(self, "ranges", {**ranges, **pair})

    @property
    def _parametric(self) -> bool:
        named = self.model.psd is None and isinstance(self.model.autocorrelation, str)
        return named and self.model.directional is None

    @property
    def bounds(self) -> Mapping[str, Range]:
        """Where the interpolation holds."""
        return self.ranges

    def values(self, geometry: Geometry) -> dict[str, np.ndarray]:
        """Return every parameter at each geometry, shape (N,)."""
        if not np.isfinite(geometry.wavelength).all():
            msg = (
                "measurement must hold every wavelength where waves are fitted, got none. "
                "Add wavelength_um."
            )
            raise ValueError(msg)
        n, kappa = self.model.material.indices(geometry.wavelength)
        values = {
            **{name: getattr(self.model, name) for name in self.ranges if name in HEIGHTS},
            "n": n, "kappa": kappa, "specular_gain": self.specular_gain,
            "diffuse_albedo": self.diffuse_albedo,
        }  # fmt: skip
        return {
            name: np.broadcast_to(np.asarray(value, dtype=float), geometry.theta_i.shape)
            for name, value in values.items()
        }

    def mueller(
        self, values: Mapping[str, Any], geometry: Geometry, elements: Sequence[int]
    ) -> "casadi.MX":
        """Return elements of the BRDF, shape (E, N), numbered along the rows. [1/sr]"""
        import casadi

        held = {
            name: value.full().ravel()
            for name, value in values.items()
            if isinstance(value, casadi.DM)
        }
        curve = WaveCurve.through(self.model, self.ranges, held, geometry, tuple(elements))
        self.asked.append((geometry, curve.error))
        light = curve.expression(values)
        lambertian = values["diffuse_albedo"] / np.pi
        rows = (
            values["specular_gain"] * light[curve.elements.index(e), :] for e in elements
        )
        return casadi.vertcat(*(
            row + lambertian if e == 0 else row
            for row, e in zip(rows, elements, strict=True)
        ))  # fmt: skip

    def updated(self, values: Mapping[str, float]) -> "WaveSurface":
        """Return the surface with these values, good in the same ranges."""
        changes: dict[str, Any] = {k: values[k] for k in HEIGHTS if k in values}
        index: dict[str, Any] = {k: values[k] for k in ("n", "kappa") if k in values}
        if index:
            changes["material"] = replace(self.model.material, **index)
        model = self.model.with_parameters(**changes) if changes else self.model
        others: dict[str, Any] = {k: values[k] for k in self.beside if k in values}
        return replace(self, model=model, **others)

    def brdf(
        self,
        theta_i: npt.ArrayLike,
        theta_s: npt.ArrayLike,
        dphi: npt.ArrayLike,
        wavelength: Any,
        *,
        phi_i: npt.ArrayLike = 0.0,
    ) -> np.ndarray:
        """Return the Mueller BRDF without the specular beam, (..., 4, 4). [1/sr]

        Of the model itself, not of the interpolation; arguments as of `WaveModel.brdf`.
        """
        light = self.model.brdf(theta_i, theta_s, dphi, wavelength, phi_i=phi_i)
        found = self.specular_gain * light
        found[..., 0, 0] += self.diffuse_albedo / np.pi
        return found

    def coherent(
        self, theta_i: npt.ArrayLike, wavelength: Any, *, phi_i: npt.ArrayLike = 0.0
    ) -> np.ndarray:
        """Mueller matrix of the specular beam, which the gain dims too, (..., 4, 4). [1]"""
        return self.specular_gain * self.model.coherent(theta_i, wavelength, phi_i=phi_i)

    @property
    def beside(self) -> dict[str, float]:
        """Gain and albedo, which stand beside the model."""
        return {
            "specular_gain": self.specular_gain, "diffuse_albedo": self.diffuse_albedo,
        }  # fmt: skip

    @property
    def remarks(self) -> tuple[str, ...]:
        """What the readings hold that the model does not, and how far it is right."""
        if not self.asked:
            return ()
        # Of the scan itself; later questions are about what else might be read
        where, error_of_curve = self.asked[0]
        angles = where.theta_i, where.theta_s, where.dphi, where.wavelength
        found = []
        if self.model.directional is None:
            error = float(np.median(self.model.error_estimate(*angles)))
            found.append(
                f"wave optics of this surface is itself known to {100 * error:.2g} % of "
                "M00 in the median reading, which is no part of the standard errors"
            )
        if error_of_curve > _ROUGH:
            found.append(
                "the curve through waves errs by up to "
                f"{100 * error_of_curve:.2g} % of M00 over the ranges of the parameters; "
                "give WaveSurface a smaller reach or index_range about these values"
            )
        width = self._width(where)
        inside = np.flatnonzero(_off_specular(where) <= width)
        if inside.size:
            # Spread over the cone that the detector sees
            beam = self.model.coherent(where.theta_i[inside], where.wavelength[inside])
            seen = np.pi * width[inside] ** 2 * np.cos(where.theta_s[inside])
            light = self.brdf(*(angle[inside] for angle in angles))
            share = float((beam[..., 0, 0] / (seen * light[..., 0, 0])).max())
            if share > _SEEN:
                found.append(
                    f"{inside.size} readings lie in the specular beam, which adds up to "
                    f"{share:.2g} times their M00 and is no part of a BRDF: mask them"
                )
        return tuple(found)

    def _width(self, geometry: Geometry) -> np.ndarray:
        """How near to the specular direction readings see its beam, shape (N,). [rad]"""
        cones = geometry.source_half_angle, geometry.detector_half_angle
        width = sum(np.nan_to_num(one) for one in cones if one is not None)
        return np.maximum(np.broadcast_to(width, geometry.theta_i.shape), _BEAM)


def _off_specular(geometry: Geometry) -> np.ndarray:
    """Angle between the detector and the mirror image of the source, shape (N,). [rad]"""
    cosine = np.cos(geometry.theta_i) * np.cos(geometry.theta_s)
    cosine -= np.sin(geometry.theta_i) * np.sin(geometry.theta_s) * np.cos(geometry.dphi)
    angle: np.ndarray = np.arccos(np.clip(cosine, -1.0, 1.0))
    return angle

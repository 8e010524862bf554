"""The Monte Carlo as a curve that can be fitted: the analytical model plus what it lacks.

What the analytical curve lacks is multiple scattering and the true shadowing. Both change
slowly with direction and little with the parameters, so they are simulated once, at one
slope and index, and added to the analytical curve at any other nearby [1]_.

References
----------
.. [1] The difference to a known curve as a control variate: M. Pharr, W. Jakob,
   G. Humphreys, Physically Based Rendering, 4th ed., 2023, section 2.2.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import xarray as xr
from scipy.interpolate import make_interp_spline

from fitting.analytic_model import AnalyticModel
from fitting.observations import Geometry

if TYPE_CHECKING:
    import casadi

    from pbrdf import MicrofacetModel

__all__ = ["SimulatedCurve", "hemisphere_bins"]


def hemisphere_bins(slope_rms: float) -> tuple[int, int]:
    """Return (n_theta, n_dphi) that resolve the specular lobe of a slope rms.

    The lobe's standard deviation is about 2 slope_rms in exit angle; five bins in it keep
    the bin average within 0.2 % of the value at the bin's centre.

    Examples
    --------
    >>> hemisphere_bins(0.25)
    (45, 90)
    """
    n_theta = int(np.clip(np.ceil((np.pi / 2) / (0.4 * slope_rms)), 45, 180))
    return n_theta, 2 * n_theta


@dataclass(frozen=True, eq=False)
class SimulatedCurve:
    """Mueller BRDF of a simulated surface with the parameters of the analytical model.

    Parameters
    ----------
    dataset : Dataset
        What `pbrdf.simulate` returns, without a wavelength axis.
    model : MicrofacetModel
        Its slope_rms and index are those simulated; gain and diffuse albedo are free.
    simulated : MicrofacetModel, optional
        What was simulated, where `model` has moved on from it.
    """

    dataset: xr.Dataset
    model: "MicrofacetModel"
    simulated: "MicrofacetModel | None" = None
    first_order: ClassVar[frozenset[str]] = frozenset()

    def values(self, geometry: Geometry) -> dict[str, np.ndarray]:
        """Return every parameter at each geometry, shape (N,)."""
        return AnalyticModel(self.model).values(geometry)

    def mueller(
        self, values: Mapping[str, Any], geometry: Geometry, elements: Sequence[int]
    ) -> "casadi.MX":
        """Return elements of the BRDF, shape (E, N), numbered along the rows. [1/sr]"""
        import casadi

        lacking = self._lacking(geometry.theta_i, geometry.theta_s, geometry.dphi)
        table = casadi.DM(lacking.reshape(-1, 16).T[list(elements)].copy())
        gain = casadi.repmat(values["specular_gain"], len(elements), 1)
        return AnalyticModel(self.model).mueller(values, geometry, elements) + gain * table

    def updated(self, values: Mapping[str, float]) -> "SimulatedCurve":
        """Return the curve with these parameters."""
        return replace(
            self, model=AnalyticModel(self.model).updated(values), simulated=self._origin
        )

    def brdf(
        self, theta_i: np.ndarray, theta_s: np.ndarray, dphi: np.ndarray
    ) -> np.ndarray:
        """Return the Mueller BRDF at directions of shape (N,). [1/sr]"""
        lacking = self._lacking(theta_i, theta_s, dphi)
        return self.model.brdf(theta_i, theta_s, dphi) + self.model.specular_gain * lacking

    def stderr(
        self, theta_i: np.ndarray, theta_s: np.ndarray, dphi: np.ndarray
    ) -> np.ndarray:
        """Return the standard error that the simulation leaves, shape (N, 4, 4). [1/sr]"""
        return self.model.specular_gain * self._simulated(theta_i, theta_s, dphi)[1]

    @property
    def _origin(self) -> "MicrofacetModel":
        """The model that was simulated."""
        return self.simulated or self.model

    def _lacking(
        self, theta_i: np.ndarray, theta_s: np.ndarray, dphi: np.ndarray
    ) -> np.ndarray:
        """Return simulated less analytical BRDF, both for unit gain, shape (N, 4, 4)."""
        value, _ = self._simulated(theta_i, theta_s, dphi)
        unit = self._origin.with_parameters(specular_gain=1.0, diffuse_albedo=0.0)
        return value - unit.brdf(theta_i, theta_s, dphi)

    def _simulated(
        self, theta_i: np.ndarray, theta_s: np.ndarray, dphi: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the simulated BRDF and its error at directions (N,), shape (N, 4, 4).

        Raises
        ------
        ValueError
            If an incidence was not simulated.
        """
        theta_i, theta_s, dphi = np.broadcast_arrays(theta_i, theta_s, dphi)
        value, variance = np.zeros((2, *theta_i.shape, 4, 4))
        order = ("theta_s", "dphi", "stokes_out", "stokes_in")
        for incidence in np.unique(theta_i):
            simulated = self.dataset.sel(theta_i=incidence, method="nearest")
            if abs(float(simulated.theta_i) - incidence) > 1e-6:
                known = ", ".join(f"{angle:.6g}" for angle in self.dataset.theta_i.values)
                msg = f"theta_i must be one of {known} [rad], got {incidence:.6g}."
                raise ValueError(msg)
            here = theta_i == incidence
            k = simulated.stokes_out.size
            for out, array, degree in (
                (value, simulated.brdf_total, 3),
                (variance, simulated.brdf_total_stderr**2, 1),
            ):
                table = array.transpose(*order).values
                out[here, :k, :k] = interpolate_bins(
                    simulated.theta_s.values,
                    table,
                    theta_s[here],
                    dphi[here],
                    degree=degree,
                )
        return value, np.sqrt(np.maximum(variance, 0.0))


def interpolate_bins(
    theta: np.ndarray,
    values: np.ndarray,
    theta_s: np.ndarray,
    dphi: np.ndarray,
    *,
    degree: int,
) -> np.ndarray:
    """Interpolate hemisphere bins: a spline in zenith, linear in azimuth.

    The zenith axis goes on through the pole, where (-theta, dphi) is (theta, dphi + pi):
    both Stokes frames turn by pi there, which no Mueller matrix notices.

    Parameters
    ----------
    theta : ndarray, shape (n_theta,)
        Bin centres. [rad]
    values : ndarray, shape (n_theta, n_dphi, k, k)
        Azimuth bins are equal and centred on 0.
    theta_s, dphi : ndarray, shape (N,)
        Where to read. [rad]
    degree : int
        Of the spline.

    Returns
    -------
    ndarray, shape (N, k, k)
    """
    n_dphi = values.shape[1]
    # Three mirrored bins are enough for a cubic at the pole
    padded = np.concatenate([np.roll(values, n_dphi // 2, axis=1)[2::-1], values])
    angles = np.concatenate([-theta[2::-1], theta])

    position = np.asarray(dphi) / (2.0 * np.pi) * n_dphi
    left = np.floor(position).astype(int)
    share = (position - left)[:, None, None]
    # From the last bin's centre to the horizon the last bin stands
    zenith = np.minimum(theta_s, theta[-1])
    result = np.zeros((zenith.size, *values.shape[2:]))
    for column, weight in ((left % n_dphi, 1.0 - share), ((left + 1) % n_dphi, share)):
        for azimuth in np.unique(column):
            here = column == azimuth
            spline = make_interp_spline(angles, padded[:, azimuth], k=degree, axis=0)
            result[here] += weight[here] * spline(zenith[here])
    return result

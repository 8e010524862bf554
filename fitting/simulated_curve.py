"""The Monte Carlo's hemisphere bins read at the geometries of a scan."""

from dataclasses import dataclass

import numpy as np
import xarray as xr
from scipy.interpolate import make_interp_spline

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
    """Mueller BRDF of a simulation as a function of the scattered direction.

    Parameters
    ----------
    dataset : Dataset
        What `pbrdf.simulate` returns, without a wavelength axis.
    """

    dataset: xr.Dataset

    def at(
        self, theta_i: float, theta_s: np.ndarray, dphi: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return BRDF and its standard error, all bounces, each shape (..., 4, 4). [1/sr]

        Cubic in the zenith, linear in the azimuth; the zenith axis goes on through the
        pole, where (-theta, dphi) is (theta, dphi + pi): both Stokes frames turn by pi
        there, which no Mueller matrix notices.

        Raises
        ------
        ValueError
            If theta_i is not one of the simulated incidences.
        """
        here = self.dataset.sel(theta_i=theta_i, method="nearest")
        if abs(float(here.theta_i) - theta_i) > 1e-6:
            simulated = ", ".join(f"{value:.6g}" for value in self.dataset.theta_i.values)
            msg = f"theta_i must be one of {simulated} [rad], got {theta_i:.6g}."
            raise ValueError(msg)
        order = ("theta_s", "dphi", "stokes_out", "stokes_in")
        value = here.brdf_total.transpose(*order).values
        variance = (here.brdf_total_stderr**2).transpose(*order).values
        theta = here.theta_s.values
        theta_s, dphi = np.broadcast_arrays(
            np.asarray(theta_s, float), np.asarray(dphi, float)
        )
        return (
            _interpolate(theta, value, theta_s, dphi, order=3),
            np.sqrt(np.maximum(_interpolate(theta, variance, theta_s, dphi, order=1), 0.0)),
        )

    def in_plane(self, theta_i: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return signed view angle (n), BRDF and standard error (n, 4, 4) in the plane.

        The view angle is positive on the forward side. [rad]
        """
        theta = self.dataset.theta_s.values
        view = np.concatenate([-theta[::-1], theta])
        value, stderr = self.at(theta_i, np.abs(view), np.where(view > 0.0, np.pi, 0.0))
        return view, value, stderr


def _interpolate(
    theta: np.ndarray,
    values: np.ndarray,
    theta_s: np.ndarray,
    dphi: np.ndarray,
    *,
    order: int,
) -> np.ndarray:
    """Interpolate values (n_theta, n_dphi, 4, 4) at the given directions."""
    n_dphi = values.shape[1]
    opposite = np.roll(values, n_dphi // 2, axis=1)
    # Three mirrored bins are enough for a cubic at the pole
    padded = np.concatenate([opposite[2::-1], values])
    angles = np.concatenate([-theta[2::-1], theta])

    position = dphi / (2.0 * np.pi) * n_dphi
    left = np.floor(position).astype(int)
    share = (position - left)[..., None, None]
    # Past the last bin's centre, up to the horizon, the last bin stands
    zenith = np.minimum(theta_s, theta[-1])
    result = np.zeros((*theta_s.shape, *values.shape[2:]))
    for column, weight in ((left % n_dphi, 1.0 - share), ((left + 1) % n_dphi, share)):
        for azimuth in np.unique(column):
            here = column == azimuth
            spline = make_interp_spline(angles, padded[:, azimuth], k=order, axis=0)
            result[here] += weight[here] * spline(zenith[here])
    return result

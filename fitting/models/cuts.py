"""Models in the plane of incidence, as scans and figures show them."""

from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

if TYPE_CHECKING:
    from fitting.models.simulated import SimulatedModel
    from fitting.models.waves import WaveSurface
    from pbrdf import MicrofacetModel

__all__ = ["plane_curves"]


def plane_curves(
    theta_i: np.ndarray,
    theta_s: np.ndarray,
    *,
    analytic: "MicrofacetModel | WaveSurface",
    monte_carlo: "SimulatedModel | None" = None,
    waves: "WaveSurface | None" = None,
    phi_i: float = 0.0,
    wavelength: float | None = None,
) -> xr.Dataset:
    """Return M00, M10, m10 and DOLP of the models against incidence and signed view.

    Parameters
    ----------
    theta_i : ndarray, shape (incidences,)
        Incidences. [rad]
    theta_s : ndarray, shape (n,)
        Rising exit zeniths above 0, shown on both sides of the normal. [rad]
    analytic : MicrofacetModel or WaveSurface
        The model in closed form.
    monte_carlo : SimulatedModel, optional
        The simulated one.
    waves : WaveSurface, optional
        Wave optics beside facets.
    phi_i : float
        Azimuth of the plane. [rad]
    wavelength : float, optional
        Where the model needs one. [um]

    Returns
    -------
    Dataset, dims theta_i, theta_view
        `analytic_*`, `monte_carlo_*` and the `monte_carlo_*_stderr` of each, `waves_*`.
    """
    view = np.concatenate([-theta_s[::-1], theta_s])
    angles = np.meshgrid(theta_i, view, indexing="ij")
    where = angles[0], np.abs(angles[1]), np.where(angles[1] > 0.0, np.pi, 0.0)
    values = _named("analytic", analytic.brdf(*where, wavelength, phi_i=phi_i))
    if monte_carlo is not None:
        simulated = monte_carlo.brdf(*where, phi_i=phi_i)
        error = monte_carlo.stderr(*where, phi_i=phi_i)
        values |= _named("monte_carlo", simulated) | {
            "monte_carlo_M00_stderr": error[..., 0, 0],
            "monte_carlo_M10_stderr": error[..., 1, 0],
            # M00 and M10 of a bin err together, so their ratio errs less than this
            "monte_carlo_m10_stderr": error[..., 1, 0] / simulated[..., 0, 0],
            "monte_carlo_DOLP_stderr": error[..., 1, 0] / simulated[..., 0, 0],
        }
    if waves is not None:
        values |= _named("waves", waves.brdf(*where, wavelength, phi_i=phi_i))
    return xr.Dataset(
        {name: (("theta_i", "theta_view"), value) for name, value in values.items()},
        coords={"theta_i": theta_i, "theta_view": view},
    )


def _named(model: str, mueller: np.ndarray) -> dict[str, np.ndarray]:
    m00, m10, m20 = mueller[..., 0, 0], mueller[..., 1, 0], mueller[..., 2, 0]
    return {
        f"{model}_M00": m00,
        f"{model}_M10": m10,
        f"{model}_m10": m10 / m00,
        f"{model}_DOLP": np.hypot(m10, m20) / m00,
    }

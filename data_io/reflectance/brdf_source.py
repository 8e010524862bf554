"""Mueller BRDFs as functions of geometry: of a model, and of a table by interpolation."""

import warnings
from collections.abc import Callable

import numpy as np
import xarray as xr

from data_io.goniometer.frames import rotation
from pbrdf.analytic import MicrofacetModel
from pbrdf.errors import AccuracyWarning

# Mueller BRDF at zeniths and dphi [rad], shape (wavelength, ..., 4, 4)
Brdf = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def from_model(model: MicrofacetModel, waves: np.ndarray | None) -> Brdf:
    """Return the model as a function of geometry."""

    def brdf(theta_i: np.ndarray, theta_s: np.ndarray, dphi: np.ndarray) -> np.ndarray:
        each = [None] if waves is None else waves.tolist()
        return np.stack([model.brdf(theta_i, theta_s, dphi, wavelength=w) for w in each])

    return brdf


def from_dataset(dataset: xr.Dataset) -> Brdf:
    """Return the dataset as an interpolating function of geometry."""
    from scipy.interpolate import RegularGridInterpolator

    total = _total(dataset)
    theta_i, theta_s = total["theta_i"].to_numpy(), total["theta_s"].to_numpy()
    dphi = total["dphi"].to_numpy()
    _check_incidence(theta_i)
    # Next to the normal the meridian plane turns with dphi; a frame fixed to the surface
    # does not, so there the elements are smooth and can be interpolated
    fixed = rotation(np.cos(dphi), -np.sin(dphi)) @ total.to_numpy()
    # Across the normal: the first ring again, at the opposite azimuth
    mirrored = np.roll(fixed[:, :, :1], dphi.size // 2, axis=3)
    fixed = np.concatenate([mirrored, fixed], axis=2)
    rings = np.concatenate([-theta_s[:1], theta_s])
    fixed = np.concatenate([fixed, fixed[:, :, :, :1]], axis=3)
    table = RegularGridInterpolator(
        (theta_i, rings, np.append(dphi, dphi[0] + 2 * np.pi)), np.moveaxis(fixed, 0, 3)
    )

    def brdf(at_i: np.ndarray, at_s: np.ndarray, at_dphi: np.ndarray) -> np.ndarray:
        points = np.stack(
            [
                np.clip(at_i, theta_i[0], theta_i[-1]),
                np.clip(at_s, rings[0], rings[-1]),
                np.mod(at_dphi - dphi[0], 2 * np.pi) + dphi[0],
            ],
            axis=-1,
        )
        mueller = np.moveaxis(table(points), -3, 0)
        return rotation(np.cos(at_dphi), np.sin(at_dphi)) @ mueller

    return brdf


def _total(dataset: xr.Dataset) -> xr.DataArray:
    """Return the BRDF of all bounces, dims (wavelength, theta_i, theta_s, dphi, Stokes)."""
    name = "brdf" if "brdf" in dataset else "brdf_total"
    if name not in dataset:
        msg = f"source must hold the variable brdf, got {list(dataset.data_vars)}."
        raise ValueError(msg)
    brdf = dataset[name]
    if "bounces" in brdf.dims:
        brdf = brdf.sum("bounces")
    if "phi_i" in brdf.dims:
        msg = (
            "source must not depend on phi_i, the file holds isotropic surfaces only. "
            'Simulate with phi_i="uniform" or select one azimuth.'
        )
        raise ValueError(msg)
    if brdf.sizes.get("stokes_out") != 4 or brdf.sizes.get("stokes_in") != 4:
        msg = (
            f"source must have 4 x 4 Stokes elements, got {brdf.sizes.get('stokes_out')} x "
            f'{brdf.sizes.get("stokes_in")}. Simulate with stokes="full".'
        )
        raise ValueError(msg)
    if "theta_i" not in brdf.dims or brdf.sizes["theta_i"] < 2:
        msg = (
            "source must have at least 2 incident zeniths to interpolate between, got 1. "
            "Simulate with theta_i from 0 to 80 degrees in steps of 10 or less."
        )
        raise ValueError(msg)
    if "wavelength" not in brdf.dims:
        brdf = brdf.expand_dims("wavelength")
    brdf = brdf.sortby(
        ["theta_i", "wavelength"] if brdf.sizes["wavelength"] > 1 else "theta_i"
    )
    dims = ("wavelength", "theta_i", "theta_s", "dphi", "stokes_out", "stokes_in")
    return brdf.transpose(*dims)


def _check_incidence(theta_i: np.ndarray) -> None:
    """Warn of incident zeniths that leave too much to interpolation."""
    degrees = np.degrees(theta_i)
    gap = np.diff(degrees).max()
    if gap > 15 or degrees[0] > 10 or degrees[-1] < 70:
        msg = (
            f"incident zeniths from {degrees[0]:.4g} to {degrees[-1]:.4g} deg with gaps up "
            f"to {gap:.4g} deg leave much to interpolation. Simulate 0 to 80 deg by 10."
        )
        warnings.warn(msg, AccuracyWarning, stacklevel=4)

"""Result datasets: labelled axes, units from one table, the scene as attributes."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from pbrdf._version import __version__
from pbrdf.conventions import BOUNCES, RESULT_VARIABLES, STOKES, detector_bins
from pbrdf.kernels.paths.shading import (
    ABSORBED,
    LEAKED,
    N_ESCAPED,
    N_EXACT,
    N_LEAKED,
    N_MISMATCH,
    N_SEGMENTS,
    N_SELF,
    N_SIDE,
    N_TRUNCATED,
    SIDEWAYS,
    TRANSMITTED,
    TRUNCATED,
)
from pbrdf.scene.scene import Scene
from pbrdf.scene.write import scene_text
from pbrdf.simulation.moments import Moments


def to_dataset(
    moments: Sequence[Moments],
    scene: Scene,
    *,
    several: bool,
    wavelength: np.ndarray | None,
    attrs: dict[str, Any],
) -> xr.Dataset:
    """Normalise the tallies of each azimuth to a Mueller BRDF and label every axis.

    Counts in the attributes are sums over azimuths; with `several` of them the dimension
    `phi_i` follows theta_i.
    """
    plan = moments[0].plan
    theta_s, dphi, _ = detector_bins(plan.n_theta, plan.n_dphi)
    spectral = wavelength is not None and wavelength.ndim == 1
    coords: dict[str, Any] = {
        "bounces": list(BOUNCES),
        "theta_i": plan.theta_i,
        "theta_s": theta_s,
        "dphi": dphi,
        "stokes_out": list(STOKES[: plan.n_stokes]),
        "stokes_in": list(STOKES[: plan.n_stokes]),
    }
    if several:
        coords["phi_i"] = [one.plan.phi_i for one in moments]
    if wavelength is not None:
        coords["wavelength"] = wavelength if spectral else float(wavelength)

    rel_error = max(one.rel_error() for one in moments)
    layers = [_estimates(one) for one in moments]
    data: dict[str, Any] = {}
    for name, array in layers[0].items():
        dims = tuple(d for d in RESULT_VARIABLES[name].dims if several or d != "phi_i")
        if "phi_i" in dims:
            array = np.stack([one[name] for one in layers], dims.index("phi_i"))
        if "wavelength" in dims and not spectral:
            array = array.squeeze(dims.index("wavelength"))
            dims = tuple(d for d in dims if d != "wavelength")
        data[name] = (dims, array)
    dataset = xr.Dataset(data, coords)
    for variable in dataset.variables:
        entry = RESULT_VARIABLES[str(variable)]
        dataset[variable].attrs = {"units": entry.units, "long_name": entry.long_name}

    counts = np.sum([one.counts for one in moments], axis=0)
    dataset.attrs = attrs | {
        "version": __version__,
        "scene": scene_text(scene),
        "rays_per_direction": plan.n_rays * moments[0].samples,
        "path_segments": int(counts[:, N_SEGMENTS].sum()),
        "rays_escaped": counts[:, N_ESCAPED].tolist(),
        "rays_truncated": counts[:, N_TRUNCATED].tolist(),
        "rays_leaked": counts[:, N_LEAKED].tolist(),
        "rays_left_sideways": counts[:, N_SIDE].tolist(),
        "self_hits": int(counts[:, N_SELF].sum()),
        "exact_searches": int(counts[:, N_EXACT].sum()),
        "medium_mismatches": int(counts[:, N_MISMATCH].sum()),
        "rel_error": rel_error,
    }
    return dataset


def _estimates(moments: Moments) -> dict[str, np.ndarray]:
    """Estimates of one azimuth, which uses its moments up; dimensions but phi_i."""
    plan = moments.plan
    _, _, weight = detector_bins(plan.n_theta, plan.n_dphi)
    brdf, stderr, total, total_stderr = moments.finish()
    albedo, albedo_stderr = moments.albedo()
    energy = moments.energy()
    return {
        # (theta_i, wavelength, bounces, ...) to (bounces, theta_i, wavelength, ...)
        "brdf": np.moveaxis(brdf, 2, 0),
        "brdf_stderr": np.moveaxis(stderr, 2, 0),
        "brdf_total": total,
        "brdf_total_stderr": total_stderr,
        "albedo": np.moveaxis(albedo, 2, 0),
        "albedo_stderr": np.moveaxis(albedo_stderr, 2, 0),
        "projected_solid_angle": weight,
        "absorbed": energy[..., ABSORBED],
        "transmitted": energy[..., TRANSMITTED],
        "truncated": energy[..., TRUNCATED],
        "leaked": energy[..., LEAKED],
        "left_sideways": energy[..., SIDEWAYS],
        "side_exits": moments.counts[:, N_SIDE] / (plan.n_rays * moments.samples),
    }

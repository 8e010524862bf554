"""Synthetic goniometer scans of a known model, for the tests of the fits."""

import numpy as np
import xarray as xr

from pbrdf import Material, MicrofacetModel

# Values that break symmetry, near the paper's vinyl siding (section 4.2)
VINYL = MicrofacetModel(
    Material(1.53), slope_rms=0.252, specular_gain=0.8, diffuse_albedo=0.13
)


def scan(
    model,
    theta_i=30.0,
    elements=("M00", "M10"),
    *,
    noise=0.0,
    seed=0,
    stderr=True,
    step=2.5,
    dphi_offset=0.0,
    wavelength=None,
    phi_i=0.0,
):
    """Scan `model` in plane, -75 to 75 degrees, with noise relative to M00."""
    view = np.deg2rad(np.arange(-75.0, 75.1, step))
    rng = np.random.default_rng(seed)
    incidence = np.full(view.size, np.deg2rad(theta_i))
    dphi = np.where(view > 0.0, np.pi, 0.0) + dphi_offset
    brdf = model.brdf(incidence, np.abs(view), dphi, wavelength, phi_i=phi_i)
    spread = noise * brdf[:, 0, 0]
    data = {}
    for name in elements:
        exact = brdf[:, int(name[1]), int(name[2])]
        data[name] = ("geometry", exact + spread * rng.standard_normal(view.size))
        if stderr and noise:
            data[f"{name}_stderr"] = ("geometry", spread)
    coords = {
        "theta_i": ("geometry", incidence),
        "theta_s": ("geometry", np.abs(view)),
        "dphi": ("geometry", dphi),
    }
    if phi_i:
        coords["phi_i"] = ("geometry", np.full(view.size, phi_i))
    if wavelength is not None:
        coords["wavelength"] = ("geometry", np.full(view.size, wavelength))
    return xr.Dataset(data, coords=coords)

"""A small result whose every value is known: no two cells and elements are alike."""

import numpy as np
import xarray as xr


def hand_made(angles=(0.3, 0.9), waves=(0.45, 0.85), n_theta=6, n_dphi=8) -> xr.Dataset:
    theta_s = (np.arange(n_theta) + 0.5) * np.pi / 2 / n_theta
    dphi = np.arange(n_dphi) * 2 * np.pi / n_dphi
    shape = (len(angles), len(waves), n_theta, n_dphi)
    where = np.meshgrid(*(np.arange(n) for n in shape), indexing="ij")
    m00 = 1.0 + 0.3 * where[0] + 0.1 * where[1] + 0.05 * where[2] + 0.01 * where[3]
    matrix = np.zeros((*shape, 4, 4))
    matrix[..., 0, 0] = m00
    matrix[..., 1, 0] = 0.3 * m00
    matrix[..., 2, 0] = 0.4 * m00 * np.sin(dphi + 0.2)
    matrix[..., 0, 1] = 0.2 * m00
    matrix[..., 1, 1] = 0.7 * m00
    matrix[..., 3, 2] = 0.15 * m00
    axes = ("theta_i", "wavelength", "theta_s", "dphi", "stokes_out", "stokes_in")
    stokes = list("IQUV")
    return xr.Dataset(
        {
            "brdf_total": (axes, matrix),
            "brdf_total_stderr": (axes, np.full_like(matrix, 0.02)),
        },
        {
            "theta_i": list(angles), "wavelength": list(waves), "theta_s": theta_s,
            "dphi": dphi, "stokes_out": stokes, "stokes_in": stokes,
        },
    )  # fmt: skip

"""A model averaged over the bins of the Monte Carlo, as studies compare the two."""

import numpy as np
import xarray as xr

__all__ = ["as_result", "bin_averages"]


def bin_averages(model, theta_i, n_theta, n_dphi, *, order=6):
    """Mean of a model's Mueller BRDF over each bin, weighted with cos(theta) dOmega.

    Returns an array of shape (n_theta, n_dphi, 4, 4) [1/sr]; `order` Gauss nodes a side.
    """
    node, weight = np.polynomial.legendre.leggauss(order)
    step_t, step_p = np.pi / 2 / n_theta, 2 * np.pi / n_dphi
    theta = (np.arange(n_theta)[:, None] + 0.5 + 0.5 * node) * step_t
    dphi = (np.arange(n_dphi)[:, None] + 0.5 * node) * step_p
    value = model.brdf(theta_i, theta[:, None, :, None], dphi[None, :, None, :])
    measure = (np.sin(theta) * np.cos(theta) * weight)[:, None, :, None] * weight
    total = np.einsum("tojk,tpjkmn->tpmn", measure, value)
    return total / measure.sum((2, 3))[..., None, None]


def as_result(model, like):
    """Return the model in the layout of a result of `simulate`, with errors of 0."""
    n_theta, n_dphi = like.sizes["theta_s"], like.sizes["dphi"]
    values = [
        bin_averages(model, float(theta), n_theta, n_dphi)
        for theta in np.atleast_1d(like.theta_i.values)
    ]
    n_out, n_in = like.sizes["stokes_out"], like.sizes["stokes_in"]
    total = like.brdf_total.copy(data=np.array(values)[..., :n_out, :n_in])
    return xr.Dataset(
        {"brdf_total": total, "brdf_total_stderr": xr.zeros_like(total)}, attrs=like.attrs
    )

"""A BRDF model in the bins of a result, as the two are compared."""

from typing import Any

import numpy as np
import xarray as xr

from pbrdf.derived.elements import mueller

__all__ = ["beside", "bin_averages", "on_bins"]

_BINS = ("theta_s", "dphi", "stokes_out", "stokes_in")
# Values in a cell may differ by so much before it is cut in four, if they count for more
# than this share of all light
_STEEP, _COUNTS = 8.0, 1e-5
# Cuts of any cell at most, and at least at the specular direction, where lobes are narrow
_MOST_CUTS, _CUTS_AT_MIRROR = 10, 4


def bin_averages(
    model: Any,
    theta_i: float,
    n_theta: int,
    n_dphi: int,
    *,
    wavelength: float | None = None,
    phi_i: float = 0.0,
    order: int = 4,
) -> np.ndarray:
    """Mean of a Mueller BRDF over each bin, weighted with cos(theta) dOmega. [1/sr]

    Parameters
    ----------
    model : MicrofacetModel, WaveModel, or other with `brdf`
        What is averaged.
    theta_i, phi_i : float
        Direction of the source. [rad]
    n_theta, n_dphi : int
        Bins of equal angle over [0, π/2]; over the circle, the first centred on 0.
    wavelength : float, optional
        In vacuum. [um]
    order : int
        Nodes of the Gauss-Legendre rule along each side of a bin. Where the model varies
        much within a bin, it is cut in four, and these again.

    Returns
    -------
    ndarray, shape (n_theta, n_dphi, 4, 4)

    Examples
    --------
    What is the same in all directions is so in all bins:

    >>> from pbrdf import Material, MicrofacetModel
    >>> white = MicrofacetModel(Material(1.5), 0.2, specular_gain=0.0, diffuse_albedo=np.pi)
    >>> np.unique(bin_averages(white, 0.4, 3, 4)[..., 0, 0].round(12))
    array([1.])
    """
    step = np.array([np.pi / 2 / n_theta, 2 * np.pi / n_dphi])
    i, j = (k.ravel() for k in np.indices((n_theta, n_dphi)))
    corner = np.stack([i, j - 0.5], axis=1) * step
    owner = np.arange(len(corner))
    turned = {} if phi_i == 0.0 else {"phi_i": phi_i}
    total, area = np.zeros((len(corner), 4, 4)), np.zeros(len(corner))
    for cuts in range(_MOST_CUTS + 1):
        value, measure = _cells(model, theta_i, corner, step, order, wavelength, turned)
        whole = np.einsum("cop,copmn->cmn", measure, value)
        if cuts == 0:
            light = np.abs(whole[:, 0, 0]).sum()
        size = measure.sum((1, 2))
        low, high = (f(np.abs(value[..., 0, 0]), axis=(1, 2)) for f in (np.min, np.max))
        steep = (high > _STEEP * low) & (high * size > _COUNTS * light)
        if cuts < _CUTS_AT_MIRROR:
            away = np.abs(corner + 0.5 * step - [theta_i, np.pi])
            steep |= (away <= 0.51 * step).all(axis=1)
        if cuts == _MOST_CUTS:
            steep[:] = False
        np.add.at(total, owner[~steep], whole[~steep])
        np.add.at(area, owner[~steep], size[~steep])
        if not steep.any():
            break
        step = 0.5 * step
        quarters = np.array([[0, 0], [0, 1], [1, 0], [1, 1]]) * step
        corner = (corner[steep][:, None] + quarters).reshape(-1, 2)
        owner = np.repeat(owner[steep], 4)
    means: np.ndarray = total / area[:, None, None]
    return means.reshape(n_theta, n_dphi, 4, 4)


def _cells(
    model: Any,
    theta_i: float,
    corner: np.ndarray,
    step: np.ndarray,
    order: int,
    wavelength: float | None,
    turned: dict[str, float],
) -> tuple[np.ndarray, np.ndarray]:
    """Values (cells, order, order, 4, 4) at the nodes of cells, and cos(theta) dOmega."""
    node, weight = np.polynomial.legendre.leggauss(order)
    theta = corner[:, :1] + 0.5 * (1.0 + node) * step[0]
    dphi = corner[:, 1:] + 0.5 * (1.0 + node) * step[1]
    value = model.brdf(theta_i, theta[:, :, None], dphi[:, None, :], wavelength, **turned)
    along = np.sin(theta) * np.cos(theta) * weight
    return value, along[:, :, None] * weight * step.prod() / 4


def on_bins(model: Any, like: xr.DataArray) -> xr.Dataset:
    """Return `brdf_total` of a model in the bins and at the places of a BRDF. [1/sr]

    Parameters
    ----------
    model : MicrofacetModel, WaveModel, or other with `brdf`
        What is averaged.
    like : DataArray
        With the dimensions theta_s, dphi, stokes_out, stokes_in, and theta_i, wavelength,
        phi_i as dimensions or coordinates.

    Raises
    ------
    ValueError
        If the bins have other dimensions, at which a model has no value.
    """
    places = [str(d) for d in like.dims if d not in _BINS]
    strange = set(places) - {"theta_i", "wavelength", "phi_i"}
    if strange:
        msg = (
            "a model has values over theta_i, wavelength and phi_i, got a result over "
            f"{', '.join(sorted(strange))} too. Choose one of each by .sel."
        )
        raise ValueError(msg)
    n_theta, n_dphi = like.sizes["theta_s"], like.sizes["dphi"]
    pick = [["IQUV".index(str(s)) for s in like[d].values] for d in _BINS[2:]]
    out = np.empty([like.sizes[d] for d in (*places, *_BINS)])
    for at in np.ndindex(*(like.sizes[d] for d in places)):
        here = like.isel(dict(zip(places, at, strict=True))).coords
        # The azimuth of a result may be a word: uniform
        turned = "phi_i" in here and here["phi_i"].dtype.kind == "f"
        mean = bin_averages(
            model, float(here["theta_i"]), n_theta, n_dphi,
            wavelength=float(here["wavelength"]) if "wavelength" in here else None,
            phi_i=float(here["phi_i"]) if turned else 0.0,
        )  # fmt: skip
        out[at] = mean[..., pick[0], :][..., pick[1]]
    coords = {d: like[d] for d in (*places, *_BINS)}
    return xr.Dataset({"brdf_total": ((*places, *_BINS), out)}, coords)


def beside(result: xr.Dataset, model: Any, name: str = "model") -> xr.Dataset:
    """Return a result, as "simulated", and a model in its bins along a dimension `state`.

    Raises
    ------
    ValueError
        If the result has a dimension at which a model has no value.
    """
    value, stderr = mueller(result)
    found = on_bins(model, value).brdf_total.transpose(*value.dims)
    both = xr.DataArray(["simulated", name], dims="state", name="state")
    parts = {"brdf_total": [value, found]}
    if stderr is not None:
        parts["brdf_total_stderr"] = [stderr, xr.zeros_like(stderr)]
    whole = {
        key: xr.concat(pair, both, coords="minimal", compat="override")
        for key, pair in parts.items()
    }
    return xr.Dataset(whole, attrs=result.attrs)

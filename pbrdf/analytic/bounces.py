"""Light of two bounces between the facets: a term that is computed, not fitted."""

import numpy as np
import numpy.typing as npt

from pbrdf.analytic.geometry import flat_geometry
from pbrdf.analytic.microfacet import MicrofacetModel
from pbrdf.kernels.microfacet.second_bounce import fill_second_bounce

__all__ = ["second_bounce"]

# Slope scales that the sum over first facets takes in, to each side
REACH = 6.0


def second_bounce(
    model: MicrofacetModel,
    theta_i: npt.ArrayLike,
    theta_s: npt.ArrayLike,
    dphi: npt.ArrayLike,
    wavelength: npt.ArrayLike | None = None,
    *,
    phi_i: npt.ArrayLike = 0.0,
    nodes: int = 48,
) -> np.ndarray:
    """Mueller BRDF of the light that two facets mirror in turn. [1/sr]

    Add it to `MicrofacetModel.brdf` in place of the paper's constants (23). There is
    nothing to fit: every pair of facets of Smith's surface, with its chance of being lit,
    of seeing the other and of being seen, and with both Mueller matrices.

    Parameters
    ----------
    model : MicrofacetModel
        Gaussian slopes; only its material, slope_rms and specular_gain matter.
    theta_i, theta_s, dphi, wavelength, phi_i
        As in `MicrofacetModel.brdf`.
    nodes : int
        Points an axis of the sum over first facets; 48 leave about 1 %, time grows as its
        square.

    Returns
    -------
    ndarray, shape (..., 4, 4)

    Raises
    ------
    ValueError
        If the slopes are not Gaussian.

    Notes
    -----
    Smith's facets know nothing of their neighbours. On a real Gaussian surface slopes
    nearby are correlated: two bounces send out 2 to 30 % less in all, and half as much in
    the plane of incidence at grazing exit. One and two bounces together are within 3 % of
    all that a ray-traced surface reflects; `studies/second_bounce` has the numbers. Light
    of three bounces and more is left out.

    References
    ----------
    .. [1] E. Heitz, J. Hanika, E. d'Eon, C. Dachsbacher, Multiple-scattering microfacet
       BSDFs with the Smith model, ACM Trans. Graph. 35, 58 (2016).

    Examples
    --------
    >>> from pbrdf import Material
    >>> metal = MicrofacetModel(Material(1.37, 7.62), slope_rms=0.3)
    >>> second_bounce(metal, 1.0, 1.1, 3.0)[0, 0].round(2) > 0.05
    np.True_
    """
    if model.slope_distribution != "gaussian":
        msg = (
            f"slope_distribution must be 'gaussian' for the second bounce, "
            f"got {model.slope_distribution!r}. Use the Monte Carlo for other surfaces."
        )
        raise ValueError(msg)
    n, kappa = model.material.indices(wavelength)
    shape, columns = flat_geometry(theta_i, theta_s, dphi, phi_i, n, kappa)
    size = columns[0].size
    full = [np.broadcast_to(column, size).copy() for column in columns]
    out = np.zeros((size, 4, 4))
    fill_second_bounce(*full, model.roughness(), nodes, REACH, out)
    return model.specular_gain * out.reshape(*shape, 4, 4)

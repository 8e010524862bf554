"""Reflection and transmission of a smooth interface as Mueller matrices."""

import numpy as np
import numpy.typing as npt

from pbrdf.errors import require
from pbrdf.kernels.optics.fresnel import fill_amplitudes, fill_reflection, fill_transmission
from pbrdf.optics.checks import checked_kappa, checked_n

__all__ = ["fresnel_amplitudes", "specular_mueller", "transmission_mueller"]


def specular_mueller(
    cos_beta: npt.ArrayLike,
    n: npt.ArrayLike,
    kappa: npt.ArrayLike = 0.0,
    *,
    n_incident: npt.ArrayLike = 1.0,
) -> np.ndarray:
    """Mueller matrix of specular reflection in the facet's own (s, p) frame.

    Equations (1) to (8) and (10) of the paper with their corrections: labels s and p put
    right, (10) halved and written for Q = I_s - I_p, fields as exp(-i w t).

    Parameters
    ----------
    cos_beta : array_like, shape (...)
        Cosine of the local incidence angle. [1]
    n, kappa : array_like
        Index n + i kappa behind the interface; n = inf is a perfect mirror. [1]
    n_incident : array_like
        Real index of the medium the light comes from; above n it totally reflects. [1]

    Returns
    -------
    ndarray, shape (..., 4, 4)
        [..., 0, 0] is the reflectance of unpolarised light. [1]

    Raises
    ------
    ValueError
        If cos_beta leaves [0, 1], an index is not positive or kappa < 0.

    References
    ----------
    .. [1] M. Born and E. Wolf, Principles of Optics, 7th ed., 1999, section 1.5.

    Examples
    --------
    Glass at normal incidence reflects 4 % and flips U and V:

    >>> specular_mueller(1.0, 1.5).round(3).diagonal() + 0.0
    array([ 0.04,  0.04, -0.04, -0.04])

    Total reflection from inside at 45 degrees is a retarder:

    >>> specular_mueller(0.5**0.5, 1.0, n_incident=1.5)[2, 2:].round(9)
    array([ 0.8, -0.6])
    """
    shape, columns = _interface(cos_beta, n, kappa, n_incident)
    out = np.zeros((columns[0].size, 4, 4))
    fill_reflection(*columns, out)
    return out.reshape(*shape, 4, 4)


def transmission_mueller(
    cos_beta: npt.ArrayLike,
    n: npt.ArrayLike,
    kappa: npt.ArrayLike = 0.0,
    *,
    n_incident: npt.ArrayLike = 1.0,
) -> np.ndarray:
    """Mueller matrix of the power that crosses a smooth interface, in its (s, p) frame.

    With `specular_mueller` it adds up to all the power: M[0, 0] and M[0, 1] of the sum are
    1 and 0. Flux, not radiance: no factor n^2. Arguments and errors as there.

    Notes
    -----
    Behind an absorbing interface s and p waves carry the powers 1 - R_s and 1 - R_p; the
    elements 22 to 33 then are those of the Jones matrix with these powers and the phases of
    t_s and t_p, just inside.

    Examples
    --------
    Light leaves glass polarised along p:

    >>> transmission_mueller(0.5, 1.5)[0].round(4) + 0.0
    array([ 0.9108, -0.0874,  0.    ,  0.    ])
    """
    shape, columns = _interface(cos_beta, n, kappa, n_incident)
    out = np.zeros((columns[0].size, 4, 4))
    fill_transmission(*columns, out)
    return out.reshape(*shape, 4, 4)


def fresnel_amplitudes(
    cos_beta: npt.ArrayLike,
    n: npt.ArrayLike,
    kappa: npt.ArrayLike = 0.0,
    *,
    n_incident: npt.ArrayLike = 1.0,
) -> tuple[np.ndarray, np.ndarray]:
    """Complex amplitudes (r_s, r_p); at normal incidence r_p = -r_s.

    Arguments and errors as in `specular_mueller`.

    Examples
    --------
    Nothing of p is reflected at Brewster's angle:

    >>> r_s, r_p = fresnel_amplitudes(1 / (1 + 1.5**2) ** 0.5, 1.5)
    >>> bool(abs(r_p) < 1e-15), float(r_s.real.round(6))
    (True, -0.384615)
    """
    shape, (cosine, index, absorption) = _interface(cos_beta, n, kappa, n_incident)
    pairs = np.empty((2, cosine.size), dtype=np.complex128)
    fill_amplitudes(cosine, index, absorption, pairs)
    return pairs[0].reshape(shape), pairs[1].reshape(shape)


def _interface(
    cos_beta: npt.ArrayLike,
    n: npt.ArrayLike,
    kappa: npt.ArrayLike,
    n_incident: npt.ArrayLike,
) -> tuple[tuple[int, ...], list[np.ndarray]]:
    """Check, broadcast and flatten; the index becomes relative to the incident medium."""
    cosine = require(
        "cos_beta", cos_beta, lambda v: (v >= 0) & (v <= 1), "lie in [0, 1] [1]",
        "It is the cosine of the incidence angle.",
    )  # fmt: skip
    index, absorption = checked_n(n), checked_kappa(kappa)
    outside = require(
        "n_incident", n_incident, lambda v: (v > 0) & np.isfinite(v),
        "be finite and > 0 [1]", "",
    )  # fmt: skip
    arrays = np.broadcast_arrays(cosine, index / outside, absorption / outside)
    return arrays[0].shape, [np.ascontiguousarray(a.reshape(-1)) for a in arrays]

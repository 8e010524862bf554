r"""How far sample statistics of a correlated surface scatter, and what form removal takes.

For a Gaussian process with autocovariance C, quadratic statistics have the covariance
(Isserlis' theorem)

.. math:: \mathrm{cov}(\hat D_j, \hat D_k) = \frac{2}{L} \int G_{jk}(m)^2\,dm,
   \qquad G_{jk}(m) = C(m + k - j) - C(m - j) - C(m + k) + C(m),

where G is the covariance between an increment of lag j and one of lag k that starts m
later.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from scipy import linalg

Array = np.ndarray
Correlogram = Callable[[Array], Array]

# Nodes a correlation length in the integrals over the separation m
_NODES = 12


@dataclass(frozen=True)
class Extent:
    """What decides how many independent pieces a measurement holds.

    Parameters
    ----------
    length : float
        Along the axis. [um]
    n_points : int
        Heights in all.
    across : float
        Mean squared correlation between lines of a map, 1 for a profile: the inverse of the
        number of independent lines.
    """

    length: float
    n_points: int
    across: float = 1.0


def increment_covariance(
    lags: Array,
    rho: Correlogram,
    corr_length: float,
    variances: tuple[float, float],
    extent: Extent,
) -> Array:
    """Covariance matrix of (mean square height, mean square increments at the lags).

    Parameters
    ----------
    lags : ndarray, shape (n,)
        [um]
    rho : callable
        Autocorrelation of the true heights.
    corr_length : float
        Its 1/e length. [um]
    variances : (float, float)
        Of the heights and of white noise on each of them. [um²]
    extent : Extent
        Length and independent lines.

    Returns
    -------
    ndarray, shape (n + 1, n + 1)
        [um⁴]
    """
    height, noise = variances
    step = corr_length / _NODES
    reach = min(5 * corr_length + lags[-1], extent.length)
    m = np.arange(-np.ceil(reach / step), np.ceil(reach / step) + 1) * step
    weight = np.clip(1 - np.abs(m) / extent.length, 0, None)
    weight *= 2 * step / extent.length * extent.across

    at_m = height * rho(np.abs(m))
    ahead = height * rho(np.abs(m + lags[:, None]))
    behind = height * rho(np.abs(m - lags[:, None]))
    shifted = height * rho(np.abs(m + lags[None, :, None] - lags[:, None, None]))
    between = shifted - behind[:, None, :] - ahead[None, :, :] + at_m
    rise = ahead - at_m

    n = lags.size
    result = np.empty((n + 1, n + 1))
    result[0, 0] = np.sum(weight * at_m**2)
    result[0, 1:] = result[1:, 0] = rise**2 @ weight
    result[1:, 1:] = np.einsum("jkm,jkm,m->jk", between, between, weight)
    return result + _noise_covariance(lags, rho, (height, noise), extent.n_points)


def _noise_covariance(
    lags: Array, rho: Correlogram, variances: tuple[float, float], n_points: int
) -> Array:
    """Part of the covariance that white noise adds, alone and times the heights."""
    height, noise = variances
    drop = height * (1 - rho(lags))
    apart = height * (1 - rho(np.abs(lags[:, None] - lags)))
    # Signal increments at the separations where their noises coincide: m = j - k, j, -k, 0
    total = height * (1 - rho(lags[:, None] + lags))
    cross = 4 * (drop[:, None] + drop) - 2 * apart - 2 * total
    n = lags.size
    result = np.empty((n + 1, n + 1))
    result[0, 0] = 2 * (2 * noise * height + noise**2)
    result[0, 1:] = result[1:, 0] = 2 * (4 * noise * drop + 2 * noise**2)
    result[1:, 1:] = 2 * (2 * noise * cross + noise**2 * (4 + 2 * np.eye(n)))
    return result / n_points


def mean_power_of_correlation(
    rho: Correlogram, corr_length: float, length: float, power: int
) -> float:
    r"""(2/L) ∫₀ᴸ (1 - r/L) ρ(r)ᵖ dr, at most 1."""
    r = np.linspace(0, min(length, 12 * corr_length), 1200)
    value = 2 / length * np.trapezoid((1 - r / length) * rho(r) ** power, r)
    return float(min(value, 1.0))


def form_losses(rho: Correlogram, corr_length: float, length: float, degree: int) -> Array:
    """Share of the height variance that a fitted Legendre term of each degree takes away.

    Parameters
    ----------
    rho : callable
        Autocorrelation.
    corr_length, length : float
        1/e length and length of the profile. [um]
    degree : int
        Highest degree of the form.

    Returns
    -------
    ndarray, shape (degree + 1,)
        Expected share, degree by degree. [1]
    """
    if degree < 0:
        return np.zeros(0)
    n = int(np.clip(5 * length / corr_length, 64, 400))
    x = (np.arange(n) + 0.5) / n
    if length > 80 * corr_length:
        # Far longer than the correlation every smooth term takes the same: S(0) / L
        share = mean_power_of_correlation(rho, corr_length, length, 1)
        return np.full(degree + 1, share)
    basis = legendre.legvander(2 * x - 1, degree)
    terms = np.linalg.qr(basis)[0]
    taken = linalg.matmul_toeplitz(rho(x * length - x[0] * length), terms)
    return np.asarray(np.sum(terms * taken, axis=0) / n)

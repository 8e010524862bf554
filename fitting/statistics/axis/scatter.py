r"""How far sample statistics of a correlated surface scatter, and what form removal takes.

For a Gaussian process with autocovariance C, quadratic statistics have the covariance
(Isserlis' theorem)

.. math:: \mathrm{cov}(\hat D_j, \hat D_k) = \frac{2}{L} \int G_{jk}(m)^2\,dm,
   \qquad G_{jk}(m) = C(m + k - j) - C(m - j) - C(m + k) + C(m),

where G is the covariance between an increment of lag j and one of lag k that starts m
later.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial import legendre
from scipy import linalg

from fitting.statistics.axis.autocorrelation import Correlation

Array = np.ndarray

# Nodes a correlation length in the integrals over the separation m
_NODES = 12
_MOST_NODES = 1500


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
    correlation: Correlation,
    variances: tuple[float, float],
    extent: Extent,
) -> Array:
    """Covariance matrix of (mean square height, mean square increments at the lags).

    Parameters
    ----------
    lags : ndarray, shape (n,)
        [um]
    correlation : Correlation
        Of the true heights.
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
    rho = correlation.rho
    reach = min(5 * correlation.longest_length() + lags[-1], extent.length)
    step = max(correlation.corr_length / _NODES, reach / _MOST_NODES)
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
    return result + _noise_covariance(lags, correlation, (height, noise), extent.n_points)


def _noise_covariance(
    lags: Array, correlation: Correlation, variances: tuple[float, float], n_points: int
) -> Array:
    """Part of the covariance that white noise adds, alone and times the heights."""
    height, noise = variances
    rho = correlation.rho
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


def mean_power_of_correlation(correlation: Correlation, length: float, power: int) -> float:
    r"""(2/L) ∫₀ᴸ (1 - r/L) ρ(r)ᵖ dr, at most 1."""
    reach = min(length, 8 * correlation.longest_length())
    r = np.linspace(
        0, reach, int(np.clip(30 * reach / correlation.corr_length, 400, 20_000))
    )
    rho = correlation.rho(r)
    # Odd powers of grooves would cancel and claim more pieces than there are
    raised = rho if power == 1 else np.abs(rho) ** power
    value = 2 / length * np.trapezoid((1 - r / length) * raised, r)
    return float(min(value, 1.0))


def form_losses(correlation: Correlation, length: float, degree: int) -> Array:
    """Share of the height variance that a fitted Legendre term of each degree takes away.

    Parameters
    ----------
    correlation : Correlation
        Of the heights.
    length : float
        Of the profile. [um]
    degree : int
        Highest degree of the form.

    Returns
    -------
    ndarray, shape (degree + 1,)
        Expected share, degree by degree. [1]
    """
    if degree < 0:
        return np.zeros(0)
    if length > 80 * correlation.longest_length():
        # Far longer than the correlation every smooth term takes the same: S(0) / L
        share = mean_power_of_correlation(correlation, length, 1)
        return np.full(degree + 1, share)
    n = _nodes(correlation, length)
    # Expected square of the projection on a unit vector t: sum of C(i - j) t_i t_j
    return np.asarray(
        _term_correlation(degree, n) @ correlation.rho(np.arange(n) * (length / n)) / n
    )


def form_scatter(correlation: Correlation, length: float, degree: int) -> float:
    """Share of the variance of the mean square height that goes with the removed form.

    With P the projection on the form, tr(CC) - tr((1 - P) C (1 - P) C) over tr(CC).
    """
    if degree < 0 or length > 80 * correlation.longest_length():
        return 0.0
    n = _nodes(correlation, length)
    x = (np.arange(n) + 0.5) / n
    terms = np.linalg.qr(legendre.legvander(2 * x - 1, degree))[0]
    covariance = linalg.toeplitz(correlation.rho((x - x[0]) * length))
    blurred = covariance @ terms
    removed = 2 * np.sum(blurred**2) - np.sum((terms.T @ blurred) ** 2)
    return float(removed / np.sum(covariance**2))


def _nodes(correlation: Correlation, length: float) -> int:
    """Nodes that resolve the correlation over a profile; few values, for the cache."""
    wanted = 5 * length / correlation.corr_length
    return next((n for n in (128, 400) if n >= wanted), 800)


@lru_cache(maxsize=32)
def _term_correlation(degree: int, n: int) -> Array:
    """Correlation of each orthonormal term with itself at 0 .. n - 1 steps, both signs."""
    x = (np.arange(n) + 0.5) / n
    terms = np.linalg.qr(legendre.legvander(2 * x - 1, degree))[0].T
    both = np.array([2 * np.correlate(t, t, "full")[n - 1 :] for t in terms])
    both[:, 0] /= 2
    return both

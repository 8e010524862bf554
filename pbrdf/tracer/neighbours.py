"""Bins share their noise with their neighbours where only noise tells them apart.

The spread over samples of a bin that few paths reached is as uncertain as their number, and
falls and rises with the mean: a bin that was missed by the rare strong paths looks dark and
certain. Its neighbours tell how often such paths come.
"""

import numpy as np

# Neighbours on either side, in zenith and in azimuth
REACH = 2
# With so many paths a bin knows its noise as well as its neighbours do
MANY = 60.0
TINY = 1e-300


def share_noise(
    mean: np.ndarray, variance: np.ndarray, weight: np.ndarray, one: float
) -> np.ndarray:
    """Variances of the flux of bins, those of like neighbours taken together.

    With V the mean variance around a bin and S² the scatter of the means there, noise
    alone explains V / S² of the scatter, at most all of it: the light of neighbours is
    like that of the bin to this degree. With N paths in a bin (mean squared over V) its
    variance becomes (1 - B) own + B V, B = MANY / (MANY + N) min(1, V / S²); an empirical
    Bayes estimate. V allows for one more path around the bin than were seen.

    M00 decides for all elements. A bin with no light around it keeps its variance, and an
    element without noise in all bins has none.

    Parameters
    ----------
    mean, variance : ndarray, shape (n_theta, n_dphi, stokes, stokes)
        Flux of the bins and variances of it. [1]
    weight : ndarray, shape (n_theta, n_dphi)
        Projected solid angle of the bins, to which the variance of few paths is
        proportional. [sr]
    one : float
        Flux of one path of mean strength. [1]

    Returns
    -------
    ndarray, in the shape of variance

    References
    ----------
    .. [1] B. Efron, C. Morris, J. Am. Stat. Assoc. 68, 117 (1973).
    .. [2] G. Smyth, Stat. Appl. Genet. Mol. Biol. 3, 3 (2004): moderated variances.
    """
    area = weight[..., None, None]
    m00 = mean[..., :1, :1]
    seen = np.where(m00 != 0.0, variance, 0.0)
    number = _around(np.ones_like(area))
    around = _around(seen / area)
    # An element has its share of the path not seen, as it has of the noise of M00
    of_all = seen.sum(axis=(0, 1))
    unseen = one**2 * of_all / max(of_all[0, 0], TINY)
    noise = (around + unseen / area) / number

    # Each bin's density m00 / area counts by its area
    light = _around(m00) ** 2 / _around(area)
    scatter = np.maximum(_around(m00 * m00 / area) - light, 0.0)
    scatter /= np.maximum(number - 1.0, 1.0)
    noise_00 = np.maximum(noise[..., :1, :1], TINY)
    paths = light / number / noise_00
    share = MANY / (MANY + paths) * noise_00 / np.maximum(scatter, noise_00)
    shared = variance + share * (noise * area - variance)
    return np.where(around[..., :1, :1] > 0.0, shared, variance)


def _around(values: np.ndarray) -> np.ndarray:
    """Sum over each bin and its neighbours, round the azimuth but not over the pole."""
    n_theta, n_dphi = values.shape[:2]
    reach = min(REACH, (n_dphi - 1) // 2)
    rows, sums = np.zeros_like(values), np.zeros_like(values)
    for step in range(-reach, reach + 1):
        rows += np.roll(values, step, axis=1)
    for step in range(-REACH, REACH + 1):
        here = slice(max(-step, 0), n_theta - max(step, 0))
        there = slice(max(step, 0), n_theta - max(-step, 0))
        sums[here] += rows[there]
    return sums

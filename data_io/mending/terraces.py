r"""De-terracing: the surface under a map that was digitised to bands.

Each height h is known to lie, but for noise, within its band. The surface is a Gaussian
field with the autocorrelation that the increments of the map imply
(`data_io.mending.roughness_prior`), and noise is white. Two draws alternate (Gibbs):
of the heights with noise, u given h, each from a normal cut off at its band; and of the
surface, h given u, by the Wiener filter

.. math::
   \hat h = \frac{S}{S + s^2} \hat u + \sqrt{\frac{S s^2}{S + s^2}} \hat w ,

with S the spectrum, s² the variance of the noise and w white. Both draws are over-relaxed
[1]_: a draw lies on the other side of its mean, so that heights that their band leaves free
drift through it. A walk at random takes ten times as many draws. Missing heights have no
band and follow their neighbours. A draw has the roughness of the surface between the edges
of the bands, which is what slopes and light need; the mean of the draws is the smoothest
surface that is as likely, and their scatter the uncertainty of the heights.

References
----------
.. [1] S. L. Adler, Over-relaxation method for the Monte Carlo evaluation of the partition
   function for multiquadratic actions, Phys. Rev. D 23, 2901 (1981).
"""

from dataclasses import dataclass

import numpy as np
import scipy.fft
from scipy import special
from scipy.sparse import linalg

from data_io.mending.bands import Bands, find_bands
from data_io.mending.roughness_prior import fit_prior
from pbrdf.surface.heightmap import HeightMap

Array = np.ndarray

# Draws to reach the surface, and as many again to know its scatter; a large map knows its
# autocorrelation so well that it starts nearer
_DRAWS = 30
_DRAWS_LARGE = 8
_LARGE = 300_000
# Share of its distance from the mean that a draw keeps, on the other side
_OVER = 0.9
# Heights drawn with less noise than this share of a band move too slowly between draws
_LEAST_NOISE = 0.12


@dataclass(frozen=True, eq=False)
class Deterraced:
    """A surface drawn or smoothed between the bands of a terraced map.

    Parameters
    ----------
    surface : HeightMap
        One draw, or the mean of many. [um]
    uncertainty : ndarray, shape (nx, ny)
        Standard deviation of the true height about the mean of the draws. [um]
    noise : float
        Standard deviation of the noise before digitisation, as found. [um]
    bands : Bands
        Levels and their limits.
    """

    surface: HeightMap
    uncertainty: Array
    noise: float
    bands: Bands


def deterrace(
    surface: HeightMap, *, draw: bool = True, seed: int = 0, bands: Bands | None = None
) -> Deterraced:
    """Draw the surface under a terraced map, consistent with the band of each height.

    Parameters
    ----------
    surface : HeightMap
        Heights in bands, NaN where missing. [um]
    draw : bool
        A random surface with the roughness of the true one; False: the mean of many, the
        smoothest. Slopes and reflectance need the draw.
    seed : int
        The same seed gives the same surface.
    bands : Bands, optional
        Levels and limits; found from the heights by default.

    Returns
    -------
    Deterraced
        The surface, holes filled, with the uncertainty that the bands add.

    Raises
    ------
    ValueError
        If the heights are not in bands.

    Examples
    --------
    >>> rng = np.random.default_rng(2)
    >>> from pbrdf import GaussianSurface
    >>> true = GaussianSurface(shape=(64, 64), spacing=1.0, corr_length=8.0,
    ...                        height_rms=1.0).sample(seed=3)
    >>> terraced = HeightMap(np.round(true.heights / 0.5) * 0.5, 1.0, periodic=True)
    >>> found = deterrace(terraced)
    >>> maps = (terraced, found.surface)
    >>> errors = [float(np.std(one.heights - true.heights)) for one in maps]
    >>> errors[1] < 0.6 * errors[0]
    True
    """
    heights = surface.heights
    bands = bands or find_bands(heights)
    if bands is None:
        msg = "heights must lie in bands to be de-terraced, these do not. Leave them be."
        raise ValueError(msg)
    rng = np.random.default_rng(seed)
    low, high = bands.limits(heights)
    known = np.isfinite(low)
    middle = np.full(heights.shape, np.nan)
    middle[known] = (low[known] + high[known]) / 2
    level = float(np.nanmean(middle))
    prior = fit_prior(middle, bands.width)
    shape = _torus(heights.shape, prior.longest, periodic=surface.periodic)
    limits = [np.full(shape, -np.inf), np.full(shape, np.inf)]
    inside = tuple(slice(n) for n in heights.shape)
    limits[0][inside], limits[1][inside] = low - level, high - level
    least = (_LEAST_NOISE * bands.width) ** 2
    noise = max(prior.noise, least)
    spectrum = prior.spectrum(shape)
    margin = [(0, n - m) for n, m in zip(shape, heights.shape, strict=True)]
    field = np.pad(np.where(known, middle - level, 0.0), margin, mode="symmetric")
    observed = np.isfinite(limits[0])
    noisy = field
    total = np.zeros(shape)
    square = np.zeros(shape)
    draws = _DRAWS if heights.size < _LARGE else _DRAWS_LARGE
    for i in range(2 * draws):
        over = _OVER if i else 0.0
        noisy = _cut_normal(rng, noisy, field, np.sqrt(noise), (limits[0], limits[1]), over)
        # What lies in a hole follows its rim too slowly from draw to draw
        if i == 0 and not known.all():
            noisy = _in_holes(noisy, observed, spectrum, noise, rng)
        field = _surface_given(rng, field, noisy, spectrum, noise, over)
        noise = max(float(np.mean((noisy - field)[observed] ** 2)), least)
        if i >= draws:
            total += field
            square += field**2
    mean = total[inside] / draws
    variance = (square[inside] - draws * mean**2) / (draws - 1)
    unseen = prior.variance * (1 - prior.correlation_to_nearest(known) ** 2)
    scatter = np.sqrt(np.maximum(variance, np.where(known, 0.0, unseen)))
    chosen = field[inside] if draw else mean
    found = HeightMap(
        chosen + level, surface.spacing, periodic=surface.periodic, labels=surface.labels
    )
    return Deterraced(found, scatter, float(np.sqrt(noise)), bands)


def _torus(shape: tuple[int, ...], longest: float, *, periodic: bool) -> tuple[int, int]:
    """Return the size of a periodic grid whose far side does not feel the near one."""
    if periodic:
        return shape[0], shape[1]
    margins = [int(min(max(2.5 * longest, 8), n / 3 + 8)) for n in shape]
    sizes = [
        scipy.fft.next_fast_len(n + m, real=True)
        for n, m in zip(shape, margins, strict=True)
    ]
    return sizes[0], sizes[1]


def _surface_given(
    rng: np.random.Generator,
    last: Array,
    noisy: Array,
    spectrum: Array,
    noise: float,
    over: float,
) -> Array:
    """Draw the surface given its heights with white noise on the whole torus."""
    before, seen, white = (
        scipy.fft.rfft2(values, workers=1)
        for values in (last, noisy, rng.standard_normal(noisy.shape))
    )
    gain = spectrum / (spectrum + noise)
    mean = gain * seen
    fresh = np.sqrt((1 - over**2) * gain * noise) * white
    drawn = mean - over * (before - mean) + fresh
    return scipy.fft.irfft2(drawn, s=noisy.shape, workers=1)


def _in_holes(
    noisy: Array, observed: Array, spectrum: Array, noise: float, rng: np.random.Generator
) -> Array:
    """Draw what was not observed, given what was, at once.

    A free draw of the field and its noise is corrected by the mean surface that its
    difference from the observed heights implies (Matheron). With F the Wiener filter that
    mean solves x = F (d + x) on the unobserved nodes.
    """

    def filtered(values: Array) -> Array:
        seen = scipy.fft.rfft2(values, workers=1) * spectrum / (spectrum + noise)
        return scipy.fft.irfft2(seen, s=values.shape, workers=1)

    white = scipy.fft.rfft2(rng.standard_normal(noisy.shape), workers=1)
    free = scipy.fft.irfft2(np.sqrt(spectrum) * white, s=noisy.shape, workers=1)
    free += np.sqrt(noise) * rng.standard_normal(noisy.shape)
    hidden = ~observed
    full = np.where(observed, noisy - free, 0.0)

    def left(x: Array) -> Array:
        full_x = np.zeros(noisy.shape)
        full_x[hidden] = x
        return x - filtered(full_x)[hidden]

    count = int(hidden.sum())
    system = linalg.LinearOperator((count, count), matvec=left, dtype=float)
    mean, _ = linalg.cg(system, filtered(full)[hidden], rtol=1e-3, maxiter=30)
    drawn = noisy.copy()
    drawn[hidden] = free[hidden] + mean
    return drawn


def _cut_normal(
    rng: np.random.Generator,
    last: Array,
    mean: Array,
    sd: float,
    limits: tuple[Array, Array],
    over: float,
) -> Array:
    """Draw normals of given means that lie between limits, from the last ones.

    The share of a normal below a value is, itself put through a normal, over-relaxed.
    """
    a, b, t = ((values - mean) / sd for values in (*limits, last))
    # The lower tail keeps its digits, the upper does not
    upper = a > 0
    a, b, t = np.where(upper, -b, a), np.where(upper, -a, b), np.where(upper, -t, t)
    p_a, p_b = special.ndtr(a), special.ndtr(b)
    span = np.maximum(p_b - p_a, 1e-300)
    fresh = np.sqrt(1 - over**2) * rng.standard_normal(mean.shape)
    if over:
        below = np.clip((special.ndtr(t) - p_a) / span, 1e-12, 1 - 1e-12)
        fresh -= over * special.ndtri(below)
    chance = p_a + span * special.ndtr(fresh)
    drawn = np.clip(special.ndtri(np.maximum(chance, 1e-300)), a, b)
    return mean + sd * np.where(upper, -drawn, drawn)

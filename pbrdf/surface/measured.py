"""Random surfaces with a measured autocorrelation and height distribution."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.fft
from numpy.polynomial import hermite_e
from scipy import interpolate, special

from pbrdf.errors import require
from pbrdf.surface.drawing import generator, grid_shape
from pbrdf.surface.heightmap import HeightMap

Array = np.ndarray

# Hermite terms of the height transform; more than the shape of a histogram can tell
_TERMS = 14
_QUADRATURE = 80


@dataclass(frozen=True, kw_only=True)
class MeasuredSurface:
    r"""Periodic random surface with a tabulated autocorrelation and height distribution.

    Parameters
    ----------
    shape : (int, int)
        Number of grid nodes (nx, ny); the periods are shape times spacing.
    spacing : float or (float, float)
        Grid steps dx, dy. [um]
    height_rms : float
        Rms height, exact in the ensemble. [um]
    corr_length : float or (float, float)
        Lengths that scale the lags along x and y. [um]
    lags, autocorrelation : sequence of float
        Autocorrelation, below 1, at rising lags above 0 in units of corr_length; by power
        law below the first lag, zero beyond the last. It depends on direction through
        corr_length only.
    quantiles : sequence of float, optional
        Heights in units of height_rms at normal scores evenly spaced from -3 to 3, rising
        (25 of them, say): the height distribution. A Gaussian by default.

    Raises
    ------
    ValueError
        If a value is not positive, a table does not rise or an autocorrelation leaves
        [-1, 1).

    Notes
    -----
    Heights are h(g) of a Gaussian field g with h fixed by the quantiles. The Hermite series
    of h gives the autocorrelation of the heights from that of g,

    .. math:: \rho_h = \sum_k a_k^2\,k!\,\rho_g^k,

    which is inverted so that the heights have the tabulated one (Grigoriu, Applied
    Non-Gaussian Processes, 1995, section 3.1). What no Gaussian field can have is cut
    from its spectrum; `clipped` tells how much.

    Examples
    --------
    >>> lags = np.geomspace(0.01, 8, 80)
    >>> jagged = MeasuredSurface(shape=(128, 128), spacing=0.5, height_rms=1.2,
    ...                          corr_length=6.0, lags=lags,
    ...                          autocorrelation=np.exp(-lags))
    >>> jagged.sample(seed=1)
    HeightMap(128 x 128 nodes, spacing=(0.5, 0.5) um, periodic)
    """

    shape: tuple[int, int]
    spacing: float | tuple[float, float]
    height_rms: float
    corr_length: float | tuple[float, float]
    lags: tuple[float, ...]
    autocorrelation: tuple[float, ...]
    quantiles: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        for name in ("spacing", "corr_length", "height_rms", "lags"):
            require(
                name,
                getattr(self, name),
                lambda v: (v > 0) & np.isfinite(v),
                "be positive",
                "Lengths are micrometres, lags are in units of corr_length.",
            )
        require(
            "autocorrelation",
            self.autocorrelation,
            lambda v: (v < 1) & (v >= -1),
            "lie in [-1, 1)",
            "Leave lag 0 out of the table.",
        )
        if self.quantiles is not None:
            require(
                "quantiles", self.quantiles, np.isfinite, "be finite",
                "Give heights in units of height_rms.",
            )  # fmt: skip
        object.__setattr__(self, "shape", grid_shape(self.shape))
        for name in ("lags", "autocorrelation", "quantiles"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, tuple(float(v) for v in value))
        if len(self.lags) != len(self.autocorrelation) or len(self.lags) < 2:
            msg = (
                f"lags and autocorrelation must be of one length of at least 2, got "
                f"{len(self.lags)} and {len(self.autocorrelation)}. Give one value a lag."
            )
            raise ValueError(msg)
        for name in ("lags", "quantiles"):
            value = getattr(self, name)
            if value is not None and (len(value) < 2 or (np.diff(value) <= 0).any()):
                msg = f"{name} must be at least two rising values, got {value}. Sort them."
                raise ValueError(msg)

    @cached_property
    def facet_slope_rms(self) -> tuple[float, float]:
        """Ensemble rms of the facet slopes along x and y. [1]"""
        drops = 1 - self._rho(self._steps / self._lengths)
        slopes = self.height_rms * np.sqrt(2 * drops) / self._steps
        return float(slopes[0]), float(slopes[1])

    @property
    def ensemble_height_rms(self) -> float:
        """Ensemble rms height. [um]"""
        return self.height_rms

    def decorrelation(self, axis: int, lag: np.ndarray) -> np.ndarray:
        """1 minus the autocorrelation at distances along an axis [um]. [1]"""
        return 1.0 - self._rho(np.asarray(lag) / self._lengths[axis])

    def likely_heights(self, count: int) -> np.ndarray:
        """Heights of which each is as likely as the next, rising. [um]"""
        scores = special.ndtri((np.arange(count) + 0.5) / count)
        return self.height_rms * self._transform(scores)

    @property
    def clipped(self) -> float:
        """Share of the height variance that no Gaussian field can have in this form."""
        return self._spectrum[1]

    def sample(self, seed: int | np.random.SeedSequence | None = None) -> HeightMap:
        """Draw one realisation; the same seed gives the same heights bit for bit."""
        rng = generator(seed)
        field = scipy.fft.rfft2(rng.standard_normal(self.shape), workers=1)
        field *= self._spectrum[0]
        gaussian = scipy.fft.irfft2(field, s=self.shape, workers=1, overwrite_x=True)
        heights = self.height_rms * self._transform(gaussian)
        dx, dy = self._steps
        return HeightMap(heights, (float(dx), float(dy)), periodic=True)

    @property
    def _steps(self) -> Array:
        return np.broadcast_to(np.asarray(self.spacing, dtype=np.float64), (2,))

    @property
    def _lengths(self) -> Array:
        return np.broadcast_to(np.asarray(self.corr_length, dtype=np.float64), (2,))

    def _rho(self, u: Array) -> Array:
        """Autocorrelation at lags in units of corr_length."""
        lags = np.log(self.lags)
        drop = np.log1p(-np.asarray(self.autocorrelation))
        # In logarithms the power law near lag 0, which decides the slope, is a line
        curve = interpolate.PchipInterpolator(lags, drop)
        first = (drop[1] - drop[0]) / (lags[1] - lags[0])
        log_u = np.log(np.maximum(u, 1e-300))
        below = drop[0] + first * (log_u - lags[0])
        inside = curve(np.clip(log_u, lags[0], lags[-1]))
        rho = -np.expm1(np.where(log_u < lags[0], below, inside))
        return np.where(u > self.lags[-1], 0.0, rho)

    @cached_property
    def _spectrum(self) -> tuple[Array, float]:
        """Filter of white noise for the Gaussian field, and the share cut from it."""
        offsets = [
            np.minimum(np.arange(n), n - np.arange(n)) * step / length
            for n, step, length in zip(self.shape, self._steps, self._lengths, strict=True)
        ]
        rho = self._gaussian_rho(self._rho(np.hypot(offsets[0][:, None], offsets[1])))
        power = scipy.fft.rfft2(rho, workers=1).real
        kept = np.maximum(power, 0.0)
        # Both half-planes count, the columns 0 and n/2 once
        weights = np.full(power.shape[1], 2.0)
        weights[0] = 1.0
        if self.shape[1] % 2 == 0:
            weights[-1] = 1.0
        total, whole = (kept @ weights).sum(), (power @ weights).sum()
        return np.sqrt(kept * whole / total), float(1 - whole / total)

    @cached_property
    def _standard(self) -> tuple[interpolate.PchipInterpolator, float, float]:
        """Monotone curve through the quantiles, its mean and rms over the Gaussian."""
        quantiles = np.linspace(-3, 3, 3) if self.quantiles is None else self.quantiles
        curve = interpolate.PchipInterpolator(np.linspace(-3, 3, len(quantiles)), quantiles)
        nodes, weights = self._nodes
        values = _straight_tails(curve, nodes)
        mean = float(weights @ values)
        return curve, mean, float(np.sqrt(weights @ (values - mean) ** 2))

    @property
    def _nodes(self) -> tuple[Array, Array]:
        """Gauss-Hermite nodes and weights of a normal variable."""
        nodes, weights = hermite_e.hermegauss(_QUADRATURE)
        return nodes, weights / np.sqrt(2 * np.pi)

    def _transform(self, gaussian: Array) -> Array:
        """Heights of unit rms and zero mean from normal scores."""
        curve, mean, rms = self._standard
        return (_straight_tails(curve, gaussian) - mean) / rms

    def _gaussian_rho(self, rho: Array) -> Array:
        """Autocorrelation that the Gaussian field needs for the heights to have `rho`."""
        if self.quantiles is None:
            return rho
        nodes, weights = self._nodes
        values = self._transform(nodes)
        orders = np.arange(1, _TERMS + 1)
        basis = np.array([hermite_e.hermeval(nodes, np.eye(_TERMS + 1)[k]) for k in orders])
        shares = (basis @ (weights * values)) ** 2 / special.factorial(orders)
        shares = shares / shares.sum()
        # 1 - rho keeps its digits near lag 0, where it decides the slope
        drop = np.concatenate(
            [[0.0], np.geomspace(1e-12, 1, 400), np.linspace(1.01, 2, 100)]
        )
        with np.errstate(divide="ignore"):
            inside = np.log1p(-np.minimum(drop, 1.0))
        powers = np.where(
            drop[:, None] < 1,
            -np.expm1(orders * inside[:, None]),
            1 - (1 - drop[:, None]) ** orders,
        )
        reached = np.maximum.accumulate(powers @ shares)
        return 1 - np.interp(1 - rho, reached, drop)


def _straight_tails(curve: interpolate.PchipInterpolator, x: Array) -> Array:
    """Curve between -3 and 3, its secants over the outer half beyond."""
    inside = np.clip(x, -3.0, 3.0)
    low = float(curve(-2.5) - curve(-3.0)) / 0.5
    high = float(curve(3.0) - curve(2.5)) / 0.5
    tails = np.where(x < 0, low, high) * (x - inside)
    return np.asarray(curve(inside) + tails)

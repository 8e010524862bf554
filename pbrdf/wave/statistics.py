"""Statistics of Gaussian heights as waves see them: autocorrelation and its spectrum."""

from functools import cached_property, lru_cache

import numpy as np
from scipy import integrate, optimize, special

from pbrdf.errors import require
from pbrdf.kernels.wave import orders

__all__ = ["Exponential", "Gaussian", "KCorrelation", "Statistics", "panels", "reach"]

Array = np.ndarray

# Share of the area that a range of lags may leave out: the orders above the first see the
# square of the autocorrelation and its higher powers
TAIL = 1e-10
# Nodes of a panel of the quadratures below
PANEL_NODES = 16
# Wave vectors beyond a limit are followed to this multiple of it
FINEST = 30.0


class Statistics:
    """Heights with Gaussian distribution and an isotropic autocorrelation.

    Parameters
    ----------
    height_rms : float
        Rms height. [um]
    corr_length : float
        Lag at which the autocorrelation has fallen to 1/e. [um]
    law : int, optional
        Code of the sums over orders in closed form, if there is one.
    """

    def __init__(
        self, height_rms: float, corr_length: float, law: int | None = None
    ) -> None:
        given = {"height_rms": height_rms, "corr_length": corr_length}
        for name, value in given.items():
            require(
                name, value, lambda v: (v > 0) & np.isfinite(v), "be positive [um]",
                "A flat surface has a coherent part only.",
            )  # fmt: skip
        self.height_rms, self.corr_length = float(height_rms), float(corr_length)
        self.law = law

    @property
    def bounded(self) -> bool:
        """Whether the spectrum falls faster than any power: it then has all its moments."""
        return self.law == orders.GAUSSIAN

    def correlation(self, lag: Array) -> Array:
        """Autocorrelation of the heights over their variance at lags [um]. [1]"""
        raise NotImplementedError

    def spectrum(self, wave_vector: Array, dimensions: int) -> Array:
        """Fourier transform W of the autocorrelation at K [rad/um].

        Of a profile (one dimension) Int C exp(-iKx) dx [um^3], of an isotropic surface
        Int C exp(-iK.x) d2x [um^4]; two-sided: height_rms^2 = Int W dK/(2 pi)^dimensions.
        """
        raise NotImplementedError

    def spread(self, limit: float, dimensions: int) -> float:
        """Rms wave vector per axis of the components up to `limit` [rad/um]."""
        edges = np.r_[0.0, np.geomspace(1e-3 / self.corr_length, limit, 33)]
        wave_vector, weight = panels(edges)
        density = self.spectrum(wave_vector, dimensions) * weight / self.height_rms**2
        if dimensions == 1:
            return float(np.sqrt((density * wave_vector**2).sum() / np.pi))
        return float(np.sqrt((density * wave_vector**3).sum() / (4 * np.pi)))

    def fine(self, limit: float, dimensions: int) -> float:
        """Mean absolute wave vector per axis of the components beyond `limit` [rad/um].

        They are followed to FINEST times the limit: over power laws of finer and finer
        roughness the mean has no end, but grows with its logarithm.
        """
        wave_vector, weight = panels(limit * np.geomspace(1.0, FINEST, 25))
        density = self.spectrum(wave_vector, dimensions) * weight / self.height_rms**2
        return float((density * wave_vector**dimensions).sum() / np.pi**dimensions)

    @cached_property
    def farthest_lag(self) -> float:
        """Lag beyond which the square of the autocorrelation has no area left. [um]"""
        lags = self.corr_length * np.geomspace(1e-3, 1e3, 3000)
        return reach(lags, self.correlation(lags))


def reach(lags: Array, correlation: Array) -> float:
    """Lag beyond which the square of a correlation has a share TAIL of its area."""
    area = integrate.cumulative_trapezoid(correlation**2 * lags, lags, initial=0.0)
    return float(lags[min(np.searchsorted(area, (1 - TAIL) * area[-1]) + 1, lags.size - 1)])


class Gaussian(Statistics):
    """Autocorrelation exp(-x^2/l^2)."""

    def __init__(self, height_rms: float, corr_length: float) -> None:
        super().__init__(height_rms, corr_length, orders.GAUSSIAN)

    def correlation(self, lag: Array) -> Array:
        """See `Statistics`."""
        return np.exp(-((lag / self.corr_length) ** 2))

    def spectrum(self, wave_vector: Array, dimensions: int) -> Array:
        """See `Statistics`."""
        unit = self.corr_length * np.sqrt(np.pi)
        bell = np.exp(-((0.5 * wave_vector * self.corr_length) ** 2))
        return self.height_rms**2 * unit**dimensions * bell

    def spread(self, limit: float, dimensions: int) -> float:
        """See `Statistics`."""
        share = special.gammainc(1 + dimensions / 2, (0.5 * limit * self.corr_length) ** 2)
        return float(np.sqrt(2.0 * share) / self.corr_length)


class Exponential(Statistics):
    """Autocorrelation exp(-|x|/l): cusps at every scale, so an infinite rms slope."""

    def __init__(self, height_rms: float, corr_length: float) -> None:
        super().__init__(height_rms, corr_length, orders.EXPONENTIAL)

    def correlation(self, lag: Array) -> Array:
        """See `Statistics`."""
        return np.exp(-np.abs(lag) / self.corr_length)

    def spectrum(self, wave_vector: Array, dimensions: int) -> Array:
        """See `Statistics`."""
        length = self.corr_length
        fall = 1.0 + (wave_vector * length) ** 2
        if dimensions == 1:
            return 2.0 * self.height_rms**2 * length / fall
        return 2.0 * np.pi * self.height_rms**2 * length**2 / fall**1.5


class KCorrelation(Statistics):
    """K-correlation (ABC) spectrum: flat to a knee, then a power law.

    The density over an isotropic surface falls as 1/(1 + (B f)^2)^((exponent + 1)/2), that
    of a profile as 1/(1 + (B f)^2)^(exponent/2), `exponent` being the C of ABC fits. Above
    1; 2 is the exponential autocorrelation, above 3 the rms slope is finite.

    Parameters
    ----------
    height_rms, corr_length : float
        As in `Statistics`; the knee B follows from corr_length. [um]
    exponent : float
        Slope of the density of profiles at high frequencies. [1]
    """

    def __init__(self, height_rms: float, corr_length: float, exponent: float) -> None:
        super().__init__(height_rms, corr_length)
        value = require(
            "exponent", exponent, lambda v: (v > 1) & (v < 60), "lie in (1, 60) [1]",
            "At 1 the heights have no finite variance.",
        )  # fmt: skip
        self.exponent = float(value)
        at = optimize.brentq(lambda x: _matern(x, float(value)) - np.exp(-1), 1e-12, 60.0)
        self._scale = self.corr_length / at

    def correlation(self, lag: Array) -> Array:
        """See `Statistics`."""
        return _matern(np.abs(lag) / self._scale, self.exponent)

    def spectrum(self, wave_vector: Array, dimensions: int) -> Array:
        """See `Statistics`."""
        order = 0.5 * (self.exponent - 1.0)
        half = dimensions / 2.0
        norm = (4 * np.pi) ** half * special.gamma(order + half) / special.gamma(order)
        fall = (1.0 + (wave_vector * self._scale) ** 2) ** -(order + half)
        return self.height_rms**2 * norm * self._scale**dimensions * fall


def _matern(x: Array | float, exponent: float) -> Array:
    """Autocorrelation of a power-law spectrum at lags in units of its scale."""
    order = 0.5 * (exponent - 1.0)
    x = np.asarray(x, dtype=np.float64)
    safe = np.where(x > 1e-12, x, 1.0)
    value = (
        2.0 ** (1 - order) / special.gamma(order) * safe**order * special.kv(order, safe)
    )
    return np.where(x > 1e-12, value, 1.0)


@lru_cache(maxsize=8)
def _unit_panel(nodes: int) -> tuple[Array, Array]:
    """Gauss-Legendre nodes and weights on [0, 1]."""
    x, w = np.polynomial.legendre.leggauss(nodes)
    return 0.5 * (x + 1.0), 0.5 * w


def panels(edges: Array, nodes: int = PANEL_NODES) -> tuple[Array, Array]:
    """Composite Gauss-Legendre quadrature over the panels between the edges."""
    x, w = _unit_panel(nodes)
    widths = np.diff(edges)[:, None]
    return (edges[:-1, None] + widths * x).ravel(), (widths * w).ravel()

"""What a user may say of the heights, turned into their statistics."""

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
from scipy import interpolate, special

from pbrdf.errors import require
from pbrdf.wave.statistics import (
    Exponential,
    Gaussian,
    KCorrelation,
    Statistics,
    panels,
    reach,
)

__all__ = ["FORMS", "FromCorrelation", "FromDensity", "heights_of"]

Array = np.ndarray

FORMS = {
    "gaussian": "exp(-x^2/l^2)",
    "exponential": "exp(-|x|/l), with an infinite rms slope",
    "k-correlation": "power-law (ABC) spectrum of a given exponent",
}
LAGS, WAVES = 600, 400
# A function of the lag is transformed as far as it is larger than this
SMALLEST_KNOWN = 1e-9
# A function this large at the last lag never falls
SMALLEST_LASTING = 1e-3
# Panels of lags in a transform, some seconds
MOST_PANELS = 30_000
# Where a correlation has been this small for so many lags, there is nothing more
SMALLEST_CORRELATION, QUIET = 1e-4, 40
# Difference of height_rms and the integral of a density that rounding and the finite range
# of a measurement may explain; a forgotten side or 2 pi makes 30 % at least
HEIGHT_TOLERANCE = 0.05


class FromCorrelation(Statistics):
    """Autocorrelation rho(x) given as a function, or as a table of lags [um]."""

    def __init__(
        self, height_rms: float, corr_length: float | None, rho: Callable[[Array], Array],
        farthest: float,
    ) -> None:  # fmt: skip
        self._rho = rho
        self._last = farthest
        self._spectra: dict[int, tuple[Array, Any, float]] = {}
        length = one_over_e(rho, farthest) if corr_length is None else corr_length
        super().__init__(height_rms, length)

    def correlation(self, lag: Array) -> Array:
        """See `Statistics`."""
        return np.asarray(self._rho(np.abs(lag)))

    def spectrum(self, wave_vector: Array, dimensions: int) -> Array:
        """See `Statistics`; negative parts, which no surface has, are cut."""
        spectra = self._spectra
        if dimensions not in spectra:
            spectra[dimensions] = self._transformed(dimensions)
        steps, spline, top = spectra[dimensions]
        at = np.arcsinh(np.asarray(wave_vector) * self.corr_length)
        value = np.maximum(spline(np.minimum(at, steps[-1])), 0.0)
        return self.height_rms**2 * np.where(at <= top, value, 0.0)

    def _transformed(self, dimensions: int) -> tuple[Array, Any, float]:
        """Spline of the spectrum over arcsinh(K l)."""
        length, far = self.corr_length, self._last
        largest = 3e3 / far + 60.0 / length
        steps = np.linspace(0.0, np.arcsinh(largest * length), WAVES)
        wave = np.sinh(steps) / length
        count = max(int(far * largest / (2 * np.pi)), 32)
        if count > MOST_PANELS:
            msg = (
                f"autocorrelation must fall below {SMALLEST_KNOWN:g} within "
                f"{far * MOST_PANELS / count:.4g} um, got {far:.4g} um: its spectrum would "
                "take minutes. Give psd, or a table that ends."
            )
            raise ValueError(msg)
        lag, weight = panels(np.linspace(0.0, far, count), 12)
        rho = self.correlation(lag) * weight
        kernel = np.cos if dimensions == 1 else special.j0
        along = 2.0 * rho if dimensions == 1 else 2.0 * np.pi * rho * lag
        # One by one, as all together would take gigabytes
        values = np.array([kernel(one * lag) @ along for one in wave])
        # Beyond the first place below rounding there is only noise
        noise = 1e-12 * np.abs(values).max()
        below = np.flatnonzero(np.abs(values) < noise)
        top = steps[below[0]] if below.size else steps[-1]
        return steps, interpolate.CubicSpline(steps, values), float(top)


class FromDensity(Statistics):
    """Two-sided spectral density over frequencies [1/um], of a profile or of a surface.

    Power laws between the frequencies, constant below the first, nothing above the last.
    """

    def __init__(self, frequency: Array, density: Array, dimensions: int) -> None:
        self._frequency = frequency
        self._density = density
        self._dimensions = dimensions
        f, weight = panels(np.r_[0.0, frequency], 24)
        density = self._at(f) * weight
        density = 2.0 * density if dimensions == 1 else 2.0 * np.pi * f * density
        height = float(np.sqrt(density.sum()))
        kernel = np.cos if dimensions == 1 else special.j0
        lags, values = [0.0], [height**2]
        quiet = 0
        # As far as it is more than noise
        for lag in np.geomspace(0.01 / frequency[-1], 6.0 / frequency[0], LAGS):
            lags.append(float(lag))
            values.append(float((kernel(2 * np.pi * f * lag) * density).sum()))
            quiet = quiet + 1 if abs(values[-1]) < SMALLEST_CORRELATION * values[0] else 0
            if quiet == QUIET:
                break
        known = np.array(lags)
        rho = interpolate.CubicSpline(known, np.array(values) / values[0])
        far = reach(known[1:], rho(known[1:]))
        self._rho, self._farthest = rho, far
        super().__init__(height, one_over_e(rho, far))

    def _at(self, frequency: Array) -> Array:
        """Density by power laws between the points."""
        known, density = self._frequency, self._density
        inside = np.clip(frequency, known[0], known[-1])
        value = np.exp(np.interp(np.log(inside), np.log(known), np.log(density)))
        return np.where(frequency <= known[-1], value, 0.0)

    def correlation(self, lag: Array) -> Array:
        """See `Statistics`."""
        lag = np.abs(lag)
        far = self.farthest_lag
        return np.where(lag <= far, self._rho(np.minimum(lag, far)), 0.0)

    @cached_property
    def farthest_lag(self) -> float:
        """See `Statistics`."""
        return self._farthest

    def spectrum(self, wave_vector: Array, dimensions: int) -> Array:
        """See `Statistics`; the density itself, in the dimensions it was measured in."""
        if dimensions != self._dimensions:
            msg = f"the density is that of {self._dimensions} dimensions, not {dimensions}."
            raise ValueError(msg)
        return self._at(np.asarray(wave_vector) / (2 * np.pi))


def one_over_e(rho: Callable[[Array], Array], farthest: float) -> float:
    """Lag at which an autocorrelation first falls to 1/e."""
    lags = np.r_[0.0, np.geomspace(1e-5 * farthest, farthest, 4000)]
    values = rho(lags)
    below = np.flatnonzero(values < np.exp(-1))
    if not below.size:
        msg = (
            f"autocorrelation must fall below 1/e within its lags, got {values.min():.3g} "
            f"at the least up to {farthest:.4g} um. Give longer lags."
        )
        raise ValueError(msg)
    pair = [below[0] - 1, below[0]]
    return float(np.interp(-np.exp(-1), -values[pair], lags[pair]))


def heights_of(
    autocorrelation: Any, psd: Any, height_rms: float | None, corr_length: float | None,
    exponent: float | None, dimensions: int,
) -> Statistics:  # fmt: skip
    """Statistics of the heights of a profile (1) or an isotropic surface (2 dimensions)."""
    if psd is not None:
        return _from_density(psd, height_rms, corr_length, dimensions)
    if height_rms is None:
        msg = "height_rms must be given [um], or a psd, which has it. Got neither."
        raise ValueError(msg)
    if not isinstance(autocorrelation, str):
        return _from_correlation(autocorrelation, height_rms, corr_length)
    if autocorrelation not in FORMS:
        msg = (
            f"autocorrelation must be one of {', '.join(FORMS)}, a function of the lag or "
            f"(lag, correlation), got {autocorrelation!r}."
        )
        raise ValueError(msg)
    if corr_length is None:
        msg = f"corr_length must be given [um] with autocorrelation={autocorrelation!r}."
        raise ValueError(msg)
    if autocorrelation == "k-correlation":
        if exponent is None:
            msg = (
                "exponent must be given with autocorrelation='k-correlation': the C of an "
                "ABC fit, by which the density of profiles falls."
            )
            raise ValueError(msg)
        return KCorrelation(height_rms, corr_length, exponent)
    known = {"gaussian": Gaussian, "exponential": Exponential}
    return known[autocorrelation](height_rms, corr_length)


def _columns(name: str, pair: Any, parts: tuple[str, str]) -> tuple[Array, Array]:
    """Two rising columns of a table."""
    try:
        first, second = pair
    except (TypeError, ValueError) as error:
        msg = f"{name} must be two columns of numbers, got {type(pair).__name__}."
        raise TypeError(msg) from error
    x, y = (
        np.array(
            require(f"{name} {part}", one, np.isfinite, "be finite", "Leave gaps out.")
        )
        for part, one in zip(parts, (first, second), strict=True)
    )
    if x.ndim != 1 or x.shape != y.shape or x.size < 4:
        msg = (
            f"{name} must be two columns of one length of at least 4, got shapes "
            f"{x.shape} and {y.shape}."
        )
        raise ValueError(msg)
    if (np.diff(x) <= 0).any():
        msg = f"{name} must have a rising first column. Sort it."
        raise ValueError(msg)
    return x, y


def _from_density(
    psd: Any, height_rms: float | None, corr_length: float | None, dimensions: int
) -> Statistics:
    """Statistics of a measured density, checked against height_rms where given."""
    if corr_length is not None:
        msg = f"corr_length must be left out with a psd, which has it, got {corr_length:g}."
        raise ValueError(msg)
    frequency, density = _columns("psd", psd, ("frequency", "density"))
    if frequency[0] == 0.0:
        frequency, density = frequency[1:], density[1:]
    require("psd frequency", frequency, lambda v: v > 0, "be positive [1/um]", "")
    require("psd density", density, lambda v: v > 0, "be positive", "Leave gaps out.")
    statistics = FromDensity(frequency, density, dimensions)
    if height_rms is not None:
        ratio = statistics.height_rms / float(height_rms)
        if abs(ratio - 1.0) > HEIGHT_TOLERANCE:
            what = "profile" if dimensions == 1 else "surface"
            msg = (
                f"psd must integrate to height_rms {height_rms:g} um, got "
                f"{statistics.height_rms:.4g} um, {ratio:.3g} times as much. It is the "
                f"two-sided density of a {what} over frequencies in 1/um, without 2 pi."
            )
            raise ValueError(msg)
    return statistics


def _from_correlation(rho: Any, height_rms: float, corr_length: float | None) -> Statistics:
    """Statistics of an autocorrelation given as a function or a table."""
    if callable(rho):
        at_zero = float(np.asarray(rho(np.zeros(1)))[0])
        if abs(at_zero - 1.0) > 1e-9:
            msg = f"autocorrelation must be 1 at lag 0, got {at_zero:.6g}. Divide by it."
            raise ValueError(msg)
        start = corr_length if corr_length is not None else 1.0
        lags = start * np.geomspace(1e-3, 1e5, 4000)
        known = require(
            "autocorrelation", rho(lags), np.isfinite, "be finite",
            f"It is asked at lags from {lags[0]:g} to {lags[-1]:g} um.",
        )  # fmt: skip
        above = np.flatnonzero(np.abs(known) > SMALLEST_KNOWN)
        farthest = float(lags[min(above[-1] + 1, lags.size - 1)])
        if abs(known[-1]) > SMALLEST_LASTING:
            msg = (
                f"autocorrelation must fall to 0, got {known[-1]:.3g} at "
                f"{farthest:.3g} um. Subtract what is no roughness: a plane, a wave."
            )
            raise ValueError(msg)
        length = one_over_e(rho, farthest)
        if corr_length is not None and abs(length / corr_length - 1.0) > 0.01:
            msg = (
                f"corr_length must be the lag where the autocorrelation is 1/e, "
                f"{length:.4g} um, got {corr_length:g}. Leave it out."
            )
            raise ValueError(msg)
        return FromCorrelation(height_rms, length, rho, farthest)
    lag, values = _columns("autocorrelation", rho, ("lag", "value"))
    values_ok = require(
        "autocorrelation", values, lambda v: np.abs(v) <= 1 + 1e-9, "lie in [-1, 1] [1]",
        "It is the correlation, not the covariance.",
    )  # fmt: skip
    if lag[0] > 0:
        lag, values_ok = np.r_[0.0, lag], np.r_[1.0, values_ok]
    elif lag[0] < 0 or abs(values_ok[0] - 1.0) > 1e-9:
        msg = (
            f"autocorrelation must begin with 1 at lag 0, got {values_ok[0]:g} at "
            f"{lag[0]:g} um."
        )
        raise ValueError(msg)
    spline = interpolate.CubicSpline(lag, values_ok)
    far = float(lag[-1])

    def table(x: Array) -> Array:
        return np.where(x <= far, spline(np.minimum(x, far)), 0.0)

    length = one_over_e(table, far)
    if corr_length is not None and abs(length / corr_length - 1.0) > 0.01:
        msg = f"corr_length must be {length:.4g} um as in the table, got {corr_length:g}."
        raise ValueError(msg)
    return FromCorrelation(height_rms, length, table, far)

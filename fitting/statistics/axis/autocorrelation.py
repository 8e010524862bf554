"""Forms of the autocorrelation of heights: Gaussian, periodic, Matérn, several scales.

Each is normalised, ρ(0) = 1. The Gaussian is the paper's. Matérn runs from surfaces as
jagged as an exponential autocorrelation (smoothness ν = 1/2, no slope at all without a
cut-off) to the Gaussian (ν → ∞). Two Gaussian scales describe fine roughness on coarse;
many describe what has no simple form. The periodic form is that of machined grooves.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy import integrate, optimize, special

Array = np.ndarray

SMOOTHNESS_RANGE = (0.15, 8.0)

_HERMITE_NODES, _HERMITE_WEIGHTS = np.polynomial.hermite.hermgauss(24)
_HERMITE_WEIGHTS /= np.sqrt(np.pi)


@dataclass(frozen=True)
class Correlation:
    """One autocorrelation function of unit variance.

    Parameters
    ----------
    form : str
        ``gaussian``, ``periodic``, ``matern``, ``two-scale`` or ``multi-scale``.
    corr_length : float
        Lag at which the autocorrelation is 1/e. [um]
    parameters : mapping
        What defines the form, by name.
    rho : callable
        Autocorrelation against lag [um].
    spectrum : callable
        Two-sided power spectrum against frequency [1/um], in um; its integral over all
        frequencies, negative ones included, is 1.
    """

    form: str
    corr_length: float
    parameters: dict[str, float]
    rho: Callable[[Array], Array]
    spectrum: Callable[[Array], Array]

    def band_variance(self, cutoff: float, derivative: int = 1) -> float:
        r"""Variance of a derivative of the heights, from wavelengths above `cutoff`.

        .. math:: 2 \int_0^{1/\lambda_c} (2\pi f)^{2m} S(f)\,df

        Parameters
        ----------
        cutoff : float
            Shortest wavelength that counts, λ_c. [um]; 0 takes all.
        derivative : int
            m = 1 slope, m = 2 curvature.

        Returns
        -------
        float
            Times height_rms², the variance. [um^-2m]; infinite where it does not exist.
        """
        smoothness = self.parameters.get("smoothness", np.inf)
        if cutoff <= 0 and smoothness <= derivative:
            return np.inf
        # Substituting f = e^t spreads the decades of a multi-scale surface evenly
        top = np.log(1 / cutoff) if cutoff > 0 else np.log(1e4 / self.shortest_length())
        t = np.linspace(np.log(1e-4 / self.corr_length), top, 4001)
        f = np.exp(t)
        integrand = 2 * (2 * np.pi * f) ** (2 * derivative) * self.spectrum(f) * f
        return float(integrate.simpson(integrand, x=t))

    def blurred(self, blur: float) -> tuple[float, "Correlation"]:
        r"""Share of the height variance that a Gaussian blur leaves, and what is left.

        .. math:: B(r) = \int ρ(r - u) \exp(-u^2 / 4 σ^2) / \sqrt{4 π σ^2} \, du

        A blur of standard deviation σ along the surface acts twice on products of heights.
        B(0) is the share; B(r) / B(0) is the autocorrelation of the blurred heights.

        Parameters
        ----------
        blur : float
            σ. [um] Not above the shortest length, which it would hide.

        Examples
        --------
        A Gaussian stays one, of length sqrt(l² + 4 σ²):

        >>> share, left = gaussian(2.0).blurred(0.75)
        >>> round(share, 9), round(float(left.rho(2.5)), 9), round(float(np.exp(-1)), 9)
        (0.8, 0.367879441, 0.367879441)
        """
        if blur <= 0:
            return 1.0, self

        def raw(r: Array) -> Array:
            lags = np.abs(np.add.outer(2 * blur * _HERMITE_NODES, np.asarray(r)))
            return np.tensordot(_HERMITE_WEIGHTS, self.rho(lags), 1)

        def power(f: Array) -> Array:
            return np.exp(-((2 * np.pi * blur * f) ** 2)) * self.spectrum(f)

        share = float(raw(np.zeros(())))
        return share, replace(
            self, rho=lambda r: raw(r) / share, spectrum=lambda f: power(f) / share
        )

    def stretched(self, factor: float) -> "Correlation":
        """Return the same form with all lengths multiplied by `factor`."""
        return Correlation(
            self.form,
            self.corr_length * factor,
            {
                k: v * factor if k.endswith("length") else v
                for k, v in self.parameters.items()
            },
            lambda r: self.rho(r / factor),
            lambda f: self.spectrum(f * factor) * factor,
        )

    def longest_length(self) -> float:
        """Lag beyond which nothing is correlated, a few times over. [um]"""
        names = ("long_length", "coherence_length")
        return max(self.corr_length, *(self.parameters.get(n, 0.0) for n in names))

    def shortest_length(self) -> float:
        """Shortest length in the description. [um]"""
        return min(self.corr_length, self.parameters.get("short_length", np.inf))


@dataclass(frozen=True)
class Family:
    """How a form is parametrised for the fit: logarithms, with start and limits.

    `build` takes the parameter vector, `starts` a first guess of corr_length, `limits` that
    and the shortest length that the spacing resolves.
    """

    form: str
    build: Callable[[Array], Correlation]
    starts: Callable[[float], list[list[float]]]
    limits: Callable[[float, float], tuple[list[float], list[float]]]


def gaussian(corr_length: float) -> Correlation:
    """ρ(r) = exp(-r²/l²), the paper's form; slope_rms = sqrt(2) height_rms / l.

    Examples
    --------
    >>> round(gaussian(2.0).band_variance(0.0), 6)  # 2 / l²
    0.5
    """
    length = corr_length
    return Correlation(
        "gaussian",
        length,
        {},
        lambda r: np.exp(-((r / length) ** 2)),
        lambda f: np.sqrt(np.pi) * length * np.exp(-((np.pi * length * f) ** 2)),
    )


def matern(corr_length: float, smoothness: float) -> Correlation:
    """Matérn form with its 1/e length and smoothness ν; ν = 1/2 is exp(-r/l).

    Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006, (4.14), (4.15).
    """
    nu = smoothness
    kappa = _matern_unit_length(nu) / corr_length
    # Logarithms: the gamma functions overflow long before their ratio does
    scale = np.log(2 * np.sqrt(np.pi)) + special.gammaln(nu + 0.5) - special.gammaln(nu)
    return Correlation(
        "matern",
        corr_length,
        {"smoothness": nu},
        lambda r: _matern_unit(kappa * np.abs(r), nu),
        lambda f: np.exp(
            scale
            + 2 * nu * np.log(kappa)
            - (nu + 0.5) * np.log(kappa**2 + (2 * np.pi * f) ** 2)
        ),
    )


def periodic(period: float, coherence: float) -> Correlation:
    """ρ(r) = exp(-r²/c²) cos(2πr/P): grooves of period P that keep step over a length c."""
    wave = 2 * np.pi / period

    def rho(r: Array) -> Array:
        return np.exp(-((r / coherence) ** 2)) * np.cos(wave * r)

    def spectrum(f: Array) -> Array:
        lobes = [np.exp(-((np.pi * coherence * (f + s / period)) ** 2)) for s in (-1, 1)]
        return np.sqrt(np.pi) * coherence / 2 * np.sum(lobes, axis=0)

    # Below a quarter period both factors fall
    top = min(period / 4, coherence)
    corr_length = optimize.brentq(lambda r: float(rho(np.array(r))) - np.exp(-1), 0.0, top)
    parameters = {"period": period, "coherence_length": coherence}
    return Correlation("periodic", float(corr_length), parameters, rho, spectrum)


def two_scale(long_length: float, short_length: float, short_share: float) -> Correlation:
    """Two Gaussian scales; `short_share` of the height variance has the short one."""
    parts = (
        (1 - short_share, gaussian(long_length)),
        (short_share, gaussian(short_length)),
    )

    def rho(r: Array) -> Array:
        return np.sum([share * part.rho(r) for share, part in parts], axis=0)

    def spectrum(f: Array) -> Array:
        return np.sum([share * part.spectrum(f) for share, part in parts], axis=0)

    low, high = sorted((short_length, long_length))
    corr_length = (
        optimize.brentq(lambda r: rho(r) - np.exp(-1), low * (1 - 1e-9), high * (1 + 1e-9))
        if high > low
        else low
    )
    parameters = {
        "long_length": long_length,
        "short_length": short_length,
        "short_share": short_share,
    }
    return Correlation("two-scale", corr_length, parameters, rho, spectrum)


def multi_scale(lengths: Array, shares: Array) -> Correlation:
    """Sum of Gaussian scales; `shares` of the height variance, lengths rising. [um]"""
    squares = np.asarray(lengths) ** 2

    def rho(r: Array) -> Array:
        return np.tensordot(shares, np.exp(-np.multiply.outer(1 / squares, r**2)), 1)

    def spectrum(f: Array) -> Array:
        waves = np.exp(-np.multiply.outer(np.pi**2 * squares, f**2))
        return np.tensordot(shares * np.sqrt(np.pi * squares), waves, 1)

    corr_length = float(
        optimize.brentq(
            lambda r: float(rho(np.array(r))) - np.exp(-1),
            0.99 * lengths[0],
            1.01 * lengths[-1],
        )
    )
    slopes = shares / squares
    parameters = {
        "short_length": float(lengths[0]),
        "long_length": float(lengths[-1]),
        "short_slope_share": float(slopes[0] / slopes.sum()),
    }
    return Correlation("multi-scale", corr_length, parameters, rho, spectrum)


def multi_scale_family(lengths: Array, shares: Array) -> Family:
    """Make a family of the shares of fixed lengths, by their log-ratios to the first."""
    start = np.log(shares[1:] / shares[0]).tolist()

    def build(p: Array) -> Correlation:
        weights = np.exp(np.concatenate([[0.0], p]))
        return multi_scale(lengths, weights / weights.sum())

    limits = ([v - 5 for v in start], [v + 5 for v in start])
    return Family(
        "multi-scale", build, lambda _: [start], lambda _length, _shortest: limits
    )


def _matern_unit(x: Array, nu: float) -> Array:
    """2^(1-ν)/Γ(ν) x^ν K_ν(x), 1 at x = 0."""
    x = np.maximum(np.asarray(x, dtype=float), 1e-10)
    log = (1 - nu) * np.log(2) - special.gammaln(nu) + nu * np.log(x)
    # kve = K_ν e^x does not underflow
    return np.minimum(np.exp(log - x) * special.kve(nu, x), 1.0)


def _matern_unit_length(nu: float) -> float:
    """Argument at which the unit Matérn function is 1/e."""
    return float(optimize.brentq(lambda x: _matern_unit(x, nu) - np.exp(-1), 1e-8, 30.0))


GAUSSIAN = Family(
    "gaussian",
    lambda p: gaussian(np.exp(p[0])),
    lambda length: [[np.log(length)]],
    lambda length, shortest: ([np.log(max(length / 30, shortest))], [np.log(length * 30)]),
)

MATERN = Family(
    "matern",
    lambda p: matern(np.exp(p[0]), np.exp(p[1])),
    lambda length: [[np.log(length), np.log(0.6)], [np.log(length), np.log(2.5)]],
    lambda length, shortest: (
        [np.log(max(length / 30, shortest)), np.log(SMOOTHNESS_RANGE[0])],
        [np.log(length * 30), np.log(SMOOTHNESS_RANGE[1])],
    ),
)

PERIODIC = Family(
    "periodic",
    lambda p: periodic(np.exp(p[0]), np.exp(p[1])),
    # cos falls to 1/e at 0.19 periods
    lambda length: [[np.log(5.25 * length), np.log(k * length)] for k in (3.0, 15.0)],
    lambda length, _: (
        [np.log(2 * length), np.log(0.7 * length)],
        [np.log(100 * length), np.log(60 * length)],
    ),
)

TWO_SCALE = Family(
    "two-scale",
    # Long length, ratio of the lengths, logit of the share
    lambda p: two_scale(np.exp(p[0]), np.exp(p[0] - p[1]), special.expit(p[2])),
    lambda length: [[np.log(1.2 * length), np.log(5.0), special.logit(0.15)]],
    lambda length, shortest: (
        [np.log(max(length / 5, shortest)), np.log(1.5), special.logit(0.003)],
        [np.log(length * 30), np.log(100.0), special.logit(0.9)],
    ),
)

FAMILIES = (GAUSSIAN, PERIODIC, MATERN, TWO_SCALE)

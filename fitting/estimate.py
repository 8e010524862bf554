"""A measured number with its uncertainty: what every statistic of this package is."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy import special

LEVEL = 0.95
# An rms from less than this many independent values is anyone's guess
_LEAST_FREEDOM = 0.5
# and a length known no better than to a factor of e^(1.96 * 1.5) = 19 likewise
_WIDEST = 1.5
_NORMAL = float(special.ndtri(0.5 + LEVEL / 2))


@dataclass(frozen=True)
class Estimate:
    """Value, standard error and the two ends of its 95 % confidence interval.

    The interval is not always symmetric: a variance from few independent samples is
    bounded more tightly from below than from above.

    Parameters
    ----------
    value : float
        Best value, in the unit of the quantity.
    stderr : float
        Standard error; infinite where the data do not determine the value.
    low, high : float
        Ends of the 95 % interval.

    Examples
    --------
    >>> print(Estimate(0.2534, 0.0121, 0.231, 0.279))
    0.253 ± 0.012 (95 %: 0.231 .. 0.279)
    """

    value: float
    stderr: float
    low: float
    high: float

    def __float__(self) -> float:
        return self.value

    def __str__(self) -> str:
        if not np.isfinite(self.stderr):
            return f"{self.value:.3g} (not determined)"
        # Two digits of the error say all there is to say about the value
        digits = _decimals(self.stderr)
        value, stderr = f"{self.value:.{digits}f}", f"{self.stderr:.{digits}f}"
        low, high = f"{self.low:.{digits}f}", f"{self.high:.{digits}f}"
        return f"{value} ± {stderr} (95 %: {low} .. {high})"

    def as_dict(self) -> dict[str, float]:
        """Give the four numbers by name, for reports and files."""
        return {
            "value": self.value,
            "stderr": self.stderr,
            "low": self.low,
            "high": self.high,
        }

    def reaching(self, low: float, high: float) -> Self:
        """Widen the interval to these ends, and the standard error with it."""
        if not np.isfinite(self.stderr):
            return self
        low, high = min(low, self.low), max(high, self.high)
        stderr = max(self.stderr, min(self.value - low, high - self.value) / _NORMAL)
        return type(self)(self.value, float(stderr), float(low), float(high))

    @classmethod
    def undetermined(cls, value: float, *, low: float = 0.0) -> Self:
        """Make a value the data do not determine: any above `low` is possible."""
        return cls(float(value), np.inf, float(low), np.inf)

    @classmethod
    def symmetric(cls, value: float, stderr: float, *, lowest: float = -np.inf) -> Self:
        """Make a normal interval, cut at the smallest value the quantity can have."""
        half = _NORMAL * stderr
        return cls(
            float(value),
            float(stderr),
            float(max(value - half, lowest)),
            float(value + half),
        )

    @classmethod
    def root_mean_square(cls, value: float, log_variance: float) -> Self:
        """Interval of an rms whose square is scaled chi-squared.

        Parameters
        ----------
        value : float
            The rms.
        log_variance : float
            Variance of the logarithm of its square, 2 / (degrees of freedom). Above 4 the
            value counts as not determined.
        """
        freedom = 2 / max(log_variance, 1e-12)
        if freedom < _LEAST_FREEDOM:
            return cls.undetermined(value)
        low, high = (
            value * np.sqrt(freedom / special.chdtri(freedom, tail))
            for tail in (0.5 - LEVEL / 2, 0.5 + LEVEL / 2)
        )
        stderr = value * np.sqrt(log_variance) / 2
        return cls(float(value), float(stderr), float(low), float(high))

    @classmethod
    def positive(cls, value: float, log_variance: float) -> Self:
        """Interval symmetric in the logarithm, for lengths and ratios.

        Parameters
        ----------
        value : float
            The quantity, above zero.
        log_variance : float
            Variance of its logarithm.
        """
        spread = np.sqrt(log_variance)
        if spread > _WIDEST:
            return cls.undetermined(value)
        factor = np.exp(_NORMAL * spread)
        return cls(
            float(value),
            float(value * spread),
            float(value / factor),
            float(value * factor),
        )


def _decimals(stderr: float) -> int:
    """Decimals that show two digits of a standard error."""
    if stderr <= 0:
        return 6
    return int(np.clip(1 - np.floor(np.log10(stderr)), 0, 12))

"""Are the heights Gaussian? A decision that knows how few independent heights there are."""

from dataclasses import dataclass

import numpy as np
from scipy import special

from fitting.estimate import Estimate

Array = np.ndarray

DECISION_LEVEL = 0.05
# Below this many independent heights no test of shape has power
_FEWEST = 20
_BLOCK = 1 << 18


@dataclass(frozen=True)
class Gaussianity:
    """Verdict on the height distribution.

    Parameters
    ----------
    skewness, kurtosis : Estimate
        Of the heights; kurtosis is the excess, 0 for a Gaussian. The intervals are those of
        a Gaussian surface of this autocorrelation. [1]
    effective_samples : float
        Independent heights that would scatter as much, N / Σρ³ for the skewness.
    p_value : float
        Probability of as large a departure if the heights were Gaussian.
    """

    skewness: Estimate
    kurtosis: Estimate
    effective_samples: float
    p_value: float

    @property
    def is_gaussian(self) -> bool:
        """Whether a Gaussian is not rejected at the 5 % level."""
        return self.p_value >= DECISION_LEVEL

    @property
    def verdict(self) -> str:
        """The decision in words."""
        if self.effective_samples < _FEWEST:
            return (
                f"cannot be decided: {self.effective_samples:.0f} independent heights are "
                f"too few (at least {_FEWEST})"
            )
        word = "compatible with" if self.is_gaussian else "not"
        return (
            f"{word} Gaussian (p = {self.p_value:.2g}, "
            f"{self.effective_samples:.0f} independent heights)"
        )


def judge_gaussianity(
    heights: Array, skew_samples: float, kurt_samples: float
) -> Gaussianity:
    """Test skewness and excess kurtosis against a correlated Gaussian surface.

    Parameters
    ----------
    heights : ndarray
        Residual heights; NaN is ignored. [um]
    skew_samples, kurt_samples : float
        Independent samples N / Σρ³ and N / Σρ⁴: in a Gaussian process the third and fourth
        Hermite moments scatter as 6 Σρ³ / N and 24 Σρ⁴ / N.

    Notes
    -----
    Both are carried to normal variables by the transformations of D'Agostino (1970) and of
    Anscombe and Glynn (1983), with the effective in place of the actual number of samples,
    and their squares are added (D'Agostino and Pearson 1973).
    """
    skew, kurt = _shape(heights)
    n, m = max(skew_samples, 8.0), max(kurt_samples, 20.0)
    p_value = float(
        special.chdtrc(2, _skew_score(skew, n) ** 2 + _kurt_score(kurt, m) ** 2)
    )
    return Gaussianity(
        Estimate.symmetric(skew, np.sqrt(6 / skew_samples)),
        Estimate.symmetric(kurt, np.sqrt(24 / kurt_samples), lowest=-2.0),
        float(skew_samples),
        p_value,
    )


def _shape(heights: Array) -> tuple[float, float]:
    """Skewness and excess kurtosis, block by block to spare memory."""
    flat = heights.ravel()
    blocks = [flat[i : i + _BLOCK] for i in range(0, flat.size, _BLOCK)]
    mean = float(np.nanmean(flat))
    sums = np.zeros(4)
    for block in blocks:
        z = block[np.isfinite(block)] - mean
        square = z * z
        sums += (z.size, square.sum(), np.dot(square, z), np.dot(square, square))
    second, third, fourth = sums[1:] / sums[0]
    return float(third / second**1.5), float(fourth / second**2 - 3)


def _skew_score(skew: float, n: float) -> float:
    """Sample skewness as a standard normal variable (D'Agostino 1970)."""
    y = skew * np.sqrt((n + 1) * (n + 3) / (6 * (n - 2)))
    beta = 3 * (n * n + 27 * n - 70) * (n + 1) * (n + 3)
    beta /= (n - 2) * (n + 5) * (n + 7) * (n + 9)
    w2 = np.sqrt(2 * (beta - 1)) - 1
    return float(np.arcsinh(y / np.sqrt(2 / (w2 - 1))) / np.sqrt(np.log(w2) / 2))


def _kurt_score(excess: float, n: float) -> float:
    """Sample excess kurtosis as a standard normal variable (Anscombe and Glynn 1983)."""
    mean = -6 / (n + 1)
    spread = np.sqrt(24 * n * (n - 2) * (n - 3) / ((n + 1) ** 2 * (n + 3) * (n + 5)))
    x = (excess - mean) / spread
    skew = 6 * (n * n - 5 * n + 2) / ((n + 7) * (n + 9))
    skew *= np.sqrt(6 * (n + 3) * (n + 5) / (n * (n - 2) * (n - 3)))
    a = 6 + 8 / skew * (2 / skew + np.sqrt(1 + 4 / skew**2))
    root = np.cbrt((1 - 2 / a) / (1 + x * np.sqrt(2 / (a - 4))))
    return float((1 - 2 / (9 * a) - root) / np.sqrt(2 / (9 * a)))

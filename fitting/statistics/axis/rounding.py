r"""Heights on a lattice: what whole-pixel edges and coarse converters do to roughness.

Rounding to multiples of a step q is neither white nor independent of the heights where a
step holds over several samples, which is why subtracting q²/12 (Sheppard) is not enough for
slopes. The mean square increment of rounded Gaussian heights is known in closed form
whenever the heights spread over more than about one step:

.. math::
   D_q = D + \frac{q^2}{6}
       - \frac{q^2}{\pi^2} \sum_{k \ge 1} \frac{\overline{\cos(2 \pi k \mu / q)}}{k^2}
         e^{-2 \pi^2 k^2 D / q^2}

with D the true mean square increment and μ the increment of the form (tilt, curvature) that
is removed after rounding. It follows from E[rounded increment² | d] = d² + q² f (1 - f),
f = frac(d/q), and the Fourier series of f (1 - f).
"""

from dataclasses import dataclass

import numpy as np

Array = np.ndarray

_MOST_HARMONICS = 200
# A lattice shows in this many heights as well as in all of a large map
_MOST_HEIGHTS = 200_000
# Steps this far below the rms increment change nothing that is printed
_NEGLIGIBLE = 0.02


def find_step(heights: Array) -> float:
    """Step of the lattice that heights lie on, 0 if they lie on none. [um]

    Parameters
    ----------
    heights : ndarray
        As measured, before any form is removed; NaN is ignored. [um]

    Examples
    --------
    >>> round(find_step(0.3 * np.array([1, 4, 2, 2, 3, 5, 1, 2, 7, 1, 3, 2]) + 0.05), 9)
    0.3
    """
    sample = heights.ravel()
    sample = sample[:: max(1, sample.size // _MOST_HEIGHTS)]
    sample = sample[np.isfinite(sample)]
    levels = np.unique(sample)
    if levels.size < 2 or levels.size > sample.size / 2:
        return 0.0
    gaps = np.diff(levels)
    # Equal heights that differ by rounding of the file are one level
    gaps = gaps[gaps > 1e-9 * np.ptp(levels)]
    if gaps.size == 0:
        return 0.0
    step = gaps.min()
    counts = np.round(gaps / step)
    step = gaps.sum() / counts.sum()
    if np.abs(gaps / step - counts).max() > 0.02:
        return 0.0
    return float(step)


@dataclass(frozen=True)
class Rounding:
    """Rounding to multiples of `step`, seen by the increments at given lags.

    Parameters
    ----------
    step : float
        Lattice step q. [um]; 0 for heights that are not rounded.
    cosines : ndarray, shape (n_harmonics, n_lags)
        Mean of cos(2 π k μ / q) over the increments μ of the removed form.
    """

    step: float
    cosines: Array

    @classmethod
    def of_form(cls, step: float, form_increments: Array, smallest: float) -> "Rounding":
        """From increments of the removed form and the smallest mean square increment.

        Parameters
        ----------
        step : float
            [um]
        form_increments : ndarray, shape (n_samples, n_lags)
            [um]
        smallest : float
            Decides how many harmonics count: the last has decayed to exp(-8 pi²). [um²]
        """
        if step <= 0:
            return cls(0.0, np.zeros((0, 0)))
        n = int(np.clip(2 * step / np.sqrt(max(smallest, 1e-300)), 8, _MOST_HARMONICS))
        k = np.arange(1, n + 1)[:, None, None]
        return cls(step, np.cos(2 * np.pi * k * form_increments / step).mean(axis=1))

    def increments(self, mean_square: Array) -> Array:
        """D_q of the rounded heights from D of the true ones. [um²]"""
        if self.step <= 0:
            return mean_square
        k, decay = self._harmonics(mean_square)
        ripple = np.sum(self.cosines * decay / k**2, axis=0) / np.pi**2
        return mean_square + self.step**2 * (1 / 6 - ripple)

    def gain(self, mean_square: Array) -> Array:
        """dD_q/dD, above 1 where steps hold over several samples."""
        if self.step <= 0:
            return np.ones_like(mean_square)
        _, decay = self._harmonics(mean_square)
        return 1 + 2 * np.sum(self.cosines * decay, axis=0)

    def _harmonics(self, mean_square: Array) -> tuple[Array, Array]:
        k = np.arange(1, len(self.cosines) + 1)[:, None]
        exponent = 2 * (np.pi * k / self.step) ** 2 * np.maximum(mean_square, 0)
        return k, np.exp(-exponent)

    @property
    def variance(self) -> float:
        """Variance that rounding adds to the heights, q²/12. [um²]"""
        return self.step**2 / 12


def is_negligible(step: float, first_increment: float) -> bool:
    """Whether a step is far below the rms increment between neighbours."""
    return step <= _NEGLIGIBLE * np.sqrt(max(first_increment, 0.0))

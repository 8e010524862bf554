"""Structure functions: mean square height increments against lag, from any sampling."""

from dataclasses import dataclass

import numpy as np
from scipy import fft

Array = np.ndarray

# Positions off an even grid by less than this share of a step are still even
_EVEN = 0.1
_MOST_PAIRS = 20_000_000


@dataclass(frozen=True)
class Increments:
    """Mean square height increments at some lags.

    Parameters
    ----------
    lags : ndarray, shape (n,)
        Rising. [um]
    mean_square : ndarray, shape (n,)
        Mean of (z(x + lag) - z(x))². [um²]
    pairs : ndarray, shape (n,)
        Number of pairs in each mean.
    """

    lags: Array
    mean_square: Array
    pairs: Array


@dataclass(frozen=True)
class EvenSampling:
    """One axis of evenly spaced heights, gaps allowed.

    Parameters
    ----------
    spacing, length : float
        Step and length along the axis. [um]
    n_points : int
        Heights that are not missing, over all lines.
    variance : float
        Mean square residual height. [um²]
    mean_square : ndarray
        Structure function at 0, 1, 2 ... steps; NaN where there are no pairs. [um²]
    pairs : ndarray
        Number of pairs at each.
    """

    spacing: float
    length: float
    n_points: int
    variance: float
    mean_square: Array
    pairs: Array

    @property
    def longest_lag(self) -> float:
        """Longest lag with pairs enough. [um]"""
        return (self.mean_square.size - 1) * self.spacing

    def first_fall(self) -> float:
        """Lag where the autocorrelation falls to 1/e of its value at one step. [um]"""
        correlation = self.variance - self.mean_square / 2
        below = correlation < correlation[1] * np.exp(-1)
        below[:2] = False
        k = int(np.argmax(below)) if below.any() else self.mean_square.size - 1
        return max(k, 1) * self.spacing

    def increments(self, longest: float, n: int) -> Increments:
        """About `n` lags up to `longest`, denser where they are short."""
        top = int(np.clip(np.ceil(longest / self.spacing), 5, self.mean_square.size - 1))
        steps = np.unique(
            np.round(
                np.concatenate([np.geomspace(1, top, n // 2), np.linspace(1, top, n)])
            ).astype(int)
        )
        steps = steps[self.pairs[steps] > 0]
        return Increments(steps * self.spacing, self.mean_square[steps], self.pairs[steps])


@dataclass(frozen=True)
class UnevenSampling:
    """A profile whose points are not evenly spaced.

    Parameters
    ----------
    x, z : ndarray, shape (n,)
        Positions, rising, and residual heights. [um]
    """

    x: Array
    z: Array

    @property
    def spacing(self) -> float:
        """Mean distance between neighbours. [um]"""
        return float((self.x[-1] - self.x[0]) / (self.x.size - 1))

    @property
    def length(self) -> float:
        """Length of the profile. [um]"""
        return float(self.x[-1] - self.x[0]) + self.spacing

    @property
    def n_points(self) -> int:
        """Number of points."""
        return int(self.x.size)

    @property
    def variance(self) -> float:
        """Mean square residual height, points weighted by the length they stand for."""
        return float(np.average(self.z**2, weights=np.gradient(self.x)))

    @property
    def longest_lag(self) -> float:
        """Longest lag with pairs enough. [um]"""
        return self.length / 3

    def first_fall(self) -> float:
        """Lag where the autocorrelation falls to 1/e of its value at one step. [um]"""
        found = self.increments(self.longest_lag, 60)
        correlation = self.variance - found.mean_square / 2
        below = correlation < correlation[0] * np.exp(-1)
        below[0] = False
        return float(found.lags[np.argmax(below)] if below.any() else found.lags[-1])

    def increments(self, longest: float, n: int) -> Increments:
        """About `n` bins of lag up to `longest`, each at its root mean square lag."""
        spacing = self.spacing
        top = max(min(longest, self.longest_lag), 5 * spacing)
        # Bins between half steps while lags are short, as for even spacing
        steps = np.unique(
            np.round(
                np.concatenate(
                    [
                        np.geomspace(1, top / spacing, n // 2),
                        np.linspace(1, top / spacing, n),
                    ]
                )
            )
        )
        edges = np.concatenate([[0.0], (steps[:-1] + steps[1:]) / 2, [steps[-1] + 0.5]])
        edges = edges * spacing
        sums = np.zeros((3, steps.size))
        most = min(self.x.size - 1, max(1, _MOST_PAIRS // self.x.size))
        for k in range(1, most + 1):
            distance = self.x[k:] - self.x[:-k]
            if distance.min() > edges[-1]:
                break
            bins = np.searchsorted(edges, distance) - 1
            inside = bins < steps.size
            bins, distance = bins[inside], distance[inside]
            square = ((self.z[k:] - self.z[:-k]) ** 2)[inside]
            for row, values in enumerate((np.ones_like(distance), distance**2, square)):
                sums[row] += np.bincount(bins, values, minlength=steps.size)
        filled = sums[0] > 0
        pairs, square_lag, square = sums[:, filled]
        return Increments(np.sqrt(square_lag / pairs), square / pairs, pairs)


Sampling = EvenSampling | UnevenSampling


def profile_sampling(x: Array, z: Array) -> Sampling:
    """Choose how the increments of a profile are gathered."""
    n = x.size
    spacing = (x[-1] - x[0]) / (n - 1)
    if np.abs(x - x[0] - spacing * np.arange(n)).max() < _EVEN * spacing:
        return line_sampling(z[None, :], spacing)
    steps = np.diff(x)
    shortest = steps.min()
    counts = np.round(steps / shortest)
    # An even profile with points left out keeps its grid, with gaps
    if np.abs(steps / shortest - counts).max() < _EVEN / 2 and counts.sum() < 4 * n:
        grid = np.full(int(counts.sum()) + 1, np.nan)
        grid[np.concatenate([[0], np.cumsum(counts).astype(int)])] = z
        return line_sampling(grid[None, :], steps.sum() / counts.sum())
    return UnevenSampling(x, z)


def line_sampling(lines: Array, spacing: float) -> EvenSampling:
    """Gather increments along the last axis of evenly spaced lines; NaN is missing.

    Parameters
    ----------
    lines : ndarray, shape (n_lines, n)
        Residual heights. [um]
    spacing : float
        Step along a line. [um]
    """
    n_lines, n = lines.shape
    top = max(n // 3, min(n - 1, 6))
    size = fft.next_fast_len(n + top + 1, real=True)
    products = np.zeros(top + 1)
    squares = np.zeros(top + 1)
    pairs = np.zeros(top + 1)
    # Blocks of lines bound the memory of a large map
    block = max(1, 4_000_000 // size)
    for start in range(0, n_lines, block):
        part = lines[start : start + block]
        known = np.isfinite(part)
        complete = bool(known.all())
        z = part if complete else np.where(known, part, 0.0)
        spectrum = fft.rfft(z, size, axis=1)
        products += _summed_correlation(spectrum, spectrum, size)[: top + 1]
        if complete:
            total = np.sum(z**2, axis=0)
            rising = np.concatenate([[0.0], np.cumsum(total)])
            steps = np.arange(top + 1)
            squares += rising[n - steps] + (rising[-1] - rising[steps])
            pairs += part.shape[0] * (n - steps)
        else:
            mask = fft.rfft(known.astype(float), size, axis=1)
            power = fft.rfft(z**2, size, axis=1)
            squares += _summed_correlation(mask, power, size)[: top + 1]
            squares += _summed_correlation(power, mask, size)[: top + 1]
            pairs += np.round(_summed_correlation(mask, mask, size)[: top + 1])
    with np.errstate(invalid="ignore", divide="ignore"):
        mean_square = np.where(
            pairs > 0, np.maximum(squares - 2 * products, 0) / pairs, np.nan
        )
    return EvenSampling(
        spacing=float(spacing),
        length=float(n * spacing),
        n_points=int(pairs[0]),
        variance=float(products[0] / pairs[0]),
        mean_square=mean_square,
        pairs=pairs,
    )


def _summed_correlation(first: Array, second: Array, size: int) -> Array:
    """Sum over lines of the correlation of two sets of lines, by their transforms."""
    if first is second:
        power = np.einsum("ij,ij->j", first.real, first.real)
        power += np.einsum("ij,ij->j", first.imag, first.imag)
        return fft.irfft(power, size)
    return fft.irfft(np.einsum("ij,ij->j", first.conj(), second), size)

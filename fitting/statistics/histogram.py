"""Histograms of heights and slopes with the Gaussian beside them (the paper's Fig. 7)."""

from dataclasses import dataclass

import numpy as np

Array = np.ndarray


@dataclass(frozen=True)
class Histogram:
    """Density of a measured quantity and the Gaussian of its corrected rms.

    Parameters
    ----------
    edges : ndarray, shape (n + 1,)
        Bin edges, in the quantity's unit.
    density : ndarray, shape (n,)
        Of the measured values; its integral is 1.
    rms : float
        Of the Gaussian: noise, rounding and form removal corrected.
    lag : float
        Distance over which slopes were taken; 0 for heights. [um]
    quantity, units : str
        For axis labels.
    """

    edges: Array
    density: Array
    rms: float
    lag: float
    quantity: str
    units: str

    @property
    def centres(self) -> Array:
        """Middles of the bins."""
        return (self.edges[1:] + self.edges[:-1]) / 2

    def gaussian(self, at: Array | None = None) -> Array:
        """Density of the Gaussian at the bin centres, or where asked."""
        x = self.centres if at is None else np.asarray(at)
        rms = max(self.rms, 1e-12)
        return np.exp(-0.5 * (x / rms) ** 2) / (rms * np.sqrt(2 * np.pi))


def make_histogram(
    values: Array,
    rms: float,
    *,
    lag: float,
    quantity: str,
    units: str,
    lattice: float = 0.0,
) -> Histogram:
    """Bin centred values; bins hold whole steps of a lattice the values may lie on."""
    known = values[np.isfinite(values)].ravel()
    known = known - known.mean()
    # A direction in which nothing varies still has a histogram, of one bar
    reach = max(float(np.abs(known).max()), 1e-12)
    n = int(np.clip(2 * known.size ** (1 / 3), 15, 121)) | 1
    width = 2 * reach / n
    if lattice > 0:
        # A bin that holds now two levels, now three, draws a comb that is not there
        width = lattice * max(1.0, np.ceil(width / lattice))
        n = 2 * int(np.ceil(reach / width)) + 1
    edges = (np.arange(n + 1) - n / 2) * width
    density = np.histogram(known, edges)[0] / (known.size * width)
    return Histogram(edges, density, rms, lag, quantity, units)

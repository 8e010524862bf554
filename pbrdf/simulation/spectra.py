"""Room for the light of many wavelengths: `pbrdf.kernels.paths.spectra` from Python."""

from dataclasses import dataclass, replace

import numpy as np

from pbrdf.kernels.bins.bin_fits import MAX_ORDER, choose_orders, cosine_ranges
from pbrdf.kernels.optics.fresnel_table import FresnelTable, build_table
from pbrdf.kernels.paths import spectra as kernel
from pbrdf.kernels.paths.path_buffer import N_STATES
from pbrdf.kernels.paths.shading import N_RECORD

# From this many wavelengths on, sums by bin cost less than every path shaded for each
WORTHWHILE = 4
# Rows of the buffer of paths with several bounces, 10 MB: for half a million rays or so
BUFFER = 2**18


def chebyshev_points() -> tuple[np.ndarray, np.ndarray]:
    """Chebyshev points of each order, and the matrices from values there to powers."""
    largest = MAX_ORDER
    points = np.zeros((largest + 1, largest))
    powers = np.zeros((largest + 1, largest, largest))
    for order in range(1, largest + 1):
        x = np.cos((np.arange(order) + 0.5) * np.pi / order)
        points[order, :order] = x
        powers[order, :order, :order] = np.linalg.inv(np.vander(x, increasing=True))
    return points, powers


POINTS, POWERS = chebyshev_points()


@dataclass(frozen=True, kw_only=True)
class Spectrum:
    """What the samples of a run share: the table of elements and the bins by angle.

    Attributes
    ----------
    table : FresnelTable
        Elements of all wavelengths and materials.
    bins : tuple of ndarray, shape (n_theta, n_dphi, N_BIN)
        For each incident direction, see `pbrdf.kernels.paths.spectra`.
    sizes : tuple of int
        Sums of each incident direction.
    """

    table: FresnelTable
    bins: tuple[np.ndarray, ...]
    sizes: tuple[int, ...]

    @classmethod
    def of(
        cls,
        n: np.ndarray,
        kappa: np.ndarray,
        theta_i: np.ndarray,
        shape: tuple[int, int],
        *,
        half_angle: float,
        n_sums: int,
    ) -> "Spectrum":
        """Tabulate materials (wavelengths, materials) and lay out bins of a shape."""
        table = build_table(n, kappa)
        bins, sizes = [], []
        factors = np.empty((4, MAX_ORDER))
        for theta in theta_i:
            ranges = np.empty((*shape, 2))
            cosine_ranges(theta, half_angle, ranges)
            orders = np.empty(shape, dtype=np.int64)
            choose_orders(ranges, table, POINTS, POWERS, factors, orders)
            ends = n_sums * np.cumsum(orders).reshape(shape)
            layout = np.empty((*shape, kernel.N_BIN))
            layout[..., kernel.BIN_START] = ends - n_sums * orders
            layout[..., kernel.BIN_ORDER] = orders
            layout[..., kernel.BIN_MID] = ranges[..., 0]
            layout[..., kernel.BIN_SCALE] = 1.0 / ranges[..., 1]
            bins.append(layout)
            sizes.append(int(ends[-1, -1]))
        return cls(table=table, bins=tuple(bins), sizes=tuple(sizes))

    def part(self, first: int, last: int) -> "Spectrum":
        """Return what some of the directions share."""
        return replace(self, bins=self.bins[first:last], sizes=self.sizes[first:last])

    def of_waves(self, first: int, last: int) -> "Spectrum":
        """Return what some of the wavelengths share: the bins of all."""
        table = FresnelTable(*(part[first:last] for part in self.table))
        return replace(self, table=table)

    def room(self, index: int, max_bounces: int) -> kernel.Spectra:
        """Empty sums and buffer for incident direction `index` of samples."""
        return kernel.Spectra(
            self.bins[index],
            np.zeros((self.table.n.shape[1], self.sizes[index])),
            np.empty((max(BUFFER, max_bounces + 2), 1, N_RECORD)),
            np.zeros(N_STATES, dtype=np.int64),
            self.table, POINTS, POWERS, np.empty((4, MAX_ORDER)),
        )  # fmt: skip

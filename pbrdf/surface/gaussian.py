"""Random Gaussian surfaces: the paper's section 4.1 and equation (19)."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.fft

from pbrdf.errors import require
from pbrdf.memory import check_surface
from pbrdf.surface.drawing import default_shape, generator, grid_shape
from pbrdf.surface.heightmap import HeightMap

# Amplitude, as a share of the largest, below which a wave is left out
STOPPED = 1e-7
# Cells a correlation length where no spacing is given
CELLS = 8
# Rows transformed together: they stay in the cache
ROWS = 32


@dataclass(frozen=True, kw_only=True)
class GaussianSurface:
    """Periodic Gaussian random surface with autocorrelation exp(-x²/lx² - y²/ly²).

    Parameters
    ----------
    shape : (int, int), optional
        Number of grid nodes (nx, ny); the periods are shape times spacing. By default
        powers of two, at least 256, with periods of 16 correlation lengths or more.
    spacing : float or (float, float), optional
        Grid steps dx, dy. [um] By default an eighth of the correlation length of each axis.
        `studies/surface_resolution` measures what either costs in accuracy, and
        `studies/variance_reduction/plan.py` in time.
    corr_length : float or (float, float)
        Where the autocorrelation falls to 1/e, one value or (lx, ly). [um]
    slope_rms : float, optional
        Rms slope per axis of the mesh facets, exact in the ensemble. With lx ≠ ly it is the
        root mean square of the two axes, so that the rms gradient stays √2 slope_rms;
        `facet_slope_rms` gives each. [1]
    height_rms : float, optional
        Rms height, exact in the ensemble. Give this or slope_rms. [um]

    Raises
    ------
    ValueError
        If both or neither of slope_rms and height_rms are given, a value is not positive,
        or the grid cannot hold the correlation length.

    Notes
    -----
    White noise is filtered with the square root of the discrete spectrum of the periodic
    autocorrelation, so amplitudes as well as phases are random and heights are jointly
    Gaussian on the grid. Equation (19), slope = √2 height / length, holds for the
    continuous surface; facets average over one cell, which lowers the slope by
    1 - 1/(4 m²) for m cells a correlation length. The forward differences of the grid are
    what `slope_rms` fixes.

    Examples
    --------
    >>> surface = GaussianSurface(
    ...     shape=(256, 256), spacing=1.0, corr_length=16, slope_rms=0.3
    ... )
    >>> surface.sample(seed=1)
    HeightMap(256 x 256 nodes, spacing=(1.0, 1.0) um, periodic)
    >>> round(surface.ensemble_height_rms, 3)
    3.397
    """

    shape: tuple[int, int] = None  # type: ignore[assignment]  # filled in below
    spacing: float | tuple[float, float] = None  # type: ignore[assignment]
    corr_length: float | tuple[float, float]
    slope_rms: float | None = None
    height_rms: float | None = None

    def __post_init__(self) -> None:
        if (self.slope_rms is None) == (self.height_rms is None):
            msg = (
                "slope_rms and height_rms: give exactly one, got "
                f"{self.slope_rms} and {self.height_rms}. "
                "The other follows from corr_length."
            )
            raise ValueError(msg)
        for name in ("spacing", "corr_length", "slope_rms", "height_rms"):
            value = getattr(self, name)
            if value is not None:
                checked = require(
                    name,
                    value,
                    lambda v: (v > 0) & np.isfinite(v),
                    "be positive",
                    "Lengths are micrometres, slopes are tangents.",
                )
                # Plain numbers, whatever NumPy type they came in: they go into files
                plain = checked.tolist()
                object.__setattr__(self, name, plain if checked.ndim == 0 else tuple(plain))
        if self.spacing is None:
            steps = (self._lengths / CELLS).tolist()
            spacing = steps[0] if np.ndim(self.corr_length) == 0 else tuple(steps)
            object.__setattr__(self, "spacing", spacing)
        if self.shape is None:
            object.__setattr__(self, "shape", default_shape(self._lengths / self._steps))
        object.__setattr__(self, "shape", grid_shape(self.shape))
        periods = np.asarray(self.shape) * self._steps
        if (periods < 4 * self._lengths).any():
            msg = (
                f"shape times spacing must be at least 4 corr_length [um], got periods "
                f"{periods.tolist()} for corr_length {self._lengths.tolist()}. "
                "Take more nodes or a coarser spacing."
            )
            raise ValueError(msg)

    @property
    def _steps(self) -> np.ndarray:
        return np.broadcast_to(np.asarray(self.spacing, dtype=np.float64), (2,))

    @property
    def _lengths(self) -> np.ndarray:
        return np.broadcast_to(np.asarray(self.corr_length, dtype=np.float64), (2,))

    @property
    def isotropic(self) -> bool:
        """True if both correlation lengths are the same."""
        lx, ly = self._lengths
        return bool(lx == ly)

    def correlation(self, axis: int) -> np.ndarray:
        """Autocorrelation along one axis at the lags of the grid, made periodic."""
        n, step, length = self.shape[axis], self._steps[axis], self._lengths[axis]
        lags = np.arange(n) * step
        images = np.arange(-2, 3)[:, None] * n * step
        periodic: np.ndarray = np.exp(-(((lags + images) / length) ** 2)).sum(axis=0)
        return periodic / periodic[0]

    @cached_property
    def facet_slope_rms(self) -> tuple[float, float]:
        """Ensemble rms of the facet slopes along x and y. [1]"""
        return (
            float(self.ensemble_height_rms * self._slope_per_height(0)),
            float(self.ensemble_height_rms * self._slope_per_height(1)),
        )

    def _slope_per_height(self, axis: int) -> float:
        """Rms forward difference at unit rms height, from 2 (C(0) - C(1)) / step²."""
        n, step, length = self.shape[axis], self._steps[axis], self._lengths[axis]
        # The images of the periodic autocorrelation matter below 6 correlation lengths only
        periodic = self.correlation(axis)
        drop = 1.0 - periodic[1]
        if n * step > 12 * length:
            drop = -np.expm1(-((step / length) ** 2))
        return float(np.sqrt(2.0 * drop) / step)

    def decorrelation(self, axis: int, lag: np.ndarray) -> np.ndarray:
        """1 minus the autocorrelation at distances along an axis [um]. [1]"""
        # Exact where the difference from 1 is small; images of the period left out
        fallen: np.ndarray = -np.expm1(-((np.asarray(lag) / self._lengths[axis]) ** 2))
        return fallen

    @cached_property
    def ensemble_height_rms(self) -> float:
        """Ensemble rms height. [um]"""
        if self.height_rms is not None:
            return float(self.height_rms)
        slopes = self._slope_per_height(0), self._slope_per_height(1)
        wanted = 0.0 if self.slope_rms is None else self.slope_rms
        return float(wanted / np.sqrt(np.mean(np.square(slopes))))

    @cached_property
    def _filter(self) -> np.ndarray:
        """Square root of the discrete spectrum, for a half-complex transform.

        Its columns end where no wave along y passes any more, at a power of 1e-14.
        """
        check_surface(self)
        along_x = scipy.fft.fft(self.correlation(0)).real
        along_y = scipy.fft.rfft(self.correlation(1)).real
        amplitude_x = np.sqrt(np.maximum(along_x, 0.0))
        amplitude_y = np.sqrt(np.maximum(along_y, 0.0))
        passed = np.flatnonzero(amplitude_y > STOPPED * amplitude_y.max())[-1] + 1
        return self.ensemble_height_rms * amplitude_x[:, None] * amplitude_y[:passed]

    def sample(self, seed: int | np.random.SeedSequence | None = None) -> HeightMap:
        """Draw one realisation; the same seed gives the same heights bit for bit."""
        rng = generator(seed)
        nx, ny = self.shape
        passed = self._filter.shape[1]
        # Waves along y that the filter stops need no transform along x
        waves = np.empty((nx, passed), dtype=complex)
        blocks = [slice(first, min(first + ROWS, nx)) for first in range(0, nx, ROWS)]
        for rows in blocks:
            noise = rng.standard_normal((rows.stop - rows.start, ny))
            waves[rows] = scipy.fft.rfft(noise)[:, :passed]
        spectrum = scipy.fft.fft(waves, axis=0, overwrite_x=True)
        spectrum *= self._filter
        waves = scipy.fft.ifft(spectrum, axis=0, overwrite_x=True)
        heights = np.empty(self.shape)
        for rows in blocks:
            heights[rows] = scipy.fft.irfft(waves[rows], n=ny)
        heights.setflags(write=False)
        dx, dy = self._steps
        return HeightMap(heights, (float(dx), float(dy)), periodic=True)

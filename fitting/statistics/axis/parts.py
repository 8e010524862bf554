"""Parts of a result: one axis, its autocorrelation, the uncorrected values."""

from dataclasses import dataclass, field

import numpy as np

from fitting.estimate import Estimate
from fitting.statistics.axis.fit import AxisFit

Array = np.ndarray


@dataclass(frozen=True, kw_only=True)
class Autocorrelation:
    """Form of the autocorrelation of the true heights.

    Parameters
    ----------
    form : str
        ``gaussian``, ``periodic``, ``matern``, ``two-scale``, or ``multi-scale`` where none
        of them fits.
    description : str
        The same in words.
    parameters : dict
        Of the form: ``period``, ``coherence_length`` [um] (periodic), ``smoothness``
        (Matérn; 0.5 is exponential), or ``long_length``,
        ``short_length`` [um] and ``short_share`` of the variance (two-scale) or
        ``short_slope_share`` of the slope variance (multi-scale).
    lag, measured, fitted : ndarray
        Autocorrelation against lag [um], noise and rounding taken off; 1 at lag 0.
    """

    form: str
    description: str
    parameters: dict[str, float]
    lag: Array
    measured: Array
    fitted: Array

    @property
    def is_gaussian(self) -> bool:
        """Whether exp(-r²/l²) is compatible with the data."""
        return self.form == "gaussian"


@dataclass(frozen=True, kw_only=True)
class AxisStatistics:
    """Statistics along one axis of a map, or along the profile.

    Parameters
    ----------
    axis : str
        ``x`` or ``y``.
    corr_length, slope_rms, curvature_rms : Estimate
        [um], [1], [1/um]
    cutoff : float
        Shortest wavelength that the data resolve. [um]
    autocorrelation : Autocorrelation
        Its form along this axis.
    spacing, length : float
        Mean step and length along the axis. [um]
    plain_corr_length : float
        1/e lag of the uncorrected sample autocorrelation. [um]
    fit : AxisFit
        The fit behind the numbers.
    """

    axis: str
    corr_length: Estimate
    slope_rms: Estimate
    curvature_rms: Estimate
    cutoff: float
    autocorrelation: Autocorrelation
    spacing: float
    length: float
    plain_corr_length: float
    fit: AxisFit = field(repr=False)


@dataclass(frozen=True, kw_only=True)
class PlainStatistics:
    """What uncorrected formulas give on the same residual heights, for comparison.

    Parameters
    ----------
    height_rms, corr_length, slope_rms : float
        Root mean square, 1/e lag of the sample autocorrelation, root mean square of forward
        differences. [um], [um], [1]
    """

    height_rms: float
    corr_length: float
    slope_rms: float

"""A first look: surface statistics and the analytical fit, nothing simulated."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from fitting.models.cuts import plane_curves
from fitting.pipeline import GAINS, Clock, Progress, slope_knowledge
from fitting.readings.observations import Mask
from fitting.readings.wavelengths import one_wavelength
from fitting.result.fit_result import FitResult
from fitting.run import fit
from fitting.statistics.result import SurfaceStatistics
from fitting.statistics.surface import surface_statistics
from pbrdf import Material, MicrofacetModel

if TYPE_CHECKING:
    from data_io import Profile
    from pbrdf import HeightMap

__all__ = ["QuickResult", "run_quick"]

# Exit zeniths of the curve
_ZENITHS = np.deg2rad(np.arange(0.5, 90.0))


@dataclass(frozen=True, kw_only=True, eq=False)
class QuickResult:
    """What a surface and a scan say by the analytical model alone.

    Attributes
    ----------
    surface : Profile or HeightMap
        The measured surface.
    statistics : SurfaceStatistics
        Of it.
    measurement : Dataset
        The scan.
    analytic : FitResult
        The analytical curve brought to the scan at the measured slope.
    curves : Dataset, dims theta_i, theta_view
        The fitted curve in the plane of incidence.
    seconds : mapping of str to float
        Elapsed time by stage. [s]
    """

    surface: "Profile | HeightMap"
    statistics: SurfaceStatistics
    measurement: xr.Dataset
    analytic: FitResult
    curves: xr.Dataset
    seconds: Mapping[str, float]


def run_quick(  # noqa: PLR0913  (as run_pipeline)
    surface: "Profile | HeightMap",
    measurement: xr.Dataset,
    *,
    material: Material,
    free: Sequence[str] = GAINS,
    shadowing: str = "smith-correlated",
    form: str | int = "tilt",
    mask: Sequence[Mask] = (),
    accept: Sequence[str] = (),
    progress: Progress | None = None,
) -> QuickResult:
    """Measure the surface and fit the analytical curve.

    Light of several bounces is not in that curve: `run_pipeline` says how much it matters.

    Parameters
    ----------
    surface, measurement, material, free, shadowing, form, mask, accept, progress
        As of `fitting.run_pipeline`.

    Raises
    ------
    ValueError
        If the scan holds several wavelengths, or nothing that the fit can use.
    """
    index = Material(*material.index(one_wavelength(measurement)), name=material.name)
    clock = Clock(progress or (lambda *_: None))
    with clock.stage("surface statistics"):
        statistics = surface_statistics(surface, form=form)
    free, priors = slope_knowledge(statistics, free)
    start = MicrofacetModel(
        index, slope_rms=statistics.slope_rms.value, shadowing=shadowing
    )
    with clock.stage("analytical fit"):
        analytic = fit(
            measurement, start, free=free, priors=priors, mask=mask, accept=accept
        )
    model = analytic.model
    assert isinstance(model, MicrofacetModel)
    curves = plane_curves(np.unique(measurement.theta_i.values), _ZENITHS, analytic=model)
    return QuickResult(
        surface=surface,
        statistics=statistics,
        measurement=measurement,
        analytic=analytic,
        curves=curves,
        seconds=clock.seconds,
    )

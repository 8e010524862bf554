"""A first look: surface statistics and the analytical fit, nothing simulated."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from fitting.models.cuts import plane_curves
from fitting.readings.observations import Mask
from fitting.readings.wavelengths import one_wavelength
from fitting.result.fit_result import FitResult
from fitting.run import fit
from fitting.statistics.mended import mended_once
from fitting.statistics.result import SurfaceStatistics
from fitting.statistics.surface import surface_statistics
from pbrdf import Material, MicrofacetModel

if TYPE_CHECKING:
    from data_io import Profile
    from pbrdf import HeightMap

__all__ = ["GAINS", "Clock", "Progress", "QuickResult", "first_look", "run_quick"]

GAINS = ("specular_gain", "diffuse_albedo")
# Exit zeniths of the curve
_ZENITHS = np.deg2rad(np.arange(0.5, 90.0))

Progress = Callable[[str, int, int], None]


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
    clock = Clock(progress or (lambda *_: None))
    look = first_look(
        surface, measurement, partial(fit, mask=mask, accept=accept), clock,
        material=material, free=free, shadowing=shadowing, form=form,
    )  # fmt: skip
    model = look.analytic.model
    assert isinstance(model, MicrofacetModel)
    curves = plane_curves(np.unique(measurement.theta_i.values), _ZENITHS, analytic=model)
    return QuickResult(
        surface=surface,
        statistics=look.statistics,
        measurement=measurement,
        analytic=look.analytic,
        curves=curves,
        seconds=clock.seconds,
    )


@dataclass(frozen=True, eq=False)
class _FirstLook:
    """Statistics of the surface, what to fit given what they know, and the first fit."""

    surface: "Profile | HeightMap"
    statistics: SurfaceStatistics
    free: tuple[str, ...]
    priors: dict[str, tuple[float, float]]
    analytic: FitResult


def first_look(
    surface: "Profile | HeightMap",
    measurement: xr.Dataset,
    bring: Callable[..., FitResult],
    clock: "Clock",
    *,
    material: Material,
    free: Sequence[str],
    shadowing: str,
    form: str | int,
) -> _FirstLook:
    """Measure the surface and `bring` the analytical curve to the scan."""
    index = Material(*material.index(one_wavelength(measurement)), name=material.name)
    with clock.stage("surface statistics"):
        mended = mended_once(surface)
        statistics = surface_statistics(mended, form=form)
    wanted, priors = _slope_knowledge(statistics, free)
    start = MicrofacetModel(
        index, slope_rms=statistics.slope_rms.value, shadowing=shadowing
    )
    with clock.stage("analytical fit"):
        analytic = bring(measurement, start, free=wanted, priors=priors)
    return _FirstLook(mended, statistics, wanted, priors, analytic)


def _slope_knowledge(
    statistics: SurfaceStatistics, free: Sequence[str]
) -> tuple[tuple[str, ...], dict[str, tuple[float, float]]]:
    """Return what to fit and what the surface tells of the slope.

    A slope that the surface does not determine is fitted to the scan instead.
    """
    slope = statistics.slope_rms
    if np.isfinite(slope.stderr):
        return tuple(free), {"slope_rms": (slope.value, slope.stderr)}
    return tuple(dict.fromkeys((*free, "slope_rms"))), {}


@dataclass
class Clock:
    """Elapsed time by stage. [s]"""

    report: Progress
    seconds: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time the block under this name."""
        self.report(name, 0, 1)
        begin = perf_counter()
        yield
        self.seconds[name] = perf_counter() - begin
        self.report(name, 1, 1)

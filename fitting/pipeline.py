"""The whole way: a measured surface and a goniometer scan become a reflectance model.

The surface gives the slope; the slope gives the analytical curve and the random surfaces of
the Monte Carlo; the scan gives the gains of both curves. The uncertainty of the measured
slope goes into every fitted number.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from fitting.checks.unread import what_hangs_together, what_is_not_read
from fitting.models.cuts import plane_curves
from fitting.models.simulated import SimulatedModel
from fitting.prediction.beside_gaussian import MeasuredSlopes, measured_slopes
from fitting.prediction.beside_waves import WaveFit, wave_fit
from fitting.quick import GAINS, Clock, Progress, QuickResult, first_look
from fitting.readings.observations import Mask
from fitting.readings.wavelengths import one_wavelength
from fitting.result.fit_result import FitResult
from fitting.run import fit
from fitting.statistics.result import SurfaceStatistics
from pbrdf import GaussianSurface, HeightMap, Material, MicrofacetModel, Scene
from pbrdf.errors import check_seed
from pbrdf.validity import judge, roughness_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from data_io import Profile

__all__ = ["PipelineResult", "random_surface", "run_pipeline"]

# Cells a correlation length: facets then lie within 0.2 % of the surface they stand for
CELLS = 12
NODES = 256
# What a simulation adds to the analytical curve holds for slopes so near to its own
FAR = 0.1
# Rays over the map itself, beside those over all realisations
_SHARE = 8


@dataclass(frozen=True, kw_only=True, eq=False)
class PipelineResult(QuickResult):
    """What a surface and a scan say together: `curves` are both fitted ones.

    Attributes
    ----------
    surface, statistics, measurement, analytic, curves, seconds
        As of `fitting.quick.QuickResult`.
    monte_carlo : FitResult
        The simulated curve, all bounces, brought to the scan at the measured slope.
    scan_slope : FitResult or None
        The simulated curve with the slope free too: what the scan alone asks for. None
        where the slope is among the free parameters anyway.
    simulation : Dataset
        The Monte Carlo, for unit gain.
    unknown : tuple of str
        What these data cannot tell, in words.
    measured_slopes : MeasuredSlopes or None
        Of a map: its own slope distribution beside the Gaussian, and the Monte Carlo over
        the map itself.
    waves : WaveFit or None
        The same heights by wave optics, where they matter at the wavelength of the scan.
    """

    monte_carlo: FitResult
    scan_slope: FitResult | None
    simulation: xr.Dataset
    unknown: tuple[str, ...]
    measured_slopes: MeasuredSlopes | None = None
    waves: WaveFit | None = None

    @property
    def model(self) -> MicrofacetModel:
        """The fitted analytical model."""
        model: MicrofacetModel = self.analytic.model
        return model

    def plot(self) -> "Figure":
        """Draw the scan beside both fitted curves."""
        from data_io import in_plane
        from fitting.report.fit_files import calibrated
        from pbrdf.plots import scan_figure

        fit = self.monte_carlo
        scan = calibrated(fit, next(iter(fit.models)), float("nan"), self.measurement)
        return scan_figure(in_plane(scan), self.curves)


def run_pipeline(  # noqa: PLR0913  (what one may want to choose on the whole way)
    surface: "Profile | HeightMap",
    measurement: xr.Dataset,
    *,
    material: Material,
    free: Sequence[str] = GAINS,
    shadowing: str = "smith-correlated",
    form: str | int = "tilt",
    mask: Sequence[Mask] = (),
    n_rays: int = 200_000,
    realizations: int = 32,
    seed: int = 0,
    workers: int | None = None,
    accept: Sequence[str] = (),
    progress: Progress | None = None,
) -> PipelineResult:
    """Measure the surface, fit the analytical curve, simulate, fit the simulated curve.

    Parameters
    ----------
    surface : Profile or HeightMap
        The measured surface; its roughness is taken as isotropic. Faults of one that comes
        as it was measured are mended first, with a warning (`data_io.mend_map`).
    measurement : Dataset
        Goniometer scan in the project's conventions, dimension `geometry`, one wavelength.
    material : Material
        Index of the surface; the start where n or kappa is free.
    free : sequence of str
        Parameters to fit, see `fitting.fit`.
    shadowing : str
        Of the analytical model.
    form : str or int
        Form to remove from the surface, see `fitting.surface_statistics`.
    mask : sequence of callable
        Readings to leave out, see `fitting.readings.masks`.
    n_rays, realizations, seed, workers
        Of the Monte Carlo, see `pbrdf.simulate`.
    accept : sequence of str
        Errors of physics in the scan to go on in spite of, see `fitting.fit`.
    progress : callable, optional
        Called with (stage, steps done, steps in all).

    Returns
    -------
    PipelineResult

    Raises
    ------
    ValueError
        If the scan holds several wavelengths, or nothing that the fit can use.
    """
    check_seed(seed)
    clock = Clock(progress or (lambda *_: None))
    bring = partial(fit, mask=mask, accept=accept)
    look = first_look(
        surface, measurement, bring, clock,
        material=material, free=free, shadowing=shadowing, form=form,
    )  # fmt: skip
    statistics, free, priors = look.statistics, look.free, look.priors
    analytic = look.analytic

    simulated = partial(
        _simulated, statistics, measurement, free,
        n_rays=n_rays, realizations=realizations, seed=seed, workers=workers,
        progress=lambda done, total: clock.report("Monte Carlo", done, total),
    )  # fmt: skip
    with clock.stage("Monte Carlo"):
        curve = simulated(analytic.model)
        simulation = curve.simulation(np.unique(measurement.theta_i.values))
    with clock.stage("Monte Carlo fit"):
        monte_carlo = bring(measurement, curve, free=free, priors=priors)
    scan_slope = None
    if "slope_rms" not in free:
        with clock.stage("slope of the scan"):
            wanted = partial(bring, measurement, free=(*free, "slope_rms"))
            scan_slope = _with_slope(wanted, curve, simulated, statistics)

    with clock.stage("slopes as measured"):
        own = _own_slopes(
            look.surface, analytic, simulation, statistics.slope_rms.value,
            n_rays=n_rays * max(realizations // _SHARE, 1), seed=seed, workers=workers,
        )  # fmt: skip
    with clock.stage("waves"):
        waves = wave_fit(statistics, measurement, bring, material=material, free=free)

    return PipelineResult(
        surface=surface,
        statistics=statistics,
        measurement=measurement,
        analytic=analytic,
        monte_carlo=monte_carlo,
        scan_slope=scan_slope,
        simulation=simulation,
        curves=plane_curves(
            simulation.theta_i.values,
            simulation.theta_s.values,
            analytic=analytic.model,
            monte_carlo=monte_carlo.model,
            waves=None if waves is None else waves.model,
            wavelength=None if waves is None else waves.wavelength,
        ),
        unknown=(
            *what_is_not_read(measurement, statistics),
            *_beyond_optics(measurement, statistics, waves),
            *what_hangs_together(monte_carlo),
            *analytic.warnings,
        ),
        measured_slopes=own,
        waves=waves,
        seconds=clock.seconds,
    )


def _with_slope(
    bring: Callable[..., FitResult],
    curve: SimulatedModel,
    simulated: Callable[..., SimulatedModel],
    statistics: SurfaceStatistics,
) -> FitResult:
    """Fit the slope too, and simulate again where it lies far from that of the surface."""
    found = bring(curve)
    if abs(found.values["slope_rms"] / statistics.slope_rms.value - 1.0) > FAR:
        found = bring(simulated(found.model.model))
    return found


def _own_slopes(
    surface: "Profile | HeightMap",
    fitted: FitResult,
    ensemble: xr.Dataset,
    slope_rms: float,
    **tracing: Any,
) -> MeasuredSlopes | None:
    """Compare the slopes of a map with a Gaussian's; a profile has none across it."""
    if not isinstance(surface, HeightMap):
        return None
    return measured_slopes(surface, fitted, ensemble, slope_rms=slope_rms, **tracing)


def random_surface(statistics: SurfaceStatistics, slope_rms: float) -> GaussianSurface:
    """Return the Gaussian surface of the measured correlation length and a slope."""
    corr_length = statistics.corr_length.value
    return GaussianSurface(
        shape=(NODES, NODES),
        spacing=corr_length / CELLS,
        corr_length=corr_length,
        slope_rms=slope_rms,
    )


def hemisphere_bins(slope_rms: float) -> tuple[int, int]:
    """Return (n_theta, n_dphi) that resolve the specular lobe of a slope rms.

    The lobe's standard deviation is about 2 slope_rms in exit angle; five bins in it keep
    the bin average within 0.2 % of the value at the bin's centre.

    Examples
    --------
    >>> hemisphere_bins(0.25)
    (45, 90)
    """
    n_theta = int(np.clip(np.ceil((np.pi / 2) / (0.4 * slope_rms)), 45, 180))
    return n_theta, 2 * n_theta


def _simulated(
    statistics: SurfaceStatistics,
    measurement: xr.Dataset,
    free: Sequence[str],
    model: MicrofacetModel,
    **options: Any,
) -> SimulatedModel:
    """Return the simulated surface with the slope and the values of a model."""
    slope = float(np.sqrt(np.mean(np.square(model.slope_rms))))
    n_theta, n_dphi = hemisphere_bins(slope)
    circular = any("3" in str(name)[1:3] for name in measurement.data_vars)
    n, kappa = model.material.index()
    held = ((n, n), (kappa, kappa))
    return SimulatedModel(
        Scene(random_surface(statistics, slope), model.material),
        model,
        index_range=None if {"n", "kappa"} & set(free) else held,
        n_theta=n_theta,
        n_dphi=n_dphi,
        stokes="full" if circular else "linear",
        **options,
    )


def _beyond_optics(
    measurement: xr.Dataset, statistics: SurfaceStatistics, waves: WaveFit | None
) -> tuple[str, ...]:
    """Name where geometric optics fails on this surface, and what stands in for it."""
    wavelength = one_wavelength(measurement)
    if wavelength is None:
        return ()
    rough = roughness_of(random_surface(statistics, statistics.slope_rms.value))
    notes = judge(rough, np.unique(measurement.theta_i.values), wavelength).notes
    return notes if waves is None else (*notes, waves.text)

"""Ways to find the light of a case: this engine twice, and two plain programs."""

import importlib.util
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from pbrdf import GaussianSurface, HeightMap, observe, simulate
from pbrdf.bench.scenes import N_DPHI, N_THETA, Case
from pbrdf.bench.yardstick import simulate_plainly
from pbrdf.conventions import detector_bins
from pbrdf.errors import AccuracyWarning

# Points a side of a bin for the mean of the model; odd, as bins are centred on azimuth 0
FINER = 15


@dataclass(frozen=True, kw_only=True)
class Size:
    """How long a run is.

    Attributes
    ----------
    side, n_rays, realizations : int
        Nodes a side, rays a realisation, and realisations: batches of rays over a map.
    seed : int
        Every way draws the same surfaces from it.
    workers : int or None
        Threads of the engine.
    """

    side: int
    n_rays: int
    realizations: int
    seed: int
    workers: int | None = 1


@dataclass(frozen=True)
class Found:
    """Light of unit flux by a run, and what it took.

    Attributes
    ----------
    value, error : ndarray, shape (wavelengths, bins)
        M00 of all bounces, and its standard error; NaN where a program states none. [1/sr]
    seconds, core_seconds : float
        Wall time, and processor time of all threads. [s]
    """

    value: np.ndarray
    error: np.ndarray
    seconds: float
    core_seconds: float


Way = Callable[[Case, Size], Found]


def _timed(run: Callable[[], tuple[np.ndarray, np.ndarray]]) -> Found:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AccuracyWarning)
        wall, core = time.perf_counter(), time.process_time()
        value, error = run()
        return Found(value, error, time.perf_counter() - wall, time.process_time() - core)


def engine(case: Case, size: Size, **how: Any) -> Found:
    """Run `simulate`, or `observe` where the case has readings."""
    scene = case.scene(size.side)
    # A map is traced in batches within one call; realisations draw new surfaces
    rays = {"n_rays": size.n_rays, "realizations": size.realizations}
    if isinstance(scene.surface, HeightMap):
        rays = {"n_rays": size.n_rays * size.realizations}
    common: dict[str, Any] = {
        "seed": size.seed, "workers": size.workers, "stokes": "unpolarized",
    } | rays | case.options | how  # fmt: skip

    def run() -> tuple[np.ndarray, np.ndarray]:
        if case.readings is None:
            return _light(
                simulate(scene, case.theta_i, n_theta=N_THETA, n_dphi=N_DPHI, **common)
            )
        theta_s, dphi = case.readings
        return _light(
            observe(scene, np.full(theta_s.shape, case.theta_i), theta_s, dphi, **common)
        )

    return _timed(run)


def _light(result: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    bins = {"theta_i": 0} if "theta_i" in result.brdf_total.dims else {}
    n_waves = result.sizes.get("wavelength", 1)
    value, error = (
        one.isel(stokes_out=0, stokes_in=0, **bins).values.reshape(n_waves, -1)
        for one in (result.brdf_total, result.brdf_total_stderr)
    )
    return value, error


def reduced(case: Case, size: Size) -> Found:
    """Run the engine as users do."""
    return engine(case, size)


def plain(case: Case, size: Size) -> Found:
    """Run the engine without variance reduction."""
    return engine(case, size, variance_reduction=False)


def numpy_and_embreex(case: Case, size: Size) -> Found:
    """Run the plain program in NumPy and embreex over the same surfaces."""

    def light(heights: np.ndarray, seed: int) -> np.ndarray:
        assert case.index is not None
        rng = np.random.default_rng(seed)
        flux = simulate_plainly(
            heights, case.theta_i, case.index, size.n_rays, N_THETA, N_DPHI, rng
        )
        return flux[..., 0, 0].sum(axis=0)

    return _timed(lambda: _mean(case, size, light))


def mitsuba(case: Case, size: Size) -> Found:
    """Run the loop over Mitsuba 3 over the same surfaces."""
    import drjit

    from pbrdf.bench import mitsuba_loop as loop

    drjit.set_thread_count(size.workers or 0)
    side = round(np.sqrt(size.n_rays))

    def light(heights: np.ndarray, seed: int) -> np.ndarray:
        assert case.index is not None
        flux, bins = loop.no_light((N_THETA, N_DPHI)), (N_THETA, N_DPHI)
        built = loop.build_scene(heights)
        loop.trace(
            built, heights, case.theta_i, 0.0, case.index.real, side, flux, bins, seed
        )
        shares = np.array(flux).reshape(3, *bins, 16)[..., 0].sum(axis=0)
        return np.asarray(shares / side**2)

    return _timed(lambda: _mean(case, size, light))


def _mean(
    case: Case, size: Size, light: Callable[[np.ndarray, int], np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Mean of a program's light over realisations, and its error. [1/sr]"""
    surface = case.scene(size.side).surface
    assert isinstance(surface, HeightMap | GaussianSurface)
    weight = detector_bins(N_THETA, N_DPHI)[2]
    streams = np.random.SeedSequence(size.seed).generate_state(size.realizations)
    samples = []
    for seed in map(int, streams):
        drawn = surface if isinstance(surface, HeightMap) else surface.sample(seed)
        samples.append(light(drawn.heights, seed))
    value = np.mean(samples, axis=0) / weight
    error = np.std(samples, axis=0, ddof=1) / np.sqrt(len(samples)) / weight
    return value.reshape(1, -1), error.reshape(1, -1)


def programs_for(case: Case) -> dict[str, Way]:
    """Find the ways that know a case, by name."""
    known: dict[str, Way] = {"reduced": reduced, "plain": plain}
    if case.index is not None:
        known["NumPy + embreex"] = numpy_and_embreex
        # The loop over Mitsuba knows glass alone
        if complex(case.index).imag == 0.0 and importlib.util.find_spec("mitsuba"):
            known["Mitsuba 3"] = mitsuba
    return known


def model_light(case: Case) -> np.ndarray | None:
    """M00 of the analytical model, averaged over the bins. [1/sr]"""
    if case.model is None:
        return None
    theta_s, dphi, weight = detector_bins(FINER * N_THETA, FINER * N_DPHI)
    light = weight * case.model.brdf(case.theta_i, theta_s[:, None], dphi)[..., 0, 0]
    value, area = (
        np.roll(one, FINER // 2, axis=1)
        .reshape(N_THETA, FINER, N_DPHI, FINER)
        .sum(axis=(1, 3))
        for one in (light, weight)
    )
    return np.asarray((value / area).reshape(1, -1))

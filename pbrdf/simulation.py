"""Monte Carlo prediction of the Mueller BRDF of a scene: section 3 of the paper."""

import os
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial

import numpy as np
import numpy.typing as npt
import xarray as xr

from pbrdf.errors import AccuracyWarning, require
from pbrdf.kernels.shading import base_strength
from pbrdf.results import to_dataset
from pbrdf.scene import Scene
from pbrdf.surface import GaussianSurface, HeightMap
from pbrdf.tracer.embree import EmbreeField
from pbrdf.tracer.field import Field
from pbrdf.tracer.plan import Moments, Plan, Tally
from pbrdf.tracer.skips import chosen_skips, explanation
from pbrdf.tracer.trace import prepare, trace_sample
from pbrdf.tracer.world import WetField, contaminant_materials, media_of
from pbrdf.validity import contamination_warnings, geometric_optics_warnings

STOKES_COUNT = {"full": 4, "linear": 3, "unpolarized": 1}
# A fixed surface has no realisations; its rays are dealt to this many independent batches
BATCHES = 32
# Below this many realisations the standard errors themselves are too uncertain
FEW_REALIZATIONS = 8
# Where paths are cut: on a clean surface, and where transparent bodies may catch light
MOST_BOUNCES, MOST_EVENTS = 64, 1024
# Half-angle of the widest source [rad]
WIDEST_SOURCE = 0.5
# Where a run towards a target error gives up
MAX_SAMPLES = 4096


def simulate(  # noqa: PLR0913  (the public signature)
    scene: Scene,
    theta_i: npt.ArrayLike,
    *,
    phi_i: float | str = 0.0,
    n_rays: int = 100_000,
    realizations: int = 1,
    seed: int | None = 0,
    max_bounces: int | None = None,
    target_rel_error: float | None = None,
    wavelength: npt.ArrayLike | None = None,
    n_theta: int = 45,
    n_dphi: int = 90,
    stokes: str = "full",
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
    skips: bool | Iterable[str] = True,
    explain: bool = False,
    source_half_angle: float = 0.0,
    fold: bool = False,
) -> xr.Dataset:
    """Trace light from the source to the hemisphere and bin it as Mueller BRDF.

    Parameters
    ----------
    scene : Scene
        Surface and substrate.
    theta_i : array_like, shape () or (angles,)
        Zenith angle of the source, in [0, π/2). [rad]
    phi_i : float or "uniform"
        Azimuth of the source [rad]; "uniform" averages over it, as suits an isotropic
        surface.
    n_rays : int
        Rays an incident direction and realisation.
    realizations : int
        Surfaces drawn from a GaussianSurface; a HeightMap is traced with this many times
        n_rays. With `target_rel_error` it is the least number.
    seed : int or None
        Makes the run reproducible bit for bit, for any number of workers; None draws one.
    max_bounces : int, optional
        Paths are cut after so many bounces, 64 on a clean surface and 1024 among
        contaminants, where light may be caught; what they still carry is `truncated`.
    target_rel_error : float, optional
        Add samples until the largest stderr / M00 over the bins above a tenth of the peak
        falls below this; the dataset says what was reached.
    wavelength : array_like, optional
        Vacuum wavelength, scalar or (wavelengths,); needed by tabulated materials. [um]
    n_theta, n_dphi : int
        Detector bins in zenith and azimuth; n_dphi is even.
    stokes : {"full", "linear", "unpolarized"}
        Stokes elements to compute: all, without V, or M00 alone.
    workers : int, optional
        Threads; all cores by default. Does not change the result.
    progress : callable, optional
        Called with (samples done, samples in all).
    skips : bool or names of `pbrdf.tracer.skips.SKIPS`
        What may be left out without changing the result; False sends every ray through
        Embree. The same rays are traced in any case.
    explain : bool
        Say in the attribute `explanation` what was left out and why.
    source_half_angle : float
        Half-angle of the source, a disc of uniform radiance about (theta_i, phi_i): its
        directions carry equal parts of the flux through the mean surface. dphi and the
        Stokes frame stay those of its axis, the frame carried along great circles. [rad]
    fold : bool
        Average every sample with its mirror image in the plane of incidence, which halves
        the variance. For surfaces that are their own mirror image in the mean only: an
        isotropic GaussianSurface on a square grid with phi_i="uniform".

    Returns
    -------
    xarray.Dataset
        `brdf` [sr^-1] and `brdf_stderr` (bounces, theta_i, [wavelength], theta_s, dphi,
        stokes_out, stokes_in), `brdf_total` for all bounces, `albedo`, the energy budget
        and `projected_solid_angle`; see `pbrdf.conventions.RESULT_VARIABLES`.

    Raises
    ------
    TypeError, ValueError
        If an argument is out of its range.

    Warns
    -----
    AccuracyWarning
        If realisations are too few for honest standard errors, or geometric optics fails at
        the wavelength.

    Notes
    -----
    A bin holds flux / (incident flux ∫cosθ dΩ). Standard errors come from independent
    surface realisations, or from 32 or more batches of rays where the surface is fixed.
    A bin that no ray reached has the error of one ray.

    Examples
    --------
    >>> from pbrdf import HeightMap, Material
    >>> scene = Scene(HeightMap.flat(size=(1.0, 1.0)), Material(1.5))
    >>> result = simulate(scene, 0.0, n_rays=320)
    >>> round(float(result.albedo.sel(bounces="1").item()), 6)
    0.04
    """
    fixed = not _varies(scene)
    rays = _count("n_rays", n_rays, BATCHES)
    drawn = _count("realizations", realizations, 1)
    batched = fixed or drawn == 1
    samples = max(BATCHES, drawn) if batched else drawn
    angles = _angles(theta_i)
    waves = _wavelengths(wavelength)
    n, kappa, base = _constants(scene, waves)
    media = None
    if scene.contaminants:
        covering = contaminant_materials(scene.contaminants)
        media = media_of(scene.materials, covering, waves)
    bounces = max_bounces
    if bounces is None:
        bounces = MOST_BOUNCES if media is None else MOST_EVENTS
    allowed = chosen_skips(skips)
    if (base.shape[1] > 0 or media is not None) and "walk" not in allowed:
        where = "over a diffuse base" if media is None else "among contaminants"
        msg = (
            f'skips must hold "walk" {where}, got {sorted(allowed)}. '
            "The Embree route traces clean opaque Fresnel surfaces only."
        )
        raise ValueError(msg)
    plan = Plan(
        theta_i=angles,
        phi_i=_azimuth(phi_i),
        n_rays=-(-rays * drawn // samples) if batched else rays,
        max_bounces=_count("max_bounces", bounces, 1),
        n=n,
        kappa=kappa,
        base=base,
        n_stokes=_stokes_count(stokes),
        n_theta=_count("n_theta", n_theta, 1),
        n_dphi=_even("n_dphi", n_dphi),
        skips=allowed,
        media=media,
        half_angle=_half_angle(source_half_angle, angles, clean=media is None),
        fold=_mirrored(fold, scene, phi_i),
    )
    target = None if target_rel_error is None else _target(target_rel_error)
    _check_scene(scene)
    notes = _warnings(scene, angles, waves, drawn)
    for note in notes:
        warnings.warn(note, AccuracyWarning, stacklevel=2)

    root = np.random.SeedSequence(seed)
    # Tallies to use again: to make a large one costs more than to clear it
    spare: deque[Tally] = deque()
    if batched:
        # The surface, or the one realisation asked for, stays the same in all batches
        first = root.spawn(1)[0] if _varies(scene) else root
        draw = partial(_trace_fixed, _realize(scene, plan, first), plan, spare)
    else:
        draw = partial(_trace_realization, scene, plan, spare)

    moments = Moments(plan)
    limit = samples if target is None else max(samples, MAX_SAMPLES)
    for tally in _in_order(draw, root, limit, _workers(workers)):
        moments.add(tally)
        spare.append(tally.emptied())
        if progress is not None:
            progress(moments.samples, samples if target is None else limit)
        enough = moments.samples >= max(samples, 2)
        if target is not None and enough and moments.rel_error() <= target:
            break
    for note in (late := _contamination_notes(moments, waves)):
        warnings.warn(note, AccuracyWarning, stacklevel=2)
    notes += late
    return to_dataset(
        moments,
        scene,
        wavelength=waves,
        attrs={
            "seed": int(root.entropy),  # type: ignore[arg-type]
            "n_rays": rays,
            "realizations": 1 if batched else moments.samples,
            "ray_batches": moments.samples if batched else 0,
            "stderr_excludes_surface": batched,
            "max_bounces": plan.max_bounces,
            "stokes": stokes,
            "phi_i": "uniform" if plan.phi_i is None else plan.phi_i,
            "source_half_angle": plan.half_angle,
            "folded": plan.fold,
            "target_rel_error": np.nan if target is None else target,
            "intersector": "height-field walk" if "walk" in allowed else "embree",
            "explanation": _explain(scene, plan) if explain else [],
            "contaminants": [str(dict(report)) for report in moments.reports],
            "warnings": notes,
        },
    )


def _contamination_notes(moments: Moments, waves: np.ndarray | None) -> list[str]:
    """Warnings of what lies on the surface, known after the first sample."""
    late = list(moments.notes)
    for wave in () if waves is None else np.atleast_1d(waves):
        late += contamination_warnings(moments.reports, float(wave))
    return late


def _varies(scene: Scene) -> bool:
    """Whether realisations of the scene differ."""
    drawn = any(getattr(one, "random", False) for one in scene.contaminants)
    return drawn or not isinstance(scene.surface, HeightMap)


def _realize(
    scene: Scene, plan: Plan, seed: np.random.SeedSequence
) -> Field | EmbreeField | WetField:
    """One realisation of the scene, ready for tracing."""
    surface = scene.surface
    if not isinstance(surface, HeightMap):
        surface = surface.sample(seed)
    target = prepare(surface, plan.skips)
    if plan.media is None:
        return target
    assert isinstance(target, Field)  # contaminants exclude the Embree route
    return WetField.of(target, surface, scene.contaminants, plan.media, seed)


def _taken(spare: deque[Tally]) -> Tally | None:
    try:
        return spare.pop()
    except IndexError:
        return None


def _trace_fixed(
    target: Field | EmbreeField | WetField,
    plan: Plan,
    spare: deque[Tally],
    seed: np.random.SeedSequence,
) -> Tally:
    return trace_sample(target, plan, seed, _taken(spare))


def _trace_realization(
    scene: Scene, plan: Plan, spare: deque[Tally], seed: np.random.SeedSequence
) -> Tally:
    heights, rays = seed.spawn(2)
    return trace_sample(_realize(scene, plan, heights), plan, rays, _taken(spare))


def _explain(scene: Scene, plan: Plan) -> list[str]:
    surface = scene.surface
    sample = surface if isinstance(surface, HeightMap) else surface.sample(0)
    steepest = float(Field.of(sample).terrain.steepest)
    return explanation(plan, periodic=sample.periodic, steepest=steepest)


def _in_order(
    draw: Callable[[np.random.SeedSequence], Tally],
    root: np.random.SeedSequence,
    samples: int,
    workers: int,
) -> Iterator[Tally]:
    """Tallies of the samples in their order, computed a few ahead by threads."""
    with ThreadPoolExecutor(workers) as pool:
        pending: deque[Future[Tally]] = deque()
        submitted = 0
        try:
            while submitted < samples or pending:
                while submitted < samples and len(pending) < 2 * workers:
                    pending.append(pool.submit(draw, root.spawn(1)[0]))
                    submitted += 1
                yield pending.popleft().result()
        finally:
            for future in pending:
                future.cancel()


def _angles(theta_i: npt.ArrayLike) -> np.ndarray:
    angles = np.atleast_1d(
        require(
            "theta_i",
            theta_i,
            lambda v: (v >= 0) & (v < np.pi / 2),
            "lie in [0, 1.571) rad",
            "Angles are radians; use np.deg2rad.",
        )
    )
    if angles.ndim != 1 or angles.size == 0:
        msg = (
            f"theta_i must be a number or one-dimensional [rad], got shape {angles.shape}."
        )
        raise ValueError(msg)
    return angles


def _wavelengths(wavelength: npt.ArrayLike | None) -> np.ndarray | None:
    if wavelength is None:
        return None
    waves = require(
        "wavelength",
        wavelength,
        lambda v: (v > 0) & np.isfinite(v),
        "be positive [um]",
        "Wavelengths are micrometres.",
    )
    if waves.ndim > 1 or waves.size == 0:
        msg = (
            f"wavelength must be a number or one-dimensional [um], got shape {waves.shape}."
        )
        raise ValueError(msg)
    return waves


def _azimuth(phi_i: float | str) -> float | None:
    if isinstance(phi_i, str):
        if phi_i != "uniform":
            msg = f'phi_i must be an angle [rad] or "uniform", got {phi_i!r}.'
            raise ValueError(msg)
        return None
    value = require("phi_i", phi_i, np.isfinite, "be finite [rad]", 'Or pass "uniform".')
    if value.ndim > 0:
        msg = f"phi_i must be one angle [rad], got shape {value.shape}. Run once for each."
        raise ValueError(msg)
    return float(value)


def _half_angle(value: float, angles: np.ndarray, *, clean: bool) -> float:
    half = float(
        require(
            "source_half_angle",
            value,
            lambda v: (v >= 0) & (v <= WIDEST_SOURCE),
            f"lie in [0, {WIDEST_SOURCE}] rad",
            "Angles are radians; use np.deg2rad.",
        )
    )
    if half > 0.0 and angles.max() + half >= np.pi / 2:
        msg = (
            f"source_half_angle must leave the cone above the horizon [rad], got {half:g} "
            f"about theta_i {angles.max():g}. Take a smaller cone or a steeper source."
        )
        raise ValueError(msg)
    if half > 0.0 and not clean:
        msg = (
            f"source_half_angle must be 0 among contaminants [rad], got {half:g}. "
            "Average simulations of several directions."
        )
        raise ValueError(msg)
    return half


def _mirrored(fold: bool, scene: Scene, phi_i: float | str) -> bool:
    """`fold`, if the scene is its own mirror image in the mean."""
    surface = scene.surface
    symmetric = (
        isinstance(surface, GaussianSurface)
        and np.unique(surface.corr_length).size == 1
        and np.unique(surface.spacing).size == 1
        and not scene.contaminants
        and isinstance(phi_i, str)
    )
    if fold and not symmetric:
        msg = (
            "fold must be left out where the mean is not its own mirror image, got a "
            f"{type(surface).__name__} and phi_i {phi_i!r}. It takes a clean isotropic "
            'GaussianSurface with dx = dy, and phi_i="uniform".'
        )
        raise ValueError(msg)
    return fold


def _count(name: str, value: int, least: int) -> int:
    number = require(
        name,
        value,
        lambda v: (v >= least) & (v == np.floor(v)) & (v < 2**53),
        f"be a whole number of at least {least}",
        "Counts are whole numbers.",
    )
    return int(number)


def _even(name: str, value: int) -> int:
    number = _count(name, value, 2)
    if number % 2:
        msg = f"{name} must be even, got {number}. Bins are centred on 0 and on pi."
        raise ValueError(msg)
    return number


def _stokes_count(stokes: str) -> int:
    if stokes not in STOKES_COUNT:
        msg = f"stokes must be one of {', '.join(STOKES_COUNT)}, got {stokes!r}."
        raise ValueError(msg)
    return STOKES_COUNT[stokes]


def _target(value: float) -> float:
    return float(
        require(
            "target_rel_error",
            value,
            lambda v: (v > 0) & (v < 1),
            "lie in (0, 1) [1]",
            "0.01 asks for 1 %.",
        )
    )


def _workers(workers: int | None) -> int:
    if workers is None:
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 1
    return _count("workers", workers, 1)


def _constants(
    scene: Scene, waves: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Index n, kappa and strength of the diffuse base, (wavelengths, materials)."""
    count = 1 if waves is None or waves.ndim == 0 else waves.size
    shape = (count, len(scene.materials))
    n, kappa, base = np.empty(shape), np.empty(shape), np.empty(shape)
    for column, material in enumerate(scene.materials):
        n[:, column], kappa[:, column] = material.indices(waves)
        albedo = material.diffuse_albedo
        opaque = kappa[:, column].any() or not np.isfinite(n[:, column]).all()
        if albedo > 0.0 and opaque:
            msg = (
                f"kappa must be 0 over a diffuse base [1], got {kappa[:, column].max():g} "
                f"and diffuse_albedo {albedo:g}. "
                "Light does not reach a base under an absorber."
            )
            raise ValueError(msg)
        base[:, column] = [
            base_strength(albedo, *index)
            for index in zip(n[:, column], kappa[:, column], strict=True)
        ]
    return n, kappa, base if base.any() else np.empty((count, 0))


def _check_scene(scene: Scene) -> None:
    if isinstance(scene.surface, HeightMap) and scene.surface.missing > 0.0:
        msg = (
            "heights must be complete to be traced, got "
            f"{100 * scene.surface.missing:.2g} % missing. Fill the holes with "
            "HeightMap.filled()."
        )
        raise ValueError(msg)


def _warnings(
    scene: Scene, angles: np.ndarray, waves: np.ndarray | None, drawn: int
) -> list[str]:
    notes: list[str] = []
    if _varies(scene) and drawn == 1:
        notes.append(
            "One realisation of a random scene: standard errors hold for this "
            "one only. Ask for 16 realizations or more."
        )
    elif _varies(scene) and drawn < FEW_REALIZATIONS:
        notes.append(
            f"{drawn} realizations are too few for honest standard errors; "
            "ask for 16 or more."
        )
    if waves is not None and not isinstance(scene.surface, HeightMap):
        for wave in np.atleast_1d(waves):
            notes += geometric_optics_warnings(scene.surface, angles, float(wave))
    return notes

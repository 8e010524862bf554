"""Monte Carlo prediction of the Mueller BRDF of a scene: section 3 of the paper."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

import pbrdf.accessor  # noqa: F401  (registers ds.pbrdf)
from pbrdf.scene.scene import Scene
from pbrdf.simulation.memory import OF_SIZE, Effort, asked_size, check_run
from pbrdf.simulation.pilot import choose
from pbrdf.simulation.plan import Plan
from pbrdf.simulation.results import judged_before, labelled
from pbrdf.simulation.samples import Ready, Singles, trace_samples
from pbrdf.simulation.singles.mapped import MappedSingle, map_of_facets
from pbrdf.simulation.singles.single_bounce import without_rays
from pbrdf.simulation.singles.wet import beside_bodies
from pbrdf.simulation.skips import chosen_skips
from pbrdf.simulation.waves import check_waves
from pbrdf.surface import MeshSurface
from pbrdf.tracer import arguments
from pbrdf.tracer.asked import Run
from pbrdf.tracer.embree import EmbreeField
from pbrdf.tracer.field import Field
from pbrdf.tracer.media import media_of_scene
from pbrdf.wave import WaveModel

# Where paths are cut: on a clean surface, and where transparent bodies may catch light
MOST_BOUNCES, MOST_EVENTS = 64, 1024
# Rays an incident direction and realisation, where nobody says how many
N_RAYS = 100_000
# Arguments of `simulate` that a pilot has too
_GEOMETRY = (
    "n_theta", "n_dphi", "skips", "fold", "source_half_angle", "max_bounces",
)  # fmt: skip


def simulate(  # noqa: PLR0913  (the public signature)
    scene: Scene,
    theta_i: npt.ArrayLike,
    *,
    phi_i: npt.ArrayLike | str = 0.0,
    n_rays: int | None = None,
    realizations: int | None = None,
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
    wave: str | WaveModel | None = None,
    variance_reduction: bool = True,
) -> xr.Dataset:
    """Trace light from the source to the hemisphere and bin it as Mueller BRDF.

    Parameters
    ----------
    scene : Scene
        Surface and substrate.
    theta_i : array_like, shape () or (angles,)
        Zenith angle of the source, in [0, π/2). [rad]
    phi_i : float, array_like of shape (azimuths,), or "uniform"
        Azimuth of the source; several add the dimension `phi_i` and share surfaces and
        entry points, so each gives what it would give alone. "uniform" averages over the
        azimuth, as suits an isotropic surface. [rad]
    n_rays : int, optional
        Rays an incident direction and realisation, 100 000 if not planned.
    realizations : int, optional
        Surfaces drawn from a GaussianSurface; a HeightMap is traced with this many times
        n_rays. With `target_rel_error` it is the least number. 1 if not planned.
    seed : int or None
        Makes the run reproducible bit for bit, for any number of workers; None draws one.
    max_bounces : int, optional
        Paths are cut after so many bounces, 64 on a clean surface and 1024 among
        contaminants and in solids of a mesh, where light may be caught; what they still
        carry is `truncated`.
    target_rel_error : float, optional
        Add samples until the largest stderr / M00 over the bins above a tenth of the peak
        falls below this; the dataset says what was reached. Without n_rays and realizations
        both are planned from a short pilot run, see `pbrdf.simulation.pilot`.
    wavelength : array_like, optional
        Vacuum wavelength, scalar or (wavelengths,); needed by tabulated materials. [um]
    n_theta, n_dphi : int
        Detector bins in zenith and azimuth; n_dphi is even.
    stokes : {"full", "linear", "unpolarized"}
        Stokes elements to compute: all, without V, or M00 alone.
    workers : int, optional
        Threads; all cores by default. Does not change the result.
    progress : callable, optional
        Called with (samples done, samples in all); towards a target error with as many in
        all as the error so far asks for.
    skips : bool or names of `pbrdf.simulation.skips.SKIPS`
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
        the variance. For scenes that are their own mirror image in the mean only: an
        isotropic random surface on a square grid or a flat one, drops and spheres drawn
        anew for every realisation, and phi_i="uniform".
    wave : str or WaveModel, optional
        Let waves do the first bounce by this form of `pbrdf.wave.METHODS`, "auto" say, and
        add their mean field as `coherent`, a beam apart from the BRDF. A WaveModel is a
        fine structure on the facets of the surface (`pbrdf.wave.TwoScaleModel`). For clean
        Gaussian surfaces at given wavelengths. Later bounces are those of the rays.
    variance_reduction : bool
        Take single bounces on a GaussianSurface from the known law of its slopes and from
        looks at facets of given slopes, those on a HeightMap from all of its facets, or
        beside drops and spheres the noise of the slopes off them, see the notes; False is
        the plain estimator.

    Returns
    -------
    xarray.Dataset
        `brdf` [sr^-1] and `brdf_stderr` (bounces, theta_i, [phi_i], [wavelength], theta_s,
        dphi, stokes_out, stokes_in), `brdf_total` for all bounces, `albedo`, the energy
        budget and `projected_solid_angle`; see `pbrdf.conventions.RESULT_VARIABLES`.

    Raises
    ------
    TypeError, ValueError
        If an argument is out of its range.

    Warns
    -----
    AccuracyWarning
        If realisations are too few for honest standard errors, geometric optics fails at
        the wavelength, or rays were lost by a fault.

    Notes
    -----
    A bin holds flux / (incident flux ∫cosθ dΩ). Standard errors come from independent
    surface realisations, or from 32 or more batches of rays where the surface is fixed.
    A bin that few rays reached shares the noise of bins like it around; one in the dark has
    the error of one ray.

    Over realisations of a clean GaussianSurface without a diffuse base, single bounces do
    not come from the rays: the light of facets of all slopes, by Smith's height-correlated
    rule, is an integral, and only how many of them are seen in units of that rule is
    sampled, by facets of given slopes put at random places of the realisations. Their share
    of the noise falls by one to three orders of magnitude; where no facet hides another
    nothing is left of it. Rays give the other bounces, scaled so that no light is lost.

    Over a HeightMap they are a sum over its facets, each by what a few of its points see,
    and looks at random points correct it.

    Beside drops and spheres on a GaussianSurface single bounces come from the rays, less
    what the same rays over the clean surface tell of the noise of its slopes.

    Examples
    --------
    >>> from pbrdf import HeightMap, Material
    >>> scene = Scene(HeightMap.flat(size=(1.0, 1.0)), Material(1.5))
    >>> result = simulate(scene, 0.0, n_rays=320)
    >>> round(float(result.albedo.sel(bounces="1").item()), 6)
    0.04
    """
    return traced(prepared(**locals()))


# Arguments that are on or off
SWITCHES = ("variance_reduction", "explain")


def prepared(*, whole: bool = True, **given: Any) -> Ready:
    """Check and plan a run, by the arguments of `simulate`; `whole` if all is kept."""
    ready = planned(whole=whole, **given)
    scene, plans, wanted = ready.run.scene, ready.plans, wants_looks(ready.run, given)
    single: Singles = without_rays(scene, plans, wanted=wanted)
    if single is None:
        single = beside_bodies(scene, plans, ready.run.samples, wanted=wanted)
    return replace(ready, single=single, target=facets_of(ready))


def facets_of(ready: Ready) -> Field | EmbreeField | None:
    """Return the map of a run if its facets are to give the single bounces."""
    given, run = ready.given, ready.run
    wanted = given["variance_reduction"] and given["wave"] is None
    return map_of_facets(run.scene.surface, ready.plans, run.samples, wanted=wanted)


def wants_looks(run: Run, given: Mapping[str, Any]) -> bool:
    """Whether single bounces need not come from rays, as far as the arguments say."""
    return given["variance_reduction"] and not run.batched and given["wave"] is None


def planned(*, whole: bool = True, **given: Any) -> Ready:
    """Do the same without the integral over single bounces, which takes time."""
    scene, theta_i, wave = given["scene"], given["theta_i"], given["wave"]
    n_rays, realizations = given["n_rays"], given["realizations"]
    target = given["target_rel_error"]
    light, _ = (arguments.switch(name, given[name]) for name in SWITCHES)
    root = arguments.seed_sequence(given["seed"])
    size = asked_size(theta_i, **{name: given[name] for name in OF_SIZE})
    if whole:
        check_run(scene, size, Effort.of(given))
    geometry = {name: given[name] for name in _GEOMETRY}
    common = {name: given[name] for name in ("wavelength", "workers")}
    pilot = partial(
        simulate, scene, theta_i, phi_i=given["phi_i"], stokes="unpolarized",
        variance_reduction=light, **common, **geometry,
    )  # fmt: skip
    rays, drawn, chosen = _counts(n_rays, realizations, target, scene, root, pilot)
    run = Run.asked(
        scene, root=root, n_rays=rays, realizations=drawn, stokes=given["stokes"],
        target_rel_error=target, progress=given["progress"], **common,
    )  # fmt: skip
    plans, several = _plans(run, theta_i, given["phi_i"], **geometry)
    if wave is not None:
        check_waves(scene, wave, run.waves, given["stokes"], plans)
    return Ready(
        run=run, plans=plans, several=several, single=None, chosen=chosen, given=given
    )


def traced(ready: Ready) -> xr.Dataset:
    """Trace the samples of a run, and label what they gave."""
    early = judged_before(ready)
    if ready.target is not None:
        # Not before the map was judged, and only for the directions of this part
        single = [MappedSingle.of(ready.target, plan) for plan in ready.plans]
        ready = replace(ready, single=single)
    return labelled(ready, *trace_samples(ready.run, ready.plans, ready.single), early)


def _plans(  # noqa: PLR0913  (arguments of `simulate`)
    run: Run,
    theta_i: npt.ArrayLike,
    phi_i: npt.ArrayLike | str,
    *,
    max_bounces: int | None,
    n_theta: int,
    n_dphi: int,
    skips: bool | Iterable[str],
    source_half_angle: float,
    fold: bool,
) -> tuple[list[Plan], bool]:
    """Plan the rays of each azimuth, and say whether azimuths are a dimension."""
    angles = arguments.zeniths(theta_i)
    azimuths, several = arguments.azimuths(phi_i)
    media = media_of_scene(run.scene, run.waves)
    if max_bounces is None:
        max_bounces = MOST_BOUNCES if media is None else MOST_EVENTS
    allowed = chosen_skips(skips)
    walks = not isinstance(run.scene.surface, MeshSurface)
    if walks and media is not None and "walk" not in allowed:
        msg = (
            f'skips must hold "walk" among contaminants, got {sorted(allowed)}. '
            "The Embree route traces clean surfaces only."
        )
        raise ValueError(msg)
    plan = Plan(
        theta_i=angles,
        phi_i=azimuths[0],
        n_rays=run.rays_of_sample,
        max_bounces=arguments.count("max_bounces", max_bounces, 1),
        n=run.n,
        kappa=run.kappa,
        base=run.base,
        n_stokes=run.n_stokes,
        n_theta=arguments.count("n_theta", n_theta, 1),
        n_dphi=arguments.even_count("n_dphi", n_dphi),
        skips=allowed,
        media=media,
        half_angle=arguments.half_angle(source_half_angle, angles),
        fold=arguments.mirrored(fold, run.scene, phi_i),
    )
    return [plan.at(azimuth) for azimuth in azimuths], several


def _counts(
    n_rays: int | None,
    realizations: int | None,
    target: float | None,
    scene: Scene,
    root: np.random.SeedSequence,
    pilot: Callable[..., xr.Dataset],
) -> tuple[int, int, list[str]]:
    """Rays and realisations as asked for or planned, and what the plan says."""
    sentences: list[str] = []
    if target is not None and n_rays is None and realizations is None:
        choice = choose(pilot, scene, arguments.target_error(target), root)
        n_rays, realizations = choice.n_rays, choice.realizations
        sentences = choice.sentences
    rays = N_RAYS if n_rays is None else n_rays
    return rays, 1 if realizations is None else realizations, sentences

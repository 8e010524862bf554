"""Monte Carlo prediction of the Mueller BRDF of a scene: section 3 of the paper."""

import copy
import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

import pbrdf.accessor  # noqa: F401  (registers ds.pbrdf)
from pbrdf.contaminants import Film
from pbrdf.contaminants.arguments import material_of
from pbrdf.errors import AccuracyWarning
from pbrdf.kernels.bodies.world import Media
from pbrdf.kernels.paths.shading import LEAKED, N_LEAKED, N_SIDE, SIDEWAYS, TRUNCATED
from pbrdf.scene.scene import Scene
from pbrdf.simulation.memory import OF_SIZE, asked_size, check_run
from pbrdf.simulation.moments import Moments
from pbrdf.simulation.pilot import choose
from pbrdf.simulation.plan import Plan
from pbrdf.simulation.results import to_dataset
from pbrdf.simulation.samples import trace_samples
from pbrdf.simulation.single_bounce import SingleBounce, without_rays
from pbrdf.simulation.skips import chosen_skips, explanation, mesh_explanation
from pbrdf.simulation.waves import check_waves, join_waves
from pbrdf.surface import HeightMap, MeshSurface
from pbrdf.tracer import arguments
from pbrdf.tracer.asked import Run
from pbrdf.tracer.field import Field
from pbrdf.tracer.media import (
    clear_materials,
    covering_materials,
    media_of,
    opaque_drop_notes,
)
from pbrdf.tracer.thin_films import thin_absorber_warnings
from pbrdf.validity import (
    Judgement,
    attach,
    judge_contaminants,
    lost_light_warnings,
    lost_ray_warnings,
)

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
    wave: str | None = None,
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
    wave : str, optional
        Let waves do the first bounce by this form of `pbrdf.wave.METHODS`, "auto" say, and
        add their mean field as `coherent`, a beam apart from the BRDF. For clean isotropic
        Gaussian surfaces at given wavelengths. Later bounces are those of the rays.
    variance_reduction : bool
        Take single bounces on a GaussianSurface from the known law of its slopes and from
        looks at facets of given slopes, see the notes; False is the plain estimator.

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

    Examples
    --------
    >>> from pbrdf import HeightMap, Material
    >>> scene = Scene(HeightMap.flat(size=(1.0, 1.0)), Material(1.5))
    >>> result = simulate(scene, 0.0, n_rays=320)
    >>> round(float(result.albedo.sel(bounces="1").item()), 6)
    0.04
    """
    return traced(prepared(**locals()))


@dataclass(frozen=True, kw_only=True)
class Ready:
    """A run that is checked and planned, as its arguments say.

    `chosen` says how a plan was chosen; `given` holds the arguments of `simulate`.
    """

    run: Run
    plans: list[Plan]
    several: bool
    single: list[SingleBounce] | None
    chosen: list[str]
    given: dict[str, Any]

    def part(self, first: int, last: int) -> "Ready":
        """Return the run of some of the directions, with the rays they have among all."""
        single = self.single and [one.part(first, last) for one in self.single]
        # Streams are spawned anew, from the same root
        run = replace(self.run, root=copy.deepcopy(self.run.root))
        plans = [plan.part(first, last) for plan in self.plans]
        return replace(self, run=run, plans=plans, single=single)


# Arguments that are on or off
SWITCHES = ("variance_reduction", "explain")


def prepared(*, whole: bool = True, **given: Any) -> Ready:
    """Check and plan a run, by the arguments of `simulate`; `whole` if all is kept."""
    scene, theta_i, wave = given["scene"], given["theta_i"], given["wave"]
    n_rays, realizations = given["n_rays"], given["realizations"]
    target = given["target_rel_error"]
    light, _ = (arguments.switch(name, given[name]) for name in SWITCHES)
    root = arguments.seed_sequence(given["seed"])
    size = asked_size(theta_i, **{name: given[name] for name in OF_SIZE})
    if whole:
        check_run(
            scene, size, n_rays=n_rays, realizations=realizations,
            planned=target is not None, workers=given["workers"], looks=light,
        )  # fmt: skip
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
    single = without_rays(scene, plans, wanted=light and not run.batched and wave is None)
    if wave is not None:
        check_waves(scene, wave, run.waves, given["stokes"], plans[0].half_angle)
    return Ready(
        run=run, plans=plans, several=several, single=single, chosen=chosen, given=given
    )


def traced(ready: Ready) -> xr.Dataset:
    """Trace the samples of a run, and label what they gave."""
    run, plans, single, given = ready.run, ready.plans, ready.single, ready.given
    scene, wave, plan = run.scene, given["wave"], plans[0]
    # What rays do not see at these wavelengths is no fault where waves do the first bounce
    judged = run.judged(plan.theta_i, None if wave else run.waves)
    early = [*judged.notes, *opaque_drop_notes(scene.contaminants, run.waves)]
    _warn(early)
    moments, done = trace_samples(run, plans, single)

    laid = _judge_contaminants(scene, moments[0], run.waves)
    late = [*moments[0].notes, *laid.notes, *_missing_light(moments)]
    late += _thin_films(scene, moments[0], run.waves)
    _warn(late)
    # Told in any case, but no surprise to one who set the limit
    cut = _cut_light(moments)
    _warn(() if given["max_bounces"] is not None else cut)
    phi_i = given["phi_i"]
    result = to_dataset(
        moments,
        scene,
        several=ready.several,
        wavelength=run.waves,
        attrs=run.attributes(done)
        | {
            "max_bounces": plan.max_bounces,
            "phi_i": phi_i if isinstance(phi_i, str) else np.asarray(phi_i, float).tolist(),
            "source_half_angle": plan.half_angle,
            "folded": plan.fold,
            "intersector": _intersector(scene, plan.skips),
            "plan": ready.chosen,
            "variance_reduction": "none" if single is None else "single bounces",
            "explanation": _explain(scene, plan, single) if given["explain"] else [],
            "contaminants": [str(dict(report)) for report in moments[0].reports],
            "warnings": [*early, *late, *judged.remarks, *cut],
        },
    )  # fmt: skip
    result = attach(result, {**judged.numbers, **laid.numbers})
    return result if wave is None else join_waves(result, scene, wave)


def _warn(notes: Iterable[str]) -> None:
    """Warn whoever called `simulate`."""
    for note in notes:
        warnings.warn(note, AccuracyWarning, stacklevel=4)


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
    media = _media(run)
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


def _media(run: Run) -> Media | None:
    """Tell what light goes through, None on a clean opaque surface."""
    scene = run.scene
    covering = covering_materials(scene)
    if not covering:
        return None
    films = [one.material for one in scene.contaminants if isinstance(one, Film)]
    return media_of(scene.materials, covering, run.waves, [*films, *clear_materials(scene)])


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


def _judge_contaminants(
    scene: Scene, moments: Moments, waves: np.ndarray | None
) -> Judgement:
    """Judge what lies on the surface, known only after laying it."""
    if waves is None or not scene.contaminants:
        return Judgement()
    coverings = [material_of(one.material) for one in scene.contaminants]
    return judge_contaminants(moments.reports, waves, coverings, scene.materials)


def _missing_light(moments: Sequence[Moments]) -> list[str]:
    """Warnings of rays lost, and of light that leaked or left sideways."""
    first = moments[0]
    lost = sum(int(one.counts[:, N_LEAKED].sum()) for one in moments)
    rays = first.plan.n_rays * first.samples * len(first.plan.theta_i) * len(moments)
    energy = np.max([one.energy() for one in moments], axis=0)
    aside = np.max([one.counts[:, N_SIDE] for one in moments], axis=0)
    shares = {
        "leaked": energy[..., LEAKED],
        "left_sideways": energy[..., SIDEWAYS],
        "side_exits": aside / (first.plan.n_rays * first.samples),
    }
    plan = first.plan
    found = lost_ray_warnings(lost, rays)
    if found:
        del shares["leaked"]  # said already
    return found + lost_light_warnings(shares, plan.theta_i, plan.max_bounces)


def _cut_light(moments: Sequence[Moments]) -> list[str]:
    """Say how much light was cut off."""
    plan = moments[0].plan
    share = np.max([one.energy() for one in moments], axis=0)[..., TRUNCATED]
    return lost_light_warnings({"truncated": share}, plan.theta_i, plan.max_bounces)


def _thin_films(scene: Scene, moments: Moments, waves: np.ndarray | None) -> list[str]:
    """Warnings of films whose waves overlap; their thickness is known after laying them."""
    coverings = [material_of(one.material) for one in scene.contaminants]
    angles = moments.plan.theta_i
    return thin_absorber_warnings(
        moments.reports, coverings, scene.materials, angles, waves
    )


def _explain(scene: Scene, plan: Plan, single: Sequence[SingleBounce] | None) -> list[str]:
    surface = scene.surface
    if isinstance(surface, MeshSurface):
        return mesh_explanation(plan, faces=len(surface.faces), kind=surface.kind)
    sample = surface if isinstance(surface, HeightMap) else surface.sample(0)
    steepest = float(Field.of(sample).terrain.steepest)
    lines = explanation(plan, periodic=sample.periodic, steepest=steepest)
    return lines + (single[0].explanation() if single else [])


def _intersector(scene: Scene, allowed: frozenset[str]) -> str:
    if isinstance(scene.surface, MeshSurface):
        return "embree, refined in float64"
    return "height-field walk" if "walk" in allowed else "embree"

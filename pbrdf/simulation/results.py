"""Result datasets: labelled axes, units from one table, attributes that tell all."""

import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from pbrdf._version import __version__
from pbrdf.contaminants.arguments import material_of
from pbrdf.conventions import BOUNCES, RESULT_VARIABLES, STOKES, detector_bins
from pbrdf.errors import AccuracyWarning
from pbrdf.kernels.paths.shading import (
    ABSORBED,
    LEAKED,
    N_ESCAPED,
    N_EXACT,
    N_LEAKED,
    N_MISMATCH,
    N_SEGMENTS,
    N_SELF,
    N_SIDE,
    N_TRUNCATED,
    SIDEWAYS,
    TRANSMITTED,
    TRUNCATED,
)
from pbrdf.scene.scene import Scene
from pbrdf.scene.write import scene_text
from pbrdf.simulation.moments import Moments
from pbrdf.simulation.plan import Plan
from pbrdf.simulation.samples import Ready, Singles
from pbrdf.simulation.singles.mapped import MappedSingle
from pbrdf.simulation.singles.wet import BesideBodies
from pbrdf.simulation.skips import explanation, mesh_explanation
from pbrdf.simulation.waves import join_waves
from pbrdf.surface import HeightMap, MeshSurface
from pbrdf.tracer.field import Field
from pbrdf.tracer.media import opaque_drop_notes
from pbrdf.tracer.thin_films import thin_absorber_warnings
from pbrdf.validity import (
    Judgement,
    judge_contaminants,
    lost_light_warnings,
    lost_ray_warnings,
    variables,
)


def to_dataset(
    moments: Sequence[Moments],
    scene: Scene,
    judged: Mapping[str, np.ndarray],
    *,
    several: bool,
    wavelength: np.ndarray | None,
    attrs: dict[str, Any],
) -> xr.Dataset:
    """Normalise the tallies of each azimuth to a Mueller BRDF and label every axis.

    `judged` are numbers of the limits of geometric optics. Counts in the attributes are
    sums over azimuths; with `several` of them the dimension `phi_i` follows theta_i.
    """
    plan = moments[0].plan
    spectral = wavelength is not None and wavelength.ndim == 1
    rel_error = max(one.rel_error() for one in moments)
    layers = [_estimates(one) for one in moments]
    data: dict[str, Any] = {}
    for name, array in layers[0].items():
        entry = RESULT_VARIABLES[name]
        dims = tuple(d for d in entry.dims if several or d != "phi_i")
        if "phi_i" in dims:
            array = np.stack([one[name] for one in layers], dims.index("phi_i"))
        if "wavelength" in dims and not spectral:
            array = array.squeeze(dims.index("wavelength"))
            dims = tuple(d for d in dims if d != "wavelength")
        data[name] = (dims, array, entry.about)
    data |= variables(judged, spectral=spectral)
    counts = np.sum([one.counts for one in moments], axis=0)
    told = attrs | {
        "version": __version__,
        "scene": scene_text(scene),
        "rays_per_direction": plan.n_rays * moments[0].samples,
        "path_segments": int(counts[:, N_SEGMENTS].sum()),
        "rays_escaped": counts[:, N_ESCAPED].tolist(),
        "rays_truncated": counts[:, N_TRUNCATED].tolist(),
        "rays_leaked": counts[:, N_LEAKED].tolist(),
        "rays_left_sideways": counts[:, N_SIDE].tolist(),
        "self_hits": int(counts[:, N_SELF].sum()),
        "exact_searches": int(counts[:, N_EXACT].sum()),
        "medium_mismatches": int(counts[:, N_MISMATCH].sum()),
        "rel_error": rel_error,
    }
    azimuths = [one.plan.phi_i for one in moments] if several else None
    return xr.Dataset(data, _axes(plan, azimuths, wavelength), told)


def _axes(
    plan: Plan, azimuths: list[float | None] | None, wavelength: np.ndarray | None
) -> dict[str, tuple[tuple[str, ...], Any, dict[str, str]]]:
    """Coordinates of a result; `azimuths` where they are a dimension."""
    theta_s, dphi, _ = detector_bins(plan.n_theta, plan.n_dphi)
    axes: dict[str, Any] = {
        "bounces": list(BOUNCES),
        "theta_i": plan.theta_i,
        "theta_s": theta_s,
        "dphi": dphi,
        "stokes_out": list(STOKES[: plan.n_stokes]),
        "stokes_in": list(STOKES[: plan.n_stokes]),
    }
    if azimuths is not None:
        axes["phi_i"] = azimuths
    if wavelength is not None:
        axes["wavelength"] = wavelength if wavelength.ndim else float(wavelength)
    return {
        name: ((name,) if np.ndim(values) else (), values, RESULT_VARIABLES[name].about)
        for name, values in axes.items()
    }


def _estimates(moments: Moments) -> dict[str, np.ndarray]:
    """Estimates of one azimuth, which uses its moments up; dimensions but phi_i."""
    plan = moments.plan
    _, _, weight = detector_bins(plan.n_theta, plan.n_dphi)
    brdf, stderr, total, total_stderr = moments.finish()
    albedo, albedo_stderr = moments.albedo()
    energy = moments.energy()
    return {
        # (theta_i, wavelength, bounces, ...) to (bounces, theta_i, wavelength, ...)
        "brdf": np.moveaxis(brdf, 2, 0),
        "brdf_stderr": np.moveaxis(stderr, 2, 0),
        "brdf_total": total,
        "brdf_total_stderr": total_stderr,
        "albedo": np.moveaxis(albedo, 2, 0),
        "albedo_stderr": np.moveaxis(albedo_stderr, 2, 0),
        "projected_solid_angle": weight,
        "absorbed": energy[..., ABSORBED],
        "transmitted": energy[..., TRANSMITTED],
        "truncated": energy[..., TRUNCATED],
        "leaked": energy[..., LEAKED],
        "left_sideways": energy[..., SIDEWAYS],
        "side_exits": moments.counts[:, N_SIDE]
        / (plan.n_rays * plan.walks * moments.samples),
    }


def judged_before(ready: Ready) -> Judgement:
    """Judge a run before it is traced, and warn of what that says."""
    run = ready.run
    # What rays do not see at these wavelengths is no fault where waves do the first bounce
    waves = None if ready.given["wave"] else run.waves
    judged = run.judged(ready.plans[0].theta_i, waves)
    early = [*judged.notes, *opaque_drop_notes(run.scene.contaminants, run.waves)]
    _warn(early)
    return replace(judged, notes=tuple(early))


def labelled(
    ready: Ready, moments: list[Moments], done: int, judged: Judgement
) -> xr.Dataset:
    """Label the moments of `done` samples of a run."""
    run, plan, single, given = ready.run, ready.plans[0], ready.single, ready.given
    scene, wave = run.scene, given["wave"]
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
        {**judged.numbers, **laid.numbers},
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
            "variance_reduction": _reduction(single),
            "explanation": _explain(scene, plan, single) if given["explain"] else [],
            "contaminants": [str(dict(report)) for report in moments[0].reports],
            "warnings": [*judged.notes, *late, *judged.remarks, *cut],
        },
    )  # fmt: skip
    return result if wave is None else join_waves(result, scene, wave)


def _warn(notes: Iterable[str]) -> None:
    """Warn whoever called `simulate`."""
    for note in notes:
        warnings.warn(note, AccuracyWarning, stacklevel=5)


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
    rays = first.plan.n_rays * first.plan.walks * first.samples
    energy = np.max([one.energy() for one in moments], axis=0)
    aside = np.max([one.counts[:, N_SIDE] for one in moments], axis=0)
    shares = {
        "leaked": energy[..., LEAKED],
        "left_sideways": energy[..., SIDEWAYS],
        "side_exits": aside / rays,
    }
    plan = first.plan
    found = lost_ray_warnings(lost, rays * len(first.plan.theta_i) * len(moments))
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


def _explain(scene: Scene, plan: Plan, single: Singles) -> list[str]:
    surface = scene.surface
    if isinstance(surface, MeshSurface):
        return mesh_explanation(plan, faces=len(surface.faces), kind=surface.kind)
    sample = surface if isinstance(surface, HeightMap) else surface.sample(0)
    steepest = float(Field.of(sample).terrain.steepest)
    lines = explanation(plan, periodic=sample.periodic, steepest=steepest)
    return lines + (single[0].explanation() if single else [])


def _reduction(single: Singles) -> str:
    """Name what makes the noise less."""
    if single is None:
        return "none"
    if isinstance(single[0], MappedSingle):
        return "single bounces by facet"
    beside = isinstance(single[0], BesideBodies)
    return "single bounces beside bodies" if beside else "single bounces"


def _intersector(scene: Scene, allowed: frozenset[str]) -> str:
    if isinstance(scene.surface, MeshSurface):
        return "embree, refined in float64"
    return "height-field walk" if "walk" in allowed else "embree"

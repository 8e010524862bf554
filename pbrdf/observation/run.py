"""The second way to look, from detector to source: section 3 of the paper.

`simulate` sends light over the whole hemisphere; `observe` asks for the readings of a
goniometer, one by one, each with its finite source and detector.
"""

import warnings
from collections.abc import Callable, Iterable

import numpy as np
import numpy.typing as npt
import xarray as xr

import pbrdf.accessor  # noqa: F401  (registers ds.pbrdf)
from pbrdf._version import __version__
from pbrdf.analytic.geometry import flat_geometry
from pbrdf.errors import AccuracyWarning
from pbrdf.kernels.paths.shading import LEAKED, N_LEAKED, SIDEWAYS, TRUNCATED
from pbrdf.observation.look import Look
from pbrdf.observation.readings import Readings, as_scan, to_dataset
from pbrdf.observation.samples import check_memory, look_at_samples
from pbrdf.scene.scene import Scene
from pbrdf.scene.write import scene_text
from pbrdf.surface import (
    HeightMap,
    MeshSurface,
    Surface,
)
from pbrdf.tracer import arguments
from pbrdf.tracer.asked import Run
from pbrdf.tracer.media import covering_materials, opaque_drop_notes
from pbrdf.validity import lost_light_warnings, lost_ray_warnings

__all__ = ["ESTIMATORS", "as_scan", "observe"]

ESTIMATORS = {
    "facets": "single bounces from the facets that join the cones, times the mean matrix",
    "paths": "the same with the matrix of each path",
    "corners": "bundles of rays, weighted with what their cone shares with the source",
    "count": "rays that meet the cone of the source, counted; for comparison",
}
COUNT = "count"
# From this half-angle in rms slopes on, a cone is no longer small against the lobe of the
# surface: F' errs by 0.4 %, corner rays lose 4 % of the light of two bounces
# (studies/two_ways)
WIDE = 0.25
# Up to here they lose at most 1.4 %, and counting has twice their error
NARROW_CONE = 0.15
# More rays into the hemisphere than this need a decay with the bounces
SAFE_SAMPLES = 2.0
SAFE_DECAY = 0.8
# Bounces that light is given by default: on a clean surface, and where bodies may catch it
MOST_BOUNCES, MOST_EVENTS = 64, 1024
# Narrower cones lose digits [rad]
NARROW = 1e-4
# Facets of a mesh that look up less than this are walls
LEAST_UP = 0.17


def observe(  # noqa: PLR0913  (the public signature)
    scene: Scene,
    theta_i: npt.ArrayLike,
    theta_s: npt.ArrayLike,
    dphi: npt.ArrayLike,
    *,
    phi_i: float | str = 0.0,
    source_half_angle: float = 0.01,
    detector_half_angle: float = 0.01,
    n_rays: int = 100_000,
    realizations: int = 1,
    seed: int | None = 0,
    max_bounces: int | None = None,
    hemisphere_samples: float = 2.0,
    sample_decay: float = 0.5,
    estimator: str = "facets",
    start: str = "detector",
    target_rel_error: float | None = None,
    wavelength: npt.ArrayLike | None = None,
    stokes: str = "full",
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
    variance_reduction: bool = True,
) -> xr.Dataset:
    """Look at a scene from each detector of a scan and find the source behind its facets.

    Parameters
    ----------
    scene : Scene
        Surface and substrate.
    theta_i, theta_s, dphi : array_like, broadcastable to (geometries,)
        Axes of the cones of source and detector, as the columns of a measured scan. [rad]
    phi_i : float or "uniform"
        Azimuth of the source [rad]; "uniform" averages over it, as suits an isotropic
        surface.
    source_half_angle, detector_half_angle : float
        Half-angles of the cones, in [0.0001, 0.5]. [rad]
    n_rays : int
        Bundles of rays a geometry and realisation.
    realizations, seed, target_rel_error, wavelength, stokes, workers, progress
        As in `simulate`; target_rel_error looks at every geometry above a tenth of the
        brightest.
    max_bounces : int, optional
        Paths are cut after so many bounces; what they still carry is `truncated`. 64, or
        1024 where light goes through bodies.
    hemisphere_samples, sample_decay : float
        Rays into the hemisphere above a point of a diffuse base: samples times decay to the
        power of the bounces before it, rounded at random. They change the noise only.
    estimator : {"facets", "paths", "corners", "count"}
        How light that reaches the source is valued; see Notes.
    start : {"detector", "source"}
        Where bundles start. From the source one bundle serves all detectors, which is
        quicker for scans of many detectors and few incidences.
    variance_reduction : bool
        Take the noise of the slopes off single bounces, with realisations of a
        GaussianSurface and an estimator that asks facets; False is the plain estimator.

    Returns
    -------
    xarray.Dataset
        `brdf` [sr^-1] and `brdf_stderr` (bounces, [wavelength], geometry, stokes_out,
        stokes_in) and `brdf_total`, from source to detector; coordinates theta_i, theta_s
        and dphi on `geometry`. `as_scan` makes a goniometer dataset of it.

    Raises
    ------
    TypeError, ValueError
        If an argument is out of its range.

    Warns
    -----
    AccuracyWarning
        As `simulate`; and where a cone is too wide for the estimator.

    Notes
    -----
    A reading is the mean of the BRDF over both cones, each weighted with its cosine:
    detected flux / (irradiance of the source x projected solid angle of the detector).
    Polarisers keep to the axes of the cones and are carried to each ray on the shortest
    way.

    - "count" traces rays from the detector and counts those that meet the cone of the
      source. It is unbiased and slow. Through drops, spheres, films and transparent solids
      of a mesh it is the only one, and rays start at the source.
    - "corners" lets each ray stand for the whole cone: flat facets mirror cones rigidly,
      so the solid angle is conserved, and the share of the mirrored cone that lies in the
      source takes the place of hit or miss. It takes all directions of the cone to meet
      the facets that its ray meets; the error falls as the square of the half-angle and
      is 4 % of the light of two bounces where that is a quarter of the rms slope.
    - "facets" asks each facet whether it joins the cones, instead of waiting for rays to
      find it, and sends rays to both ends from those that do; the matrix F' of equation
      (16), averaged over both cones, times this one number is the single bounce. Further
      bounces are those of "corners". "paths" gives each such path its own matrix: no bias,
      more noise.

    Over realisations of a GaussianSurface the law of its slopes gives what facets show on
    average if none is hidden. "facets" and "paths" take off what those of a realisation
    show too much, times the share in sight by Smith's height-correlated rule; what is left
    of the noise is that of hidden facets and of further bounces.

    With a diffuse base, light that reaches it straight from the source is asked for there;
    light mirrored on its way to the base is found from the source's end in the same way.

    References
    ----------
    .. [1] M. Gartley, S. Brown, J. Schott, section 3: reverse rays, solid angle of the
       corner rays, hemispherical sampling with decay.

    Examples
    --------
    A mirror shows the source: 1 / projected solid angle.

    >>> from pbrdf import HeightMap, Material
    >>> scene = Scene(HeightMap.flat(), Material.mirror())
    >>> seen = observe(scene, 0.5, 0.5, np.pi, n_rays=320, source_half_angle=0.02)
    >>> solid_angle = np.pi * np.sin(0.02) ** 2 * np.cos(0.5)
    >>> float(round(seen.brdf_total[0, 0, 0].item() * solid_angle, 9))
    1.0
    """
    angles = _angles(scene, theta_i, theta_s, dphi)
    run = Run.asked(
        scene, root=arguments.seed_sequence(seed), n_rays=n_rays,
        realizations=realizations, wavelength=wavelength, stokes=stokes,
        target_rel_error=target_rel_error, workers=workers, progress=progress,
    )  # fmt: skip
    source = _half_angle("source_half_angle", source_half_angle, angles[0])
    detector = _half_angle("detector_half_angle", detector_half_angle, angles[1])
    widest, slope = max(source, detector), _rms_slope(scene.surface)
    through = _goes_through(scene, estimator)
    look = Look(
        theta_i=angles[0],
        theta_s=angles[1],
        dphi=angles[2],
        phi_i=arguments.azimuth(phi_i),
        source=source,
        detector=detector,
        n_rays=run.rays_of_sample,
        max_bounces=_most_bounces(max_bounces, through=through),
        estimator=arguments.one_of("estimator", estimator, ESTIMATORS),
        counts=estimator == COUNT
        or (estimator != "corners" and widest > NARROW_CONE * slope > 0.0),
        from_source=through or _from_source(start),
        hemisphere_samples=arguments.in_range(
            "hemisphere_samples", hemisphere_samples, 0.1, 1e4, "2 is a good start."
        ),
        sample_decay=arguments.in_range(
            "sample_decay", sample_decay, 0.01, 1.0, "1 keeps the sampling as it is."
        ),
        n=run.n,
        kappa=run.kappa,
        base=run.base,
        n_stokes=run.n_stokes,
    )
    check_memory(run, look)
    _check_growth(look.hemisphere_samples, look.sample_decay)
    judged = run.judged(angles[0], run.waves)
    early = [*judged.notes, *_wide_cones(estimator, widest, slope)]
    early += opaque_drop_notes(scene.contaminants, run.waves)
    _warn(early)
    seen = look_at_samples(run, look, reduced=variance_reduction)
    late = [*seen.notes, *_lost_light(seen)]
    cut = _missing_light(seen, ("truncated",))
    # Told in any case, but no surprise to one who set a low limit
    _warn([*late, *(cut if look.max_bounces >= MOST_BOUNCES else ())])
    return to_dataset(
        seen,
        judged.numbers,
        wavelength=run.waves,
        attrs=run.attributes(seen.samples)
        | {
            **look.attributes(),
            "start": "source" if look.from_source else "detector",
            "rel_error": seen.rel_error(),
            "variance_reduction": "none" if seen.expected is None else "single bounces",
            "warnings": [*early, *late, *cut, *judged.remarks],
            "version": __version__,
            "scene": scene_text(scene),
        },
    )


def _angles(
    scene: Scene, theta_i: npt.ArrayLike, theta_s: npt.ArrayLike, dphi: npt.ArrayLike
) -> list[np.ndarray]:
    """Return theta_i, theta_s, dphi of each geometry, of a scene that can be observed."""
    shape, angles = flat_geometry(theta_i, theta_s, dphi, 0.0)
    if len(shape) > 1:
        msg = f"theta_i, theta_s, dphi must be one-dimensional, got shape {shape}."
        raise ValueError(msg)
    surface = scene.surface
    if isinstance(surface, MeshSurface) and surface.kind == "bodies" and not surface.period:
        msg = (
            "surface must have a mean plane to be observed, got bodies that stand alone. "
            "Give them a period, or use simulate."
        )
        raise ValueError(msg)
    return angles


def _most_bounces(given: int | None, *, through: bool) -> int:
    if given is None:
        return MOST_EVENTS if through else MOST_BOUNCES
    return arguments.count("max_bounces", given, 1)


def _from_source(start: str) -> bool:
    return arguments.one_of("start", start, ("detector", "source")) == "source"


def _goes_through(scene: Scene, estimator: str) -> bool:
    """Whether light goes through bodies of a scene; then it can only be counted."""
    clear = bool(covering_materials(scene))
    if clear and estimator != COUNT:
        msg = (
            f'estimator must be "{COUNT}" where light goes through bodies or films, got '
            f"{estimator!r}. What they refract are no cones any more; counted rays are "
            "noisier, so take wider cones or more rays."
        )
        raise ValueError(msg)
    return clear


def _wide_cones(estimator: str, widest: float, slope: float) -> list[str]:
    """Say where a cone is too wide for the estimator."""
    if estimator not in ("facets", "corners") or not widest > WIDE * slope > 0.0:
        return []
    lost = "matrices err by" if estimator == "facets" else "multiple bounces lose"
    return [
        f"A cone of half-angle {widest:.3g} rad is wide beside the rms slope "
        f"{slope:.3g}: with {estimator!r} {lost} up to some per cent. Use 'paths'."
    ]


def _warn(notes: Iterable[str]) -> None:
    """Warn whoever called `observe`."""
    for note in notes:
        warnings.warn(note, AccuracyWarning, stacklevel=3)


def _lost_light(seen: Readings) -> list[str]:
    """Say what was lost by a fault, or left a finite surface beyond its rim."""
    lost = lost_ray_warnings(int(seen.counts[N_LEAKED]), seen.bundles)
    fates = ("left_sideways",) if lost else ("leaked", "left_sideways")
    return lost + _missing_light(seen, fates)


def _missing_light(seen: Readings, fates: tuple[str, ...]) -> list[str]:
    """Say what share of the light met some fate, where it is more than a thousandth."""
    columns = {"leaked": LEAKED, "left_sideways": SIDEWAYS, "truncated": TRUNCATED}
    shares = {fate: seen.energy[:, columns[fate]] for fate in fates}
    return lost_light_warnings(shares, None, seen.look.max_bounces)


def _rms_slope(surface: Surface) -> float:
    """Rms slope per axis of a surface, or of one realisation; of a mesh without walls."""
    if isinstance(surface, MeshSurface):
        up = surface.normals[:, 2]
        gentle = up > LEAST_UP
        seen = (surface.areas * up)[gentle]
        squares = (1.0 / up[gentle] ** 2 - 1.0) / 2
        return float(np.sqrt((seen * squares).sum() / seen.sum())) if gentle.any() else 0.0
    sample = surface if isinstance(surface, HeightMap) else surface.sample(0)
    return float(np.sqrt(np.mean([np.mean(slope**2) for slope in sample.slopes()])))


def _check_growth(samples: float, decay: float) -> None:
    """Refuse sampling that sends out more rays at each bounce than find no facet."""
    if samples > SAFE_SAMPLES and decay > SAFE_DECAY:
        msg = (
            f"sample_decay must be at most {SAFE_DECAY:g} with more than {SAFE_SAMPLES:g} "
            f"hemisphere_samples, got {decay:g} with {samples:g}. Rays would multiply from "
            "bounce to bounce."
        )
        raise ValueError(msg)


def _half_angle(name: str, value: float, theta: np.ndarray) -> float:
    half = arguments.in_range(
        name, value, NARROW, 0.5, "Angles are radians; use np.deg2rad."
    )
    if theta.max() + half > np.pi / 2:
        msg = (
            f"{name} must leave the cone above the horizon [rad], got {half:g} about "
            f"{theta.max():.6g} rad. Take a smaller cone or a steeper direction."
        )
        raise ValueError(msg)
    return half

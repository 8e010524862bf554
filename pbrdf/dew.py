"""What dew does to the polarised reflectance of a surface: section 5 of the paper."""

import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from pbrdf.contaminants import Drops
from pbrdf.conventions import direction
from pbrdf.errors import AccuracyWarning, check_seed, require, told_once
from pbrdf.memory import check_room
from pbrdf.optics.materials import Material
from pbrdf.scene.scene import Scene
from pbrdf.simulation.memory import CURE, Effort, asked_size, at_work
from pbrdf.simulation.run import simulate
from pbrdf.surface import Surface
from pbrdf.tracer.arguments import isotropic

DRY = "dry"
# Directions this near to the specular one are its lobe, up to the second angle its skirt;
# the rest are the wings [rad]
LOBE, SKIRT = np.deg2rad(10.0), np.deg2rad(30.0)
REGIONS = ("lobe", "skirt", "wings", "hemisphere")
# Independent runs from which errors are estimated
RUNS = 8

Measure = Callable[[np.ndarray], np.ndarray]


def compare_dew(  # noqa: PLR0913  (a scene, an amount and a run)
    surface: Surface,
    substrate: Material | str,
    contact_angles: Sequence[float],
    theta_i: npt.ArrayLike,
    *,
    amount: Mapping[str, Any],
    water: Material | str = "water",
    runs: int = RUNS,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
    **options: Any,
) -> xr.Dataset:
    """Simulate a surface dry and with the same dew at several contact angles.

    Parameters
    ----------
    surface, substrate
        As of a `Scene`.
    contact_angles : sequence of float
        Contact angles of the water. [rad]
    theta_i : array_like, shape (angles,)
        Zenith angles of the source; its azimuth is averaged over. [rad]
    amount : mapping
        What `Drops` takes besides contact angle and material: volume_per_area,
        number_density, sizes, ...
    water : Material or str
        The liquid.
    runs : int
        Independent runs; their spread is the standard error.
    seed : int
        Makes everything reproducible.
    progress : callable, optional
        Called with (runs done, runs in all).
    **options
        What `simulate` takes, for each run.

    Returns
    -------
    xarray.Dataset
        `brdf` and `brdf_stderr` (state, theta_i, theta_s, dphi, stokes_out, stokes_in) over
        all bounces, `albedo`, the energy budget, `coverage` and the coordinate
        `contact_angle` of each state; NaN for the first, which is dry. `signature` and its
        errors are those of `signatures`.
    """
    check_seed(seed)
    angles = [
        float(angle)
        for angle in require(
            "contact_angles",
            contact_angles,
            lambda v: (v >= 0) & (v <= np.pi),
            "lie in [0, 3.1416] rad",
            "Angles are radians; use np.deg2rad.",
        )
    ]
    scenes = [Scene(surface, substrate)] + [
        Scene(surface, substrate, Drops(contact_angle=angle, material=water, **amount))
        for angle in angles
    ]
    _check_memory(scenes[-1], theta_i, len(scenes), runs, options)
    states = [DRY] + [f"{np.rad2deg(angle):.4g} deg" for angle in angles]
    results, notes = [], dict[str, None]()
    for number, scene in enumerate(scenes):
        repeats = []
        for run in range(runs):
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always", AccuracyWarning)
                # All states of a run share the seed, hence its surfaces
                common: dict[str, Any] = {"phi_i": "uniform", "seed": seed * runs + run}
                repeats.append(simulate(scene, np.atleast_1d(theta_i), **common, **options))
            notes |= {
                str(one.message): None for one in caught if "realiz" not in str(one.message)
            }
            if progress is not None:
                progress(number * runs + run + 1, len(scenes) * runs)
        results.append(_over_runs(repeats))
    told = told_once(notes)
    for note in told:
        warnings.warn(note, AccuracyWarning, stacklevel=2)
    whole = xr.concat(
        results, xr.DataArray(states, dims="state", name="state"),
        combine_attrs="drop_conflicts",
    )  # fmt: skip
    whole = whole.assign_coords(contact_angle=("state", [np.nan, *angles]))
    whole.contact_angle.attrs = {"units": "rad", "long_name": "contact angle of the water"}
    whole["projected_solid_angle"] = repeats[0].projected_solid_angle
    whole = whole.merge(signatures(whole), combine_attrs="override")
    whole["brdf"] = whole.brdf_runs.mean("run")
    # A bin that no ray reached has the error of one
    dark = whole.brdf.isel(stokes_out=0, stokes_in=0, drop=True) == 0.0
    one = whole.one_path / whole.projected_solid_angle
    stderr = _stderr(whole.brdf_runs).where(~dark, one)
    whole["brdf_stderr"] = stderr.transpose(*whole.brdf.dims)
    # Drops are laid anew in every run, and the azimuth is averaged over
    whole.attrs["isotropic"] = isotropic(surface)
    whole.attrs |= {"warnings": told, "runs": runs, "seed": seed}
    # The states have no scene in common but the surface under the water
    if "scene" in results[0].attrs:
        whole.attrs["dry_scene"] = results[0].attrs["scene"]
    return whole.drop_vars(["brdf_runs", "one_path"])


def _check_memory(
    scene: Scene,
    theta_i: npt.ArrayLike,
    states: int,
    runs: int,
    options: Mapping[str, Any],
) -> None:
    """Refuse a comparison that does not fit into the memory that is free."""
    given: dict[str, Any] = {
        "wavelength": None, "n_theta": 45, "n_dphi": 90, "stokes": "full", **options
    }  # fmt: skip
    size = asked_size(
        theta_i, "uniform", given["wavelength"], given["n_theta"], given["n_dphi"],
        given["stokes"],
    )  # fmt: skip
    work = at_work(scene, size, Effort.of(given))
    kept = states * runs * size.unit
    # All runs of a state whole beside the BRDF of those before; then copies by state, for
    # the mean and for its error
    need = max(kept + runs * size.result + work, 3 * kept)
    words = f"{states} states x {runs} runs x {size.words()}"
    check_room(need, words, f"{CURE}, or fewer runs=.")


def signatures(result: xr.Dataset) -> xr.Dataset:
    """Reduce a comparison to numbers: means over parts of the hemisphere.

    Unpolarised light comes in. Each mean is weighted with the projected solid angle.

    Returns
    -------
    xarray.Dataset
        `signature`, `signature_stderr`, and the difference from dry, `added`,
        `added_stderr`, with dims (state, theta_i, region, quantity). Regions: the lobe
        within 10 degrees of the specular direction, its skirt up to 30 degrees, the wings
        beyond, the hemisphere. Quantities: M00, M10, the magnitudes |M20| and of the
        polarised part P = √(M10² + M20² + M30²) [1/sr], DOLP = ΣP / ΣM00 [1], and the peak
        over the region of M00 and P [1/sr].

    Notes
    -----
    Errors and means are those of the jackknife over runs, which takes away the first order
    of the bias that magnitudes and peaks of noisy values have. A region that no ray reached
    has the error of one ray, and a DOLP of 0 ± 1.
    """
    column = result.brdf_runs.isel(stokes_in=0)
    axes = ("run", "state", "theta_i", "theta_s", "dphi", "stokes_out")
    runs = column.transpose(*axes).values
    weight = result.projected_solid_angle.values
    regions = _regions(result)

    def measure(mean: np.ndarray) -> np.ndarray:
        """Quantities (state, theta_i, region, quantity), twice: as they are and added."""
        values = np.stack(
            [_quantities(mean, weight, region) for region in regions.swapaxes(0, 1)],
            axis=-2,
        )
        return np.stack([values, values - values[:1]])

    value, stderr = jackknife(runs, measure)
    # Where no ray went there is no spread, but the error of one ray
    one = result.one_path.transpose("state", "theta_i").values[..., None]
    floor = one / np.sum(regions * weight, axis=(-2, -1))
    floors = np.stack([floor] * 4 + [np.ones_like(floor)] + [floor] * 2, axis=-1)
    dark = (value[0, ..., :1] == 0.0) & (stderr[0, ..., :1] == 0.0)
    stderr = np.where(dark, floors, stderr)
    # What is added to the dark has the error of both
    stderr[1, 1:] = np.where(dark[:1], np.hypot(stderr[1, 1:], floors[:1]), stderr[1, 1:])
    _whole_peaks(value, stderr)
    dims = ("state", "theta_i", "region", "quantity")
    names = ("signature", "added")
    table = {name: (dims, value[k]) for k, name in enumerate(names)}
    table |= {f"{name}_stderr": (dims, stderr[k]) for k, name in enumerate(names)}
    coords = {"region": list(REGIONS), "quantity": list(QUANTITIES)}
    return xr.Dataset(table, coords)


def _whole_peaks(value: np.ndarray, stderr: np.ndarray) -> None:
    """Make the peak of the hemisphere that of the region that has it, in place.

    The jackknife takes more from a peak that several bins compete for than from one alone,
    and would put the peak of the whole below those of its parts.
    """
    for k, name in enumerate(QUANTITIES):
        if not name.startswith("peak"):
            continue
        parts, errors = value[0, :, :, :-1, k], stderr[:, :, :, :-1, k]
        best = np.where(np.isfinite(parts), parts, -np.inf).argmax(axis=-1)[..., None]
        highest = np.take_along_axis(parts, best, -1)[..., 0]
        error = np.take_along_axis(errors[0], best, -1)[..., 0]
        value[0, :, :, -1, k], stderr[0, :, :, -1, k] = highest, error
        value[1, :, :, -1, k] = highest - highest[:1]
        # Of the same region the runs share their noise
        common = np.take_along_axis(errors[1], best, -1)[..., 0]
        apart = np.hypot(error, error[:1])
        stderr[1, :, :, -1, k] = np.where(best[..., 0] == best[:1, :, 0], common, apart)


QUANTITIES = ("M00", "M10", "|M20|", "P", "DOLP", "peak M00", "peak P")


def _quantities(mean: np.ndarray, weight: np.ndarray, region: np.ndarray) -> np.ndarray:
    """Quantities of one region (theta_i, theta_s, dphi), last axis as QUANTITIES."""
    share = weight * region
    share = share / share.sum(axis=(-2, -1), keepdims=True)
    polarised = np.sqrt(np.sum(mean[..., 1:] ** 2, axis=-1))

    def over(values: np.ndarray) -> np.ndarray:
        total: np.ndarray = np.sum(values * share, axis=(-2, -1))
        return total

    def peak(values: np.ndarray) -> np.ndarray:
        highest: np.ndarray = np.max(np.where(region, values, -np.inf), axis=(-2, -1))
        return highest

    m00, p = over(mean[..., 0]), over(polarised)
    degree = np.divide(p, m00, out=np.zeros_like(p), where=m00 > 0.0)
    return np.stack(
        [m00, over(mean[..., 1]), over(np.abs(mean[..., 2])), p, degree,
         peak(mean[..., 0]), peak(polarised)],
        axis=-1,
    )  # fmt: skip


def jackknife(runs: np.ndarray, measure: Measure) -> tuple[np.ndarray, np.ndarray]:
    """Value and standard error of any function of the mean over runs (first axis).

    Efron & Stein, Ann. Stat. 9, 586 (1981).

    Examples
    --------
    Of the mean itself it is the usual error:

    >>> value, stderr = jackknife(np.array([1.0, 2.0, 4.0]), lambda mean: mean)
    >>> round(float(value), 4), round(float(stderr), 4)
    (2.3333, 0.8819)
    """
    number = len(runs)
    total = runs.sum(axis=0)
    whole = measure(total / number)
    parts = np.stack([measure((total - run) / (number - 1)) for run in runs])
    mean = parts.mean(axis=0)
    spread = np.sqrt((number - 1) / number * np.sum((parts - mean) ** 2, axis=0))
    return number * whole - (number - 1) * mean, spread


def _regions(result: xr.Dataset) -> np.ndarray:
    """Which bins belong to which region, (theta_i, region, theta_s, dphi)."""
    theta_s, dphi = np.meshgrid(result.theta_s, result.dphi, indexing="ij")
    # The source is at azimuth 0, its mirror image at π
    specular = direction(result.theta_i.values, np.pi)
    away = np.arccos(np.clip(direction(theta_s, dphi) @ specular.T, -1.0, 1.0))
    away = np.moveaxis(away, -1, 0)
    skirt = (away > LOBE) & (away <= SKIRT)
    return np.stack([away <= LOBE, skirt, away > SKIRT, np.ones_like(skirt)], axis=1)


def _over_runs(repeats: Sequence[xr.Dataset]) -> xr.Dataset:
    """All runs of one state: every BRDF, and the means of the rest."""
    brdf = xr.concat([one.brdf_total for one in repeats], "run")
    albedo = xr.concat([one.albedo.sum("bounces") for one in repeats], "run")
    budget = ("absorbed", "transmitted", "truncated", "leaked")
    found = xr.Dataset({"brdf_runs": brdf, "albedo": albedo.mean("run")})
    found["albedo_stderr"] = _stderr(albedo)
    # The mean path of a run, which over all runs counts less
    paths = [
        one.albedo.sum("bounces") / np.maximum(one.attrs["rays_escaped"], 1)
        for one in repeats
    ]
    found["one_path"] = xr.concat(paths, "run").mean("run") / len(repeats)
    for name in budget:
        found[name] = xr.concat([one[name] for one in repeats], "run").mean("run")
    found.attrs = repeats[0].attrs
    found.attrs = {
        key: value
        for key, value in repeats[0].attrs.items()
        if key not in ("seed", "rel_error", "warnings")
    }
    return found


def _stderr(values: xr.DataArray) -> xr.DataArray:
    return values.std("run", ddof=1) / np.sqrt(values.sizes["run"])

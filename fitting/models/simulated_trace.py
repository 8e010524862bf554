"""What a fit keeps of a Monte Carlo run: few numbers a detector bin, good for any index.

Over an opaque surface the paths of the light do not depend on its index. Light that bounced
once leaves a facet whose normal the two directions dictate, so its Mueller matrix is the
analytical one times one number, the share of such facets that is lit and seen; the
simulation has to tell only the ratio of that number to the analytical one. Light that
bounced more often is shaded, in the same run, at the nodes of an `IndexGrid`.

The run is dealt to independent groups of realisations. Whatever is computed from the
simulation can be computed from each group, and the spread says how well it is known,
however the errors of neighbouring bins hang together.
"""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr

from fitting.models.index_grid import IndexGrid
from pbrdf import HeightMap, Material, MicrofacetModel, Scene, simulate
from pbrdf.errors import AccuracyWarning
from pbrdf.memory import check_room
from pbrdf.simulation.memory import CURE, Effort, asked_size, at_work

__all__ = ["Trace", "group_count", "interpolate_bins", "merged", "trace"]

# Independent runs, from whose spread the error of anything fitted follows
_GROUPS, _FEWEST = 16, 8
# Below this share of the analytical curve's own error a bin's count speaks for itself
_TRUSTED = 0.5
# What independent runs have together
_COUNTS = {
    "realizations", "ray_batches", "rays_per_direction", "path_segments", "rays_escaped",
    "rays_truncated", "rays_leaked", "rays_left_sideways", "self_hits", "exact_searches",
    "medium_mismatches",
}  # fmt: skip
# Nodes of the average over a bin
_ORDER = 4


@dataclass(frozen=True, eq=False)
class Trace:
    """A simulated surface seen from one source direction.

    Parameters
    ----------
    ratio : ndarray, shape (n_theta, n_dphi) or (n_theta, n_dphi, G)
        Light of one bounce over that of the analytical model, in each bin; of each group.
    multiple : ndarray, shape (n_theta, n_dphi, 16, K) or (n_theta, n_dphi, G, 16, K)
        Light of more bounces as coefficients of the grid's polynomials. [1/sr]
    """

    ratio: np.ndarray
    multiple: np.ndarray

    @cached_property
    def groups(self) -> "list[Trace]":
        """The trace of each group alone."""
        return [
            Trace(self.ratio[:, :, g], self.multiple[:, :, g])
            for g in range(self.ratio.shape[2])
        ]

    @cached_property
    def mean(self) -> "Trace":
        """The trace of all groups together."""
        return Trace(self.ratio.mean(axis=2), self.multiple.mean(axis=2))

    def read(self, theta_s: np.ndarray, dphi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return ratio (N,) and coefficients (N, 16, K), or those of each group."""
        return (
            interpolate_bins(self.ratio, theta_s, dphi),
            interpolate_bins(self.multiple, theta_s, dphi),
        )


def trace(  # noqa: PLR0913  (what one may want to choose of a run)
    scene: Scene,
    theta_i: Sequence[float],
    grid: IndexGrid,
    *,
    index: tuple[float, float],
    companion: MicrofacetModel,
    phi_i: float | None = None,
    n_rays: int = 10_000,
    realizations: int = 160,
    seed: int = 0,
    workers: int | None = None,
    n_theta: int = 45,
    n_dphi: int = 36,
    stokes: str = "full",
    progress: Callable[[int, int], None] | None = None,
) -> tuple[list[Trace], xr.Dataset]:
    """Simulate a surface for every index of a grid; return a `Trace` for each incidence.

    Parameters
    ----------
    scene : Scene
        Opaque surface of one material, whose index is not used.
    theta_i : sequence of float
        Incidences. [rad]
    grid : IndexGrid
        Indices to be ready for.
    index : (float, float)
        n and kappa at which light of one bounce is counted, and the dataset holds.
    companion : MicrofacetModel
        Analytical model of the same surface.
    phi_i : float, optional
        Azimuth of the source [rad]; None averages over it, as suits an isotropic surface.
    n_rays, realizations, seed, workers, n_theta, n_dphi, stokes, progress
        See `pbrdf.simulate`; the realisations are dealt to `group_count` runs.

    Returns
    -------
    list of Trace
    Dataset
        What `pbrdf.simulate` returns, for the one `index`; its errors come from the spread
        of the groups.
    """
    groups = group_count(scene, realizations)
    nodes = np.concatenate([[complex(*index)], [] if grid.is_point else grid.nodes])
    # No wavelength of light: a key to the indices, too short for any diffraction
    keys = 1e-9 * np.arange(1, len(nodes) + 1)
    material = Material(*index)
    if len(nodes) > 1:
        material = Material.from_table(wavelength=keys, n=nodes.real, kappa=nodes.imag)
    fixed = isinstance(scene.surface, HeightMap)
    each = -(-realizations // groups)
    lights = np.atleast_1d(theta_i).size
    size = asked_size([0.0] * lights, 0.0, keys, n_theta, n_dphi, stokes)
    effort = Effort(
        n_rays=n_rays, realizations=each, workers=workers, planned=False, looks=False
    )
    work = at_work(scene, size, effort)
    cure = f"{CURE}, or a smaller index_range=."
    check_room(work + groups * size.result, f"{groups} runs x {size.words()}", cure)
    runs = []
    for number, child in enumerate(np.random.SeedSequence(seed).generate_state(groups)):
        with warnings.catch_warnings():
            # A group has few realisations; the groups together have enough
            warnings.simplefilter("ignore", AccuracyWarning)
            run = simulate(
                Scene(scene.surface, material),
                theta_i,
                phi_i="uniform" if phi_i is None else phi_i,
                n_rays=n_rays * each if fixed else n_rays,
                realizations=1 if fixed else each,
                seed=int(child),
                n_theta=n_theta,
                n_dphi=n_dphi,
                stokes=stokes,
                wavelength=keys if len(nodes) > 1 else None,
                # Averaged over azimuth, an isotropic surface is its own mirror image
                fold=phi_i is None,
                workers=workers,
                # Every index sees the same paths, one as well as many
                variance_reduction=False,
            )
        runs.append(run if len(nodes) > 1 else run.expand_dims(wavelength=keys[:1]))
        if progress is not None:
            progress(number + 1, groups)
    once, more = zip(*(_split(run, grid) for run in runs), strict=True)
    counted, multiple = np.stack(once, axis=-1), np.stack(more, axis=-3)
    unit = companion.with_parameters(material=Material(*index))
    traces = []
    for i, incidence in enumerate(theta_i):
        expected = _bin_means(unit, incidence, phi_i or 0.0, n_theta, n_dphi)
        traces.append(Trace(_ratio(counted[i], expected), multiple[i]))
    return traces, merged([run.isel(wavelength=0, drop=True) for run in runs])


def group_count(scene: Scene, realizations: int) -> int:
    """Return the number of independent runs; of a fixed surface the rays are dealt.

    Raises
    ------
    ValueError
        If there are too few realisations to show their spread.
    """
    if isinstance(scene.surface, HeightMap):
        return _GROUPS
    if realizations < _FEWEST:
        msg = (
            f"realizations must be at least {_FEWEST} to show the error of the simulation, "
            f"got {realizations}. Take fewer rays in each instead."
        )
        raise ValueError(msg)
    return min(_GROUPS, realizations)


def merged(runs: Sequence[xr.Dataset]) -> xr.Dataset:
    """Return the mean of independent runs, and the standard errors that their spread shows.

    A bin that no ray reached in any of them keeps the error of one ray.
    """
    together = xr.concat(runs, "run", data_vars="all", coords="minimal", compat="equals")
    result = together.mean("run", keep_attrs=True)
    for name in [str(name) for name in together.data_vars]:
        if name.endswith("_stderr"):
            spread = together[name.removesuffix("_stderr")].std("run", ddof=1)
            one_ray = np.sqrt((together[name] ** 2).mean("run"))
            error = spread.where(spread > 0.0, one_ray) / np.sqrt(len(runs))
            result[name] = error.assign_attrs(together[name].attrs)
    # What one run says of its own precision does not hold for all of them
    attrs = {k: v for k, v in runs[0].attrs.items() if k != "rel_error"}
    for name in _COUNTS & attrs.keys():
        counts = np.sum([run.attrs[name] for run in runs], axis=0)
        attrs[name] = counts.tolist()
    attrs["warnings"] = [
        note for note in attrs["warnings"] if "too few for honest" not in note
    ]
    result.attrs = attrs | {"independent_runs": len(runs)}
    return result


def _split(run: xr.Dataset, grid: IndexGrid) -> tuple[np.ndarray, np.ndarray]:
    """Return M00 of one bounce (angles, n_theta, n_dphi) and coefficients of the rest."""
    order = (
        "bounces",
        "wavelength",
        "theta_i",
        "theta_s",
        "dphi",
        "stokes_out",
        "stokes_in",
    )
    brdf = run.brdf.transpose(*order).values
    several = brdf[1:, -len(grid.nodes) :].sum(axis=0)
    values = np.zeros((*several.shape[:-2], 4, 4))
    values[..., : several.shape[-2], : several.shape[-1]] = several
    values = values.reshape(*values.shape[:-2], 16)
    coefficients = np.tensordot(values, grid.coefficients, axes=(0, 1))
    return brdf[0, 0, ..., 0, 0], coefficients


def _ratio(counted: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """Return counted over expected light, drawn to 1 where the count says nothing.

    A bin hit by few rays is known to a factor at best; there the analytical curve stands.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(expected[..., None] > 0.0, counted / expected[..., None], 1.0)
        mean = ratio.mean(axis=-1, keepdims=True)
        error = ratio.std(axis=-1, ddof=1, keepdims=True) / np.sqrt(ratio.shape[-1])
        weight = np.where(mean > 0.0, 1.0 / (1.0 + (error / (_TRUSTED * mean)) ** 2), 0.0)
    return np.asarray(1.0 + weight * (ratio - 1.0))


def _bin_means(
    model: MicrofacetModel, theta_i: float, phi_i: float, n_theta: int, n_dphi: int
) -> np.ndarray:
    """Return the mean of M00 over each bin, weighted as the simulation's is."""
    node, weight = np.polynomial.legendre.leggauss(_ORDER)
    step, turn = 0.5 * np.pi / n_theta, 2.0 * np.pi / n_dphi
    theta = (np.arange(n_theta)[:, None] + 0.5 + 0.5 * node) * step
    dphi = (np.arange(n_dphi)[:, None] + 0.5 * node) * turn
    m00 = model.brdf(theta_i, theta[:, None, :, None], dphi[None, :, None, :], phi_i=phi_i)
    share = weight * np.sin(theta) * np.cos(theta)
    mean = np.einsum("tpab,ta,b->tp", m00[..., 0, 0], share, weight)
    return np.asarray(mean / share.sum(axis=1)[:, None] / weight.sum())


def interpolate_bins(
    values: np.ndarray, theta_s: np.ndarray, dphi: np.ndarray
) -> np.ndarray:
    """Interpolate hemisphere bins linearly in zenith and azimuth.

    The zenith axis goes on through the pole, where (-theta, dphi) is (theta, dphi + pi):
    both Stokes frames turn by pi there, which no Mueller matrix notices.

    Parameters
    ----------
    values : ndarray, shape (n_theta, n_dphi, ...)
        At the bins' centres: equal zenith bins from 0 to pi/2, equal azimuth bins of which
        the first is centred on 0.
    theta_s, dphi : ndarray, shape (N,)
        Where to read. [rad]

    Returns
    -------
    ndarray, shape (N, ...)
    """
    n_theta, n_dphi = values.shape[:2]
    row, up = _between(np.asarray(theta_s) / (0.5 * np.pi) * n_theta - 0.5)
    column, on = _between(np.asarray(dphi) / (2.0 * np.pi) * n_dphi)
    result = np.zeros((row.size, *values.shape[2:]))
    trailing = [1] * (values.ndim - 2)
    for theta, theta_weight in ((row, 1.0 - up), (row + 1, up)):
        # Below the pole it is seen from the other side; past the last bin it stands
        mirrored = np.where(theta < 0, n_dphi // 2, 0)
        inside = np.minimum(np.where(theta < 0, -1 - theta, theta), n_theta - 1)
        for azimuth, weight in ((column, 1.0 - on), (column + 1, on)):
            share = (theta_weight * weight).reshape(-1, *trailing)
            result += share * values[inside, (azimuth + mirrored) % n_dphi]
    return result


def _between(position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the whole number below each position, and how far it is past that."""
    below = np.floor(position + 1e-9).astype(int)
    return below, np.maximum(position - below, 0.0)

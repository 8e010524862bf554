"""Memory that `simulate` will take, foretold before it begins."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from pbrdf.conventions import BOUNCES
from pbrdf.kernels.bins.bin_fits import MAX_ORDER, MIN_ORDER
from pbrdf.kernels.paths.shading import N_RECORD
from pbrdf.kernels.paths.spectra import N_SUMS
from pbrdf.kernels.sights.light import N_CELL
from pbrdf.kernels.sights.mapped import N_LOOK
from pbrdf.memory import (
    NODE,
    PROGRAM,
    SHARE,
    Size,
    check_room,
    check_surface,
    free_bytes,
)
from pbrdf.scene.scene import Scene
from pbrdf.simulation.singles.profiles import most_bytes
from pbrdf.simulation.singles.single_bounce import LEAST_DPHI, LEAST_THETA
from pbrdf.simulation.spectra import BUFFER, WORTHWHILE
from pbrdf.surface import GaussianSurface, HeightMap
from pbrdf.tracer import arguments

__all__ = ["CURE", "OF_SIZE", "Effort", "asked_size", "at_once", "at_work", "check_run"]

CURE = (
    "Reduce theta_i=, phi_i=, wavelength=, n_theta= or n_dphi=, take stokes='unpolarized'"
)
_PARTS = "go part by part: -o name.zarr, or pbrdf.simulation.simulate_parts"
# Arguments of `simulate` that say how large its result is, besides theta_i
OF_SIZE = ("phi_i", "wavelength", "n_theta", "n_dphi", "stokes")
# Rays and samples where a plan or a target error will say how many
_RAYS, _MANY = 100_000, 10**6
# Numbers of 8 bytes a bin that tell how facets are seen and balance them with the rays
_LOOKS = 16
# Buffered rows of a ray, at the most
_ROWS = 2


def asked_size(
    theta_i: npt.ArrayLike, phi_i: npt.ArrayLike | str, wavelength: npt.ArrayLike | None,
    n_theta: int, n_dphi: int, stokes: str,
) -> Size:  # fmt: skip
    """Return the size of what is asked for; arguments as of `simulate`.

    Raises
    ------
    TypeError, ValueError
        If one is out of its range.
    """
    waves = arguments.wavelengths(wavelength)
    n_theta = arguments.count("n_theta", n_theta, 1)
    return Size(
        angles=len(arguments.zeniths(theta_i)),
        azimuths=len(arguments.azimuths(phi_i)[0]),
        waves=1 if waves is None else waves.size,
        bins=n_theta * arguments.even_count("n_dphi", n_dphi),
        n_stokes=arguments.stokes_count(stokes),
    )


@dataclass(frozen=True, kw_only=True)
class Effort:
    """How much is traced, and by how many, as `simulate` is asked.

    Attributes
    ----------
    n_rays, realizations, workers : int or None
        As of `simulate`.
    planned : bool
        Whether there is a target error, and samples are as many as it takes.
    looks : bool
        Whether single bounces may come from looks at facets.
    """

    n_rays: int | None
    realizations: int | None
    workers: int | None
    planned: bool
    looks: bool

    @classmethod
    def of(cls, given: Mapping[str, Any]) -> "Effort":
        """Return what these options of `simulate` ask for."""
        return cls(
            n_rays=given.get("n_rays"),
            realizations=given.get("realizations"),
            workers=given.get("workers"),
            planned=given.get("target_rel_error") is not None,
            looks=given.get("variance_reduction", True),
        )


def check_run(scene: Scene, size: Size, effort: Effort) -> None:
    """Refuse a run that does not fit into the memory that is free.

    Arguments as of `at_work`.

    Raises
    ------
    ValueError
        With what it would take, and what to change.
    """
    room = free_bytes()
    check_surface(scene.surface, room)
    need = at_work(scene, size, effort)
    check_room(need, size.words(), f"{CURE}, fewer workers=, or {_PARTS}.", room)


def at_work(scene: Scene, size: Size, effort: Effort, *, among: int | None = None) -> float:
    """Return the most that `simulate` takes at one time. [bytes]

    It is an upper end: threads need not hold all tallies that they may at one time.

    Parameters
    ----------
    scene : Scene
    size : Size
        What is computed.
    effort : Effort
        How much is traced.
    among : int, optional
        How many wavelengths there are in all, if these are a part of them.
    """
    threads = arguments.worker_count(effort.workers)
    rays = arguments.count("n_rays", effort.n_rays or _RAYS, 1)
    few = _MANY if effort.planned else 1
    drawn = arguments.count("realizations", effort.realizations or few, 1)
    batched = not arguments.varies(scene) or drawn == 1
    samples = max(arguments.BATCHES, drawn) if batched else drawn
    samples = _MANY if effort.planned else samples
    clean = not scene.contaminants and not getattr(scene.surface, "transparent", ())
    spectral = clean and (among or size.waves) >= WORTHWHILE
    # Those traced, those that wait for the one before them, and the one that is added
    tallies = min(samples, 2 * threads + 1)
    # Means and scatters by bounces, the scatter of all together
    held = float((2 * len(BOUNCES) + 1) * size.unit)
    held += tallies * _tally(size, len(scene.materials), rays if spectral else None)
    # One after another: what was estimated, and strengths of single elements of it
    finished = size.result + 8 * size.unit / size.n_stokes**2
    surface = scene.surface
    drawn_anew = surface if isinstance(surface, GaussianSurface) and not batched else None
    mapped = surface if clean and isinstance(surface, HeightMap) else None
    if effort.looks and (drawn_anew is not None or mapped is not None):
        sights = _sights(size)
        if drawn_anew is not None:
            lines = most_bytes(drawn_anew, size.bins // LEAST_THETA)
            sights += size.angles * size.azimuths * lines
        if mapped is not None:
            # What the points of each facet tell, and looks of each batch
            sights += 2.0 * mapped.heights.size * size.angles * size.azimuths
            sights += 8.0 * N_LOOK * threads * rays
        held += sights
        finished += sights + 6 * size.unit / size.n_stokes**2
    if size.azimuths > 1:
        # Azimuths are put together in arrays of their own
        finished += size.result
    nodes = int(np.prod(getattr(surface, "shape", (0,))))
    surfaces = NODE * nodes * (1 if batched else min(samples, threads))
    return max(held + surfaces, finished) + PROGRAM


def at_once(scene: Scene, size: Size, effort: Effort) -> tuple[int, int]:
    """Return how many directions of the source, and wavelengths, fit into free memory.

    Fewer wavelengths than all only where not even one direction fits with all of them.

    Raises
    ------
    ValueError
        If not even one direction at one wavelength does.
    """

    def need(angles: int, waves: int) -> float:
        part = replace(size, angles=angles, waves=waves)
        return at_work(scene, part, effort, among=size.waves) + _sights(part)

    check_surface(scene.surface)
    least = replace(size, angles=1, waves=1)
    check_room(need(1, 1), least.words(), f"{CURE}, or fewer workers=.")
    free = SHARE * free_bytes()
    # Beside a part the one that is being written
    if need(1, size.waves) > free:
        one, two = need(1, 1), need(1, 2)
        fits = int(1 + (0.5 * free - one) / (two - one))
        return 1, max(1, min(size.waves - 1, fits))
    one, two = need(1, size.waves), need(2, size.waves)
    fits = int(1 + (0.5 * free - one) / (two - one))
    return max(1, min(size.angles, fits)), size.waves


def _tally(size: Size, materials: int, rays: int | None) -> float:
    """Memory of the tally of a sample, with `rays` that wait to be shaded. [bytes]"""
    directions = size.angles * size.azimuths
    by_bin = directions * size.bins
    small = len(BOUNCES) * by_bin + 8 * by_bin
    flux = len(BOUNCES) * size.unit
    if rays is None:
        return small + flux
    sums = 1 if size.n_stokes == 1 else N_SUMS
    orders = (MIN_ORDER + MAX_ORDER) / 2
    rows = min(BUFFER, _ROWS * rays)
    light = 8 * (materials * by_bin * sums * orders + directions * rows * N_RECORD)
    # A buffer that overflows is shaded into the flux
    return small + light + (flux if _ROWS * rays > BUFFER else 0)


def _sights(size: Size) -> float:
    """Memory of single bounces that do not come from rays. [bytes]"""
    per_bin = 8 * size.angles * size.azimuths
    cells = per_bin * max(size.bins, LEAST_THETA * LEAST_DPHI)
    light = cells * (N_CELL + size.waves * size.n_stokes**2)
    balance = (_LOOKS + (len(BOUNCES) + 1) * size.waves) * per_bin * size.bins
    return float(light + balance)

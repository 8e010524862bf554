"""Simulations part by part, and several from one trace."""

import inspect
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from pbrdf.scene.scene import Scene
from pbrdf.simulation import memory
from pbrdf.simulation.memory import OF_SIZE, Effort, asked_size, check_run
from pbrdf.simulation.plan import Plan
from pbrdf.simulation.results import judged_before, labelled
from pbrdf.simulation.run import (
    facets_of,
    planned,
    prepared,
    simulate,
    traced,
    wants_looks,
)
from pbrdf.simulation.samples import Ready, Singles, trace_samples
from pbrdf.simulation.singles.mapped import MappedSingle
from pbrdf.simulation.singles.single_bounce import SingleBounce, can_do_without
from pbrdf.surface import Surface
from pbrdf.tracer import arguments

__all__ = ["simulate_parts", "simulate_together"]


def simulate_parts(
    scene: Scene,
    theta_i: npt.ArrayLike,
    *,
    at_once: int | None = None,
    waves_at_once: int | None = None,
    **options: Any,
) -> Iterator[xr.Dataset]:
    """Simulate some directions after others: for results that do not fit into memory.

    Put together along theta_i they are what `simulate` gives, bit for bit; attributes are
    those of each part. Where one direction does not fit, its wavelengths come in groups,
    one group after another before the next direction. Realisations are drawn, and rays
    traced, anew for each part.

    Parameters
    ----------
    scene, theta_i
        As of `simulate`.
    at_once : int, optional
        Directions of a part; as many as fit into the free memory by default.
    waves_at_once : int, optional
        Wavelengths of a part; all of them by default, or as many as fit.
    **options
        What `simulate` takes but target_rel_error, which is reached by all directions
        together.

    Yields
    ------
    xarray.Dataset
        Its `encoding["first"]` holds the places of its first direction and wavelength.

    Raises
    ------
    TypeError, ValueError
        As `simulate`, or if not even one direction fits at one wavelength.

    Examples
    --------
    >>> from pbrdf import HeightMap, Material
    >>> scene = Scene(HeightMap.flat(size=(1.0, 1.0)), Material(1.5))
    >>> parts = simulate_parts(scene, [0.0, 0.3, 0.6], at_once=2, n_rays=320)
    >>> [part.sizes["theta_i"] for part in parts]
    [2, 1]
    """
    bound = inspect.signature(simulate).bind(scene, theta_i, **options)
    bound.apply_defaults()
    given = bound.arguments
    if given["target_rel_error"] is not None:
        msg = (
            f"target_rel_error must be left out here, got {given['target_rel_error']}: it "
            "is reached by all directions together. Give n_rays and realizations."
        )
        raise ValueError(msg)
    size = asked_size(theta_i, **{name: given[name] for name in OF_SIZE})
    if at_once is None:
        at_once, fitting = memory.at_once(scene, size, Effort.of(given))
        waves_at_once = waves_at_once or fitting
    at_once = arguments.count("at_once", at_once, 1)
    by_waves = arguments.count("waves_at_once", waves_at_once or size.waves, 1)
    ready = prepared(whole=False, **given)
    starts = list(product(range(0, size.angles, at_once), range(0, size.waves, by_waves)))
    for number, (first, wave) in enumerate(starts):
        part = ready.part(first, min(first + at_once, size.angles))
        if by_waves < size.waves:
            part = part.of_waves(wave, min(wave + by_waves, size.waves))
        told = _told(given["progress"], number, len(starts))
        made = traced(replace(part, run=replace(part.run, progress=told)))
        made.encoding["first"] = {"theta_i": first, "wavelength": wave}
        yield made


def _told(
    progress: Callable[[int, int], None] | None, number: int, parts: int
) -> Callable[[int, int], None] | None:
    """Count the samples of one of several parts on from those before it."""
    if progress is None:
        return None
    return lambda done, total: progress(number * total + done, parts * total)


def simulate_together(
    surface: Surface,
    theta_i: npt.ArrayLike,
    lights: Sequence[tuple[Any, npt.ArrayLike | None]],
    **options: Any,
) -> list[xr.Dataset]:
    """Simulate a clean surface of several materials, or at several wavelengths, at once.

    One trace serves all. Each result is that of `simulate` bit for bit, or where that sums
    single bounces by bin (four wavelengths or more, skip "spectra") within the 1e-8 of M00
    that it keeps to.

    Parameters
    ----------
    surface, theta_i
        As of `Scene` and `simulate`.
    lights : sequence of (substrate, wavelength)
        Of each result: as of `Scene` and `simulate`.
    **options
        What `simulate` takes besides, but target_rel_error, which each run reaches with a
        number of samples of its own.

    Returns
    -------
    list of Dataset

    Raises
    ------
    ValueError
        As `simulate`, or if light goes through the surface, or only some of the materials
        have a diffuse base, or only some of the lights four wavelengths.

    Examples
    --------
    >>> from pbrdf import HeightMap, Material
    >>> flat = HeightMap.flat(size=(1.0, 1.0))
    >>> lights = [(Material(1.5), None), (Material(2.0), None)]
    >>> results = simulate_together(flat, 0.0, lights, n_rays=320)
    >>> [round(one.albedo.values.sum(), 4) for one in results]
    [np.float64(0.04), np.float64(0.1111)]
    """
    if options.get("target_rel_error") is not None:
        msg = (
            f"target_rel_error must be left out here, got {options['target_rel_error']}: "
            "each run reaches it by itself. Give n_rays and realizations."
        )
        raise ValueError(msg)
    # One seed for all, drawn if none is given
    seed = int(arguments.seed_sequence(options.get("seed", 0)).entropy)  # type: ignore[arg-type]
    each = []
    for substrate, wavelength in lights:
        asked = options | {"seed": seed, "wavelength": wavelength}
        bound = inspect.signature(simulate).bind(
            Scene(surface, substrate), theta_i, **asked
        )
        bound.apply_defaults()
        each.append(planned(whole=False, **bound.arguments))
    _check_all(each)
    plans, first = _joined(each), each[0]
    single: Singles = None
    if wants_looks(first.run, first.given) and can_do_without(surface, first.plans[0]):
        single = [SingleBounce.of(surface, plan) for plan in plans]
    judged = [judged_before(one) for one in each]
    target = facets_of(first)
    if target is not None:
        single = [MappedSingle.of(target, plan) for plan in plans]
    moments, done = trace_samples(first.run, plans, single)
    found, at = [], 0
    for one, notes in zip(each, judged, strict=True):
        end = at + len(one.plans[0].n)
        own = [
            all_waves.of_waves(at, end, plan)
            for all_waves, plan in zip(moments, one.plans, strict=True)
        ]
        found.append(labelled(replace(one, single=single), own, done, notes))
        at = end
    return found


def _check_all(each: Sequence[Ready]) -> None:
    """Refuse runs that do not fit together into the memory that is free."""
    given = each[0].given
    size = asked_size(given["theta_i"], **{name: given[name] for name in OF_SIZE})
    waves = sum(len(one.run.n) for one in each)
    check_run(each[0].run.scene, replace(size, waves=waves), Effort.of(given))


def _joined(each: Sequence[Ready]) -> list[Plan]:
    """Put the constants of all runs into one plan each azimuth, as if of more wavelengths.

    Raises
    ------
    ValueError
        If a run asks for other paths.
    """
    for number, one in enumerate(each):
        plan, wanted = one.plans[0], each[0].plans[0]
        same = (
            plan.media is None
            and plan.base.shape[1] == wanted.base.shape[1]
            and plan.n.shape[1] == wanted.n.shape[1]
            and (plan.spectrum is None) == (wanted.spectrum is None)
        )
        if not same:
            msg = (
                "lights must be of opaque materials, all with a diffuse base or none, and "
                f"all of four wavelengths or more or none, got another at index {number}. "
                "Simulate it alone."
            )
            raise ValueError(msg)
    joined = []
    for plans in zip(*(one.plans for one in each), strict=True):
        constants = {
            name: np.concatenate([getattr(plan, name) for plan in plans])
            for name in ("n", "kappa", "base")
        }
        # By bin only what each would sum by bin alone
        skips = plans[0].skips
        skips = skips if plans[0].spectrum else skips - {"spectra"}
        joined.append(replace(plans[0], skips=skips, **constants))
    return [joined[0], *(joined[0].at(plan.phi_i) for plan in joined[1:])]

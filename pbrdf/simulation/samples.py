"""Samples of a run: realisations of a scene, or batches of rays over one, until enough."""

import copy
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from pbrdf.scene.scene import Scene
from pbrdf.simulation.moments import Moments
from pbrdf.simulation.plan import Plan, Tally
from pbrdf.simulation.singles.single_bounce import SingleBounce
from pbrdf.simulation.singles.wet import BesideBodies
from pbrdf.simulation.trace import Target, prepare, trace_sample
from pbrdf.surface import FixedSurface, HeightMap, MeshSurface
from pbrdf.tracer import arguments
from pbrdf.tracer.asked import Run
from pbrdf.tracer.embree import EmbreeField
from pbrdf.tracer.field import Field
from pbrdf.tracer.schedule import gather
from pbrdf.tracer.wet_field import WetField
from pbrdf.tracer.wet_mesh import WetMesh

# What is known of the single bounces of each plan
Singles = Sequence[SingleBounce | BesideBodies] | None


@dataclass(frozen=True, kw_only=True)
class Ready:
    """A run that is checked and planned, as its arguments say.

    `chosen` says how a plan was chosen; `given` holds the arguments of `simulate`.
    """

    run: Run
    plans: list[Plan]
    several: bool
    single: Singles
    chosen: list[str]
    given: dict[str, Any]

    def part(self, first: int, last: int) -> "Ready":
        """Return the run of some of the directions, with the rays they have among all."""
        single = self.single and [one.part(first, last) for one in self.single]
        # Streams are spawned anew, from the same root
        run = replace(self.run, root=copy.deepcopy(self.run.root))
        plans = [plan.part(first, last) for plan in self.plans]
        return replace(self, run=run, plans=plans, single=single)

    def of_waves(self, first: int, last: int) -> "Ready":
        """Return the run of some of the wavelengths, over the same rays."""
        run, own = self.run, slice(first, last)
        waves = None if run.waves is None else np.atleast_1d(run.waves)[own]
        run = replace(
            run, root=copy.deepcopy(run.root), waves=waves, n=run.n[own],
            kappa=run.kappa[own], base=run.base[own],
        )  # fmt: skip
        plans = [plan.of_waves(first, last) for plan in self.plans]
        single = self.single and [one.of_waves(first, last) for one in self.single]
        return replace(self, run=run, plans=plans, single=single)


def trace_samples(
    run: Run, plans: Sequence[Plan], single: Singles
) -> tuple[list[Moments], int]:
    """Trace samples until there are enough: the moments of each plan, and how many."""
    # Tallies to use again: to make a large one costs more than to clear it
    spare: deque[Tally] = deque()
    if run.batched:
        # The surface, or the one realisation asked for, stays the same in all batches
        first = run.root.spawn(1)[0] if arguments.varies(run.scene) else run.root
        draw = partial(_trace_fixed, _realize(run.scene, plans[0], first), plans, spare)
    else:
        draw = partial(_trace_realization, run.scene, plans, single, spare)
    moments = [Moments(one) for one in plans]
    if clean := [one for one in single or () if isinstance(one, SingleBounce)]:
        moments = [Moments(*both) for both in zip(plans, clean, strict=True)]

    def add(tallies: Sequence[Tally], each: Callable[..., Iterable[Any]]) -> None:
        for one, tally in zip(moments, tallies, strict=True):
            one.add(tally, each)
            spare.append(tally.emptied())

    done = gather(
        draw, run.root, add, lambda: max(one.rel_error() for one in moments),
        samples=run.samples, target=run.target, workers=run.workers, progress=run.progress,
    )  # fmt: skip
    return moments, done


def _realize(scene: Scene, plan: Plan, seed: np.random.SeedSequence) -> Target:
    """One realisation of the scene, ready for tracing."""
    surface = scene.surface
    if not isinstance(surface, FixedSurface):
        surface = surface.sample(seed)
    if isinstance(surface, MeshSurface) and plan.media is not None:
        return WetMesh.of(surface, scene, plan.media, seed, plan.skips)
    target = prepare(surface, plan.skips)
    if plan.media is None:
        return target
    # Contaminants on a height map exclude the Embree route
    assert isinstance(target, Field)
    assert isinstance(surface, HeightMap)
    return WetField.of(
        target, surface, scene.contaminants, plan.media, seed,
        skips_deep="deep" in plan.skips,
    )  # fmt: skip


def _taken(spare: deque[Tally]) -> Tally | None:
    try:
        return spare.pop()
    except IndexError:
        return None


def _trace_fixed(
    target: Target,
    plans: Sequence[Plan],
    spare: deque[Tally],
    seed: np.random.SeedSequence,
) -> list[Tally]:
    """One sample of every azimuth: the same surface, streams and entry points."""
    return [trace_sample(target, plan, seed, _taken(spare)) for plan in plans]


def _trace_realization(
    scene: Scene,
    plans: Sequence[Plan],
    single: Singles,
    spare: deque[Tally],
    seed: np.random.SeedSequence,
) -> list[Tally]:
    heights, rays, looks = seed.spawn(3)
    if single is None:
        return _trace_fixed(_realize(scene, plans[0], heights), plans, spare, rays)
    if beside := [one for one in single if isinstance(one, BesideBodies)]:
        return _trace_beside_bodies(scene, plans, beside, spare, (heights, rays, looks))
    clean = [one for one in single if isinstance(one, SingleBounce)]
    if all(one.everything for one in clean):
        tallies = [_taken(spare) or Tally.empty(plan) for plan in plans]
        terrain = None
    else:
        target = _realize(scene, plans[0], heights)
        tallies = _trace_fixed(target, plans, spare, rays)
        assert isinstance(target, (Field, EmbreeField))  # no bodies on it
        terrain = (target if isinstance(target, Field) else target.field).terrain
    for plan, one, tally in zip(plans, clean, tallies, strict=True):
        one.add(terrain, plan, looks, tally)
    return tallies


def _trace_beside_bodies(
    scene: Scene,
    plans: Sequence[Plan],
    beside: Sequence[BesideBodies],
    spare: deque[Tally],
    seeds: tuple[np.random.SeedSequence, ...],
) -> list[Tally]:
    """One realisation with bodies; `seeds` of the scene, its rays and the looks."""
    heights, rays, looks = seeds
    target = _realize(scene, plans[0], heights)
    assert isinstance(target, WetField)
    tallies = _trace_fixed(target, plans, spare, rays)
    bodies = beside[0].on_plane(heights)
    for plan, one, tally in zip(plans, beside, tallies, strict=True):
        one.add(target, bodies, plan, (rays, looks), tally)
    return tallies

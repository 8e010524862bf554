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
from pbrdf.simulation.singles.clean import Clean
from pbrdf.simulation.singles.mapped import MappedSingle
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
Singles = Sequence[SingleBounce | MappedSingle | BesideBodies] | None


@dataclass(frozen=True, kw_only=True)
class Ready:
    """A run that is checked and planned, as its arguments say.

    `chosen` says how a plan was chosen; `given` holds the arguments of `simulate`; `target`
    is the map if its facets are to give the single bounces.
    """

    run: Run
    plans: list[Plan]
    several: bool
    single: Singles
    chosen: list[str]
    given: dict[str, Any]
    target: Field | EmbreeField | None = None

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
    clean: list[Clean] = []
    for one, plan in zip(single or (), plans, strict=False):
        if isinstance(one, SingleBounce):
            clean.append(one.with_light(plan))
        elif isinstance(one, MappedSingle):
            clean.append(one)
    if single and isinstance(single[0], MappedSingle):
        draw = partial(_trace_map, single[0].target, plans, clean, spare)
    elif run.batched:
        # The surface, or the one realisation asked for, stays the same in all batches
        first = run.root.spawn(1)[0] if arguments.varies(run.scene) else run.root
        draw = partial(_trace_fixed, _realize(run.scene, plans[0], first), plans, spare)
    else:
        draw = partial(_trace_realization, run.scene, plans, clean or single, spare)
    moments = [Moments(one) for one in plans]
    if clean:
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


def _taken(spare: deque[Tally], plan: Plan) -> Tally:
    try:
        return spare.pop()
    except IndexError:
        return Tally.empty(plan)


def _trace_fixed(
    target: Target,
    plans: Sequence[Plan],
    spare: deque[Tally],
    seed: np.random.SeedSequence,
) -> list[Tally]:
    """One sample of every azimuth: the same surface, streams and entry points."""
    return [trace_sample(target, plan, seed, _taken(spare, plan)) for plan in plans]


def _trace_map(
    target: Field | EmbreeField,
    plans: Sequence[Plan],
    single: Sequence[Clean],
    spare: deque[Tally],
    seed: np.random.SeedSequence,
) -> list[Tally]:
    """Do so with single bounces from the facets of the map."""
    # The rays are those of the plain estimator
    return _trace_clean(target, plans, single, spare, (seed, seed.spawn(1)[0]))


def _trace_clean(
    target: Field | EmbreeField | None,
    plans: Sequence[Plan],
    single: Sequence[Clean],
    spare: deque[Tally],
    seeds: tuple[np.random.SeedSequence, np.random.SeedSequence],
) -> list[Tally]:
    """One sample whose single bounces do not come from its rays; seeds of these and looks.

    Without a target no ray is traced.
    """
    tallies = []
    for plan, one in zip(plans, single, strict=True):
        tallies.append(_taken(spare, plan))
        # Azimuths share the tallies, but not what is known
        tallies[-1].leave_out(one.serves())
    terrain = None
    if target is not None and not all(one.everything for one in single):
        tallies = [
            trace_sample(
                target, plan, seeds[0], tally,
                # A Gaussian surface turned by half a circle is another one
                both_ways=isinstance(one, SingleBounce) and plan.phi_i is not None,
            )
            for plan, one, tally in zip(plans, single, tallies, strict=True)
        ]  # fmt: skip
        terrain = (target if isinstance(target, Field) else target.field).terrain
    for plan, one, tally in zip(plans, single, tallies, strict=True):
        one.add(terrain, plan, seeds[1], tally)
    return tallies


def _trace_realization(
    scene: Scene,
    plans: Sequence[Plan],
    single: Sequence[Clean | BesideBodies] | None,
    spare: deque[Tally],
    seed: np.random.SeedSequence,
) -> list[Tally]:
    heights, rays, looks = seed.spawn(3)
    if single is None:
        return _trace_fixed(_realize(scene, plans[0], heights), plans, spare, rays)
    if beside := [one for one in single if isinstance(one, BesideBodies)]:
        return _trace_beside_bodies(scene, plans, beside, spare, (heights, rays, looks))
    clean = [one for one in single if not isinstance(one, BesideBodies)]
    if all(one.everything for one in clean):
        return _trace_clean(None, plans, clean, spare, (rays, looks))
    target = _realize(scene, plans[0], heights)
    assert isinstance(target, (Field, EmbreeField))  # no bodies on it
    return _trace_clean(target, plans, clean, spare, (rays, looks))


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

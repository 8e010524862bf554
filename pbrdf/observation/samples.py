"""Samples of a look at a scene: realisations, or batches of rays over one, until enough."""

from functools import partial

import numpy as np

from pbrdf.observation.look import Look, Sight
from pbrdf.observation.one_sample import look_at
from pbrdf.observation.readings import Readings
from pbrdf.surface import FixedSurface, GaussianSurface, MeasuredSurface, MeshSurface
from pbrdf.tracer.asked import Run
from pbrdf.tracer.field import Field
from pbrdf.tracer.mesh_field import MeshField
from pbrdf.tracer.schedule import gather


def look_at_samples(run: Run, look: Look) -> Readings:
    """Look at samples until there are enough."""
    surface = run.scene.surface
    if run.batched:
        shared = (
            surface
            if isinstance(surface, FixedSurface)
            else surface.sample(run.root.spawn(1)[0])
        )
        draw = partial(look_at, _ready(shared), look)
    else:
        assert not isinstance(surface, FixedSurface)  # a fixed surface is batched
        draw = partial(_look_at_realization, surface, look)
    seen = Readings(look)
    gather(
        draw, run.root, lambda sight, _: seen.add(sight), seen.rel_error,
        samples=run.samples, target=run.target, workers=run.workers, progress=run.progress,
    )  # fmt: skip
    return seen


def _ready(surface: FixedSurface) -> Field | MeshField:
    """Make a surface ready for tracing."""
    if isinstance(surface, MeshSurface):
        return MeshField.of(surface, frozenset(["steep"]))
    return Field.of(surface)


def _look_at_realization(
    surface: GaussianSurface | MeasuredSurface, look: Look, seed: np.random.SeedSequence
) -> Sight:
    heights, rays = seed.spawn(2)
    return look_at(Field.of(surface.sample(heights)), look, rays)

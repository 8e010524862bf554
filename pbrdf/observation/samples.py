"""Samples of a look at a scene: realisations, or batches of rays over one, until enough."""

from functools import partial

import numpy as np

from pbrdf.conventions import BOUNCES
from pbrdf.memory import NODE, PROGRAM, Size, check_room
from pbrdf.observation.beams import BeamLook
from pbrdf.observation.expected import Expected, expected_of
from pbrdf.observation.look import Look, Sight
from pbrdf.observation.one_sample import look_at
from pbrdf.observation.readings import Readings
from pbrdf.surface import FixedSurface, GaussianSurface, MeasuredSurface, MeshSurface
from pbrdf.tracer import arguments
from pbrdf.tracer.asked import Run
from pbrdf.tracer.field import Field
from pbrdf.tracer.media import media_of_scene
from pbrdf.tracer.mesh_field import MeshField
from pbrdf.tracer.schedule import MOST_SAMPLES, gather


def at_work(run: Run, look: Look) -> float:
    """Return the most that looking at the samples of a run takes at one time. [bytes]"""
    unit = _size(look).unit
    samples = run.samples if run.target is None else MOST_SAMPLES
    sights = min(samples, 2 * run.workers + 1)
    # Matrices of each sight by bounces, those that come by luck, and their variance; means
    # and scatters of two kinds and what is foretold, with copies of some while one is added
    held = (3 * len(BOUNCES) * sights + (5 + 4) * (len(BOUNCES) + 1)) * unit
    nodes = int(np.prod(getattr(run.scene.surface, "shape", (0,))))
    return held + NODE * nodes * (1 if run.batched else min(samples, run.workers)) + PROGRAM


def check_memory(run: Run, look: Look) -> None:
    """Refuse a run that does not fit into the memory that is free.

    Raises
    ------
    ValueError
        With what it would take, and what to change.
    """
    cure = (
        "Take fewer geometries (theta_i=, theta_s=) or wavelengths (wavelength=) at a "
        "time, or stokes='linear' or 'unpolarized'."
    )
    check_room(at_work(run, look), _size(look).words(), cure)


def _size(look: Look) -> Size:
    return Size(
        angles=look.size, azimuths=1, waves=len(look.n), bins=1, n_stokes=look.n_stokes
    )


def look_at_samples(run: Run, look: Look, *, reduced: bool) -> Readings:
    """Look at samples until there are enough; `reduced` if known noise is taken off."""
    surface, expected = run.scene.surface, None
    reduced = arguments.switch("variance_reduction", reduced)
    media = media_of_scene(run.scene, run.waves)
    if media is not None:
        beams = BeamLook(scene=run.scene, media=media, look=look)
        first = run.root.spawn(1)[0]
        draw = (
            partial(beams.at, beams.ready(first)) if run.batched else beams.at_realization
        )
    elif run.batched:
        shared = (
            surface
            if isinstance(surface, FixedSurface)
            else surface.sample(run.root.spawn(1)[0])
        )
        draw = partial(look_at, _ready(shared), look)
    else:
        assert not isinstance(surface, FixedSurface)  # a fixed surface is batched
        expected = expected_of(surface, look, wanted=reduced)
        draw = partial(_look_at_realization, surface, look, expected)
    seen = Readings(look, expected)
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
    surface: GaussianSurface | MeasuredSurface, look: Look, expected: Expected | None,
    seed: np.random.SeedSequence,
) -> Sight:  # fmt: skip
    heights, rays = seed.spawn(2)
    return look_at(Field.of(surface.sample(heights)), look, rays, expected)

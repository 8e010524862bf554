"""Light that goes through bodies and films, counted as it leaves to the detectors.

Where light is refracted or comes apart, cones of directions do not stay cones, and no facet
says alone how it joins source and detector: rays from the source are counted.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from pbrdf.conventions import BOUNCES
from pbrdf.kernels.bodies.beams import N_STATE, Room
from pbrdf.kernels.bodies.detectors import CAUGHT, FORETOLD, Cones
from pbrdf.kernels.bodies.transparent import trace_among_bodies, trace_on_mesh
from pbrdf.kernels.bodies.world import N_HIT, Media
from pbrdf.kernels.cones.record import N_AXES
from pbrdf.kernels.paths import shading
from pbrdf.kernels.terrain.entry import Source
from pbrdf.kernels.terrain.sweep import N_FIRST
from pbrdf.observation.bundles import near_misses
from pbrdf.observation.look import Look, Sight, Sums
from pbrdf.scene.scene import Scene
from pbrdf.surface import FixedSurface, MeshSurface
from pbrdf.tracer.field import Field
from pbrdf.tracer.wet_field import WetField
from pbrdf.tracer.wet_mesh import WetMesh

NO_MEETINGS = np.empty((0, N_FIRST))
NO_EDGES = np.empty(0), np.empty((0, 2))


@dataclass(frozen=True, kw_only=True)
class BeamLook:
    """A scene that light goes through, and how to look at it."""

    scene: Scene
    media: Media
    look: Look

    def ready(self, seed: np.random.SeedSequence) -> WetField | WetMesh:
        """Draw the surface, lay what lies on it, and make both ready for tracing."""
        surface = self.scene.surface
        if not isinstance(surface, FixedSurface):
            heights, seed = seed.spawn(2)
            surface = surface.sample(heights)
        if isinstance(surface, MeshSurface):
            skips = frozenset(["steep", "deep"])
            return WetMesh.of(surface, self.scene, self.media, seed, skips)
        return WetField.of(
            Field.of(surface), surface, self.scene.contaminants, self.media, seed
        )

    def at_realization(self, seed: np.random.SeedSequence) -> Sight:
        """Look at a realisation of the scene."""
        laid, rays = seed.spawn(2)
        return self.at(self.ready(laid), rays)

    def at(self, target: WetField | WetMesh, seed: np.random.SeedSequence) -> Sight:
        """Look at a scene made ready; releases the interpreter lock."""
        look = self.look
        sample, rng = Sums(look), np.random.default_rng(seed)
        for theta in np.unique(look.theta_i):
            group = np.flatnonzero(look.theta_i == theta)
            cones = _cones(look, group)
            tally = _tally(look, cones)
            _trace(target, _source(target, look, theta, rng), look, tally)
            _add(sample, group, cones, tally)
        return Sight(
            brdf=sample.brdf, caught=sample.caught, tried=sample.tried,
            glints=sample.glints,
            glints_caught=sample.glints_caught, foretold=sample.foretold, one=sample.one,
            energy=sample.energy / sample.bundles, counts=sample.counts,
            facet_counts=sample.facet_counts, bundles=sample.bundles, notes=target.notes,
        )  # fmt: skip


def _cones(look: Look, group: np.ndarray) -> Cones:
    """Cones of the detectors of a group of geometries, with room for their light."""
    reach, chance = near_misses(look.source, look.detector, counting=True)
    theta, turn = look.theta_s[group], look.dphi[group]
    same = [np.cos(look.detector), np.sin(look.detector), np.cos(reach), chance]
    targets = np.column_stack(
        [
            np.sin(theta), np.cos(theta), np.cos(turn), np.sin(turn),
            np.tile(same, (len(group), 1)),
        ]
    )  # fmt: skip
    shape = look.shape[1:]
    return Cones(
        targets, np.empty((len(group), N_AXES)), np.zeros((2, len(group), *shape)),
        np.zeros((len(group), shape[0]), dtype=np.int64),
    )  # fmt: skip


def _tally(look: Look, cones: Cones) -> shading.Tally:
    """Room for the fates of rays; the cones take the place of bins."""
    waves, n_stokes = len(look.n), look.n_stokes
    return shading.Tally(
        *NO_EDGES, np.empty((waves, len(BOUNCES), 0, 0, n_stokes, n_stokes)),
        np.empty((len(BOUNCES), 0, 0), dtype=bool), np.zeros((waves, shading.N_ENERGIES)),
        np.zeros(shading.N_COUNTS, dtype=np.int64), np.zeros((4, 4)), cones,
    )  # fmt: skip


def _source(
    target: WetField | WetMesh, look: Look, theta: float, rng: np.random.Generator
) -> Source:
    """Rays of the source at one zenith."""
    launch = target.field.entry_rectangle(theta, look.phi_i, look.source)
    return Source(
        np.sin(theta), np.cos(theta), look.phi_i or 0.0, look.phi_i is None, launch,
        target.field.entry_lines(launch, look.n_rays, look.source), look.n_rays,
        rng.random(5), rng.integers(2**63, dtype=np.uint64), np.sin(look.source),
    )  # fmt: skip


def _trace(
    target: WetField | WetMesh, source: Source, look: Look, tally: shading.Tally
) -> None:
    room = Room(np.empty((look.max_bounces + 2, N_STATE)), np.zeros(N_HIT), NO_MEETINGS)
    rest: Any = (look.max_bounces, look.n_stokes, room, tally)
    if isinstance(target, WetMesh):
        trace_on_mesh(target.world(), source, target.field.top, *rest)
    else:
        trace_among_bodies(target.world, source, target.field.terrain.z_top, *rest)


def _add(sample: Sums, group: np.ndarray, cones: Cones, tally: shading.Tally) -> None:
    """Add what the rays of a group have brought to the sample, as BRDF."""
    look = sample.look
    scale = 1.0 / (look.n_rays * look.solid_angles()[1][group])
    flux = cones.flux * scale[:, None, None, None, None]
    sample.brdf[group] += flux[CAUGHT]
    sample.glints[group] += flux[CAUGHT]
    sample.foretold[group] += flux[FORETOLD] * scale[:, None, None, None, None]
    sample.caught[group] += cones.caught
    sample.glints_caught[group] += cones.caught
    sample.one[group] = scale[:, None]
    sample.energy += tally.energy
    sample.counts += tally.counts
    sample.bundles += look.n_rays

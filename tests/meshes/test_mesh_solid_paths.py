"""Paths through solids of a mesh, against every triangle tried in turn in float64."""

import numpy as np
import pytest
import trimesh

from pbrdf import Material, MeshSurface, Scene
from pbrdf.kernels import from_python
from pbrdf.kernels.bodies.beams import (
    FACET,
    INDEX,
    INSIDE,
    KX,
    KY,
    KZ,
    LEFT,
    MUELLER,
    N_INSIDE,
    N_STATE,
    NOTHING,
    SX,
    SY,
    X,
    Y,
    Z,
)
from pbrdf.kernels.bodies.events import move_beam, next_event
from pbrdf.kernels.bodies.media import solid_at
from pbrdf.kernels.bodies.splitting import meet_interface, meet_solid
from pbrdf.kernels.bodies.world import ASTRAY, GROUND, N_HIT, OUT, SOLID_OUT
from pbrdf.kernels.paths.random import Draw
from pbrdf.tracer.media import clear_materials, covering_materials, media_of
from pbrdf.tracer.wet_mesh import WetMesh
from tests.meshes.shapes import SlowMesh, joined, pair, plate

# Parts of other kernels, with entries of their own
next_event = from_python(next_event)
move_beam = from_python(move_beam)
solid_at = from_python(solid_at)
meet_solid = from_python(meet_solid)
meet_interface = from_python(meet_interface)

# A ray this near an edge may go either way in float32, and all after it [um]
UNSURE = 3e-5
SKIPS = frozenset(["deep", "steep"])


def overhang():
    """A ball on a stem that both cut into a plate, and a ring across the seam."""
    ring = trimesh.creation.torus(0.8, 0.25, major_sections=14, minor_sections=9)
    ring.apply_transform(trimesh.transformations.rotation_matrix(0.7, [1.0, 0.4, 0.0]))
    parts = [
        plate(6.0, 5.0),
        pair(trimesh.creation.icosphere(subdivisions=2, radius=1.1), (2.1, 2.3, 2.2)),
        pair(
            trimesh.creation.cylinder(radius=0.3, height=3.0, sections=9), (2.1, 2.3, 0.6)
        ),
        pair(ring, (5.6, 0.3, 1.4)),
    ]
    labels = np.concatenate([np.full(len(f), k) for k, (_, f) in enumerate(parts)])
    return MeshSurface(joined(*parts), (6.0, 5.0), labels, transparent=[1, 2, 3])


class SlowSolids(SlowMesh):
    """Facets from either side, and which solids a place is inside of."""

    def __init__(self, surface):
        super().__init__(surface)
        self.solid = np.asarray(surface.solids)[self.face]

    def next(self, place, k, leaves):
        """Nearest facet: (face, place on it, whether it is left), and the margin."""
        rate, time, there, near, met = self.crossings(place, k, leaves)
        if not met.any():
            return None, float(near.min())
        best = np.flatnonzero(met)[np.argmin(time[met])]
        # Two facets that are met as soon as each other may be taken in either order
        others = np.sort(time[met])
        gap = others[1] - others[0] if len(others) > 1 else np.inf
        margin = float(np.where(time <= time[best] + 1e-6, near, np.inf).min())
        margin = min(margin, float(gap), float(time[best]), abs(float(rate[best])))
        return (int(self.face[best]), there[best] - self.move[best], rate[best] > 0), margin

    def holding(self, place):
        """Solids that a place is inside of: facets above it, by side."""
        found = {}
        a, b, c = (self.corners[:, k] - place for k in range(3))
        areas = np.stack(
            [p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0] for p, q in ((b, c), (c, a), (a, b))]
        )
        total = areas.sum(axis=0)
        hit = ((areas > 0).all(axis=0) | (areas < 0).all(axis=0)) & (self.solid > 0)
        height = (areas * np.stack([a[:, 2], b[:, 2], c[:, 2]])).sum(axis=0)
        for k in np.flatnonzero(hit & (height * np.sign(total) > 0.0)):
            found[self.solid[k]] = found.get(self.solid[k], 0) + int(np.sign(total[k]))
        return sorted(solid for solid, count in found.items() if count > 0)


def launched(state, place, k):
    state[:] = 0.0
    state[0, [X, Y, Z]], state[0, [KX, KY, KZ]] = place, k
    state[0, [SX, SY]] = np.array([k[1], -k[0]]) / np.hypot(k[0], k[1])
    state[0, FACET], state[0, LEFT], state[0, INDEX] = -1.0, NOTHING, 1.0
    state[0, MUELLER::5][:4] = 1.0


@pytest.mark.parametrize(
    "shape", [pytest.param("overhang", marks=pytest.mark.slow), "boxes"]
)
def test_paths_and_media_are_those_of_every_triangle_tried_in_turn(shape):
    mesh = overhang()
    if shape == "boxes":
        one = trimesh.creation.box((3.0, 2.0, 1.4))
        one.apply_transform(trimesh.transformations.rotation_matrix(0.6, [0.3, 1.0, 0.2]))
        mesh = MeshSurface(
            joined(pair(one), pair(trimesh.creation.box((1.0, 4.0, 0.9)), (0.3, 0.1, 0.5))),
            transparent=True,
        )
    count = 1 if mesh.labels is None else 4
    scene = Scene(mesh, [Material(1.3, 0.7), *map(Material, (1.5, 1.4, 2.0))][-count:])
    media = media_of(
        scene.materials, covering_materials(scene), None, clear_materials(scene)
    )
    wet = WetMesh.of(mesh, scene, media, np.random.SeedSequence(0), SKIPS)
    world = wet.world()
    slow, rng = SlowSolids(mesh), np.random.default_rng(5)
    low, high = mesh.bounds
    state, hit, energy = np.empty((40, N_STATE)), np.zeros(N_HIT), np.zeros((1, 5))
    compared = crossed = within = 0
    for number in range(250):
        phi, cos = rng.uniform(0, 2 * np.pi), rng.uniform(0.2, 1.0)
        sin = np.sqrt(1 - cos**2)
        k = -np.array([sin * np.cos(phi), sin * np.sin(phi), cos])
        place = np.array([*(low + (high - low) * rng.random(3))[:2], high[2] + 1e-9])
        launched(state, place, k)
        top = 0
        # Down one branch of the beam, of which chance takes one part
        for step in range(12):
            leaves = int(state[top, FACET])
            place, k = state[top, [X, Y, Z]].copy(), state[top, [KX, KY, KZ]].copy()
            mine = sorted(
                int(-16 - s) for s in state[top, INSIDE::3][: int(state[top, N_INSIDE])]
            )
            expected, margin = slow.next(place, k, leaves)
            if margin < UNSURE:
                break
            kind = next_event(world, state, top, hit)
            assert kind != ASTRAY
            if kind < OUT and hit[0] * np.hypot(k[0], k[1]) > slow.reach:
                break
            if expected is None:
                assert kind >= OUT
                assert not mine
                break
            # The middle of the way is in the solids that the beam knows
            assert slow.holding(place + 0.5 * hit[0] * k) == mine
            move_beam(world, state, top, kind, hit)
            assert int(state[top, FACET]) == expected[0]
            assert np.abs(state[top, [X, Y, Z]] - expected[1]).max() < 1e-9
            assert (kind == SOLID_OUT) == expected[2]
            compared += 1
            crossed += kind == SOLID_OUT
            within += len(mine)
            draw = Draw(np.uint64(number), 0, 2 * step)
            if kind == GROUND:
                solid = solid_at(world, 0, state, top, kind, hit)
                new = meet_solid(world, 0, state, top, kind, solid, hit, 4, draw, energy)
            else:
                new = meet_interface(world, 0, state, top, kind, hit, 4, draw, energy)
            if new < top:
                break
            if new > top and rng.random() < 0.5:
                new = top
            state[0], top = state[new].copy(), 0
    assert compared > 350
    assert crossed > 80
    assert within > 150

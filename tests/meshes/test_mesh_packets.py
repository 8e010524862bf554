"""Rays sent to Embree together meet what each of them meets alone."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from pbrdf import GaussianSurface, MeshSurface
from pbrdf.kernels import from_python
from pbrdf.kernels.meshes.packets import APART, LANES, MISSES, TOGETHER, UNTOLD, send_packet
from pbrdf.kernels.meshes.seek import foresee, seek_facet, seek_told, times_to_sides
from pbrdf.kernels.meshes.shots import told_by_shot
from pbrdf.kernels.terrain.heightfield import HIT
from pbrdf.tracer.mesh_field import MeshField
from tests.meshes.shapes import mushrooms

MESHES = {
    "overhangs": mushrooms,
    "rough": lambda: MeshSurface.of_map(
        GaussianSurface(shape=(24, 20), spacing=0.5, corr_length=2, slope_rms=0.5).sample(2)
    ),
}


@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize("flags", [APART, TOGETHER])
def test_a_packet_tells_what_each_ray_alone_meets(name, flags):
    mesh = MESHES[name]()
    field = MeshField.of(mesh)
    facets = field.facets()
    facets.packet.flags[0] = flags
    rng = np.random.default_rng(3)
    put, send = from_python(foresee), from_python(send_packet)
    shot, told_seek = from_python(told_by_shot), from_python(seek_told)
    ends = from_python(times_to_sides)

    def alone(face, place, k):
        far = ends(field.frame, *place, *k)[0] + field.frame.lift
        return shot(facets, face, *place, *k, far)

    low, high = mesh.bounds
    # Two whole packets and a part of one, of rays down and then of those mirrored
    count = 2 * LANES + 3
    met = 0
    for _ in range(20):
        k = rng.normal(size=3)
        k[2] = -abs(k[2]) - 0.7
        k /= np.linalg.norm(k)
        start = np.column_stack(
            [rng.uniform(low[:2], high[:2], (count, 2)), np.full(count, high[2] + 1e-4)]
        )
        told = np.full(count, UNTOLD)
        for ray, place in enumerate(start):
            put(facets, ray, -1, *place, *k, told)
        send(facets, told)
        assert_array_equal(told, [alone(-1, place, k) for place in start])
        again = np.full(count, UNTOLD)
        mirrored = []
        for ray, place in enumerate(start):
            known = told_seek(facets, told[ray], -1, 0, *place, *k)
            assert known == seek_facet(facets, -1, 0, *place, *k)
            fate, face, _, *there = known
            if fate != HIT:
                continue
            r = k - 2.0 * (k @ mesh.normals[face]) * mesh.normals[face]
            put(facets, len(mirrored), face, *there, *r, again)
            mirrored.append((face, there, r))
        send(facets, again)
        assert len(mirrored) > LANES
        again = again[: len(mirrored)]
        assert_array_equal(again, [alone(*one) for one in mirrored])
        met += (again != MISSES).sum()
        assert facets.packet.filled[0] == 0
        assert not facets.packet.valid.any()
    assert met > 20

"""Parts that cut through themselves: counted, traced as their union, or refused."""

import numpy as np
import pytest
import trimesh

from pbrdf import MeshSurface
from pbrdf.errors import AccuracyWarning
from pbrdf.surface.mesh.crossings import find_crossings
from pbrdf.tracer.mesh_field import MeshField
from tests.meshes.shapes import bent_tube, plate

BALL = trimesh.creation.icosphere(subdivisions=2, radius=1.2)


def edges_through_faces(vertices, faces):
    """Every edge with every face: Cramer's rule for a + t (b - a) = p + u e + v f."""
    ends = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]))
    count = 0
    for a, b in np.unique(ends, axis=0):
        apart = ~np.isin(faces, [a, b]).any(axis=1)
        p, q, r = (vertices[faces[apart, k]] for k in range(3))
        columns = np.stack(
            [np.broadcast_to(vertices[a] - vertices[b], p.shape), q - p, r - p], axis=2
        )
        t, u, v = np.linalg.solve(columns, (vertices[a] - p)[..., None])[..., 0].T
        count += int(((t > 0) & (t < 1) & (u > 0) & (v > 0) & (u + v < 1)).sum())
    return count


def test_edges_that_pass_through_their_own_part_are_those_of_trying_all():
    vertices, faces = bent_tube()
    found = find_crossings(vertices, faces, np.zeros(len(faces), dtype=int), None)
    expected = edges_through_faces(vertices, faces)
    assert expected > 20
    assert len(found.face) == expected
    corners = vertices[faces[found.face]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.abs(((found.place - corners[:, 0]) * normal).sum(axis=1)).max() < 1e-12
    ball = find_crossings(BALL.vertices, BALL.faces, np.zeros(len(BALL.faces), int), None)
    assert len(ball.face) == 0


def test_a_tube_through_itself_is_counted():
    with pytest.warns(AccuracyWarning, match=r"cuts through itself: \d+ edges, .*union"):
        mesh = MeshSurface(bent_tube())
    assert mesh.intersecting
    assert mesh.parts == 1
    assert "edges, the first at" in mesh.repairs[0]
    assert MeshField.of(mesh).frame.crossing


def test_a_part_that_turns_inside_out_is_refused_where_it_does():
    vertices = np.array(BALL.vertices)
    vertices[vertices[:, 2].argmax()] = (0.05, 0.02, -3.0)
    with pytest.raises(ValueError, match=r"not be inside out, got .*, -1\.\d+\) um, faces"):
        MeshSurface((vertices, BALL.faces))


def test_images_may_overlap_if_they_are_opaque():
    assert MeshSurface(BALL, (2.0, 2.2)).intersecting
    apart = MeshSurface(BALL, (2.5, 2.5))
    assert not apart.intersecting
    assert not MeshField.of(apart).frame.crossing
    assert MeshField.of(MeshSurface(BALL, (2.5, 2.2))).frame.crossing
    with pytest.raises(ValueError, match=r"themselves or their images, got .* edges"):
        MeshSurface(BALL, (2.0, 2.2), transparent=True)
    copies = [BALL.copy().apply_translation([2.0 * i, 0, 0]) for i in range(2)]
    both = MeshSurface(trimesh.util.concatenate(copies), (4.0, 2.5), transparent=True)
    assert both.intersecting


def test_layers_of_a_film_that_cut_through_each_other_are_refused():
    top, faces = plate(cells=4)
    bump = top + np.array([0.0, 0.0, 1.0])
    bump[12, 2] = -0.5
    lower = faces[:, ::-1] + len(top)
    film = (np.concatenate([bump, top]), np.concatenate([faces, lower]))
    with pytest.raises(ValueError, match="must not be inside out"):
        MeshSurface(film, (10.0, 8.0), transparent=True)
    bump[12, 2] = 0.5
    film = (np.concatenate([bump, top]), film[1])
    assert MeshSurface(film, (10.0, 8.0), transparent=True).solid_labels == (0,)

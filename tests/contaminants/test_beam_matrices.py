"""What an interface does to the matrix and the frame of a beam, against plain algebra."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf.kernels import from_python
from pbrdf.kernels.bodies import interfaces
from pbrdf.kernels.bodies.beams import KX, KZ, MUELLER, N_STATE, SX, SZ
from pbrdf.kernels.optics.vectors import Vec

WAY, AXIS = slice(KX, KZ + 1), slice(SX, SZ + 1)


def beam(seed=1):
    """A state with a random matrix, direction and frame; and the three of them."""
    rng = np.random.default_rng(seed)
    state = rng.normal(size=(2, N_STATE))
    k, other = rng.normal(size=(2, 3))
    k /= np.linalg.norm(k)
    s = np.cross(other, k)
    s /= np.linalg.norm(s)
    state[1, WAY], state[1, AXIS] = k, s
    return state, matrix(state).copy(), k, s


def matrix(state):
    return state[1, MUELLER : MUELLER + 16].reshape(4, 4)


def facing(k, seed=2):
    """A random normal that looks towards the beam."""
    n = np.random.default_rng(seed).normal(size=3)
    n /= np.linalg.norm(n)
    return -n * np.sign(n @ k)


@pytest.mark.parametrize("columns", [1, 3, 4])
def test_elements_act_on_the_matrix_as_a_matrix(columns):
    a, b, c, d = 0.7, 0.2, -0.4, 0.3
    facet = np.array([[a, b, 0, 0], [b, a, 0, 0], [0, 0, c, -d], [0, 0, d, c]])
    state, before, *_ = beam()
    others = state.copy()
    from_python(interfaces.apply_elements)(state, 1, columns, (a, b, c, d))
    assert_allclose(matrix(state)[:, :columns], (facet @ before)[:, :columns], rtol=1e-14)
    assert_allclose(matrix(state)[:, columns:], before[:, columns:], rtol=0)
    others[1, MUELLER : MUELLER + 16] = state[1, MUELLER : MUELLER + 16]
    assert (state == others).all()

    state, before, *_ = beam()
    from_python(interfaces.scale_columns)(state, 1, columns, 0.25)
    assert_allclose(matrix(state)[:, :columns], 0.25 * before[:, :columns], rtol=1e-15)
    assert_allclose(matrix(state)[:, columns:], before[:, columns:], rtol=0)


def test_the_way_to_the_base_and_back_depolarises():
    state, before, *_ = beam()
    a_in, b_in, a_out, b_out, base = 0.9, 0.05, 0.6, -0.1, 0.4
    from_python(interfaces.come_out)(state, 1, 4, a_in, b_in, a_out, b_out, base)
    into = np.array([[a_in, b_in, 0, 0], [b_in, a_in, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    out = np.array([[a_out, b_out, 0, 0], [b_out, a_out, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    expected = out @ np.diag([base, 0, 0, 0]) @ into @ before
    assert_allclose(matrix(state), expected, atol=1e-15)


def test_the_frame_turns_into_the_plane_of_incidence():
    state, before, k, s = beam()
    n = facing(k)
    cosine = from_python(interfaces.meet)(state, 1, 4, Vec(*n))
    assert_allclose(cosine, -k @ n, rtol=1e-14)
    axis = np.cross(k, n) / np.linalg.norm(np.cross(k, n))
    assert_allclose(state[1, AXIS], axis, atol=1e-14)
    # Conventions: cos = e_s' . e_s, sin = e_s' . e_p, e_p = k x e_s
    c, si = axis @ s, axis @ np.cross(k, s)
    c2, s2 = c * c - si * si, 2 * c * si
    turn = np.array([[1, 0, 0, 0], [0, c2, s2, 0], [0, -s2, c2, 0], [0, 0, 0, 1]])
    assert_allclose(matrix(state), turn @ before, atol=1e-14)

    state, before, k, s = beam()
    assert from_python(interfaces.meet)(state, 1, 4, Vec(*-k)) == pytest.approx(1.0)
    assert_allclose(matrix(state), before, rtol=0)
    assert_allclose(state[1, AXIS], s, rtol=0)


def test_directions_behind_an_interface_are_those_of_the_laws():
    state, _, k, _ = beam()
    n = facing(k)
    cosine = float(-k @ n)
    from_python(interfaces.reflect_beam)(state, 1, Vec(*n), cosine)
    assert_allclose(state[1, WAY], k - 2 * (k @ n) * n, atol=1e-14)

    state, _, k, _ = beam()
    from_python(interfaces.refract_beam)(state, 1, Vec(*n), cosine, 1.5)
    out = state[1, WAY]
    assert_allclose(np.linalg.norm(out), 1.0, rtol=1e-14)
    # Snell: the tangential part of the wave vector is kept
    assert_allclose(1.5 * np.cross(out, n), np.cross(k, n), atol=1e-14)
    assert out @ n < 0

    state, *_ = beam()
    from_python(interfaces.send_out)(state, 1, Vec(*n), 0.6, 0.8, 0.3)
    out, axis = state[1, WAY], state[1, AXIS]
    assert_allclose([out @ n, np.linalg.norm(out)], [0.8, 1.0], rtol=1e-14)
    assert_allclose(axis, np.cross(out, n) / 0.6, atol=1e-14)

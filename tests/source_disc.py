"""What a flat surface answers to a source of some width, from directions drawn here."""

from functools import cache

import numpy as np


def disc(theta, phi, half, count):
    """Directions of a disc of uniform radiance by flux, drawn by rejection from its cap."""
    rng = np.random.default_rng(5)
    axis = np.array(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)]
    )
    across = np.array([-np.sin(phi), np.cos(phi), 0.0])
    along = np.cross(across, axis)
    cosine = rng.uniform(np.cos(half), 1.0, 4 * count)
    turn = rng.uniform(0.0, 2.0 * np.pi, 4 * count)
    sine = np.sqrt(1.0 - cosine**2)
    found = (
        cosine[:, None] * axis
        + (sine * np.cos(turn))[:, None] * along
        + (sine * np.sin(turn))[:, None] * across
    )
    return found[rng.random(4 * count) < found[:, 2]][:count], axis


def turn_between(old, new, beam):
    """Mueller rotations of beams from s axis `old` to `new`."""
    cos = (old * new).sum(-1)
    sin = (np.cross(beam, old) * new).sum(-1)
    turn = np.zeros((*cos.shape, 4, 4))
    turn[..., 0, 0] = turn[..., 3, 3] = 1.0
    turn[..., 1, 1] = turn[..., 2, 2] = cos**2 - sin**2
    turn[..., 1, 2] = 2 * cos * sin
    turn[..., 2, 1] = -2 * cos * sin
    return turn


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def carried(axis, s, to):
    """Vector s across `axis`, turned with it along the great circle to each of `to`."""
    hinge = unit(np.cross(axis, to))
    angle = np.arccos(np.clip(to @ axis, -1.0, 1.0))[:, None]
    # Rodrigues' rotation about the hinge
    return (
        s * np.cos(angle)
        + np.cross(hinge, s) * np.sin(angle)
        + hinge * (hinge @ s)[:, None] * (1.0 - np.cos(angle))
    )


@cache
def mirrored_disc(theta, phi, half, matrix_of, n_theta, n_dphi, count=400_000):
    """Flux (n_theta, n_dphi, 4, 4) of a disc in a flat surface, and directions drawn.

    `matrix_of` gives the Mueller matrices (count, 4, 4) in the plane of incidence for the
    cosines of incidence (count,).
    """
    to_source, axis = disc(theta, phi, half, count)
    beam = -to_source
    out = beam * [1.0, 1.0, -1.0]
    across = unit(np.cross(beam, [0.0, 0.0, 1.0]))
    start = carried(-axis, np.array([np.sin(phi), -np.cos(phi), 0.0]), beam)
    meridian = unit(np.cross([0.0, 0.0, 1.0], out))
    mueller = (
        turn_between(across, meridian, out)
        @ matrix_of(to_source[:, 2])
        @ turn_between(start, across, beam)
    )
    i = np.minimum((np.arccos(out[:, 2]) / (np.pi / 2) * n_theta).astype(int), n_theta - 1)
    dphi = np.arctan2(out[:, 1], out[:, 0]) - phi
    j = np.floor(dphi / (2 * np.pi) * n_dphi + 0.5).astype(int) % n_dphi
    flux = np.zeros((n_theta, n_dphi, 4, 4))
    np.add.at(flux, (i, j), mueller / len(out))
    flux.setflags(write=False)
    return flux, len(out)


def assert_answers_disc(result, expected, drawn):
    """All elements of all bins within 6 of their standard errors.

    Light at the rim of the disc falls into a bin with the count of drawn directions.
    """
    weight = result.projected_solid_angle.values[..., None, None]
    flux, stated = (
        result[name].values[0] * weight for name in ("brdf_total", "brdf_total_stderr")
    )
    error = np.hypot(stated, np.sqrt(expected[..., :1, :1] / drawn))
    lit = expected[..., :1, :1] > 1e-3
    z = np.abs(flux - expected) / error * lit
    assert z.max() < 6.0, z.max()
    assert np.abs(flux - expected)[~lit[..., 0, 0]].max() < 2e-3
    np.testing.assert_allclose(flux[..., 0, 0].sum(), expected[..., 0, 0].sum(), rtol=2e-3)

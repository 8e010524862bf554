"""The same physics written plainly in NumPy and embreex, as a yardstick for the engine.

Whole arrays of rays in random order, one Mueller matrix a ray, no skips: what one writes in
an afternoon. It shares no code with the engine but the surface.
"""

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

TILES = 3  # copies of the period along x and y


def build_scene(heights: np.ndarray) -> tuple[EmbreeScene, np.ndarray]:
    """Embree scene of 3 x 3 periods of a height field of unit spacing, and its normals."""
    nx, ny = heights.shape
    z = np.tile(heights, (TILES, TILES))
    z = np.pad(z, ((0, 1), (0, 1)), mode="wrap")
    x, y = np.meshgrid(
        np.arange(TILES * nx + 1) - 1.5 * nx,
        np.arange(TILES * ny + 1) - 1.5 * ny,
        indexing="ij",
    )
    vertices = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    node = np.arange(z.size).reshape(z.shape)
    a, b, c, d = node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]
    faces = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    normals = np.cross(
        vertices[faces[:, 1]] - vertices[faces[:, 0]],
        vertices[faces[:, 2]] - vertices[faces[:, 0]],
    )
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    scene = EmbreeScene(robust=True)
    TriangleMesh(scene, vertices.astype(np.float32), faces.astype(np.int32))
    return scene, normals


def rotation(old_s: np.ndarray, prop: np.ndarray, new_s: np.ndarray) -> np.ndarray:
    """Mueller rotations of beams along `prop` from the axes old_s to new_s."""
    cos = (old_s * new_s).sum(1)
    sin = (np.cross(prop, old_s) * new_s).sum(1)
    turn = np.zeros((len(prop), 4, 4))
    turn[:, 0, 0] = turn[:, 3, 3] = 1
    turn[:, 1, 1] = turn[:, 2, 2] = cos**2 - sin**2
    turn[:, 1, 2] = 2 * cos * sin
    turn[:, 2, 1] = -2 * cos * sin
    return turn


def fresnel(cosine: np.ndarray, index: complex) -> np.ndarray:
    """Reflection matrices in the facet's frame."""
    q = np.sqrt(index**2 - (1 - cosine**2) + 0j)
    r_s = (cosine - q) / (cosine + q)
    r_p = (index**2 * cosine - q) / (index**2 * cosine + q)
    mean, half = (abs(r_s) ** 2 + abs(r_p) ** 2) / 2, (abs(r_s) ** 2 - abs(r_p) ** 2) / 2
    cross = r_s * r_p.conj()
    matrix = np.zeros((len(cosine), 4, 4))
    matrix[:, 0, 0] = matrix[:, 1, 1] = mean
    matrix[:, 0, 1] = matrix[:, 1, 0] = half
    matrix[:, 2, 2] = matrix[:, 3, 3] = cross.real
    matrix[:, 2, 3], matrix[:, 3, 2] = -cross.imag, cross.imag
    return matrix


def normalised(vectors: np.ndarray) -> np.ndarray:
    """Vectors of unit length."""
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]


def simulate_plainly(
    heights: np.ndarray, theta: float, index: complex, n_rays: int, n_theta: int,
    n_dphi: int, rng: np.random.Generator, max_bounces: int = 16,
) -> np.ndarray:  # fmt: skip
    """Mean Mueller matrix a ray, by bounces and bin: (3, n_theta, n_dphi, 4, 4)."""
    scene, normals = build_scene(heights)
    nx, ny = heights.shape
    prop = np.tile([-np.sin(theta), 0.0, -np.cos(theta)], (n_rays, 1))
    start = np.stack(
        [rng.uniform(-nx / 2, nx / 2, n_rays), rng.uniform(-ny / 2, ny / 2, n_rays),
         np.zeros(n_rays)], axis=1,
    )  # fmt: skip
    place = start - prop * (heights.max() + 1) / np.cos(theta)
    axis = np.tile([0.0, -1.0, 0.0], (n_rays, 1))
    mueller = np.tile(np.eye(4), (n_rays, 1, 1))
    flux = np.zeros((3, n_theta, n_dphi, 4, 4))
    for bounce in range(max_bounces + 1):
        hit = scene.run(place.astype(np.float32), prop.astype(np.float32), output=True)
        face = np.array(hit["primID"])
        away = (face < 0) & (prop[:, 2] > 0)
        if bounce > 0 and away.any():
            k = prop[away]
            meridian = normalised(np.stack([-k[:, 1], k[:, 0], np.zeros(len(k))], axis=1))
            out = rotation(axis[away], k, meridian) @ mueller[away]
            i = np.minimum(
                (np.arccos(k[:, 2]) / (np.pi / 2) * n_theta).astype(int), n_theta - 1
            )
            turn = np.arctan2(k[:, 1], k[:, 0]) / (2 * np.pi) * n_dphi
            j = np.floor(turn + 0.5).astype(int) % n_dphi
            np.add.at(flux[min(bounce, 3) - 1], (i, j), out)
        on = face >= 0
        if not on.any():
            break
        prop, axis, mueller = prop[on], axis[on], mueller[on]
        normal = normals[face[on]]
        place = place[on] + prop * np.array(hit["tfar"], dtype=float)[on, None]
        cosine = -(prop * normal).sum(1)
        across = normalised(np.cross(prop, normal))
        mueller = fresnel(cosine, index) @ rotation(axis, prop, across) @ mueller
        prop = normalised(prop + 2 * cosine[:, None] * normal)
        place = place + 1e-3 * normal
        axis = across
    return flux / n_rays

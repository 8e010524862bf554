"""The same physics as a loop over Mitsuba 3, its mesh and its intersector, as a yardstick.

Only where Mitsuba is installed, with an LLVM that it finds or that DRJIT_LIBLLVM_PATH
names. Heights have unit spacing and repeat; rays start in scan order.
"""

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_mono_polarized")

GUARD = 64  # cells of wrapped surface round the period
BOUNCES = 6


def build_scene(heights: np.ndarray) -> Any:
    """Mesh of the period and a guard band of wrapped cells."""
    nx, ny = heights.shape
    z = np.pad(heights, ((GUARD, GUARD + 1), (GUARD, GUARD + 1)), mode="wrap")
    x, y = np.meshgrid(
        np.arange(-GUARD, nx + GUARD + 1), np.arange(-GUARD, ny + GUARD + 1), indexing="ij"
    )
    node = np.arange(z.size).reshape(z.shape)
    a, b, c, d = node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]
    faces = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
    mesh = mi.Mesh("surface", z.size, len(faces))
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = np.stack([x, y, z], -1).astype(np.float32).ravel()
    parameters["faces"] = faces.astype(np.uint32).ravel()
    parameters.update()
    return mi.load_dict({"type": "scene", "surface": mesh})


def turned(m: Any, cos: Any, sin: Any) -> list[Any]:
    """Rows of a matrix in a frame turned by an angle."""
    c2, s2 = cos * cos - sin * sin, 2.0 * cos * sin
    q = [c2 * m[1][k] + s2 * m[2][k] for k in range(4)]
    u = [c2 * m[2][k] - s2 * m[1][k] for k in range(4)]
    return [m[0], q, u, m[3]]


def reflected(m: Any, cosine: Any, n: float) -> list[Any]:
    """Rows after reflection by glass."""
    q = dr.sqrt(n * n - 1.0 + cosine * cosine)
    r_s = (cosine - q) / (cosine + q)
    r_p = (n * n * cosine - q) / (n * n * cosine + q)
    a, b, c = 0.5 * (r_s * r_s + r_p * r_p), 0.5 * (r_s * r_s - r_p * r_p), r_s * r_p
    return [
        [a * m[0][k] + b * m[1][k] for k in range(4)],
        [b * m[0][k] + a * m[1][k] for k in range(4)],
        [c * m[2][k] for k in range(4)],
        [c * m[3][k] for k in range(4)],
    ]


def no_light(bins: tuple[int, int]) -> Any:
    """Room for the light of all bounces and bins (n_theta, n_dphi)."""
    return dr.zeros(mi.Float, 3 * bins[0] * bins[1] * 16)


def trace(  # noqa: PLR0913  (a program of its own)
    scene: Any, heights: np.ndarray, theta: float, phi: float, n: float, side: int,
    flux: Any, bins: tuple[int, int], seed: int,
) -> None:  # fmt: skip
    """Add the light of side x side rays to `flux` (3, n_theta, n_dphi, 4, 4)."""
    n_theta, n_dphi = bins
    nx, ny = heights.shape
    index = dr.arange(mi.UInt32, side * side)
    shift = np.random.default_rng(seed).random(2)
    x = (mi.Float(index // side) + float(shift[0])) * (nx / side)
    y = (mi.Float(index % side) + float(shift[1])) * (ny / side)
    from_source = [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)]
    k = -mi.Vector3f([float(one) for one in from_source])
    axis = mi.Vector3f(float(np.sin(phi)), float(-np.cos(phi)), 0.0)
    start = mi.Point3f(x, y, float(heights.max()) + 0.01)
    zero = dr.zeros(mi.Float, side * side)
    matrix = [[zero + float(r == c) for c in range(4)] for r in range(4)]
    state = (
        start, k + dr.zeros(mi.Vector3f, side * side),
        axis + dr.zeros(mi.Vector3f, side * side),
        dr.zeros(mi.UInt32, side * side), dr.full(mi.Mask, True, side * side),
        *[one for row in matrix for one in row],
    )  # fmt: skip

    def body(place: Any, k: Any, s: Any, bounces: Any, active: Any, *flat: Any) -> Any:
        m = [list(flat[4 * r : 4 * r + 4]) for r in range(4)]
        ray = mi.Ray3f(place, k)
        hit = scene.ray_intersect_preliminary(ray, coherent=False, active=active)
        met = active & hit.is_valid()
        si = hit.compute_surface_interaction(ray, mi.RayFlags.Minimal, met)
        normal = dr.select(met, si.n, mi.Vector3f(0.0, 0.0, 1.0))
        cosine = dr.maximum(-dr.dot(k, normal), 1e-6)
        across = dr.normalize(dr.cross(k, normal) + mi.Vector3f(1e-12, 0.0, 0.0))
        new = turned(m, dr.dot(across, s), dr.dot(across, dr.cross(k, s)))
        new = reflected(new, cosine, n)
        now = [dr.select(met, new[i // 4][i % 4], flat[i]) for i in range(16)]
        out = dr.normalize(k + 2.0 * cosine * normal)
        place = dr.select(met, si.spawn_ray(out).o, place)
        k = dr.select(met, out, k)
        s = dr.select(met, across, s)
        bounces = bounces + dr.select(met, mi.UInt32(1), mi.UInt32(0))
        return place, k, s, bounces, met & (bounces < BOUNCES), *now

    state = dr.while_loop(state, lambda *now: now[4], body)
    _, k, s, bounces, _, *flat = state
    m = [flat[4 * r : 4 * r + 4] for r in range(4)]
    up = (k.z > 0.0) & (bounces > 0) & (bounces < BOUNCES)
    meridian = dr.normalize(mi.Vector3f(-k.y, k.x, 0.0))
    m = turned(m, dr.dot(meridian, s), dr.dot(meridian, dr.cross(k, s)))
    i = dr.minimum(mi.UInt32(dr.acos(k.z) * (n_theta / (0.5 * np.pi))), n_theta - 1)
    turn = (dr.atan2(k.y, k.x) - phi) / (2.0 * np.pi)
    turn = turn - dr.floor(turn)
    j = mi.UInt32(turn * n_dphi + 0.5) % n_dphi
    at = ((dr.minimum(bounces, 3) - 1) * n_theta + i) * n_dphi + j
    for e in range(16):
        dr.scatter_add(flux, m[e // 4][e % 4], at * 16 + e, up)
    dr.eval(flux)
    dr.sync_thread()

"""The same physics as a loop over Mitsuba 3, its mesh and its intersector, as a yardstick.

Not needed by anything else: install mitsuba into an environment of its own and run

    DRJIT_LIBLLVM_PATH=/path/to/libLLVM.so python mitsuba_loop.py heights.npy

with a height map of unit spacing that repeats (`run.py --heights heights.npy` writes the
one of the benchmark). Rays start in scan order; one thread.
"""

import argparse
import time

import drjit as dr
import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_mono_polarized")

GUARD = 64  # cells of wrapped surface round the period
BOUNCES = 6
N_THETA, N_DPHI = 45, 90


def build_scene(heights):
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


def turned(m, cos, sin):
    """Rows of a matrix in a frame turned by an angle."""
    c2, s2 = cos * cos - sin * sin, 2.0 * cos * sin
    q = [c2 * m[1][k] + s2 * m[2][k] for k in range(4)]
    u = [c2 * m[2][k] - s2 * m[1][k] for k in range(4)]
    return [m[0], q, u, m[3]]


def reflected(m, cosine, n):
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


def trace(scene, heights, theta, phi, n, side, flux, seed):
    """Add the light of side x side rays to `flux` (3, N_THETA, N_DPHI, 4, 4)."""
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

    def body(place, k, s, bounces, active, *flat):
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
        flat = [dr.select(met, new[i // 4][i % 4], flat[i]) for i in range(16)]
        out = dr.normalize(k + 2.0 * cosine * normal)
        place = dr.select(met, si.spawn_ray(out).o, place)
        k = dr.select(met, out, k)
        s = dr.select(met, across, s)
        bounces = bounces + dr.select(met, mi.UInt32(1), mi.UInt32(0))
        return place, k, s, bounces, met & (bounces < BOUNCES), *flat

    state = dr.while_loop(state, lambda *now: now[4], body)
    _, k, s, bounces, _, *flat = state
    m = [flat[4 * r : 4 * r + 4] for r in range(4)]
    up = (k.z > 0.0) & (bounces > 0) & (bounces < BOUNCES)
    meridian = dr.normalize(mi.Vector3f(-k.y, k.x, 0.0))
    m = turned(m, dr.dot(meridian, s), dr.dot(meridian, dr.cross(k, s)))
    i = dr.minimum(mi.UInt32(dr.acos(k.z) * (N_THETA / (0.5 * np.pi))), N_THETA - 1)
    turn = (dr.atan2(k.y, k.x) - phi) / (2.0 * np.pi)
    turn = turn - dr.floor(turn)
    j = mi.UInt32(turn * N_DPHI + 0.5) % N_DPHI
    at = ((dr.minimum(bounces, 3) - 1) * N_THETA + i) * N_DPHI + j
    for e in range(16):
        dr.scatter_add(flux, m[e // 4][e % 4], at * 16 + e, up)
    dr.eval(flux)
    dr.sync_thread()


def main():
    """Print the rate, and the albedo by bounces for comparison."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("heights")
    parser.add_argument("--side", type=int, default=1024)
    parser.add_argument("--repeats", type=int, default=6)
    options = parser.parse_args()
    dr.set_thread_count(1)
    heights = np.load(options.heights)
    scene = build_scene(heights)
    best = np.inf
    for seed in range(options.repeats):
        flux = dr.zeros(mi.Float, 3 * N_THETA * N_DPHI * 16)
        start = time.process_time()
        trace(scene, heights, np.deg2rad(60.0), 0.3, 1.5, options.side, flux, seed)
        best = min(best, time.process_time() - start)
    rays = options.side**2
    albedo = np.array(flux).reshape(3, -1, 16)[..., 0].sum(axis=1) / rays
    print(f"{rays / best / 1e6:.2f} M paths a core-second, albedo by bounces {albedo}")


if __name__ == "__main__":
    main()

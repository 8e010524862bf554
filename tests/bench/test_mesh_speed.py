"""Tracing over meshes beside Embree alone on the same rays, and beside the walk."""

import time

import numpy as np
import pytest

from pbrdf import GaussianSurface, Material, MeshSurface, Scene, simulate

RAYS = 1_000_000
THETA = 1.0


def best(run, repeats=3):
    """Least time of a few runs, after one that compiles. [s]"""
    run()
    times = []
    for _ in range(repeats):
        start = time.process_time()
        run()
        times.append(time.process_time() - start)
    return min(times)


def embree_alone(mesh):
    """Time [s] of Embree over all segments of the paths, called with whole arrays."""
    from embreex import rtcore_scene
    from embreex.mesh_construction import TriangleMesh

    low, high = mesh.bounds
    period = np.asarray(mesh.period)
    moves = [
        np.array([a, b, 0.0]) * [*period, 0.0] for a in range(-1, 2) for b in range(-1, 2)
    ]
    count = len(mesh.vertices)
    points = np.concatenate([mesh.vertices + move for move in moves])
    faces = np.concatenate([mesh.faces + k * count for k in range(len(moves))])
    scene = rtcore_scene.EmbreeScene()
    built = TriangleMesh(scene, points.astype(np.float32), faces.astype(np.int32))
    normals = np.tile(mesh.normals, (len(moves), 1))
    first = points[faces[:, 0]]
    lines = round(np.sqrt(RAYS))
    across, along = np.meshgrid(np.arange(lines), np.arange(lines), indexing="ij")
    start = np.stack([along.ravel() / lines, across.ravel() / lines], axis=1) * period
    start = np.column_stack([low[:2] + start, np.full(len(start), high[2])])
    k = np.tile([-np.sin(THETA), 0.0, -np.cos(THETA)], (len(start), 1))
    spent, segments = 0.0, 0
    for _ in range(6):
        origins = np.ascontiguousarray(start, dtype=np.float32)
        directions = np.ascontiguousarray(k, dtype=np.float32)
        begin = time.process_time()
        face = scene.run(origins, directions)
        spent += time.process_time() - begin
        segments += len(face)
        hit = face >= 0
        if not hit.any():
            break
        face, start, k = face[hit], start[hit], k[hit]
        n = normals[face]
        t = ((first[face] - start) * n).sum(axis=1) / (k * n).sum(axis=1)
        start = start + t[:, None] * k + 1e-4 * n
        start[:, :2] = low[:2] + (start[:, :2] - low[:2]) % period
        k = k - 2.0 * (k * n).sum(axis=1)[:, None] * n
    del built
    return spent, segments


@pytest.mark.bench
def test_speed_beside_embree_alone_and_the_walk():
    rough = GaussianSurface(shape=(256, 256), spacing=1.0, corr_length=16, slope_rms=0.4)
    heights = rough.sample(3)
    mesh = MeshSurface.of_map(heights)
    options = {"n_rays": RAYS, "workers": 1, "n_theta": 18, "n_dphi": 36}
    # The same rays over both, where a map has other means for single bounces
    options["variance_reduction"] = False
    material = Material(1.5, 0.3)

    def over(surface, skips=True):
        taken = best(
            lambda: simulate(Scene(surface, material), THETA, skips=skips, **options)
        )
        # Less what every run costs: trees, bins, moments
        fixed = best(
            lambda: simulate(
                Scene(surface, material), THETA, skips=skips, **(options | {"n_rays": 64})
            )
        )
        return taken - fixed

    walked = over(heights)
    meshed = over(mesh)
    every = over(mesh, skips=False)
    alone, segments = min(embree_alone(mesh) for _ in range(3))
    whole = simulate(Scene(mesh, material), THETA, skips=False, **options).attrs
    rate = whole["path_segments"] / every
    print(
        f"\nmesh, every segment by Embree: {rate / 1e6:.2f} M segments/s, Embree alone "
        f"{segments / alone / 1e6:.2f} M/s: {rate / (segments / alone):.2f} of it; "
        f"a map as a mesh takes "
        f"{meshed / walked:.2f} times the walk"
    )

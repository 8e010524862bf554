"""Many rays and many faces: nothing leaks, and neither time nor memory runs away."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

from pbrdf import Material, MeshSurface, Scene, morphologies, simulate
from tests.meshes.shapes import groove, joined, mushrooms, pair

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]


def solids():
    """Closed meshes with edges, vertices, thin gaps and bodies that touch."""
    tetra = trimesh.creation.box((1.0, 1.3, 0.8))
    tetra.apply_transform(trimesh.transformations.rotation_matrix(0.9, [1.0, 0.7, 0.3]))
    ring = trimesh.creation.torus(1.2, 0.4, major_sections=24, minor_sections=13)
    return {
        "groove": MeshSurface(groove(3.0, 4.0), (3.0, 4.0)),
        "mushrooms": mushrooms(),
        "spheres on a plane": morphologies.spheres_on_plane(
            period=(8.0, 8.0), radius=0.8, coverage=0.4, subdivisions=3
        ),
        "fibres": morphologies.fibres(
            period=(12.0, 12.0), radius=0.4, length=11.0, coverage=1.0, layers=4
        ),
        "bodies": MeshSurface(joined(pair(tetra, (0.2, 0.1, 0.9)), pair(ring))),
    }


@pytest.mark.parametrize("name", ["groove", "mushrooms", "spheres on a plane", "bodies"])
def test_no_ray_of_two_million_leaks_and_mirrors_keep_all_light(name):
    result = simulate(
        Scene(solids()[name], Material.mirror()), [0.0, 0.8, 1.4], phi_i=0.35,
        n_rays=670_000, n_theta=6, n_dphi=8, max_bounces=400, stokes="unpolarized",
    )  # fmt: skip
    assert result.attrs["rays_leaked"] == [0, 0, 0]
    assert result.attrs["self_hits"] == 0
    assert result.attrs["medium_mismatches"] == 0
    assert np.abs(result.absorbed).max().item() < 1e-12
    sent = (result.albedo.sum("bounces") + result.transmitted + result.truncated).values
    assert np.abs(sent - 1.0).max() < 1e-9
    assert result.truncated.max().item() < 1e-3


def test_bodies_that_cut_into_each_other_lose_less_than_a_ray_in_a_million():
    """Fibres through fibres: facets cross that have no edge in common; one ray was seen."""
    rays = 670_000
    result = simulate(
        Scene(solids()["fibres"], Material.mirror()), [0.0, 0.8, 1.4], phi_i=0.35,
        n_rays=rays, n_theta=6, n_dphi=8, max_bounces=400, stokes="unpolarized",
    )  # fmt: skip
    assert sum(result.attrs["rays_leaked"]) <= 1e-6 * 3 * rays
    assert np.abs(result.absorbed).max().item() < 1e-12


MAKE = """
import sys
from pbrdf import GaussianSurface, MeshSurface
rough = GaussianSurface(shape=(708, 708), spacing=0.3, corr_length=3, slope_rms=0.4)
rough = rough.sample(1)
MeshSurface.of_map(rough).to_trimesh().export(sys.argv[1])
print(*rough.size)
"""
COMPILE = """
from pbrdf import GaussianSurface, Material, MeshSurface, Scene, simulate
rough = GaussianSurface(shape=(64, 64), spacing=0.3, corr_length=3, slope_rms=0.4)
mesh = MeshSurface.of_map(rough.sample(1))
simulate(Scene(mesh, Material(1.5)), 0.5, n_rays=100_000, n_theta=9, n_dphi=12)
"""
MILLION = """
import re, sys, time
from pathlib import Path
from pbrdf import Material, MeshSurface, Scene, simulate
begin = time.process_time()
mesh = MeshSurface(sys.argv[1], (float(sys.argv[2]), float(sys.argv[3])))
loaded = time.process_time() - begin
result = simulate(Scene(mesh, Material(1.5)), 0.5, n_rays=100_000, n_theta=9, n_dphi=12)
assert result.attrs["rays_leaked"] == [0]
# Not ru_maxrss, which a process inherits from the one that starts it
status = Path("/proc/self/status").read_text()
peak = int(re.search(r"VmHWM:\\s+(\\d+) kB", status)[1]) / 2**20
print(len(mesh.faces), loaded, peak)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the peak is read from /proc")
def test_a_million_faces_load_and_trace_in_bounded_time_and_memory(tmp_path):
    def printed(code: str, *arguments: str) -> list[str]:
        run = subprocess.run(
            [sys.executable, "-W", "ignore", "-c", code, *arguments],
            capture_output=True, text=True, cwd=ROOT, check=True,
        )  # fmt: skip
        return run.stdout.split()

    # In a process of its own: to make the file takes more memory than to read it
    path = str(tmp_path / "million.stl")
    period = printed(MAKE, path)
    # A run that compiles kernels takes more memory than the mesh: compile them first
    printed(COMPILE)
    words = printed(MILLION, path, *period)
    faces, loaded, peak = (float(word) for word in words)
    print(f"{faces:g} faces: loaded in {loaded:.1f} s of CPU, {peak:.2f} GiB at most")
    assert faces > 1e6
    # 12 s on a slow machine; what grows as the square of the faces takes hours
    assert loaded < 30.0
    assert peak < 1.5

"""Whether geometric optics holds for a mesh: curvature, features and heights of facets."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf import AccuracyWarning, GaussianSurface, HeightMap, MeshSurface, Scene, simulate
from pbrdf.validity import judge, roughness_of, roughness_of_mesh

trimesh = pytest.importorskip("trimesh")
SURFACE = GaussianSurface(shape=(96, 96), spacing=0.75, corr_length=9.0, slope_rms=0.25)


def words(surface, theta_i, wavelength):
    found = judge(roughness_of_mesh(surface), np.atleast_1d(theta_i), wavelength)
    return " ".join(found.notes)


def of_trimesh(mesh, period=None):
    return MeshSurface((mesh.vertices, mesh.faces), period)


@pytest.mark.parametrize("subdivisions", [1, 3])
def test_radius_of_a_sphere_however_fine(subdivisions):
    ball = of_trimesh(trimesh.creation.icosphere(subdivisions=subdivisions, radius=5.0))
    rough = roughness_of_mesh(ball)
    assert_allclose(rough.radii, [5.0], rtol=0.12)
    # Slopes of directions all over the sphere have a variance of 1/3 a component
    assert_allclose(rough.corr_length, np.sqrt(3.0) * rough.radii[0], rtol=1e-9)
    found = judge(rough, np.array([0.2, 1.5]), np.array([0.7]))
    assert_allclose(found.numbers["curvature_number"], 2 * np.pi * 5.0 / 0.7, rtol=0.12)
    assert_allclose(found.numbers["coherent_share"], 0.0)
    assert found.notes == ()
    assert "The tangent plane errs" in words(ball, 0.2, 1.7)


def test_radius_of_a_fibre_and_edges_of_a_cube():
    fibre = of_trimesh(trimesh.creation.cylinder(radius=3.0, height=600.0, sections=96))
    assert_allclose(roughness_of_mesh(fibre).radii, [3.0], rtol=0.05)
    box = trimesh.creation.box((4.0, 4.0, 4.0))
    fine = box.subdivide().subdivide().subdivide()
    coarse, finer = (roughness_of_mesh(of_trimesh(one)) for one in (box, fine))
    # Four edges of π/2 a face: a mean curvature of π / 4 um, or its half where both axes
    # of it meet in one facet
    assert 4.0 / np.pi < finer.radii[0] < coarse.radii[0] < 2.0 * 4.0 / np.pi + 1e-9
    found = judge(coarse, np.array([0.4]), np.array([0.01]))
    assert found.notes == ()
    assert "traced as flat faces" in found.remarks[0]


@pytest.mark.parametrize("wavelength", [0.55, 5.0])
def test_the_mesh_of_a_map_is_judged_as_the_map(wavelength):
    sample = SURFACE.sample(4)
    theta, wave = np.array([0.2, 1.1]), np.array([wavelength])
    ours = judge(roughness_of_mesh(MeshSurface.of_map(sample)), theta, wave)
    theirs = judge(roughness_of(sample), theta, wave)
    assert len(ours.notes) == len(theirs.notes)
    for name, share in (("curvature_number", 0.35), ("corr_length_in_waves", 0.3)):
        assert_allclose(ours.numbers[name], theirs.numbers[name], rtol=share)
    assert_allclose(
        ours.numbers["coherent_share"], theirs.numbers["coherent_share"], atol=0.02
    )


def test_edges_across_the_period_count():
    """Ridges and valleys of a pyramid lattice, as many across the seam as inside."""
    corners = [(0, 0, 0), (6, 0, 0), (6, 4, 0), (0, 4, 0), (3, 2, 1.5)]
    faces = [(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)]
    one = MeshSurface((corners, faces), period=(6, 4))
    x, y = np.meshgrid(np.arange(3) * 6.0, np.arange(3) * 4.0, indexing="ij")
    moved = [
        np.array(corners, dtype=float) + np.array([a, b, 0.0])
        for a, b in zip(x.ravel(), y.ravel(), strict=True)
    ]
    nine = MeshSurface(
        (
            np.concatenate(moved),
            np.concatenate([np.array(faces) + 5 * k for k in range(9)]),
        ),
        period=(18, 12),
    )
    single, tiled = roughness_of_mesh(one), roughness_of_mesh(nine)
    assert 0.5 < single.radii[0] < 10.0
    assert_allclose(tiled.radii, single.radii, rtol=1e-9)
    assert_allclose(tiled.corr_length, single.corr_length, rtol=1e-9)


def test_a_plane_is_no_roughness_and_grains_on_it_are_judged_by_themselves():
    plane = MeshSurface.of_map(HeightMap.flat((50.0, 50.0)))
    assert words(plane, 0.4, 0.5) == ""
    ball = trimesh.creation.icosphere(subdivisions=3, radius=1.0)
    ball.apply_translation([20.0, 30.0, 1.1])
    both = of_trimesh(trimesh.util.concatenate([ball, plane.to_trimesh()]), (50.0, 50.0))
    assert_allclose(roughness_of_mesh(both).radii, [1.0], rtol=0.05)
    said = words(both, 0.4, 0.5)
    assert "The tangent plane errs" in said
    # The plane itself mirrors in the tracer too
    assert "coherent" not in said


def test_the_coherent_beam_of_facets_at_two_heights():
    """The mean of exp(i ψ h) over steps of 11 cells of 40, and two ramps that join them."""
    heights = np.zeros((160, 160))
    heights[np.arange(160) % 40 < 12] = 0.2
    surface = MeshSurface.of_map(HeightMap(heights, (0.5, 0.5), periodic=True))
    found = judge(roughness_of_mesh(surface), np.array([0.6]), np.array([0.4])).numbers
    phase = 4 * np.pi * 0.2 * np.cos(0.6) / 0.4
    ramp = (np.exp(1j * phase) - 1) / (1j * phase)
    expected = abs(27 + 11 * np.exp(1j * phase) + 2 * ramp) ** 2 / 40**2
    # Of a surface of few places what chance may leave is taken off
    assert_allclose(found["coherent_share"], [[expected]], atol=0.01)
    assert expected > 0.5


@pytest.mark.filterwarnings("ignore::pbrdf.errors.AccuracyWarning")
def test_results_over_meshes_carry_the_judgement():
    rough = MeshSurface.of_map(SURFACE.sample(1))
    with pytest.warns(AccuracyWarning, match="The tangent plane errs"):
        result = simulate(Scene(rough, "gold"), 0.4, wavelength=10.0, n_rays=64)
    assert result.curvature_number.dims == ("theta_i",)
    assert any("tangent plane" in note for note in result.attrs["warnings"])

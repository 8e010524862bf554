"""Statistics of facets: against maps, closed forms, and their own error bars."""

import numpy as np
import pytest
import trimesh

from fitting import surface_statistics
from pbrdf import GaussianSurface, HeightMap, MeshSurface, morphologies
from tests.meshes.shapes import joined, mushrooms, pair, plate

ROUGH = GaussianSurface(shape=(96, 64), spacing=1.0, corr_length=(5.0, 8.0), slope_rms=0.3)


def test_slopes_of_a_map_are_those_of_its_mesh():
    heights = ROUGH.sample(1)
    found = surface_statistics(MeshSurface.of_map(heights))
    for estimate, slope in zip(
        (found.slope_rms_x, found.slope_rms_y), heights.slopes(), strict=True
    ):
        assert estimate.value == pytest.approx(np.sqrt((slope**2).mean()), rel=1e-12)
    assert found.slope_rms_x.value > 1.2 * found.slope_rms_y.value
    both = np.hypot(found.slope_rms_x.value, found.slope_rms_y.value) / np.sqrt(2)
    assert found.slope_rms.value == pytest.approx(both, rel=1e-12)
    assert found.overhang_share.value == 0.0
    assert found.warnings == ()


def test_error_bars_hold_what_other_samples_show():
    values, errors = [], []
    for seed in range(24):
        found = surface_statistics(MeshSurface.of_map(ROUGH.sample(seed))).slope_rms
        values.append(found.value)
        errors.append(found.stderr)
    # 24 values tell their scatter to a seventh
    assert np.std(values) == pytest.approx(np.mean(errors), rel=0.5)


def test_area_and_overhang_of_a_ball_over_a_plane():
    ball = trimesh.creation.icosphere(subdivisions=4, radius=1.5)
    mesh = MeshSurface(joined(plate(cells=8), pair(ball, (5.0, 4.0, 2.0))), (10.0, 8.0))
    found = surface_statistics(mesh)
    area = 4 * np.pi * 1.5**2
    assert found.area_ratio.value == pytest.approx(1 + area / 80, rel=2e-3)
    assert found.overhang_share.value == pytest.approx(area / 2 / (80 + area), rel=2e-2)
    assert found.tilt_share.sum() == pytest.approx(1.0)
    # Zenith angles of a ball are spread as the sine, those of the plane are 0
    below = found.tilt_share[18:].sum()
    assert below == pytest.approx(found.overhang_share.value, rel=0.05)
    assert found.tilt_share[0] > 80 / (80 + area)


def test_walls_are_named_and_left_out():
    mesh = morphologies.pillars(period=(4.0, 4.0), radius=1.0, height=5.0)
    found = surface_statistics(mesh)
    assert found.slope_rms.value < 1e-9
    assert "left out" in found.warnings[0]
    # The top of the pillar is as large as what it hides of the plane
    walls = 2 * np.pi * 5.0
    share = walls / (walls + 16)
    assert found.wall_share.value == pytest.approx(share, rel=0.01)
    assert list(found.to_frame().columns) == ["value", "stderr", "low", "high"]


def test_what_is_no_surface_is_refused():
    with pytest.raises(TypeError, match="or a MeshSurface"):
        surface_statistics(3.0)
    assert hasattr(surface_statistics(ROUGH.sample(0)), "corr_length")
    assert surface_statistics(MeshSurface.of_map(HeightMap.flat())).slope_rms.value == 0.0


def test_statistics_of_a_mesh_print_as_a_table():
    text = str(surface_statistics(mushrooms())).splitlines()
    assert text[0].split()[0] == "area_ratio"
    assert text[-1].startswith("warning: ")
    assert len(text) == 7


@pytest.mark.parametrize("height", [0.0, 0.9, -0.6])
def test_what_lies_inside_of_another_body_is_no_surface(height):
    """A ball sunk in a plate across the seam: the cap that stands out, Archimedes' way."""
    radius = 1.5
    ball = trimesh.creation.icosphere(subdivisions=4, radius=radius)
    mesh = MeshSurface(joined(plate(cells=6), pair(ball, (9.6, 0.2, height))), (10.0, 8.0))
    found = surface_statistics(mesh)
    disc = np.pi * (radius**2 - height**2)
    cap = 2 * np.pi * radius * (radius + height)
    whole = 80 - disc + cap
    assert found.area_ratio.value == pytest.approx(whole / 80, rel=3e-3)
    below = max(2 * np.pi * radius * height, 0.0)
    assert found.overhang_share.value == pytest.approx(below / whole, abs=2e-3)
    # Of the area seen from above, tan² over the cap down to the wall, else level
    least = max(-height / radius, np.cos(np.deg2rad(80.0)))
    assert found.tilt_share[0] > (80 - disc) / whole - 2e-3
    square = np.pi * radius**2 * (-np.log(least**2) - (1 - least**2))
    seen = 80 - disc + np.pi * radius**2 * (1 - least**2)
    assert found.slope_rms.value == pytest.approx(np.sqrt(0.5 * square / seen), rel=0.03)


def test_what_overlaps_its_own_images_counts_once():
    """Rods along y, wider than their period along x: arcs between the valleys."""
    rod = trimesh.creation.cylinder(radius=1.0, height=12.0, sections=360)
    rod.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1.0, 0.0, 0.0]))
    found = surface_statistics(MeshSurface(rod, (1.2, 20.0)))
    # Each shows an arc of twice asin(0.6) above and one below, and its ends
    area = 4 * np.arcsin(0.6) * 12.0 + 2 * np.pi
    assert found.area_ratio.value == pytest.approx(area / 24.0, rel=5e-3)
    assert found.overhang_share.value == pytest.approx(
        2 * np.arcsin(0.6) * 12.0 / area, rel=1e-2
    )

"""Ready-made meshes: closed, seeded, and of the sizes asked for."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from pbrdf import morphologies
from pbrdf.errors import AccuracyWarning

PERIOD = (14.0, 11.0)
MADE = {
    "spheres_on_plane": {
        "period": PERIOD, "radius": 0.9, "coverage": 0.3, "subdivisions": 2,
    },
    "pillars": {"period": (4.0, 5.0), "radius": 1.0, "height": 2.5, "overhang": 0.4},
    "fibres": {
        "period": PERIOD, "radius": 0.4, "length": 9.0, "coverage": 0.8, "layers": 4,
    },
    "flakes": {
        "period": PERIOD, "radius": 2.0, "thickness": 0.1, "coverage": 0.7, "tilt_rms": 0.2,
    },
    "grit": {"period": PERIOD, "radius": 1.1, "coverage": 0.35},
}  # fmt: skip


@pytest.mark.parametrize("name", MADE)
def test_they_are_closed_grounds_and_the_same_from_the_same_seed(name):
    make = getattr(morphologies, name)
    mesh = make(**MADE[name])
    assert mesh.kind == "ground"
    assert mesh.repairs == ()
    assert mesh.period == MADE[name]["period"]
    # The plane is the lowest that light can reach, and something stands on it
    assert mesh.bounds[1, 2] > 0.1
    again = make(**MADE[name])
    assert_array_equal(again.vertices, mesh.vertices)
    if name != "pillars":
        other = make(**MADE[name], seed=5)
        assert not np.array_equal(other.vertices, mesh.vertices)


def test_spheres_cover_what_was_asked_and_keep_apart():
    mesh = morphologies.spheres_on_plane(**MADE["spheres_on_plane"])
    spheres = (len(mesh.faces) - 2) // 320
    assert spheres == round(0.3 * 14 * 11 / (np.pi * 0.81))
    # Their lowest points touch the plane, their highest are one diameter up
    assert mesh.bounds[1, 2] == pytest.approx(1.8, rel=0.05)
    body = np.asarray(mesh.vertices[4:]).reshape(spheres, -1, 3)
    assert_allclose(body[..., 2].min(axis=1), -9e-4, atol=1e-9)
    centre = body.mean(axis=1)[:, :2]
    apart = centre[:, None] - centre
    apart -= np.array(PERIOD) * np.round(apart / PERIOD)
    distance = np.linalg.norm(apart, axis=-1) + 10 * np.eye(spheres)
    assert distance.min() >= 1.8 - 1e-2


def test_a_pillar_has_its_area_and_hangs_over():
    plain = morphologies.pillars(period=(4.0, 5.0), radius=1.0, height=2.5, sections=96)
    walls = np.abs(plain.normals[:, 2]) < 1e-9
    assert plain.areas[walls].sum() == pytest.approx(2 * np.pi * 2.5, rel=3e-3)
    capped = morphologies.pillars(**MADE["pillars"])
    assert capped.areas[capped.normals[:, 2] < -0.5].sum() > 0.0
    assert capped.bounds[1, 2] == pytest.approx(2.9)


def test_a_porous_sheet_has_light_below_and_holes_of_their_size():
    mesh = morphologies.porous_sheet(period=4.0, radius=1.2, thickness=0.5, sections=64)
    assert mesh.kind == "bodies"
    assert mesh.repairs == ()
    above = mesh.areas[mesh.normals[:, 2] > 0.5].sum()
    assert above == pytest.approx(16.0 - np.pi * 1.44, rel=1e-3)
    walls = mesh.areas[np.abs(mesh.normals[:, 2]) < 0.5].sum()
    assert walls == pytest.approx(2 * np.pi * 1.2 * 0.5, rel=1e-3)


def test_flakes_have_the_slopes_asked_for():
    mesh = morphologies.flakes(
        period=(40.0, 40.0), radius=1.0, thickness=0.05, coverage=1.5, tilt_rms=0.15
    )
    tops = mesh.normals[(mesh.normals[:, 2] > 0.7)][2:].reshape(-1, 9, 3)[:, 0]
    slopes = tops[:, :2] / tops[:, 2:]
    error = 0.15 / np.sqrt(2 * slopes.size)
    assert np.sqrt((slopes**2).mean()) == pytest.approx(0.15, abs=4 * error)


@pytest.mark.parametrize(
    ("name", "options", "match"),
    [
        ("spheres_on_plane", {"coverage": 0.7}, r"coverage must lie in \(0, 0.5\]"),
        ("spheres_on_plane", {"radius": -1.0}, "radius must be positive"),
        ("pillars", {"radius": 2.0}, "must leave gaps between pillars"),
        ("fibres", {"layers": 0.5}, "layers must be 1 or more"),
        ("flakes", {"sections": 2}, "sections must be 3 or more"),
        ("grit", {"corners": 4}, "corners must be 5 or more"),
        ("grit", {"period": (0.0, 1.0)}, "period must be positive"),
    ],
)
def test_arguments_are_checked(name, options, match):
    with pytest.raises(ValueError, match=match):
        getattr(morphologies, name)(**(MADE[name] | options))


def test_coverage_that_whole_bodies_miss_is_warned_of():
    with pytest.warns(AccuracyWarning, match=r"coverage is 0.349 with 1 bodies .* not 0.5"):
        morphologies.spheres_on_plane(period=(3.0, 3.0), radius=1.0, coverage=0.5)
    with pytest.raises(ValueError, match="period must be no less than a body is wide"):
        morphologies.spheres_on_plane(period=(26.0, 8.0), radius=5.0, coverage=0.38)

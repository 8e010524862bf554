"""Total reflection under water: grooves from which all light leaves as it came."""

import numpy as np
import pytest

from pbrdf import Film, HeightMap, Material, Scene, simulate
from tests.contaminants.scenes import (
    assert_closed,
    assert_within,
    clean_counters,
    whole,
)
from tests.contaminants.test_films import reflection, transmission
from tests.source_disc import turn_between

WATER, METAL = 1.333, (0.958, 6.69)
TILT = np.deg2rad(27.0)
HEIGHT, HALF = np.tan(TILT), 1.0  # of a groove, and half its period
# Light from straight above leaves a facet under twice its tilt and is totally reflected at
# the level surface. At this height of water above the valleys all light from one facet
# falls onto one that faces it (the sum of both heights on the facets is then HEIGHT), which
# sends it straight up
LEVEL = 0.5 * (HEIGHT + HALF / np.tan(2.0 * TILT))
SEEDS = 24


def round_trip():
    """Matrix of the whole, in the frame whose s axis lies along the grooves."""
    enters, leaves = transmission(1.0, WATER), transmission(1.0, 1.0 / WATER)
    above, below = reflection(1.0, WATER), reflection(1.0, 1.0 / WATER)
    metal = reflection(np.cos(TILT), METAL[0] / WATER, METAL[1] / WATER)
    trip = metal @ reflection(np.cos(2.0 * TILT), 1.0 / WATER) @ metal
    return above + leaves @ np.linalg.inv(np.eye(4) - trip @ below) @ trip @ enters


def test_the_phase_of_total_reflection_is_that_of_the_book():
    # Born & Wolf, section 1.5.4: tan(delta/2), delta the phase of s less that of p
    cos, sin = np.cos(2.0 * TILT), np.sin(2.0 * TILT)
    half = np.arctan(cos * np.sqrt(sin**2 - WATER**-2) / sin**2)
    matrix = reflection(cos, 1.0 / WATER)
    np.testing.assert_allclose(
        matrix[[2, 3], [2, 2]], [np.cos(2.0 * half), np.sin(2.0 * half)], atol=1e-12
    )


@pytest.mark.parametrize("phi", [0.0, 0.4])
def test_grooves_under_water_send_light_back_with_the_phases_of_total_reflection(phi):
    grooves = HeightMap(np.array([[0.0] * 2, [HEIGHT] * 2]), HALF, periodic=True)
    film = Film(thickness=LEVEL - 0.5 * HEIGHT, material=Material(WATER), level=True)
    scene = Scene(grooves, Material(*METAL), film)
    results = [
        simulate(scene, 0.0, phi_i=phi, n_rays=4000, n_theta=9, n_dphi=4, seed=k)
        for k in range(SEEDS)
    ]
    matrices = np.array([whole(result) for result in results])
    # In: k = -z, s axis (sin, -cos); out: k = z, at the azimuth of the source
    along, sin, cos = np.array([0.0, 1.0, 0.0]), np.sin(phi), np.cos(phi)
    into = turn_between(np.array([sin, -cos, 0.0]), along, np.array([0.0, 0.0, -1.0]))
    out = turn_between(along, np.array([-sin, cos, 0.0]), np.array([0.0, 0.0, 1.0]))
    expected = out @ round_trip() @ into
    assert abs(expected[2, 3]) > 0.1
    assert_within(
        matrices.mean(axis=0), matrices.std(axis=0, ddof=1) / np.sqrt(SEEDS), expected
    )
    # All of it straight up
    assert float(results[0].brdf_total.isel(theta_s=slice(1, None)).max()) == 0.0
    clean_counters(results[0])
    assert assert_closed(results[0]) < 1e-3

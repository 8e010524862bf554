"""Absorbers of large index against nearly clear media: no NaN, no lost light, no crash."""

import numpy as np
import pytest

from pbrdf import (
    Drops,
    Film,
    GaussianSurface,
    HeightMap,
    Material,
    Scene,
    Spheres,
    simulate,
)
from pbrdf.kernels.optics.absorbing import interface_elements

# What is thin beside the wavelength is no question here
pytestmark = pytest.mark.filterwarnings("ignore::pbrdf.AccuracyWarning")


@pytest.mark.parametrize("pair", [(1.4, 8.0, 1.33, 0.1), (0.2, 3.5, 1.33, 0.1)])
def test_what_crosses_is_a_number_where_all_is_reflected(pair):
    """Interference before the interface carries |r| to 1 and, by rounding, beyond."""
    n, kappa, *beyond = pair
    rng = np.random.default_rng(3)
    for cosine, share in rng.random((4000, 2)):
        # From the homogeneous wave to one that runs along the interface
        index = n + share * (abs(complex(n, kappa)) - n)
        found = interface_elements(cosine, index, n, kappa, *beyond)
        assert np.isfinite(found).all()
        assert found[0] + abs(found[1]) <= 1.0


def test_light_in_a_strong_absorber_under_a_film_is_booked():
    """A drop of index 1.4 + 8i in a film: its budget was NaN in most runs."""
    drops = Drops.at(
        [(64, 64), (20, 20), (90, 40)], volume=6000.0, contact_angle=1.2,
        material=Material(1.4, 8.0),
    )  # fmt: skip
    film = Film(thickness=1.0, material=Material(1.33, 0.1))
    ground = HeightMap(np.zeros((128, 128)), 1.0, periodic=True)
    result = simulate(
        Scene(ground, Material(1.5), [drops, film]), 0.9, n_rays=4000, wavelength=4.0,
        n_theta=18, n_dphi=4, seed=1, workers=1,
    )  # fmt: skip
    sent = result.albedo.sum() + result.absorbed + result.transmitted
    assert float(sent[0]) == pytest.approx(1.0, abs=1e-4)


def test_beams_that_skim_a_nearly_clear_film_are_not_lost():
    """Beyond the critical angle the film's own kappa leaves a wave along the interface."""
    drop = Drops.at([(50, 50)], volume=30000.0, contact_angle=1.2,
                    material=Material(1.5, 1e-3))  # fmt: skip
    film = Film(thickness=60.0, material=Material(1.3330, 2e-9))
    ground = Material(1.5, diffuse_albedo=0.8)
    scene = Scene(HeightMap.flat(size=(100.0, 100.0)), ground, [drop, film])
    result = simulate(
        scene, 0.5, n_rays=20000, wavelength=0.55, n_theta=18, n_dphi=4, seed=1
    )
    assert float(result.leaked[0]) == 0.0


def anything(rng):
    """Any medium, a quarter of them clear."""
    kappa = 0.0 if rng.random() < 0.25 else 10 ** rng.uniform(-9.0, 1.0)
    return Material(rng.uniform(0.2, 3.0), kappa)


def lying(rng):
    """Drops, a sphere and a film of anything, most of them, in any order."""
    places = [(64, 64), (20, 20), (90, 40)]
    drops = Drops.at(
        places, volume=rng.uniform(500, 6000), contact_angle=rng.uniform(0.3, 2.6),
        material=anything(rng), roughness="ignore",
    )  # fmt: skip
    sphere = Spheres.at([(64, 80)], radius=8.0, material=anything(rng))
    film = Film(
        thickness=10 ** rng.uniform(-1.0, 1.5), material=anything(rng),
        level=bool(rng.random() < 0.3),
    )  # fmt: skip
    order = rng.permutation(3)
    return [(drops, sphere, film)[k] for k in order if rng.random() < 0.8]


def test_budgets_of_random_scenes_close():
    """From 0.35 to 20 um, on four grounds; over 1473 such scenes to 1.5e-4."""
    rng = np.random.default_rng(11)
    grounds = [
        Material.mirror(), Material(1.5), Material(0.9, 3.0),
        Material(1.5, diffuse_albedo=0.7),
    ]  # fmt: skip
    rough = GaussianSurface(
        shape=(128, 128), spacing=1.0, corr_length=10.0, slope_rms=0.3
    ).sample(1)
    for number in range(40):
        surface = rough if number % 2 else HeightMap.flat(size=(128.0, 128.0))
        scene = Scene(surface, grounds[number % 4], lying(rng))
        result = simulate(
            scene, rng.uniform(0.0, 1.45), n_rays=640, n_theta=9, n_dphi=4, workers=1,
            wavelength=10 ** rng.uniform(-0.45, 1.3), seed=number,
        )  # fmt: skip
        booked = result.absorbed + result.transmitted + result.truncated
        assert float(result.albedo.sum() + booked.sum()) == pytest.approx(1.0, abs=1e-3)
        assert float(result.leaked[0]) == 0.0
        assert np.isfinite(result.brdf).all()

"""Sources of some width and folding by symmetry, where water lies on the surface."""

from dataclasses import replace
from functools import cache

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
from tests.contaminants.scenes import clean_counters
from tests.contaminants.test_films import film_matrix
from tests.mirror_images import assert_folded
from tests.source_disc import assert_answers_disc, disc, mirrored_disc

WATER, PAINT = Material(1.333), Material(1.5, diffuse_albedo=0.2)
ALUMINIUM = (0.958, 6.69)
SOURCE = np.deg2rad(40.0)
ROUGH = GaussianSurface(shape=(64, 64), spacing=1.0, corr_length=8.0, slope_rms=0.3)
DEW = {"contact_angle": 1.2, "coverage": 0.25, "number_density": 4e-3, "material": WATER}
# Slopes of 0.3 contradict most contact angles, which is not at issue here
pytestmark = pytest.mark.filterwarnings("ignore::pbrdf.errors.AccuracyWarning")


@cache
def film_table():
    """Matrices of the film at 2001 cosines from 0.6 to 1."""
    cosines = np.linspace(0.6, 1.0, 2001)
    return np.array([film_matrix(np.arccos(c), WATER.n, ALUMINIUM) for c in cosines])


def film_matrices(cosine):
    return film_table()[np.rint((cosine - 0.6) / 0.4 * 2000).astype(int)]


@pytest.mark.parametrize("level", [False, True])
@pytest.mark.parametrize(("theta", "phi"), [(SOURCE, 0.7), (0.02, -2.0)])
def test_a_flat_film_on_metal_mirrors_the_disc_with_its_frames(theta, phi, level):
    """All elements of all bins, against the series of a film and directions drawn."""
    half, n_theta, n_dphi = np.deg2rad(6.0), 30, 24
    film = Film(thickness=0.3, material=WATER, level=level)
    result = simulate(
        Scene(HeightMap.flat(size=(2.0, 3.0)), Material(*ALUMINIUM), film), theta,
        phi_i=phi, n_rays=120_000, source_half_angle=half, n_theta=n_theta, n_dphi=n_dphi,
    )  # fmt: skip

    expected, drawn = mirrored_disc(theta, phi, half, film_matrices, n_theta, n_dphi)
    assert np.abs(expected[..., 2:, :2]).max() > 1e-4
    assert_answers_disc(result, expected, drawn)
    clean_counters(result)


def test_a_wet_rough_surface_answers_a_disc_as_the_mean_of_its_directions():
    """Light by zenith of the detector: wide source against 36 narrow ones."""
    options = {"n_theta": 9, "n_dphi": 2, "stokes": "unpolarized", "seed": 4}
    smooth = replace(ROUGH, slope_rms=0.15).sample(2)
    scene = Scene(smooth, Material(*ALUMINIUM), Drops(**DEW, seed=3))
    wide = simulate(
        scene, SOURCE, phi_i=0.5, n_rays=50_000, source_half_angle=0.4, **options
    )
    to_source, _ = disc(SOURCE, 0.5, 0.4, 36)
    narrow = [
        simulate(
            scene, np.arccos(one[2]), phi_i=np.arctan2(one[1], one[0]), n_rays=1600,
            **options,
        )
        for one in to_source
    ]  # fmt: skip

    def light(result):
        flux = result.brdf_total * result.projected_solid_angle
        return flux.sum("dphi").values[..., 0, 0].squeeze()

    singles = np.array([light(result) for result in narrow])
    # The drawn directions scatter more than the rays of each
    error = singles.std(axis=0, ddof=1) / np.sqrt(len(singles))
    assert np.abs((light(wide) - singles.mean(axis=0)) / error).max() < 5.0
    # And the width is seen: the axis alone is not the mean
    axis = simulate(scene, SOURCE, phi_i=0.5, n_rays=50_000, **options)
    assert (np.abs(light(wide) - light(axis)) / error).max() > 5.0


def folded(seed, fold, contaminants=(), surface=ROUGH, realizations=16):
    contaminants = contaminants or [Drops(**DEW), Film(thickness=0.2, material=WATER)]
    return simulate(
        Scene(surface, PAINT, contaminants), 0.9, phi_i="uniform", seed=seed, fold=fold,
        n_rays=2000, realizations=realizations, n_theta=6, n_dphi=12,
    )  # fmt: skip


@pytest.mark.parametrize("flat", [False, True])
def test_folding_averages_each_bin_with_its_mirror_image(flat):
    surface = HeightMap.flat(size=(96.0, 80.0)) if flat else ROUGH
    plain, fold = (folded(3, one, surface=surface, realizations=4) for one in (False, True))
    assert_folded(fold, plain)


@pytest.mark.slow
def test_folded_runs_agree_with_others_and_state_half_the_variance():
    """Of independent seeds, over all elements: the image is an estimate of the same."""
    # Spheres, for they are laid so much faster than drops
    wet = [Spheres(radius=3.0, coverage=0.2, material=WATER, sink=0.3)]
    plain, fold = (
        [folded(100 + 2 * k + one, one, wet) for k in range(12)] for one in (False, True)
    )
    off_axis = {"dphi": slice(1, 6), "theta_i": 0}

    def mean_and_variance(results):
        values = np.array([r.brdf_total.isel(off_axis).values for r in results])
        stated = np.array([r.brdf_total_stderr.isel(off_axis).values for r in results])
        return values.mean(axis=0), values.var(axis=0, ddof=1), (stated**2).mean(axis=0)

    (there, spread, stated), (here, spread_fold, stated_fold) = (
        mean_and_variance(results) for results in (plain, fold)
    )
    # Student's t of 22 degrees of freedom over 480 elements: 6 has a chance of 2e-3
    z = (there - here) / np.sqrt((spread + spread_fold) / 12)
    assert np.abs(z).max() < 6.0
    assert 0.7 < np.mean(z**2) < 1.4
    for one, other in ((spread_fold, spread), (stated_fold, stated)):
        # Every bin counts alike: of the sums a third may be one bin's
        both = (one + other)[..., 0, 0]
        ratio = np.mean(one[..., 0, 0] / both) / np.mean(other[..., 0, 0] / both)
        assert 0.35 < ratio < 0.65
    assert 0.8 < np.sqrt(spread_fold.sum() / stated_fold.sum()) < 1.25


@pytest.mark.parametrize(
    "pinned",
    [
        Drops(**DEW, seed=1),
        Drops.at(
            [[3.0, 4.0], [20.0, 30.0]], volume=20.0, contact_angle=1.0, material=WATER
        ),
    ],
)
def test_bodies_at_the_same_places_in_every_realisation_cannot_be_folded(pinned):
    with pytest.raises(ValueError, match="drawn anew for every realisation"):
        folded(0, True, [pinned])


def test_patterns_and_single_azimuths_cannot_be_folded():
    scene = Scene(ROUGH, PAINT, Drops(**DEW))
    with pytest.raises(ValueError, match="1 contaminants and phi_i 0"):
        simulate(scene, 0.3, n_rays=320, realizations=8, fold=True)
    oblong = GaussianSurface(
        shape=(96, 96), spacing=1.0, corr_length=(8.0, 4.0), slope_rms=0.3
    )
    with pytest.raises(ValueError, match="isotropic"):
        simulate(Scene(oblong, PAINT), 0.3, phi_i="uniform", n_rays=320, fold=True)

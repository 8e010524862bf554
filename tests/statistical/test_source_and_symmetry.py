"""Sources of some width, and surfaces that are their own mirror image in the mean."""

import numpy as np
import pytest

from pbrdf import GaussianSurface, HeightMap, Material, Scene, simulate
from tests.mirror_images import assert_folded, image_of
from tests.source_disc import assert_answers_disc, disc, mirrored_disc

ALUMINIUM = Material(0.958, 6.69)
FLAT = HeightMap.flat(size=(2.0, 3.0))
ROUGH = GaussianSurface(shape=(96, 80), spacing=1.0, corr_length=8.0, slope_rms=0.3).sample(
    2
)
SOURCE = np.deg2rad(40.0)


def aluminium_facet(cosine):
    """Matrices of a facet at these cosines of incidence, written out once more."""
    index = 0.958 + 6.69j
    q = np.sqrt(index**2 - 1 + cosine**2)
    r_s = (cosine - q) / (cosine + q)
    r_p = (index**2 * cosine - q) / (index**2 * cosine + q)
    matrix = np.zeros((len(cosine), 4, 4))
    matrix[:, 0, 0] = matrix[:, 1, 1] = (abs(r_s) ** 2 + abs(r_p) ** 2) / 2
    matrix[:, 0, 1] = matrix[:, 1, 0] = (abs(r_s) ** 2 - abs(r_p) ** 2) / 2
    matrix[:, 2, 2] = matrix[:, 3, 3] = (r_s * r_p.conj()).real
    matrix[:, 2, 3] = -(r_s * r_p.conj()).imag
    matrix[:, 3, 2] = (r_s * r_p.conj()).imag
    return matrix


@pytest.mark.parametrize("skips", [True, ("walk",), False])
@pytest.mark.parametrize(("theta", "phi"), [(SOURCE, 0.7), (0.02, -2.0)])
def test_flat_metal_mirrors_the_disc_with_its_frames(theta, phi, skips):
    """All elements of all bins, against directions drawn and frames turned by Rodrigues."""
    half, n_theta, n_dphi = np.deg2rad(6.0), 30, 24
    result = simulate(
        Scene(FLAT, ALUMINIUM), theta, phi_i=phi, n_rays=120_000, source_half_angle=half,
        n_theta=n_theta, n_dphi=n_dphi, skips=skips,
    )  # fmt: skip
    expected, drawn = mirrored_disc(theta, phi, half, aluminium_facet, n_theta, n_dphi)
    assert np.abs(expected[..., 1:, 1:]).max() > 0.02
    assert_answers_disc(result, expected, drawn)


def test_rough_surface_answers_a_disc_as_the_mean_of_its_directions():
    """Light by zenith of the detector: wide source against 64 narrow ones."""
    options = {"n_theta": 9, "n_dphi": 2, "stokes": "unpolarized", "seed": 4}
    scene, half = Scene(ROUGH, Material(1.5)), 0.4
    wide = simulate(
        scene, SOURCE, phi_i=0.5, n_rays=100_000, source_half_angle=half, **options
    )
    to_source, _ = disc(SOURCE, 0.5, half, 64)
    narrow = [
        simulate(
            scene, np.arccos(one[2]), phi_i=np.arctan2(one[1], one[0]), n_rays=6400,
            **options,
        )
        for one in to_source
    ]  # fmt: skip
    weight = wide.projected_solid_angle

    def light(result):
        return (result.brdf * weight).sum("dphi").values[..., 0, 0].squeeze()

    singles = np.array([light(result) for result in narrow])
    # The drawn directions scatter more than the rays of each
    error = singles.std(axis=0, ddof=1) / np.sqrt(len(singles))
    z = (light(wide) - singles.mean(axis=0)) / error
    assert np.abs(z[:2, :7]).max() < 5.0
    # And the width is seen: the axis alone is not the mean
    axis = simulate(scene, SOURCE, phi_i=0.5, n_rays=100_000, **options)
    assert (np.abs(light(wide) - light(axis)) / error).max() > 5.0


def test_a_tiny_disc_is_a_beam():
    scene = Scene(ROUGH, Material(1.5))
    options = {"n_rays": 32_000, "phi_i": 0.3, "n_theta": 9, "n_dphi": 12}
    beam, disc_ = (
        simulate(scene, 0.6, source_half_angle=half, **options) for half in (0.0, 1e-9)
    )
    assert beam.attrs["source_half_angle"] == 0.0
    error = np.hypot(beam.brdf_total_stderr, disc_.brdf_total_stderr)
    lit = beam.brdf_total > 1e-3
    assert lit.sum() > 300
    assert (np.abs(beam.brdf_total - disc_.brdf_total) / error).where(lit).max() < 6.0


@pytest.mark.filterwarnings("ignore:.*left the finite map sideways")
def test_wide_sources_on_finite_maps_stay_on_the_map():
    finite = HeightMap(ROUGH.heights, 1.0)
    result = simulate(
        Scene(finite, Material.mirror()), 0.5, phi_i=1.0, n_rays=6400, source_half_angle=0.2
    )
    assert result.attrs["rays_leaked"] == [0]
    assert result.side_exits.item() < 0.05


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"source_half_angle": -0.1}, "lie in"),
        ({"source_half_angle": 10.0}, "Angles are radians"),
        ({"source_half_angle": 0.4, "theta_i": 1.3}, "above the horizon"),
        ({"fold": True}, "its own mirror image"),
    ],
)
def test_sources_and_folds_that_make_no_sense_are_refused(options, message):
    options = {"theta_i": 0.3, "n_rays": 320} | options
    with pytest.raises(ValueError, match=message):
        simulate(Scene(ROUGH, Material(1.5)), **options)


ISOTROPIC = GaussianSurface(shape=(96, 96), spacing=1.0, corr_length=8.0, slope_rms=0.3)


def folded(seed, fold, **options):
    options = {"n_rays": 2000, "realizations": 16, "n_theta": 6, "n_dphi": 12} | options
    return simulate(
        Scene(ISOTROPIC, ALUMINIUM), 0.9, phi_i="uniform", seed=seed, fold=fold, **options
    )


def test_folding_averages_each_bin_with_its_mirror_image():
    plain, fold = folded(3, False), folded(3, True)
    assert_folded(fold, plain)
    # The image is an estimate of the same thing: unfolded, the two agree within errors
    stderr = plain.brdf_stderr
    error = np.hypot(stderr, np.abs(image_of(stderr)))
    off_axis = [1, 2, 3, 4, 5]
    z = ((plain.brdf.values - image_of(plain.brdf)) / np.where(error > 0, error, np.inf))[
        :, :, :, off_axis
    ]
    assert np.abs(z).max() < 6.0


@pytest.mark.slow
def test_stated_errors_of_folded_runs_are_their_spread():
    """Half the variance off the plane of incidence, and stated so."""
    runs = {fold: [folded(100 + s, fold) for s in range(40)] for fold in (False, True)}
    spread, stated = {}, {}
    for fold, results in runs.items():
        column = {"stokes_in": 0, "stokes_out": slice(3), "dphi": slice(1, 6)}
        values = np.array([r.brdf_total.isel(column).values for r in results])
        errors = np.array([r.brdf_total_stderr.isel(column).values for r in results])
        lit = (errors**2).mean(axis=0) < (0.2 * np.abs(values[..., :1].mean(axis=0))) ** 2
        spread[fold] = values.var(axis=0, ddof=1)[lit].sum()
        stated[fold] = (errors**2).mean(axis=0)[lit].sum()
        assert lit.sum() > 15
        assert 0.85 < np.sqrt(spread[fold] / stated[fold]) < 1.15
    assert 0.4 < spread[True] / spread[False] < 0.65

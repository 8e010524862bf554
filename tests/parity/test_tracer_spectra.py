"""Many wavelengths from sums by bin, against every path shaded for each wavelength."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from pbrdf import GaussianSurface, HeightMap, Material, Scene, simulate
from pbrdf.kernels import from_python
from pbrdf.kernels.bins import bin_fits
from pbrdf.kernels.optics import fresnel_table
from pbrdf.kernels.optics.fresnel import reflection_elements
from pbrdf.kernels.paths import shading
from pbrdf.simulation import spectra
from pbrdf.simulation.skips import SKIPS

# At grazing and around it the tangent plane fails; here numbers are compared, not physics
pytestmark = pytest.mark.filterwarnings(
    "ignore:The tangent plane errs",
    "ignore:.*left the finite map sideways",
    # Runs are compared ray for ray, over surfaces small and steep on purpose
    "ignore:A period of:pbrdf.errors.AccuracyWarning",
)

SURFACE = GaussianSurface(
    shape=(128, 96), spacing=(1.0, 1.2), corr_length=(12.0, 16.0), slope_rms=0.4
)
# Glass, glass at its Brewster angle, next to vacuum, the perfect conductor of the papers,
# aluminium, gold in the blue
N = np.array([1.5, 1.33, 1.01, 1e6, 0.958, 1.2, 1.46])
KAPPA = np.array([0.0, 0.0, 0.0, 0.0, 6.69, 7.26, 1.95])
WAVES = np.linspace(0.4, 1.0, N.size)
METAL_AND_GLASS = Material.from_table(wavelength=WAVES, n=N, kappa=KAPPA)
OTHER = Material.from_table(wavelength=WAVES, n=N[::-1], kappa=KAPPA[::-1])
BASED = Material(1.4, diffuse_albedo=0.6)
# From the source overhead over Brewster's angle to grazing
ANGLES = np.deg2rad([0.0, 30.0, 56.3, 87.0])
VALUES = ("brdf", "brdf_total", "brdf_stderr", "albedo", "absorbed", "truncated")


def run(surface=SURFACE, material=METAL_AND_GLASS, *, gathered, **options):
    options = {
        "n_rays": 3000, "realizations": 8, "phi_i": 0.4, "wavelength": WAVES,
        "n_theta": 18, "n_dphi": 24, "theta_i": ANGLES,
    } | options  # fmt: skip
    skips = set(SKIPS) if gathered else set(SKIPS) - {"spectra"}
    return simulate(Scene(surface, material), skips=skips, **options)


def labelled():
    heights = SURFACE.sample(5).heights
    labels = (np.random.default_rng(2).random(heights.shape) < 0.5).astype(np.uint8)
    return HeightMap(heights, SURFACE.spacing, periodic=True, labels=labels)


CASES = {
    "full": ({}, {}),
    "linear": ({}, {"stokes": "linear"}),
    "unpolarized": (
        {},
        {"stokes": "unpolarized", "phi_i": "uniform", "theta_i": ANGLES[2:]},
    ),
    "cut": ({}, {"max_bounces": 1, "variance_reduction": False}),
    "plain": ({}, {"variance_reduction": False}),
    "coarse": ({}, {"n_theta": 5, "n_dphi": 6}),
    "labels": ({"surface": labelled(), "material": [METAL_AND_GLASS, OTHER]}, {}),
    "base": ({"material": BASED}, {"n_rays": 500}),
    "finite": ({"surface": HeightMap(SURFACE.sample(1).heights, 1.0)}, {"theta_i": 0.3}),
}


@pytest.mark.parametrize("case", list(CASES))
def test_sums_by_bin_give_the_light_of_every_path(case):
    """To 5e-8 of M00: the tolerance of the fits, times a few elements."""
    scene, options = CASES[case]
    by_bin = run(**scene, **options, gathered=True)
    by_path = run(**scene, **options, gathered=False)
    scale = np.maximum(by_path.brdf.isel(stokes_out=0, stokes_in=0), 1e-300)
    apart = np.abs(by_bin.brdf - by_path.brdf) / scale
    assert 0.0 < apart.max() < 5e-8, "and the two routes are meant to differ"
    for name in VALUES:
        largest = float(np.abs(by_path[name]).max())
        assert_allclose(by_bin[name], by_path[name], rtol=0, atol=3e-8 * max(largest, 1e-9))
    for name in ("rays_escaped", "rays_truncated", "rays_left_sideways", "path_segments"):
        assert by_bin.attrs[name] == by_path.attrs[name]
    budget = by_bin.albedo.sum("bounces") + by_bin.truncated + by_bin.leaked
    assert_allclose(budget + by_bin.absorbed + by_bin.left_sideways, 1.0, atol=1e-9)


UNIFORM = {
    "surface": GaussianSurface(
        shape=(96, 96), spacing=1.0, corr_length=12.0, slope_rms=0.4
    ),
    "phi_i": "uniform", "theta_i": ANGLES[1:3],
}  # fmt: skip


@pytest.mark.parametrize("fold", [False, True])
def test_paths_that_overflow_their_buffer_are_shaded_too(fold, monkeypatch):
    """Some hundred times a sample here, and in some samples and directions only."""
    options = UNIFORM | {"n_rays": 600, "fold": fold, "gathered": True}
    plain = run(**options)
    for rows in (0, 200):
        monkeypatch.setattr(spectra, "BUFFER", rows)
        overflowing = run(**options)
        for name in VALUES:
            assert_allclose(overflowing[name], plain[name], rtol=1e-9, atol=1e-13)


def test_many_wavelengths_are_folded_as_one_is():
    options = UNIFORM | {"fold": True}
    by_bin, by_path = (run(**options, gathered=gathered) for gathered in (True, False))
    for name in VALUES:
        largest = float(np.abs(by_path[name]).max())
        assert_allclose(by_bin[name], by_path[name], rtol=0, atol=3e-8 * largest)


def test_any_number_of_workers_gives_the_same_bits():
    one, two = (run(gathered=True, n_rays=500, workers=count) for count in (1, 2))
    assert one.identical(two)


def test_few_wavelengths_are_shaded_path_by_path():
    material = Material.from_table(wavelength=WAVES[:3], n=N[:3], kappa=KAPPA[:3])
    options = {"material": material, "wavelength": WAVES[:3], "n_rays": 500}
    assert_array_equal(
        run(gathered=True, **options).brdf, run(gathered=False, **options).brdf
    )


@pytest.mark.parametrize(
    ("n", "kappa"), [*zip(N, KAPPA, strict=True), (np.inf, 0.0), (1.0, 0.0), (0.2, 3.0)]
)
def test_table_holds_its_tolerance_wherever_it_is_read(n, kappa):
    table_elements = from_python(fresnel_table.table_elements)
    table = fresnel_table.build_table(np.array([[n]]), np.array([[kappa]]))
    for cos_beta in np.random.default_rng(1).random(3000) ** 2:
        found = table_elements(table, 0, 0, cos_beta)
        exact = from_python(reflection_elements)(cos_beta, n, kappa)
        # A quarter more than in the middle of a step, where the table was judged
        assert np.abs(np.subtract(found, exact)).max() <= 1.25e-8 * exact[0]


@pytest.mark.parametrize("n_stokes", [1, 3, 4])
def test_two_bounces_in_closed_form_equal_the_product_of_matrices(n_stokes):
    rng = np.random.default_rng(7)
    optics = shading.Optics(
        np.array([[1.5, 0.96]]), np.array([[0.0, 6.7]]), np.empty((1, 0)), n_stokes
    )
    path_mueller = from_python(shading.path_mueller)
    for _ in range(50):
        record = np.zeros((3, 1, shading.N_RECORD))
        turn = rng.uniform(0, 2 * np.pi, 3)
        record[:, 0, shading.TURN_C], record[:, 0, shading.TURN_S] = (
            np.cos(turn),
            np.sin(turn),
        )
        record[:, 0, shading.COS_IN] = rng.random(3)
        record[:, 0, shading.COS_OUT] = shading.SPECULAR
        record[:2, 0, shading.LABEL] = rng.permutation(2)
        closed, product = np.zeros((4, 4)), np.zeros((4, 4))
        path_mueller(record, 0, 2, 0, optics, n_stokes, closed)
        from_python(shading.reflect_often)(record, 0, 2, 0, optics, n_stokes, product)
        assert_allclose(
            closed[:n_stokes, :n_stokes], product[:n_stokes, :n_stokes], atol=1e-15
        )


@pytest.mark.parametrize("theta_i", [0.0, 0.3, 1.0, 1.5])
def test_range_of_incidences_of_a_bin_holds_all_its_directions_and_no_more(theta_i):
    n_theta, n_dphi = 7, 10
    ranges = np.empty((n_theta, n_dphi, 2))
    bin_fits.cosine_ranges(theta_i, 0.0, ranges)
    share = np.linspace(0, 1, 41)
    for i in range(n_theta):
        for j in range(n_dphi):
            theta = (i + share)[:, None] * np.pi / 2 / n_theta
            dphi = (j - 0.5 + share) * 2 * np.pi / n_dphi
            double = np.cos(theta_i) * np.cos(theta) + np.sin(theta_i) * np.sin(
                theta
            ) * np.cos(dphi)
            cos_beta = np.sqrt(0.5 * (1 + double))
            mid, half = ranges[i, j]
            assert cos_beta.max() <= mid + half + 1e-12
            assert cos_beta.min() >= mid - half - 1e-12
            assert_allclose(
                [cos_beta.min(), cos_beta.max()], [mid - half, mid + half], atol=2e-3
            )

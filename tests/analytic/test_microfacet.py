"""The microfacet model against NIST SCATMECH and against 50-digit arithmetic."""

from pathlib import Path

import mpmath as mp
import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from pbrdf.analytic import MicrofacetModel
from pbrdf.optics import Material
from tests.reference import exact_pbrdf

SAMPLE = Path(__file__).parents[1] / "reference" / "facet_mueller_sample.csv"
ELEMENTS = [f"m{i}{j}" for i in range(4) for j in range(4)]


def deviation(actual, exact):
    """Largest difference of an element, in units of m00."""
    return max(
        abs(mp.mpf(float(actual[i, j])) - exact[i, j]) / exact[0, 0]
        for i in range(4)
        for j in range(4)
    )


@pytest.mark.parametrize(
    "shadowing", ["none", "smith", "maxwell-beard", "torrance-sparrow"]
)
def test_agrees_with_scatmech_to_1e_12_of_m00(shadowing):
    table = pd.read_csv(SAMPLE, comment="#")
    table = table[(table.shadowing == shadowing) & (table.m00 > 1e-200)]
    assert len(table) > 200
    for (n, kappa, slope), rows in table.groupby(["n", "kappa", "slope_rms"]):
        model = MicrofacetModel(Material(n, kappa), slope, shadowing=shadowing)
        angles = np.deg2rad(rows[["theta_i_deg", "theta_s_deg", "dphi_deg"]].to_numpy()).T
        actual = model.brdf(*angles).reshape(-1, 16)
        scale = rows.m00.to_numpy()[:, None]
        assert_allclose(actual / scale, rows[ELEMENTS] / scale, rtol=0, atol=1e-12)


def degrees(*values):
    return tuple(float(v) for v in np.deg2rad(values))


AWKWARD = {
    "retro within 1e-6 deg": [
        (np.deg2rad(30), np.deg2rad(30 + 1e-6), 1e-9),
        degrees(30, 30, 1e-6),
        (0.5, 0.5, 0.0),
        (1.5, 1.5 + 1e-8, 1e-8),
    ],
    "normal incidence": [
        (0.0, 0.0, 0.3),
        (0.0, 0.2, 1.0),
        degrees(1e-6, 0, 23),
        degrees(1e-6, 1e-6, 115),
        (1e-6, 0.3, 3.0),
    ],
    "grazing": [
        (*degrees(89.999, 89.999), np.pi),
        (*degrees(89.999, 89.9), np.pi),
        (*degrees(89.999), 0.9, np.pi - 0.1),
        (*degrees(89.999, 89.999), 3.1415),
    ],
    "Brewster": [
        (np.arctan(1.5), np.arctan(1.5), np.pi),
        (np.arctan(1.5), np.arctan(1.5) - 0.01, 3.1),
    ],
    "specular": [(0.7, 0.7, np.pi), (0.7, 0.7 + 1e-9, np.pi - 1e-9), (0.3, 0.8, -np.pi)],
    "anywhere": [(0.3, 1.1, 2.2), (1.2, 0.1, -0.4), (0.9, 1.0, -2.5), (0.2, 0.3, 9.0)],
}


@pytest.mark.parametrize("place", AWKWARD)
@pytest.mark.parametrize(
    ("n", "kappa"), [(1.5, 0.0), (1e6, 0.0), (1.37, 7.62), (1.333, 1e-8), (1.5, 1e3)]
)
def test_keeps_its_digits_where_angles_are_awkward(place, n, kappa):
    for slope in (0.05, 0.3):
        model = MicrofacetModel(Material(n, kappa), slope)
        shadow = exact_pbrdf.smith_correlated(slope)
        for geometry in AWKWARD[place]:
            exact = exact_pbrdf.brdf(*geometry, n, kappa, slope, shadow=shadow)
            if exact[0, 0] > mp.mpf(10) ** -200:
                assert deviation(model.brdf(*geometry), exact) < 1e-13


def test_anisotropic_slopes_turn_with_the_sample():
    model = MicrofacetModel(Material(1.4, 0.3), (0.15, 0.4), shadowing="none")
    for phi_i in (0.0, 0.7, -2.0):
        exact = exact_pbrdf.brdf(0.5, 0.9, 2.0, 1.4, 0.3, 0.15, 0.4, phi_i)
        assert deviation(model.brdf(0.5, 0.9, 2.0, phi_i=phi_i), exact) < 1e-13


def test_arguments_broadcast_and_stay_untouched():
    theta_i = np.array([0.1, 0.2])[:, None]
    theta_s = np.array([0.3, 0.4, 0.5])
    model = MicrofacetModel(Material(1.5), 0.2)
    matrices = model.brdf(theta_i, theta_s, 3.0)
    assert matrices.shape == (2, 3, 4, 4)
    assert matrices.dtype == np.float64
    assert_allclose(matrices[1, 2], model.brdf(0.2, 0.5, 3.0), rtol=0, atol=0)
    assert theta_i.tolist() == [[0.1], [0.2]]


def test_wavelength_broadcasts_with_the_angles():
    material = Material.from_table(wavelength=[0.4, 0.8], n=[1.6, 1.4], kappa=[0.0, 0.2])
    model = MicrofacetModel(material, 0.2)
    matrices = model.brdf(0.5, [0.5, 0.6], np.pi, wavelength=[[0.4], [0.7]])
    assert matrices.shape == (2, 2, 4, 4)
    single = MicrofacetModel(Material(1.45, 0.15), 0.2).brdf(0.5, 0.6, np.pi)
    assert_allclose(matrices[1, 1], single, rtol=1e-12)


def test_many_matrices_are_those_of_one_call_each():
    rng = np.random.default_rng(5)
    angles = rng.uniform(0, 1.5, (2, 40_000))
    dphi = rng.uniform(-3, 3, 40_000)
    model = MicrofacetModel(Material(1.5), 0.2)
    matrices = model.brdf(*angles, dphi)
    for k in (0, 16_384, 39_999):
        assert_allclose(matrices[k], model.brdf(*angles[:, k], dphi[k]), rtol=0, atol=0)


def test_diffuse_term_and_gain_are_the_papers():
    plain = MicrofacetModel(Material(1.53), 0.252)
    fitted = plain.with_parameters(specular_gain=0.0011, diffuse_albedo=0.13)
    geometry = (np.deg2rad(30), np.deg2rad(50), np.pi)
    expected = 0.0011 * plain.brdf(*geometry)
    expected[0, 0] += 0.13 / np.pi
    assert_allclose(fitted.brdf(*geometry), expected, rtol=1e-14)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda m: m.brdf(75, 0.1, 0), r"theta_i must lie in \[0, 1.571\] rad, got 75"),
        (lambda m: m.brdf(0.1, [0.1, -0.2], 0), "theta_s .* got -0.2.* at index 1"),
        (lambda m: m.brdf(0.1, 0.1, 180), "dphi must .* use np.deg2rad"),
        (lambda m: m.brdf(0.1, np.nan, 0), "theta_s must .* got nan"),
        (lambda m: m.brdf([0.1, 0.2], [0.1] * 3, 0), "broadcast together"),
        (lambda m: m.with_parameters(slope_rms=-0.1), "slope_rms must be > 0"),
        (lambda m: m.with_parameters(slope_rms=(1, 2, 3)), "one number or"),
        (lambda m: m.with_parameters(shadowing="smyth"), "shadowing must be one of none,"),
        (lambda m: m.with_parameters(slope_distribution="x"), "slope_distribution must be"),
        (lambda m: m.with_parameters(diffuse_albedo=-1), "diffuse_albedo must be >= 0"),
    ],
)
def test_bad_values_are_named(call, message):
    with pytest.raises(ValueError, match=message):
        call(MicrofacetModel(Material(1.5), 0.2))


def test_the_usual_model_and_the_general_kernel_agree():
    """The default forms have a loop of their own; an index for each geometry has not."""
    rng = np.random.default_rng(5)
    angles = (*rng.uniform(0, np.pi / 2, (2, 500)), rng.uniform(-6, 6, 500))
    model = MicrofacetModel(Material(1.37, 0.4), 0.27, diffuse_albedo=0.1)
    rows = Material.from_table(wavelength=[0.4, 0.8], n=[1.37, 1.37], kappa=[0.4, 0.4])
    general = MicrofacetModel(rows, 0.27, diffuse_albedo=0.1)
    expected = general.brdf(*angles, wavelength=np.full(500, 0.5))
    scale = expected[:, :1, :1]
    assert_allclose(model.brdf(*angles) / scale, expected / scale, rtol=0, atol=1e-13)


def test_writes_into_a_given_array():
    model = MicrofacetModel(Material(1.5), 0.3)
    theta = np.linspace(0.1, 1.2, 20_000)
    out = np.full((20_000, 4, 4), np.nan)
    assert model.brdf(theta, 0.5, 3.0, out=out) is out
    np.testing.assert_array_equal(out, model.brdf(theta, 0.5, 3.0))


@pytest.mark.parametrize(
    "out",
    [np.empty((3, 4)), np.empty((3, 4, 4), np.float32), np.empty((4, 4, 3)).T],
    ids=["shape", "type", "order"],
)
def test_refuses_an_array_that_does_not_fit(out):
    with pytest.raises(ValueError, match="out must be a contiguous, writable float64"):
        MicrofacetModel(Material(1.5), 0.3).brdf([0.1, 0.2, 0.3], 0.5, 3.0, out=out)

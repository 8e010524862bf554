"""CasADi expressions equal the compiled model, and so do their derivatives."""

import casadi as ca
import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf.analytic import (
    GRAZING_FORMS,
    SHADOWING,
    SLOPE_DISTRIBUTIONS,
    VOLUME_FORMS,
    MicrofacetModel,
)
from pbrdf.analytic.symbolic import brdf_expression
from pbrdf.optics import Material

NAMES = ["n", "kappa", "slope_rms_x", "slope_rms_y", "specular_gain", "diffuse_albedo"]
VALUES = np.array([1.4, 0.3, 0.25, 0.35, 0.9, 0.1])


def geometries(count=12):
    rng = np.random.default_rng(7)
    return np.vstack(
        [rng.uniform(0, 1.5, (2, count)), rng.uniform(-3, 3, (2, count))]
    )  # theta_i, theta_s, dphi, phi_i


def compiled(values, angles, **choices):
    n, kappa, slope_x, slope_y, gain, diffuse = values
    model = MicrofacetModel(
        Material(n, kappa),
        (slope_x, slope_y),
        specular_gain=gain,
        diffuse_albedo=diffuse,
        **choices,
    )
    return model.brdf(*angles[:3], phi_i=angles[3])


def expression(symbol, **choices):
    angles, parameters = symbol("angles", 4), symbol("parameters", len(NAMES))
    given = dict(zip(NAMES, ca.vertsplit(parameters), strict=True))
    theta_i, theta_s, dphi, phi_i = ca.vertsplit(angles)
    matrix = brdf_expression(given, theta_i, theta_s, dphi, phi_i=phi_i, **choices)
    return angles, parameters, ca.reshape(matrix.T, 16, 1)


@pytest.mark.parametrize("shadowing", SHADOWING)
@pytest.mark.parametrize("slope_distribution", SLOPE_DISTRIBUTIONS)
def test_expression_equals_compiled_model(shadowing, slope_distribution):
    choices = {"shadowing": shadowing, "slope_distribution": slope_distribution}
    angles, parameters, elements = expression(ca.SX.sym, **choices)
    function = ca.Function("f", [angles, parameters], [elements])
    at = geometries()
    actual = np.array(function.map(at.shape[1])(at, np.tile(VALUES, (at.shape[1], 1)).T))
    expected = compiled(VALUES, at, **choices)
    scale = expected[:, 0, 0]
    assert_allclose(actual / scale, expected.reshape(-1, 16).T / scale, rtol=0, atol=1e-12)


@pytest.mark.parametrize("volume_form", VOLUME_FORMS)
@pytest.mark.parametrize("grazing_form", GRAZING_FORMS)
def test_further_terms_are_the_compiled_ones(volume_form, grazing_form):
    values = {
        "n": 1.4, "kappa": 0.1, "slope_rms": 0.2, "diffuse_albedo": 0.1,
        "volume_albedo": 0.3, "volume_depolarization": 0.6, "grazing_albedo": 0.05,
    }  # fmt: skip
    symbols = {name: ca.SX.sym(name) for name in values}
    forms = {"volume_form": volume_form, "grazing_form": grazing_form}
    matrix = brdf_expression(symbols, 0.4, 0.9, 2.0, **forms)
    actual = ca.Function("f", list(symbols.values()), [matrix])(*values.values())
    material = Material(values.pop("n"), values.pop("kappa"))
    expected = MicrofacetModel(material, **values, **forms).brdf(0.4, 0.9, 2.0)
    assert_allclose(np.array(actual), expected, rtol=1e-12, atol=1e-16)


def test_matrix_symbols_serve_as_well():
    angles, parameters, elements = expression(ca.MX.sym)
    function = ca.Function("f", [angles, parameters], [elements])
    at = geometries(1)
    expected = compiled(VALUES, at).reshape(16)
    assert_allclose(
        np.array(function(at, VALUES)).ravel(), expected, rtol=1e-12, atol=1e-15
    )


@pytest.mark.parametrize("slope_distribution", ["gaussian", "modified-cauchy"])
def test_gradient_and_hessian_follow_the_compiled_model(slope_distribution):
    choices = {"slope_distribution": slope_distribution}
    angles, parameters, elements = expression(ca.SX.sym, **choices)
    total = elements[0] + 0.7 * elements[4] + 0.3 * elements[15]
    hessian, gradient = ca.hessian(total, parameters)
    derivatives = ca.Function("d", [angles, parameters], [gradient, hessian])
    at = np.array([[0.6], [0.8], [2.8], [0.4]])
    first, second = (np.array(v) for v in derivatives(at, VALUES))

    def value(values):
        matrix = compiled(values, at, **choices)[0]
        return matrix[0, 0] + 0.7 * matrix[1, 0] + 0.3 * matrix[3, 3]

    step = 1e-5 * VALUES
    for j, h in enumerate(step):
        shift = np.zeros(len(NAMES))
        shift[j] = h
        slope = (value(VALUES + shift) - value(VALUES - shift)) / (2 * h)
        assert_allclose(first[j, 0], slope, rtol=1e-7, atol=1e-9)
        changed = (
            np.array(derivatives(at, VALUES + shift)[0])
            - np.array(derivatives(at, VALUES - shift)[0])
        ).ravel() / (2 * h)
        assert_allclose(second[:, j], changed, rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize("kappa", [0.0, 1e-8])
def test_derivatives_are_finite_at_retro_normal_and_specular(kappa):
    n, k, s = ca.SX.sym("n"), ca.SX.sym("k"), ca.SX.sym("s")
    for geometry in [(0.0, 0.0, 0.3), (0.5, 0.5, 0.0), (0.5, 0.5, np.pi), (0.0, 0.5, 1.0)]:
        for law in SLOPE_DISTRIBUTIONS:
            matrix = brdf_expression(
                {"n": n, "kappa": k, "slope_rms": s}, *geometry, slope_distribution=law
            )
            hessian, gradient = ca.hessian(ca.sum1(ca.sum2(matrix)), ca.vertcat(n, k, s))
            values = ca.Function("d", [n, k, s], [gradient, hessian])(1.5, kappa, 0.2)
            assert all(np.isfinite(np.array(v)).all() for v in values)


def test_unknown_and_missing_parameters_are_named():
    with pytest.raises(ValueError, match=r"no 'sigma'. Known: .*slope_rms"):
        brdf_expression({"n": 1.5, "sigma": 0.1}, 0.1, 0.1, 0.0)
    with pytest.raises(ValueError, match=r"must hold 'slope_rms_x'"):
        brdf_expression({"n": 1.5}, 0.1, 0.1, 0.0)

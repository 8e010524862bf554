"""Fresnel matrices against Mitsuba's double-precision code and 50-digit values."""

from itertools import product
from pathlib import Path

import mpmath as mp
import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose

from pbrdf.kernels import from_python
from pbrdf.kernels.optics import fresnel as kernels
from pbrdf.optics import (
    Material,
    fresnel_amplitudes,
    specular_mueller,
    transmission_mueller,
)
from tests.reference import exact_pbrdf

ELEMENTS = [f"M{i}{j}" for i in range(4) for j in range(4)]
SAMPLE = Path(__file__).parents[1] / "reference" / "fresnel_mueller_sample.csv"


@pytest.mark.parametrize("kind", ["reflection", "transmission"])
@pytest.mark.parametrize("side", ["outside", "inside"])
def test_interface_agrees_with_mitsuba_to_1e_13(kind, side):
    table = pd.read_csv(SAMPLE, comment="#")
    rows = table[(table.kind == kind) & (table.side == side)]
    from_inside = side == "inside"
    matrix = specular_mueller if kind == "reflection" else transmission_mueller
    actual = matrix(
        rows.cos_theta_i.abs(),
        1.0 if from_inside else rows.n,
        rows.kappa,
        n_incident=rows.n if from_inside else 1.0,
    )
    assert len(rows) >= 7
    assert_allclose(actual.reshape(-1, 16), rows[ELEMENTS], rtol=0, atol=1e-13)


THICK = list(product([1.0001, 1.333, 1.5, 3.0, 1e3, 1e6], [0.0, 1e-8, 1e-3, 7.62, 1e3]))


# A thinner medium without absorption has a critical angle, where digits do not exist
@pytest.mark.parametrize(("n", "kappa"), [*THICK, (0.2, 1.0), (0.2, 7.62), (0.9, 1e3)])
def test_amplitudes_keep_their_digits(n, kappa):
    brewster = np.arctan(n)
    for theta in (1e-8, 1e-3, 0.5, brewster, brewster + 1e-6, 1.3, np.deg2rad(89.999)):
        cosine = float(np.cos(theta))
        exact = exact_pbrdf.fresnel_jones(mp.mpf(cosine), n, kappa)
        actual = fresnel_amplitudes(cosine, n, kappa)
        size = abs(exact[0])
        for r, e in zip(actual, exact, strict=True):
            assert abs(mp.mpc(complex(r)) - e) < 2e-15 * size


def test_brewster_light_is_fully_polarised():
    brewster = np.arctan(1.5)
    matrix = specular_mueller(np.cos(brewster), 1.5)
    # VALIDITY: M00 = M10 = ((n^2 - 1)/(n^2 + 1))^2 / 2
    assert_allclose(matrix[:2, 0], 0.5 * (1.25 / 3.25) ** 2, rtol=1e-14)


def test_total_reflection_is_a_retarder_with_a_phase():
    # tan(delta/2) = cos t sqrt(sin^2 t - 1/n^2)/sin^2 t: exactly cos = 0.8, sin = 0.6 here
    matrix = specular_mueller(np.sqrt(0.5), 1.0, n_incident=1.5)
    expected = np.array([[0.8, -0.6], [0.6, 0.8]])
    assert_allclose(matrix[2:, 2:], expected, atol=1e-14)
    assert_allclose(matrix[0], [1, 0, 0, 0], atol=1e-14)


def test_perfect_mirror_and_black_body_are_exact():
    for cosine in (0.0, 1e-9, 0.4, 1.0):
        mirror = specular_mueller(cosine, *Material.mirror().index())
        assert_allclose(mirror, np.diag([1, 1, -1, -1]), atol=0)
        assert_allclose(specular_mueller(cosine, *Material.black().index()), 0.0, atol=0)
        r_s, r_p = fresnel_amplitudes(cosine, np.inf)
        assert (r_s, r_p) == (-1, 1)


def test_paper_mirror_loses_what_theory_says():
    # n = 1e6: 1 - M00 = (2/n)(c + 1/c), M10 = (2/n)(1/c - c)
    cosine = np.cos(np.deg2rad(41.4))
    matrix = specular_mueller(cosine, 1e6)
    assert_allclose(1 - matrix[0, 0], 2e-6 * (cosine + 1 / cosine), rtol=1e-5)
    assert_allclose(matrix[1, 0], 2e-6 * (1 / cosine - cosine), rtol=1e-5)


@pytest.mark.parametrize(("n", "kappa"), [(1.5, 0.0), (1.37, 7.62), (0.2, 3.0), (1e6, 0.0)])
def test_reflected_and_transmitted_power_add_up(n, kappa):
    cosine = np.linspace(1e-6, 1, 200)
    both = specular_mueller(cosine, n, kappa) + transmission_mueller(cosine, n, kappa)
    assert_allclose(both[:, 0, 0], 1.0, rtol=1e-14)
    assert_allclose(both[:, 0, 1], 0.0, atol=1e-14)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((1.1, 1.5, 0.0), r"cos_beta must lie in \[0, 1\] \[1\], got 1.1"),
        ((0.5, -1.5, 0.0), "n must be > 0"),
        ((0.5, 1.5, -0.1), "kappa must be >= 0 .* kappa >= 0 absorbs"),
        ((0.5, np.nan, 0.0), "n must be > 0 .*got nan"),
    ],
)
def test_bad_values_are_named(arguments, message):
    with pytest.raises(ValueError, match=message):
        specular_mueller(*arguments)


def test_a_table_follows_the_rules_of_a_constant():
    """Its kappa may be 0, as that of glass."""
    waves = [0.4, 0.5]
    Material.from_table(wavelength=waves, n=[1.4, 1.5], kappa=[0.0, 0.0])
    with pytest.raises(
        ValueError, match=r"n must be finite and > 0 \[1\], got 0 at index 1"
    ):
        Material.from_table(wavelength=waves, n=[1.4, 0.0], kappa=[1.0, 1.0])


def test_complex_index_is_refused_not_reinterpreted():
    with pytest.raises(TypeError, match="n must be real, got complex"):
        specular_mueller(0.5, 1.5 - 0.1j)


def by_the_book(cosine, n, kappa):
    """T_s, T_p and t_s conj(t_p) from the amplitudes of Born and Wolf, 1.5.2."""
    index = complex(n, kappa)
    inner = np.sqrt(1 - (1 - cosine**2) / index**2 + 0j)
    inner = inner if (index * inner).imag >= 0 else -inner
    t_s = 2 * cosine / (cosine + index * inner)
    t_p = 2 * cosine / (index * cosine + inner)
    power_s = (index * inner).real / cosine * abs(t_s) ** 2
    power_p = (index * inner.conjugate()).real / cosine * abs(t_p) ** 2
    return power_s, power_p, t_s * t_p.conjugate()


@pytest.mark.parametrize(
    ("n", "kappa"), [(1.5, 0.0), (1.37, 7.62), (0.7, 0.3), (0.7, 0.0), (4.0, 1e-3)]
)
def test_transmission_is_that_of_the_book(n, kappa):
    parts = from_python(kernels.transmission_parts)
    for cosine in (0.05, 0.3, 0.6, 0.95, 1.0):
        power_s, power_p, turn = by_the_book(cosine, n, kappa)
        half, difference = (power_s + power_p) / 2, (power_s - power_p) / 2
        mean = np.sqrt(max(power_s * power_p, 0.0))
        assert_allclose(parts(cosine, n, kappa), [half, difference, mean], atol=2e-14)
        c, d = mean * turn.real / abs(turn), mean * turn.imag / abs(turn)
        assert_allclose(
            transmission_mueller(cosine, n, kappa),
            [
                [half, difference, 0, 0],
                [difference, half, 0, 0],
                [0, 0, c, -d],
                [0, 0, d, c],
            ],
            atol=2e-14,
        )


def test_kernels_without_a_branch_know_the_mirror():
    for cosine in (0.0, 0.4, 1.0):
        sin2 = 1 - cosine**2
        facet = from_python(kernels.facet_elements)(cosine, sin2, np.inf, 0.0)
        assert facet == (1.0, 0.0, -1.0, 0.0)
        assert from_python(kernels.transmission_parts)(cosine, np.inf, 0.0) == (0, 0, 0)
        assert_allclose(transmission_mueller(cosine, np.inf), 0.0, atol=0)
        # The same branch as an index that is finite takes
        for kappa in (0.0, 1.0, 7.62):
            finite = from_python(kernels.facet_elements)(cosine, sin2, 1.37, kappa)
            matrix = specular_mueller(cosine, 1.37, kappa)
            assert_allclose(finite, matrix[[0, 0, 2, 3], [0, 1, 2, 2]], atol=1e-15)


def test_an_interface_between_equal_media_is_none():
    for cosine in (0.0, 1e-9, 0.5):
        assert fresnel_amplitudes(cosine, 1.0) == (0, 0)
        assert_allclose(specular_mueller(cosine, 1.0), 0.0, atol=0)

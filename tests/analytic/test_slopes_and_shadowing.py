"""Slope laws, Smith's Lambda and shadowing rules against direct integrals and counts."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad
from scipy.special import erfc

from pbrdf import GaussianSurface, Material, MicrofacetModel
from pbrdf.analytic import SLOPE_DISTRIBUTIONS, SlopeTable
from pbrdf.kernels import from_python
from pbrdf.kernels.microfacet import slopes as laws
from pbrdf.kernels.microfacet.facet import directions
from pbrdf.kernels.microfacet.shadowing import combined_overhangs

directions = from_python(directions)
combined_overhangs = from_python(combined_overhangs)

MIRROR = Material.mirror()


def density(law, radius, slope):
    """The five laws as their sources write them, per unit slope area."""
    t2 = radius**2
    cos = 1 / np.sqrt(1 + t2)
    if law == "gaussian":
        return np.exp(-t2 / (2 * slope**2)) / (2 * np.pi * slope**2)
    if law == "modified-gaussian":
        x = 1 / (np.sqrt(2) * slope)
        b = 1 / (np.sqrt(np.pi) * x * np.exp(x * x) * erfc(x))
        return b * np.exp(-t2 / (2 * slope**2)) / (2 * np.pi * slope**2 * cos**3) * cos**4
    if law == "modified-cauchy":
        norm = quad(lambda c: c / (slope**2 + 1 / c**2 - 1) / c, 0, 1, epsabs=1e-13)[0]
        return cos**4 / (cos * (slope**2 + t2)) / (2 * np.pi * norm)
    if law == "exponential":
        return 3 * np.exp(-np.sqrt(3) * radius / slope) / (2 * np.pi * slope**2)
    if law == "trowbridge-reitz":
        return 2 * slope**2 / (np.pi * (2 * slope**2 + t2) ** 2)
    msg = f"no reference of the law {law!r}: write it down from its source"
    raise NotImplementedError(msg)


@pytest.mark.parametrize("law", SLOPE_DISTRIBUTIONS)
@pytest.mark.parametrize("slope", [0.08, 0.3, 0.7])
def test_laws_are_those_of_their_sources(law, slope):
    model = MicrofacetModel(MIRROR, slope, law, "none")
    for tilt in (0.0, 0.2, 0.9):
        # Retro-reflection off the facet that faces the source: f = P/(4 cos^2)
        value = model.brdf(tilt, tilt, 0.0)[0, 0] * 4 * np.cos(tilt) ** 6
        assert_allclose(value, density(law, np.tan(tilt), slope), rtol=1e-9)


@pytest.mark.parametrize("slope", [(0.3, 0.3), (0.15, 0.4)])
def test_exponential_law_has_the_named_rms_along_each_axis(slope):
    rough = laws.Roughness(laws.EXPONENTIAL, *slope, False, 1.0)
    x = np.linspace(-6, 6, 1201)
    radius = np.hypot(x[:, None] / slope[0], x / slope[1])
    values = density("exponential", radius, 1.0) / np.prod(slope)
    share = values / values.sum()
    assert_allclose(np.sqrt((share * x[:, None] ** 2).sum()), slope[0], rtol=2e-3)
    centre = from_python(laws.radial_density)(rough, 0.0)
    assert_allclose(centre, 3 / (2 * np.pi * np.prod(slope)), rtol=1e-12)


@pytest.mark.parametrize("law", SLOPE_DISTRIBUTIONS)
@pytest.mark.parametrize("slope", [0.08, 0.3, 0.7])
def test_overhang_is_the_mean_excess_of_slopes(law, slope):
    """Lambda = <max(z' - a, 0)>/a; over azimuth by hand, over the radius by quad."""
    code = SLOPE_DISTRIBUTIONS[law].code
    rough = laws.Roughness(code, slope, slope, True, laws.slope_norm(code, slope, slope))
    for theta in (0.6, 1.2, 1.5):
        cot = 1 / np.tan(theta)

        def ring(radius, cot=cot):
            half = np.arccos(min(cot / radius, 1.0))
            excess = 2 * (radius * np.sin(half) - cot * half)
            return excess * radius * density(law, radius, slope)

        pieces = [
            quad(ring, a, b, limit=200)[0] for a, b in ((cot, cot + 4), (cot + 4, np.inf))
        ]
        actual = from_python(laws.mean_overhang)(rough, np.cos(theta), np.sin(theta), slope)
        assert_allclose(actual, sum(pieces) / cot, rtol=2e-4, atol=1e-9)


@pytest.mark.parametrize("law", ["gaussian", "exponential", "trowbridge-reitz"])
def test_anisotropic_overhang_sees_the_slope_along_the_ray(law):
    model = MicrofacetModel(MIRROR, (0.1, 0.5), law)
    steep = MicrofacetModel(MIRROR, 0.5, law)
    bare = {m: m.with_parameters(shadowing="none") for m in (model, steep)}
    # In retro-reflection along y only the slope along y hides: same factor as isotropic 0.5
    factors = [
        m.brdf(1.3, 1.3, 0.0, phi_i=np.pi / 2)[0, 0]
        / bare[m].brdf(1.3, 1.3, 0.0, phi_i=np.pi / 2)[0, 0]
        for m in (model, steep)
    ]
    assert_allclose(factors[0], factors[1], rtol=1e-4 if law == "exponential" else 1e-12)


def test_direction_correlation_counts_the_same_hiding_once():
    """At one azimuth, what the lower direction sees the higher one sees too."""
    slope, low, high = 0.3, 1.35, 0.9
    nu = 1 / (np.tan(low) * slope * np.sqrt(2))
    overhang = 0.5 * (np.exp(-nu * nu) / (nu * np.sqrt(np.pi)) - erfc(nu))
    bare = MicrofacetModel(MIRROR, slope, shadowing="none")
    model = bare.with_parameters(shadowing="smith-direction")
    for pair in ((low, high), (high, low)):
        ratio = model.brdf(*pair, 0.0)[0, 0] / bare.brdf(*pair, 0.0)[0, 0]
        assert_allclose(ratio, 1 / (1 + overhang), rtol=1e-12)
    correlated = bare.with_parameters(shadowing="smith-correlated")
    assert correlated.brdf(low, high, 0.0)[0, 0] < model.brdf(low, high, 0.0)[0, 0]


def test_table_of_a_formula_is_the_formula():
    x, y = np.linspace(-1.6, 1.6, 401), np.linspace(-2.4, 2.4, 401)
    slopes = (0.2, 0.3)
    values = np.exp(-0.5 * ((x[:, None] / slopes[0]) ** 2 + (y / slopes[1]) ** 2))
    table = SlopeTable(x, y, values)
    assert_allclose(table.slope_rms, slopes, rtol=1e-6)
    for rule in ("none", "smith-correlated", "smith-direction", "torrance-sparrow"):
        measured = MicrofacetModel(Material(1.5), slope_distribution=table, shadowing=rule)
        formula = MicrofacetModel(Material(1.5), slopes, shadowing=rule)
        for geometry in [(0.5, 0.7, 2.9), (1.2, 1.3, 2.7), (1.4, 1.4, 3.0)]:
            exact = formula.brdf(*geometry, phi_i=0.6)
            assert_allclose(
                measured.brdf(*geometry, phi_i=0.6), exact, rtol=0, atol=2e-3 * exact[0, 0]
            )


def test_skewed_slopes_keep_their_side():
    """Facets that all lean one way mirror light to one side only."""
    x = np.linspace(-1, 1, 201)
    leaning = SlopeTable(x, x, np.exp(-50 * ((x[:, None] - 0.3) ** 2 + x**2)))
    model = MicrofacetModel(MIRROR, slope_distribution=leaning, shadowing="none")
    # Gradient +0.3 along x: the normal leans to -x, light from -x comes straight back
    tilt = np.arctan(0.3)
    assert model.brdf(tilt, tilt, 0.0, phi_i=np.pi)[0, 0] > 5
    assert model.brdf(tilt, tilt, 0.0, phi_i=0.0)[0, 0] < 1e-3


def test_table_of_a_surface_follows_its_slopes():
    surface = GaussianSurface(
        shape=(256, 256), spacing=1.0, corr_length=10.0, slope_rms=0.25
    )
    along_x, along_y = surface.sample(3).slopes()
    size = tuple(min(a, b) for a, b in zip(along_x.shape, along_y.shape, strict=True))
    x, y = along_x[: size[0], : size[1]], along_y[: size[0], : size[1]]
    table = SlopeTable.from_slopes(x, y, bins=61)
    assert_allclose(table.slope_rms, [x.std(), y.std()], rtol=0.02)


def test_what_a_table_cannot_be_is_refused():
    x = np.linspace(-1, 1, 5)
    with pytest.raises(ValueError, match="slope_x must rise evenly"):
        SlopeTable(x**3, x, np.ones((5, 5)))
    with pytest.raises(ValueError, match="density must be finite"):
        SlopeTable(x, x, -np.ones((5, 5)))
    table = SlopeTable(x, x, np.ones((5, 5)))
    with pytest.raises(ValueError, match="must not be 'smith'"):
        MicrofacetModel(MIRROR, slope_distribution=table, shadowing="smith")
    with pytest.raises(ValueError, match="slope_rms must be left out"):
        MicrofacetModel(MIRROR, 0.2, slope_distribution=table)
    with pytest.raises(ValueError, match="slope_rms must be > 0"):
        MicrofacetModel(MIRROR)


def test_a_law_or_rule_without_a_formula_gives_no_number():
    """Registered in the tables but not in the kernels: nan, never another law's number."""
    rough = laws.Roughness(99, 0.3, 0.3, True, 1.0)
    assert np.isnan(from_python(laws.radial_density)(rough, 0.1))
    way = directions(0.9, 0.7, 2.0, 1.0, 0.0)
    assert np.isnan(combined_overhangs(99, way, 0.1, 0.2))

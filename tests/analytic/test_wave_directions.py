"""Heights that differ from direction to direction, against the book and a transform."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf import GaussianSurface, Material, WaveModel
from pbrdf.derived.bins import bin_averages
from pbrdf.optics import coherency_eigenvalues
from pbrdf.wave import map_scattering
from tests.wave_by_the_book import first_order, mueller

INDEX = 1.6 + 0.3j
MATERIAL = Material(1.6, 0.3)
HEIGHT, LENGTHS, WAVE = 0.004, (0.9, 0.35), 0.6


def rice(theta_i, theta_s, dphi, phi_i):
    """(16 pi^2/lambda^4) cos_i cos_s |b|^2 S(f), f from the directions to both ends."""
    to_source = np.array([np.cos(phi_i), np.sin(phi_i)]) * np.sin(theta_i)
    to_sensor = np.array([np.cos(phi_i + dphi), np.sin(phi_i + dphi)]) * np.sin(theta_s)
    f_x, f_y = (to_source + to_sensor) / WAVE
    fall = (np.pi * f_x * LENGTHS[0]) ** 2 + (np.pi * f_y * LENGTHS[1]) ** 2
    density = np.pi * HEIGHT**2 * LENGTHS[0] * LENGTHS[1] * np.exp(-fall)
    factor = 16 * np.pi**2 / WAVE**4 * np.cos(theta_i) * np.cos(theta_s)
    return factor * density * mueller(first_order(theta_i, theta_s, dphi, INDEX))


def smooth_beam(theta_i):
    flat = WaveModel(MATERIAL, height_rms=1e-9, corr_length=1.0)
    return flat.coherent(theta_i, WAVE)


ANGLES = [(0.3, 0.5, 2.1, 0.4), (0.9, 0.2, -2.7, 2.9), (0.6, 0.6, np.pi, -1.1)]


@pytest.mark.parametrize("angles", ANGLES)
def test_first_order_of_two_lengths_and_of_its_density(angles):
    theta_i, theta_s, dphi, phi_i = angles
    wanted = rice(*angles)
    pair = WaveModel(MATERIAL, height_rms=HEIGHT, corr_length=LENGTHS, method="first-order")
    found = pair.brdf(theta_i, theta_s, dphi, WAVE, phi_i=phi_i)
    assert_allclose(found, wanted, atol=1e-10 * wanted[0, 0])
    f_x, f_y = np.linspace(-4, 4, 1601), np.linspace(-9, 9, 1401)
    fall = (np.pi * f_x[:, None] * LENGTHS[0]) ** 2 + (np.pi * f_y * LENGTHS[1]) ** 2
    density = np.pi * HEIGHT**2 * LENGTHS[0] * LENGTHS[1] * np.exp(-fall)
    table = WaveModel(MATERIAL, psd=(f_x, f_y, density), method="first-order")
    assert table.surface.heights.height_rms == pytest.approx(HEIGHT, rel=1e-5)
    found = table.brdf(theta_i, theta_s, dphi, WAVE, phi_i=phi_i)
    assert_allclose(found, wanted, atol=1e-3 * wanted[0, 0])
    beams = [m.coherent(theta_i, WAVE, phi_i=phi_i) for m in (pair, table)]
    lost = np.abs(beams[0] - smooth_beam(theta_i)).max()
    assert_allclose(beams[1], beams[0], atol=0.02 * lost)


EVERY = ["auto", "first-order", "kirchhoff", "small-slope", "order-weighted", "geometric"]


@pytest.mark.parametrize("method", EVERY)
def test_equal_lengths_are_the_isotropic_surface(method):
    given = {"height_rms": 0.2, "method": method}
    # auto knows no curvatures of unequal directions
    same = "order-weighted" if method == "auto" else method
    one = WaveModel(MATERIAL, corr_length=2.0, **given).with_method(same)
    two = WaveModel(MATERIAL, corr_length=(2.0, 2.0), **given)
    at = (0.5, np.array([0.2, 0.9]), np.array([2.0, -2.8]), WAVE)
    assert_allclose(two.brdf(*at, phi_i=0.7), one.brdf(*at), rtol=1e-10, atol=1e-14)
    beam = one.coherent(0.5, WAVE)
    assert_allclose(two.coherent(0.5, WAVE, phi_i=0.7), beam, rtol=1e-10, atol=1e-16)
    # A quarter turn exchanges the lengths
    long, wide = (
        WaveModel(MATERIAL, corr_length=pair, **given) for pair in ((3.0, 1.5), (1.5, 3.0))
    )
    turned = wide.brdf(*at, phi_i=0.7 + np.pi / 2)
    assert_allclose(long.brdf(*at, phi_i=0.7), turned, rtol=1e-9, atol=1e-14)
    beams = long.coherent(0.5, WAVE, phi_i=0.7), wide.coherent(0.5, WAVE, phi_i=0.7)
    assert_allclose(
        beams[0], wide.coherent(0.5, WAVE, phi_i=0.7 + np.pi / 2), rtol=1e-9, atol=1e-15
    )
    if method in ("auto", "first-order", "order-weighted"):
        assert np.abs(beams[0] - beams[1]).max() > 1e-4 * beams[0][0, 0]
    assert abs(turned[0, 0, 0] / one.brdf(*at)[0, 0, 0] - 1) > 0.05


@pytest.mark.parametrize("method", EVERY)
def test_reciprocity_and_realisability_out_of_plane(method):
    model = WaveModel(MATERIAL, height_rms=0.1, corr_length=(1.4, 0.6), method=method)
    rng = np.random.default_rng(8)
    theta_i, theta_s = rng.uniform(0, 1.5, (2, 60))
    dphi, phi_i = rng.uniform(0, 2 * np.pi, (2, 60))
    forth = model.brdf(theta_i, theta_s, dphi, WAVE, phi_i=phi_i)
    back = model.brdf(theta_s, theta_i, -dphi, WAVE, phi_i=phi_i + dphi)
    exchanged = np.diag([1.0, 1.0, -1.0, 1.0])
    scale = np.maximum(forth[:, :1, :1], 1e-290)
    turned = exchanged @ back.swapaxes(1, 2) @ exchanged
    assert (np.abs(turned - forth) / scale).max() < 2e-12
    assert coherency_eigenvalues(forth / scale).min() > -1e-13
    # The beam comes back the way it came
    theta_i, phi_i = theta_i[:3], phi_i[:3]
    beam = model.coherent(theta_i, WAVE, phi_i=phi_i)
    again = model.coherent(theta_i, WAVE, phi_i=phi_i + np.pi)
    assert_allclose(exchanged @ again.swapaxes(1, 2) @ exchanged, beam, atol=1e-12)
    assert coherency_eigenvalues(beam).min() > -1e-13


@pytest.mark.parametrize("phi_i", [0.0, 0.8])
@pytest.mark.parametrize("theta_i", [0.0, 0.5])
def test_a_brushed_mirror_returns_all_light(phi_i, theta_i):
    model = WaveModel(Material.mirror(), height_rms=0.02, corr_length=(0.8, 0.25))
    energy = model.energy(theta_i, 1.0, phi_i=phi_i)
    assert abs(energy.multiple) < 0.001
    # The Kirchhoff factor would make light
    plain = model.with_method("kirchhoff").coherent(theta_i, 1.0)[0, 0]
    assert abs(plain - energy.coherent) > 0.005
    # Out of its mirror planes it turns the polarisation of the beam
    turned = np.abs(model.coherent(0.5, 1.0, phi_i=phi_i)[0:2, 2:]).max()
    assert (turned > 1e-5) == (phi_i > 0.0)


def test_the_beam_loses_what_first_order_scatters_of_every_polarisation():
    """Mirrors keep the intensity of Q and U, too: this holds the sign of what is turned."""
    theta_i, phi_i = 0.5, 0.8
    model = WaveModel(
        Material.mirror(), height_rms=3e-4, corr_length=(0.8, 0.25), method="first-order"
    )
    x, w = np.polynomial.legendre.leggauss(40)
    theta_s, dphi = (x + 1) * np.pi / 4, np.arange(120) * np.pi / 60
    area = w * np.pi / 4 * np.cos(theta_s) * np.sin(theta_s) * np.pi / 60
    matrices = model.brdf(theta_i, theta_s[:, None], dphi, 1.0, phi_i=phi_i)
    scattered = np.einsum("tda,t->a", matrices[..., 0, :], area)
    lost = np.array([1.0, 0, 0, 0]) - model.coherent(theta_i, 1.0, phi_i=phi_i)[0]
    assert_allclose(scattered, lost, atol=3e-5 * lost[0])
    assert abs(lost[2]) > 0.1 * lost[0]


def test_a_long_brush_is_a_profile():
    """The mean field across the grooves, and Smith's hiding by slopes across them."""
    for material in (MATERIAL, Material.mirror()):
        brush = WaveModel(material, height_rms=0.06, corr_length=(0.7, 400.0))
        profile = WaveModel(material, height_rms=0.06, corr_length=0.7)
        beam = brush.coherent(0.5, WAVE)
        lines = np.array([beam[0, 0] + beam[0, 1], beam[0, 0] - beam[0, 1]])
        assert_allclose(lines, profile.profile_coherent(0.5, WAVE), rtol=3e-3)
    slopes = brush.surface.heights.slopes(1e4, np.array([0.0, np.pi / 2, 0.6]))
    steep = np.sqrt(2) * 0.06 / 0.7
    assert_allclose(
        slopes, steep * np.abs(np.cos([0.0, np.pi / 2, 0.6])), atol=2e-3 * steep
    )


@pytest.mark.filterwarnings("ignore:steps of .* leave directions behind")
def test_maps_of_two_lengths_scatter_so_by_their_transform():
    """Kirchhoff integrals of maps, without statistics, against the sum over orders."""
    lengths, height, wave, phi_i = (6.0, 2.5), 0.12, 0.8, 0.7
    surface = GaussianSurface(
        shape=(192, 160), spacing=0.3, corr_length=lengths, height_rms=height
    )
    maps = np.stack([
        map_scattering(
            surface.sample(seed), MATERIAL, 0.35, wavelength=wave, phi_i=phi_i, n_theta=18,
            n_dphi=12,
        ).brdf.values
        for seed in range(20)
    ])  # fmt: skip
    mean, error = maps.mean(0), maps.std(0, ddof=1) / np.sqrt(len(maps))
    model = WaveModel(MATERIAL, height_rms=height, corr_length=lengths, method="kirchhoff")
    expected = bin_averages(
        model, 0.35, phi_i=phi_i, n_theta=18, n_dphi=12, wavelength=wave
    )
    bright = expected[..., 0, 0] > 0.03 * expected[..., 0, 0].max()
    assert bright.sum() > 10
    apart = (mean - expected)[bright]
    scale = expected[bright][:, :1, :1]
    assert (np.abs(apart) < 4.5 * error[bright] + 0.02 * scale).all()
    # It would not pass with the axes exchanged
    other = WaveModel(
        MATERIAL, height_rms=height, corr_length=lengths[::-1], method="kirchhoff"
    )
    swapped = bin_averages(other, 0.35, phi_i=phi_i, n_theta=18, n_dphi=12, wavelength=wave)
    assert (np.abs(mean - swapped)[bright] > 9 * error[bright] + 0.04 * scale).any()


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"corr_length": (1.0, 2.0), "method": "local-curvature"},
         "method must be one of auto, first-order, kirchhoff"),
        ({"corr_length": (1.0, 2.0, 3.0), "method": "kirchhoff"}, "one length or two"),
        ({"corr_length": (1.0, -2.0), "method": "kirchhoff"}, "be positive"),
        ({"corr_length": (1.0, 2.0), "autocorrelation": "exponential"},
         "must be 'gaussian' with two lengths"),
    ],
)  # fmt: skip
def test_what_directions_do_not_know(given, message):
    with pytest.raises(ValueError, match=message):
        WaveModel(MATERIAL, height_rms=0.1, **given)


def test_densities_that_no_surface_has():
    f = np.linspace(-1.0, 1.0, 5)
    density = np.exp(-np.add.outer(f**2, f**2))
    for wrong, message in (
        ((f, f, density[:, :4]), "got shapes"),
        ((f + 0.1, f, density), "psd f_x must rise from -f to f"),
        ((f, f, density * (1 + 0.1 * f)), "the same at f and -f"),
        ((f, f, -density), "density must be >= 0"),
    ):
        with pytest.raises(ValueError, match=message):
            WaveModel(MATERIAL, psd=wrong, method="first-order")
    model = WaveModel(MATERIAL, psd=(f, f, density), method="first-order")
    with pytest.raises(ValueError, match="error must be asked of an isotropic surface"):
        model.error_estimate(0.3, 0.6, 1.0, 0.6)
    with pytest.raises(ValueError, match="method must be one of first-order where"):
        WaveModel(MATERIAL, psd=(f, f, density))

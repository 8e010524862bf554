"""Forms against integral equations solved here, for cases no form was chosen on."""

import numpy as np
import pytest

from pbrdf.optics.fresnel import specular_mueller
from studies.wave_optics.fine import compared
from studies.wave_optics.fresh import ALUMINIUM, VIEW, misses, model_of, spectrum
from tests import rigorous_profile, wave_reference


def reflectance(profile, index, beam):
    """Shares of s and p that leave upwards."""
    view = np.deg2rad(np.linspace(-89.5, 89.5, 721))
    found = rigorous_profile.amplitudes(profile, index, [beam], view)[0]
    power = (rigorous_profile.K * np.cos(view)) ** 2 / rigorous_profile.K / beam.power
    return (power * np.abs(found) ** 2).sum(axis=1) * (view[1] - view[0])


@pytest.mark.parametrize("index", [1.5, ALUMINIUM])
def test_flat_surfaces_reflect_as_fresnel_says(index):
    x = (np.arange(480) - 239.5) / 12
    flat = rigorous_profile.Profile(x, *np.zeros((3, x.size)))
    beam = rigorous_profile.Beam(0.5)
    angles, weights = np.arcsin(beam.waves / (2 * np.pi)), beam.weights**2
    weights = weights * np.cos(angles)
    expected = specular_mueller(np.cos(angles), np.real(index), np.imag(index))
    mean, half = (weights @ expected[:, 0, j] / weights.sum() for j in (0, 1))
    found = reflectance(flat, index, beam)
    # The impedance of a plane errs by 1 % of what a metal absorbs
    assert np.abs(found - [mean + half, mean - half]).max() < 2e-3 * mean**0.5


def test_rough_mirrors_keep_all_light():
    rng = np.random.default_rng(1)
    for height, length in ((0.1, 1.0), (0.3, 1.0)):
        profile = rigorous_profile.draw(rng, spectrum(((height, length),)))
        # Several bounces too; of p some runs along the surface to its ends
        found = reflectance(profile, np.inf, rigorous_profile.Beam(0.0))
        assert np.abs(found - 1).max() < 0.02


@pytest.mark.slow
@pytest.mark.parametrize(
    ("index", "scales"),
    [
        (ALUMINIUM, ((0.1, 1.0),)),
        (ALUMINIUM, ((0.2, 4.0), (0.05, 0.5))),
        (1.3, ((0.1, 0.7),)),
        (1.5, ((0.2, 2.0), (0.1, 1.0), (0.05, 0.5))),
    ],
)
def test_auto_holds_on_fresh_cases(index, scales):
    thetas = np.array([0.0, 30.0, 60.0])
    true, error = rigorous_profile.scattering(
        spectrum(scales), index, np.deg2rad(thetas), VIEW, 24, many=1000
    )
    for i, theta in enumerate(thetas):
        found = wave_reference.averaged(model_of(index, scales, "auto"), theta, VIEW)
        s, p, real, imag = misses(found, true[i], error[i])
        assert max(s, p) < 1.0
        assert max(real, imag) < 0.12
    # A form that knows no curvature is worse
    plain = wave_reference.averaged(model_of(index, scales, "kirchhoff"), 0.0, VIEW)
    auto = wave_reference.averaged(model_of(index, scales, "auto"), 0.0, VIEW)
    of_plain, of_auto = (misses(f, true[0], error[0])[:2] for f in (plain, auto))
    assert max(of_plain) > max(of_auto)


@pytest.mark.slow
def test_the_stated_error_knows_of_roughness_finer_than_the_wave():
    ratio, noise, stated = compared(ALUMINIUM, 0.05, 0.1, 10)
    # p misses a third of the power, where forms that agree with each other state 4 %
    assert (np.abs(np.log(ratio)) < 2 * np.log1p(stated) + 2 * noise).all()
    assert (np.abs(np.log(ratio[:, 1])) > 0.2).all()

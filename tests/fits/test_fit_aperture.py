"""Cones of light as wide as the lobe: averages, their refinement, and what is warned of."""

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose
from scipy.stats import qmc

from fitting import Aperture, Noise, fit
from fitting.readings.aperture import FINEST, cones_of, rays_through
from fitting.readings.cone_rule import pairs
from fitting.readings.observations import Geometry
from pbrdf import Material, MicrofacetModel
from tests.fits.scans import VINYL, scan

FREE = ("specular_gain", "diffuse_albedo", "slope_rms")
START = MicrofacetModel(Material(1.5), slope_rms=0.02)
VIEW = np.unique(np.concatenate([np.arange(-75, 76, 15.0), np.arange(22, 38.1, 1.0)]))


def narrow(slope):
    return MicrofacetModel(
        Material(1.5), slope_rms=slope, specular_gain=0.8, diffuse_albedo=0.1
    )


def vector(zenith, azimuth):
    sine = np.sin(zenith)
    return np.array([sine * np.cos(azimuth), sine * np.sin(azimuth), np.cos(zenith)])


def cone(axis, half_angle, share, turn):
    """Directions spread evenly in solid angle over a cone, from two uniform numbers."""
    cosine = 1.0 - share * (1.0 - np.cos(half_angle))
    sine = np.sqrt(1.0 - cosine**2)
    first = np.cross([0.0, 1.0, 0.0], axis)
    first = first / np.linalg.norm(first)
    second = np.cross(axis, first)
    aside = np.outer(np.cos(turn), first) + np.outer(np.sin(turn), second)
    return cosine[:, None] * axis + sine[:, None] * aside


def average(model, theta_i, theta_s, dphi, source, detector, power=14):
    """M00 averaged over both cones by 2^power points of a Sobol sequence."""
    u = qmc.Sobol(4, seed=5).random_base2(power)
    turn = 2.0 * np.pi * u[:, 2:]
    to_i = cone(vector(theta_i, 0.0), source, u[:, 0], turn[:, 0])
    to_s = cone(vector(theta_s, dphi), detector, u[:, 1], turn[:, 1])
    azimuth = [np.arctan2(to[:, 1], to[:, 0]) for to in (to_i, to_s)]
    zenith = [np.arccos(np.clip(to[:, 2], -1.0, 1.0)) for to in (to_i, to_s)]
    m00 = model.brdf(*zenith, azimuth[1] - azimuth[0])[:, 0, 0]
    weight = to_i[:, 2] * to_s[:, 2]
    return (m00 * weight).sum() / weight.sum()


def wide_scan(model, source, detector, power=14):
    """In-plane scan at 30 degrees through cones of these half-angles. [rad]"""
    view = np.deg2rad(VIEW)
    dphi = np.where(view > 0.0, np.pi, 0.0)
    theta_i = np.deg2rad(30.0)
    values = [
        average(model, theta_i, abs(v), d, source, detector, power)
        for v, d in zip(view, dphi, strict=True)
    ]
    coords = {"theta_i": np.full(view.size, theta_i), "theta_s": abs(view), "dphi": dphi}
    return xr.Dataset(
        {"M00": ("geometry", values)},
        {name: ("geometry", value) for name, value in coords.items()},
    ).assign_coords(source_half_angle=source, detector_half_angle=detector)


@pytest.mark.parametrize(
    ("slope", "source", "detector"),
    [(0.01, 2.0, 2.0), (0.003, 0.0, 1.0), (0.01, 1.0, 0.25), (0.05, 0.5, 4.0)],
)
@pytest.mark.parametrize("angles", [(30.0, 33.0, 178.0), (50.0, 48.5, 181.0), (20, 25, 60)])
def test_finest_rule_equals_many_random_directions(slope, source, detector, angles):
    model = narrow(slope)
    at = [np.deg2rad(v) for v in angles]
    cones = [np.deg2rad(v) for v in (source, detector)]
    expected = average(model, *at, *cones, power=17)
    one = Geometry(*(np.array([v]) for v in (*at, 0.0, np.nan)))
    found = cones_of(one, Aperture(source=cones[0], detector=cones[1]))
    rays = rays_through(one, found.at(np.array([0]), np.array([FINEST - 2])))
    where = (getattr(rays.geometry, name) for name in ("theta_i", "theta_s", "dphi"))
    m00 = model.brdf(*where)[:, 0, 0]
    # What 131 072 points know of a lobe a fifth of the cones wide
    assert_allclose((m00 * rays.weight).sum(), expected, rtol=4e-3)


@pytest.mark.parametrize(("source", "detector"), [(0.03, 0.03), (0.04, 0.01), (0.01, 0.02)])
@pytest.mark.parametrize(("level", "allowed"), [(4, 5e-3), (FINEST, 1e-3)])
def test_few_points_have_the_moments_of_two_discs(source, detector, level, allowed):
    at_source, at_detector, share = pairs(source, detector, level)
    for points, angle in ((at_source, source), (at_detector, detector)):
        square, radius = (points**2).sum(axis=1), 2.0 * np.sin(0.5 * angle)
        # Of a uniform disc; the fourth takes three points an axis
        assert_allclose(share @ square, radius**2 / 2.0, rtol=allowed)
        if level == FINEST:
            assert_allclose(share @ square**2, radius**4 / 3.0, rtol=5e-3)
    # Independent of each other
    both = share @ (at_source * at_detector).sum(axis=1)
    assert abs(both) < 0.5 * allowed * source * detector


@pytest.mark.parametrize(
    ("slope", "half_angle"),
    [(0.003, 1.0), (0.003, 2.0), (0.005, 0.25), (0.01, 2.0), (0.03, 1.0)],
)
def test_a_lobe_narrower_than_the_detector_gives_its_slope(slope, half_angle):
    measurement = wide_scan(narrow(slope), 0.0, np.deg2rad(half_angle), power=15)
    result = fit(measurement, START, free=FREE, noise=Noise(relative=0.01))
    miss = result.values["slope_rms"] - slope
    assert abs(miss) < 0.01 * slope
    assert abs(miss) < result.stderr["slope_rms"]
    assert not any("cones of light" in w for w in result.warnings)


def test_the_cone_of_the_argument_goes_before_that_of_the_file():
    half, noise = np.deg2rad(2.0), Noise(relative=0.01)
    measurement = wide_scan(narrow(0.01), 0.0, half, power=15)
    result = fit(measurement, START, free=FREE, noise=noise)
    point = fit(measurement, START, free=FREE, noise=noise, aperture=Aperture())
    assert point.values["slope_rms"] > result.values["slope_rms"]
    again = fit(measurement.drop_vars(["source_half_angle", "detector_half_angle"]), START,
                free=FREE, noise=noise, aperture=Aperture(detector=half))  # fmt: skip
    assert_allclose(again.values["slope_rms"], result.values["slope_rms"], rtol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("slope", [0.003, 0.005, 0.01, 0.03])
@pytest.mark.parametrize("half_angle", [0.25, 1.0, 2.0])
def test_a_lobe_narrower_than_both_cones_gives_its_slope(slope, half_angle):
    half = np.deg2rad(half_angle)
    measurement = wide_scan(narrow(slope), half, half, power=17)
    result = fit(measurement, START, free=FREE, noise=Noise(relative=0.01))
    miss = result.values["slope_rms"] - slope
    assert abs(miss) < 0.01 * slope
    assert abs(miss) < result.stderr["slope_rms"]


def test_half_angles_may_differ_from_reading_to_reading():
    model = narrow(0.02)
    wide, point = np.deg2rad(2.0), 0.0
    coarse, fine = wide_scan(model, 0.0, wide, power=15), wide_scan(model, 0.0, point, 4)
    both = xr.concat(
        [one.assign_coords(detector_half_angle=("geometry", np.full(VIEW.size, angle)))
         for one, angle in ((coarse, wide), (fine, point))], "geometry",
    )  # fmt: skip
    result = fit(both, START, free=FREE, noise=Noise(relative=0.01))
    assert_allclose(list(result.values.values()), [0.8, 0.1, 0.02], rtol=2e-3)


def test_an_unknown_cone_is_named_where_it_would_matter():
    measurement = scan(narrow(0.004), step=0.5)
    options = {"free": FREE, "noise": Noise(relative=0.01)}
    loose = fit(measurement, START, **options)
    (text,) = (w for w in loose.warnings if "cones of light" in w)
    # (r / 4)^2 beside the slope's square: 1 % at 0.57 slopes
    assert "a half-angle of 0.13 degrees changes slope_rms by 1%" in text
    stated = fit(measurement, START, aperture=Aperture(), **options)
    named = fit(measurement.assign_coords(detector_half_angle=0.0), START, **options)
    for result in (stated, named, fit(scan(VINYL, noise=0.02), VINYL)):
        assert not any("cones of light" in w for w in result.warnings)


def test_half_angles_in_degrees_are_refused():
    measurement = scan(VINYL, noise=0.02).assign_coords(detector_half_angle=1.0)
    with pytest.raises(ValueError, match=r"detector_half_angle must lie in \[0, 0.5\) rad"):
        fit(measurement, VINYL)

"""Signs and factors that other tests meet only where they cancel, each pinned by itself."""

import cmath
import math

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose
from scipy import integrate, stats

from data_io import read_goniometer
from fitting import fit, profile_likelihood
from fitting.objective.uncertainty import information, sandwich
from fitting.statistics.axis.autocorrelation import gaussian
from fitting.statistics.axis.scatter import Extent, increment_covariance
from pbrdf import Material, MicrofacetModel
from pbrdf.optics.fresnel import transmission_mueller
from tests.reference_optics import PROBES, stokes


def smith_lambda(theta, slope):
    """Mean overhang of Gaussian slopes, by quadrature over its definition."""
    cot = 1 / math.tan(theta)

    def over(z):
        return (
            (z - cot) * math.exp(-0.5 * (z / slope) ** 2) / (slope * math.sqrt(2 * math.pi))
        )

    return integrate.quad(over, cot, cot + 12 * slope)[0] / cot


@pytest.mark.parametrize("dphi", [0.2, 0.9, 2.0, 3.0, 2 * math.pi - 0.9, -0.2])
def test_direction_correlated_hiding_off_azimuth_zero(dphi):
    """Van Ginneken et al. 1998: hidings grow independent as 4.41 d / (4.41 d + 1)."""
    model = MicrofacetModel(
        Material(1.5), slope_rms=0.4, shadowing="smith-direction", specular_gain=0.7
    )
    bare = model.with_parameters(shadowing="none")
    theta_i, theta_s = 1.25, 1.1
    factor = (
        model.brdf(theta_i, theta_s, dphi)[0, 0] / bare.brdf(theta_i, theta_s, dphi)[0, 0]
    )
    low, high = sorted((smith_lambda(theta_i, 0.4), smith_lambda(theta_s, 0.4)))
    apart = math.acos(math.cos(dphi))
    weight = 4.41 * apart / (4.41 * apart + 1)
    assert_allclose(factor, 1 / (1 + high + weight * low), rtol=1e-9)


@pytest.mark.parametrize(
    ("shadowing", "combined"),
    [
        ("smith-correlated", lambda a, b: 1 / (1 + a + b)),
        ("smith-uncorrelated", lambda a, b: 1 / ((1 + a) * (1 + b))),
    ],
)
@pytest.mark.parametrize("dphi", [0.4, 2.1, -1.2])
def test_each_direction_is_hidden_by_the_slope_along_it(shadowing, combined, dphi):
    """Slopes 0.2 along x and 0.5 along y; along a direction their projections add."""
    phi_i, theta_i, theta_s = 0.7, 1.2, 1.05
    model = MicrofacetModel(Material(1.5), slope_rms=(0.2, 0.5), shadowing=shadowing)
    light, bare = (
        one.brdf(theta_i, theta_s, dphi, phi_i=phi_i)[0, 0]
        for one in (model, model.with_parameters(shadowing="none"))
    )
    hidden = [
        smith_lambda(theta, math.hypot(0.2 * math.cos(phi), 0.5 * math.sin(phi)))
        for theta, phi in ((theta_i, phi_i), (theta_s, phi_i + dphi))
    ]
    assert_allclose(light / bare, combined(*hidden), rtol=1e-9)


@pytest.mark.parametrize("cosine", [0.95, 0.5, 0.2])
@pytest.mark.parametrize("index", [(1.4, 0.6), (0.2, 3.1)])
def test_light_that_enters_an_absorber_keeps_the_phases_of_its_field(cosine, index):
    """The fields just inside, carried to Stokes vectors one polarisation after another."""
    n = complex(*index)
    inside = cmath.sqrt(1 - (1 - cosine**2) / n**2)
    t_s = 2 * cosine / (cosine + n * inside)
    t_p = 2 * cosine / (n * cosine + inside)
    power = [
        1 - abs((cosine - n * inside) / (cosine + n * inside)) ** 2,
        1 - abs((n * cosine - inside) / (n * cosine + inside)) ** 2,
    ]
    across = [math.sqrt(p) * t / abs(t) for p, t in zip(power, (t_s, t_p), strict=True)]
    before = np.array([stokes(*probe) for probe in PROBES]).T
    behind = np.array([stokes(across[0] * s, across[1] * p) for s, p in PROBES]).T
    expected = behind @ np.linalg.inv(before)
    assert abs(expected[3, 2]) > 1e-4
    assert_allclose(transmission_mueller(cosine, *index), expected, atol=1e-12)


@pytest.mark.parametrize("slope", [1.0, 0.9999, 0.9996, 1.0004, 1.0006, 0.9994])
def test_modified_cauchy_slopes_fill_the_projected_area_near_slope_one(slope):
    """Both closed forms are 0/0 at slope 1, a series stands in: equation (18) by hand."""
    model = MicrofacetModel(
        Material.mirror(),
        slope_rms=slope,
        slope_distribution="modified-cauchy",
        shadowing="none",
    )

    def projected(theta):
        # Retro-reflection: the facet tilts by theta; f = p / (4 cos^2 cos^4), equation (20)
        density = model.brdf(theta, theta, 0.0)[0, 0] * 4 * math.cos(theta) ** 6
        return density * 2 * math.pi * math.tan(theta) / math.cos(theta) ** 2

    total = integrate.quad(projected, 0, math.pi / 2 - 1e-9, epsrel=1e-10)[0]
    assert_allclose(total, 1.0, atol=2e-8)


def test_robust_covariance_of_plain_squares_is_that_of_least_squares():
    """With rho(z) = z it is s^2 (J^T J)^-1 with m - n degrees of freedom, as numpy's."""
    rng = np.random.default_rng(4)
    x = np.linspace(0.3, 2.0, 9)
    y = 1.7 * x - 0.4 + 0.3 * rng.standard_normal(9)
    line, covariance = np.polyfit(x, y, 1, cov=True)
    jacobian = np.stack([x, np.ones(9)], axis=1)
    residual = y - np.polyval(line, x)
    found = sandwich(jacobian, residual, np.ones(9), information(jacobian))
    assert_allclose(found, covariance, rtol=1e-10)


def test_covariance_of_height_and_increments_by_isserlis_sums():
    """cov(mean h^2, mean (h' - h)^2) = 2 mean of squared covariances, node by node."""
    corr_length, step, nodes = 5.0, 0.5, 900
    lags = np.array([1.0, 4.0, 9.0])
    height, noise = 1.3, 0.0

    def c(r):
        return height * np.exp(-((r / corr_length) ** 2))

    x = np.arange(nodes) * step
    expected = []
    for lag in lags:
        b = x[x + lag <= x[-1]]
        with_increment = c(x[:, None] - b - lag) - c(x[:, None] - b)
        expected.append(2 * np.mean(with_increment**2))
    found = increment_covariance(
        lags, gaussian(corr_length), (height, noise), Extent(x[-1], nodes)
    )
    assert_allclose(found[0, 1:], expected, rtol=0.03)
    assert_allclose(found[1:, 0], found[0, 1:])


def test_covariance_with_white_noise_by_isserlis_sums():
    """The part of noise alone: each node meets itself in two increments."""
    nodes, step, noise = 400, 0.5, 0.7
    lags = np.array([2.0, 5.0])
    found = increment_covariance(lags, gaussian(3.0), (0.0, noise), Extent(200.0, nodes))
    identity = noise * np.eye(nodes)
    for row, lag in enumerate(lags, start=1):
        k = round(lag / step)
        with_increment = identity[:, k:] - identity[:, :-k]
        expected = 2 * np.sum(with_increment**2) / (nodes * (nodes - k))
        assert_allclose(found[0, row], expected, rtol=1e-12)


def test_covariance_of_all_increments_by_isserlis_sums():
    """Signal and noise together, every pair of lags, node by node."""
    nodes, step, height, noise = 900, 0.5, 1.3, 0.7
    lags = np.array([1.0, 2.5, 5.0])
    x = np.arange(nodes) * step
    covariance = height * np.exp(-(((x[:, None] - x) / 5.0) ** 2)) + noise * np.eye(nodes)
    steps = [0, *np.rint(lags / step).astype(int)]

    def increments(rows, k):
        return rows[k:] - rows[:-k] if k else rows

    expected = [
        [2 * np.mean(increments(increments(covariance, j).T, k) ** 2) for k in steps]
        for j in steps
    ]
    found = increment_covariance(lags, gaussian(5.0), (height, noise), Extent(x[-1], nodes))
    assert_allclose(found, expected, rtol=0.02)


def test_interval_of_a_gain_with_estimated_noise_is_that_of_student():
    """Six degrees of freedom: 2.447 standard errors, where the normal law has 1.960."""
    model = MicrofacetModel(Material(1.5), slope_rms=0.3)
    theta = np.radians([15.0, 20.0, 28.0, 35.0, 43.0, 50.0, 60.0])
    bare = model.brdf(theta, theta, math.pi)[:, 0, 0]
    readings = bare * np.array([0.92, 0.85, 0.97, 0.9, 0.93, 0.87, 0.94])
    scan = xr.Dataset(
        {"M00": ("geometry", readings)},
        {
            "theta_i": ("geometry", theta),
            "theta_s": ("geometry", theta),
            "dphi": ("geometry", np.full(7, math.pi)),
        },
    )
    result = fit(scan, model, free=("specular_gain",))
    assert result.noise.startswith("estimated")
    found = profile_likelihood(result, "specular_gain")
    half = stats.t.ppf(0.975, 6) * result.stderr["specular_gain"]
    ends = [found.high - found.value, found.value - found.low]
    assert_allclose(ends, [half, half], rtol=0.01)


HEADER = "lambda,thetai,phi,thetar,phir,f_r11," + ",".join(
    f"f_r{i}{j}/f_r11" for i in range(1, 5) for j in range(1, 5) if (i, j) != (1, 1)
)
ELEMENTS = "0.5,0.12,-0.13,0,0.21,0.22,-0.23,0,0.31,-0.32,0.33,0,0,0,0,-0.44"


def test_the_incident_frame_of_nist_turns_with_the_azimuth_of_the_source(tmp_path):
    """At normal incidence the azimuth of the source is a name for its frame, nothing else.

    One field, written in the meridian frame of each azimuth, must leave the same light.
    """
    path = tmp_path / "scan.csv"
    azimuths = [0.0, 25.0, 110.0, 250.0]
    rows = [f"0.351,0,{azimuth},35,70,{ELEMENTS}" for azimuth in azimuths]
    path.write_text("\n".join([HEADER, *rows]) + "\n")
    scan = read_goniometer(path)
    mueller = np.array(
        [[scan[f"M{i}{j}"].to_numpy() for j in range(3)] for i in range(3)]
    ).transpose(2, 0, 1)
    field = np.array([0.6, 0.35])
    left = []
    for azimuth, matrix in zip(np.radians(azimuths), mueller, strict=True):
        # k = -z: e_s = z x k in the limit of this azimuth, e_p = k x e_s
        e_s = np.array([math.sin(azimuth), -math.cos(azimuth)])
        e_p = np.array([-math.cos(azimuth), -math.sin(azimuth)])
        left.append(matrix @ stokes(field @ e_s, field @ e_p)[:3])
    assert_allclose(left, np.broadcast_to(left[0], np.shape(left)), atol=1e-9)

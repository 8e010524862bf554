"""Checks C7 to C14 and B14, B16, B19: spheres, caps and drops with known answers."""

import csv
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf import Drops, HeightMap, Material, Scene, Spheres, simulate
from pbrdf.conventions import detector_bins
from pbrdf.errors import AccuracyWarning
from pbrdf.kernels import from_python
from pbrdf.kernels.bodies.beams import KX, KY, KZ, N_STATE
from pbrdf.kernels.bodies.interfaces import refract_beam
from pbrdf.kernels.optics.vectors import Vec
from tests.contaminants.scenes import assert_closed, assert_within, clean_counters
from tests.reference_optics import fresnel, path_mueller

refract_beam = from_python(refract_beam)

WATER = Material(1.333)
REFERENCE = Path(__file__).parents[1] / "reference"


def table(name):
    """Rows of a reference file as dictionaries of floats."""
    with (REFERENCE / name).open() as stream:
        rows = [line for line in stream if not line.startswith("#")]
    return [{k: float(v) for k, v in row.items()} for row in csv.DictReader(rows)]


# One sphere on a finite black plane has no neighbours
SIDE, NODES, RADIUS = 1.0, 33, 0.3
PLANE = HeightMap(np.zeros((NODES, NODES)), SIDE / (NODES - 1))


def one_sphere(material, theta=0.0, n_rays=400_000, **options):
    """A sphere on a black plane, and its coverage of the lit rectangle."""
    sphere = Spheres.at([[0.5, 0.5, RADIUS]], radius=RADIUS, material=material)
    scene = Scene(PLANE, Material.black(), sphere)
    result = simulate(scene, theta, n_rays=n_rays, **options)
    # The guard rim is an eighth of the side
    return result, np.pi * RADIUS**2 / (0.75 * SIDE) ** 2


def polarised_light(result, bounces=None):
    """M00 and M10 of the zenith bins over all azimuths, times the share of the light."""
    brdf, error = result.brdf_total, result.brdf_total_stderr
    if bounces is not None:
        brdf, error = (result[n].sel(bounces=bounces) for n in ("brdf", "brdf_stderr"))
    weight = result.projected_solid_angle
    column = {"theta_i": 0, "stokes_in": 0}
    flux = (brdf.isel(column) * weight).sum("dphi")
    stderr = np.sqrt(((error.isel(column) * weight) ** 2).sum("dphi"))
    return flux.values, stderr.values


@pytest.mark.filterwarnings("ignore:.*left the finite map sideways")
def test_c08_water_sphere_bin_by_bin():
    """Scattered backwards by 90 to 180 degrees; no light reaches the black plane's side."""
    result, coverage = one_sphere(WATER, n_theta=18, n_dphi=2)
    rows = [r for r in table("water_sphere_geometric_optics.csv") if r["theta_lo"] >= 90]
    expected = np.array([[r["I"], r["Q"]] for r in rows])[::-1] * coverage
    flux, stderr = polarised_light(result)
    # The reference adds Debye orders that it traced itself: 5e-4 of a bin
    assert_within(flux[:, :2], stderr[:, :2], expected, extra=5e-4 * expected[:, :1] / 5)
    assert_within(flux[:, 2:], stderr[:, 2:], 0.0)
    back = 0.058246 * coverage
    assert_within(result.albedo.sum(), 0.0, back, extra=2e-5 * coverage, limit=5)
    clean_counters(result)
    # External reflection alone: order p = 0
    external = np.array([[r["I_p0"], r["Q_p0"]] for r in rows])[::-1] * coverage
    flux, stderr = polarised_light(result, "1")
    assert_within(flux[:, :2], stderr[:, :2], external, extra=5e-4 * external[:, :1] / 5)


def rainbow(n, order, edges, impacts=500_001):
    """I and Q by scattering angle of one Debye order, as shares of all the light."""
    squares = (np.arange(impacts) + 0.5) / impacts
    cos_i, cos_t = np.sqrt(1 - squares), np.sqrt(1 - squares / n**2)
    turn = 2 * (np.arccos(cos_i) - order * np.arccos(cos_t)) + (order - 1) * np.pi
    angle = np.abs((turn + np.pi) % (2 * np.pi) - np.pi)
    light = []
    for r in (
        (cos_i - n * cos_t) / (cos_i + n * cos_t), (n * cos_i - cos_t) / (n * cos_i + cos_t)
    ):  # fmt: skip
        kept = (1 - r**2) ** 2 * r ** (2 * (order - 1))
        light.append(np.histogram(angle, edges, weights=kept)[0] / impacts / 2)
    return light[0] + light[1], light[0] - light[1]


@pytest.mark.filterwarnings("ignore:.*left the finite map sideways")
def test_c07_rainbow_stands_at_its_angle_with_its_polarisation():
    # Zenith bins of half a degree: the bow is at 180 - 137.9219 = 42.0781 degrees
    result, coverage = one_sphere(WATER, n_theta=180, n_dphi=2, n_rays=600_000)
    flux, stderr = polarised_light(result, "3+")
    edges = np.deg2rad(np.linspace(90, 180, 181))
    bows = [rainbow(1.333, p, edges) for p in (2, 3, 4, 5, 6)]
    expected = coverage * np.array([sum(b[k] for b in bows) for k in (0, 1)])[:, ::-1].T
    near = slice(72, 90)
    # Orders beyond 6 hold less than 2e-4 of the light, spread over the sphere
    assert_within(flux[near, :2], stderr[near, :2], expected[near], floor=2e-7)
    dark, bow = flux[86, 0], flux[84, 0]
    assert bow > 20 * dark  # Alexander's dark band begins within a bin
    assert_allclose(flux[84, 1] / flux[84, 0], 0.924, atol=0.02)


@pytest.mark.parametrize("theta_deg", [0.0, 30.0])
@pytest.mark.filterwarnings("ignore:.*left the finite map sideways")
def test_c09_mirror_sphere_on_black_ground(theta_deg):
    theta = np.deg2rad(theta_deg)
    # The light is so inclined that none of it misses the plane beyond the sphere
    sphere = Spheres.at([[0.5, 0.5, 0.2]], radius=0.2, material=Material.mirror())
    result = simulate(
        Scene(PLANE, Material.black(), sphere), theta, n_rays=400_000, n_theta=18, n_dphi=6
    )
    reach = 0.4 * np.tan(theta)
    lit = (0.75 - reach) * 0.75
    edges = np.linspace(0, np.pi / 2, 19)
    solid = (np.cos(edges[:-1]) - np.cos(edges[1:]))[:, None] * 2 * np.pi / 6
    # a^2/4 a steradian of the light through the circle, whose share is pi a^2 / cos / lit
    share = np.broadcast_to(0.2**2 / 4 * solid / (lit * np.cos(theta)), (18, 6))
    flux = result.brdf_total.isel(theta_i=0, stokes_in=0) * result.projected_solid_angle
    error = (
        result.brdf_total_stderr.isel(theta_i=0, stokes_in=0) * result.projected_solid_angle
    )
    assert_within(flux[..., 0], error[..., 0], share)
    assert_within(flux[..., 1:3], error[..., 1:3], 0.0)
    clean_counters(result)


@pytest.mark.filterwarnings("ignore:.*left the finite map sideways")
def test_c09_all_elements_of_the_outside_of_a_sphere():
    """Single reflections out of the plane of incidence, averaged over the bin."""
    theta, radius = np.deg2rad(30.0), 0.2
    sphere = Spheres.at([[0.5, 0.5, radius]], radius=radius, material=WATER)
    result = simulate(
        Scene(PLANE, Material.black(), sphere), theta, n_rays=2_000_000, n_theta=9,
        n_dphi=12,
    )  # fmt: skip
    theta_s, dphi, _ = detector_bins(9, 12)
    lit = (0.75 - 2 * radius * np.tan(theta)) * 0.75 * np.cos(theta)
    k_i = np.array([np.sin(theta), 0.0, np.cos(theta)])
    nodes, weights = np.polynomial.legendre.leggauss(6)
    one = {"theta_i": 0, "bounces": 0}
    brdf = (result.brdf * result.projected_solid_angle).isel(one).values
    error = (result.brdf_stderr * result.projected_solid_angle).isel(one).values
    for i, j in [(2, 1), (4, 4), (5, 7), (3, 9), (6, 6)]:
        expected = np.zeros((4, 4))
        for a, wa in zip(nodes, weights, strict=True):
            for b, wb in zip(nodes, weights, strict=True):
                t, p = theta_s[i] + a * np.pi / 36, dphi[j] + b * np.pi / 12
                k_s = np.array([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])
                half = (k_i + k_s) / np.linalg.norm(k_i + k_s)
                matrix, _ = path_mueller(k_i, [half], 1.333)
                expected += wa * wb / 4 * matrix * np.sin(t) * np.pi / 18 * np.pi / 6
        expected *= radius**2 / 4 / lit
        assert_within(brdf[i, j], error[i, j], expected, extra=2e-4 * expected[0, 0])


@pytest.mark.parametrize("theta_deg", [0.0, 41.4])
def test_c10_mirror_boss_on_a_mirror_sends_light_evenly(theta_deg):
    theta = np.deg2rad(theta_deg)
    radius, side = 0.05, 1.0
    boss = Drops.at(
        [[0.5, 0.5]], volume=2 / 3 * np.pi * radius**3, contact_angle=np.pi / 2,
        material=Material.mirror(),
    )  # fmt: skip
    scene = Scene(HeightMap.flat(size=(side, side)), Material.mirror(), boss)
    result = simulate(scene, theta, n_rays=1_000_000, n_theta=9, n_dphi=2, phi_i="uniform")
    assert_allclose(result.albedo.sum(), 1.0, atol=1e-12)
    edges = np.linspace(0, np.pi / 2, 10)
    solid = (np.cos(edges[:-1]) - np.cos(edges[1:]))[:, None] * 2 * np.pi / 2
    share = np.broadcast_to(radius**2 / 2 * solid / side**2 / np.cos(theta), (9, 2)).copy()
    flux = (result.brdf_total * result.projected_solid_angle).isel(
        theta_i=0, stokes_out=0, stokes_in=0
    )
    error = (result.brdf_total_stderr * result.projected_solid_angle).isel(
        theta_i=0, stokes_out=0, stokes_in=0
    )
    # The bin of the mirror direction holds the plane
    specular = np.zeros((9, 2), dtype=bool)
    specular[int(theta_deg / 10), :] = True
    # Bosses a period of 20 radii apart meet light that leaves below 0.05 of the horizon
    specular[8] = True
    assert_within(flux.values[~specular], error.values[~specular], share[~specular])


def test_c11_outside_of_caps():
    """f = (c_b / sin^2 t) F(beta) / (4 pi ci cr) where the normal lies on the cap."""
    angle, side = np.deg2rad(15.0), 1.0
    base = 0.34907 * side**2
    sphere = np.sqrt(base / np.pi) / np.sin(angle)
    volume = np.pi * sphere**3 / 3 * (2 + np.cos(angle)) * (1 - np.cos(angle)) ** 2
    drop = Drops.at([[0.5, 0.5]], volume=volume, contact_angle=angle, material=WATER)
    scene = Scene(HeightMap.flat(size=(side, side)), Material.black(), drop)
    theta = np.deg2rad([0.0, 41.4])
    result = simulate(scene, theta, n_rays=2_000_000, n_theta=18, n_dphi=36)
    brdf = result.brdf.sel(bounces="1", stokes_in="I")
    error = result.brdf_stderr.sel(bounces="1", stokes_in="I")
    ring = brdf.isel(theta_i=0, stokes_out=0).mean("dphi").values
    spread = error.isel(theta_i=0, stokes_out=0).values.max(axis=1) / 6
    assert_within(ring[[0, 5]], spread[[0, 5]], [0.00846, 0.00955], extra=5e-6)
    assert ring[6:].max() == 0.0
    # Every bin that lies wholly on the cap, by quadrature over the bin
    nodes, weights = np.polynomial.legendre.leggauss(6)
    theta_s, dphi, weight = detector_bins(18, 36)
    k_i = np.array([np.sin(theta[1]), 0.0, np.cos(theta[1])])
    for i, j in [(8, 18), (6, 18), (9, 17), (9, 20), (7, 16), (12, 18)]:
        total, inside = 0.0, True
        for a, wa in zip(nodes, weights, strict=True):
            for b, wb in zip(nodes, weights, strict=True):
                t = theta_s[i] + a * np.pi / 72
                p = dphi[j] + b * np.pi / 36
                k_s = np.array([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])
                half = (k_i + k_s) / np.linalg.norm(k_i + k_s)
                inside &= bool(np.arccos(half[2]) < angle)
                r_s, r_p = fresnel(k_i @ half, 1.333)
                f = (abs(r_s) ** 2 + abs(r_p) ** 2) / 2
                total += wa * wb / 4 * f * np.sin(t) * np.pi / 36 * np.pi / 18
        if not inside:
            continue
        expected = (
            0.34907 / np.sin(angle) ** 2 * total / (4 * np.pi * k_i[2]) / weight[i, j]
        )
        assert_within(
            brdf.values[1, i, j, 0],
            error.values[1, i, j, 0],
            expected,
            extra=2e-4 * expected,
        )


def furnace_angles(bins=18, inner=3):
    """Angles and shares of light from an even hemisphere, so many in each zenith bin."""
    edges = np.linspace(0, np.pi / 2, bins + 1)
    parts = (np.arange(inner) + 0.5) / inner
    squares = (
        np.sin(edges[:-1, None]) ** 2 * (1 - parts) + np.sin(edges[1:, None]) ** 2 * parts
    )
    share = np.repeat(np.diff(np.sin(edges) ** 2) / inner, inner)
    return np.arcsin(np.sqrt(squares)).ravel(), share


@pytest.mark.parametrize(
    "contact_deg",
    [
        pytest.param(15.0, marks=pytest.mark.slow),
        pytest.param(90.0, marks=pytest.mark.slow),
        pytest.param(150.0, marks=pytest.mark.slow),
        179.0,
    ],
)
def test_c13_furnace_with_drops_on_a_mirror(contact_deg, measured):
    """Light from everywhere comes back to everywhere, alike and unpolarised."""
    # Three drops of which two overlap, so that light also crosses within the water
    drops = Drops.at(
        [[0.3, 0.3], [0.42, 0.36], [0.8, 0.7]], volume=[0.004, 0.002, 0.003],
        contact_angle=np.deg2rad(contact_deg), material=WATER,
    )  # fmt: skip
    angles, share = furnace_angles()
    with pytest.warns(AccuracyWarning, match="1 pairs of drops overlap"):
        result = simulate(
            Scene(HeightMap.flat(size=(1.0, 1.0)), Material.mirror(), drops), angles,
            n_rays=20_000, n_theta=18, n_dphi=2, phi_i="uniform", max_bounces=4096,
        )  # fmt: skip
    mismatches = result.attrs["medium_mismatches"]
    measured("B16", "crossings whose media do not fit, overlapping drops", mismatches, 0)
    # Row: for every incidence and any polarisation all light comes back
    flux = result.brdf_total * result.projected_solid_angle
    row = flux.isel(stokes_out=0).sum(("theta_s", "dphi"))
    errors = result.brdf_total_stderr * result.projected_solid_angle
    row_error = np.sqrt((errors.isel(stokes_out=0) ** 2).sum(("theta_s", "dphi")))
    assert_closed(result)
    error = np.abs(row.isel(stokes_in=0) + result.truncated - 1.0).max()
    measured("B17", "energy of a lossless scene with drops", error, 1e-9)
    assert result.truncated.max() < 1e-4
    assert_within(row.values[:, 1:], row_error.values[:, 1:], 0.0, limit=6.0)
    # Column: the light out of each bin, of unpolarised light from an even sky
    light = np.einsum("a,atpo->to", share, flux.isel(stokes_in=0).values)
    stderr = np.sqrt(
        np.einsum("a,atpo->to", share**2, errors.isel(stokes_in=0).values ** 2)
    )
    sky = result.projected_solid_angle.sum("dphi").values / np.pi
    # Bins share their rays: the specular light of each ring adds to its error
    assert_within(light[:, 0] / sky, stderr[:, 0] / sky, 1.0, limit=6.0, extra=2e-3)
    assert_within(light[:, 1:] / sky[:, None], stderr[:, 1:] / sky[:, None], 0.0, limit=6.0)


@pytest.mark.parametrize(("n", "turn"), [(1.333, 23.595009), (1.5, 37.180756)])
def test_c14_prism_turns_light_by_the_least_angle(n, turn):
    """Through two sides of a prism of 60 degrees, symmetrically."""
    into, out = np.array([-1.0, 0.0, 0.0]), None
    incidence = np.arcsin(n * np.sin(np.pi / 6))
    start = np.array([np.cos(incidence), np.sin(incidence), 0.0])
    state = np.zeros((1, N_STATE))
    state[0, [KX, KY, KZ]] = start
    refract_beam(state, 0, Vec(*into), np.cos(incidence), n)
    inside = state[0, [KX, KY, KZ]].copy()
    # The second side is turned by 60 degrees; its normal towards the beam
    out = -np.array([np.cos(np.pi / 3), np.sin(np.pi / 3), 0.0])
    refract_beam(state, 0, Vec(*out), float(-inside @ out), 1 / n)
    end = state[0, [KX, KY, KZ]]
    assert_allclose(np.rad2deg(np.arccos(start @ end)), turn, atol=1e-6)


# Share of the light still missing when paths are cut, of the shared page [%]
TRAPPED = {
    179.0: {4: 35.7, 8: 6.5, 16: 1.9, 32: 0.59, 64: 0.18, 256: 0.01},
    90.0: {4: 5.0, 8: 1.6, 16: 0.61, 32: 0.21, 64: 0.09, 256: 0.001},
    15.0: {4: 2.9, 8: 2.1, 16: 0.04},
}


@pytest.mark.parametrize("contact_deg", TRAPPED)
def test_b14_light_caught_under_drops(contact_deg):
    angle = np.deg2rad(contact_deg)
    radius = 1.0 / 2.5 if contact_deg > 30 else None
    if radius is None:
        radius = 0.4 / np.sin(angle)
    volume = np.pi * radius**3 / 3 * (2 + np.cos(angle)) * (1 - np.cos(angle)) ** 2
    drop = Drops.at([[0.5, 0.5]], volume=volume, contact_angle=angle, material=WATER)
    scene = Scene(HeightMap.flat(size=(1.0, 1.0)), Material.mirror(), drop)
    for events, expected in TRAPPED[contact_deg].items():
        result = simulate(
            scene, np.full(16, np.deg2rad(41.4)), n_rays=2500, max_bounces=events,
            phi_i="uniform", stokes="unpolarized",
        )  # fmt: skip
        clean_counters(result)
        assert assert_closed(result) < 1e-9
        # The page has two digits, of a tracer of its own with its own chance
        missing = 100 * result.truncated.values
        stderr = missing.std(ddof=1) / np.sqrt(16)
        assert_within(missing.mean(), stderr, expected, extra=0.02 * expected, floor=0.01)


@pytest.mark.parametrize(
    "row", table("droplet_lattice_sample.csv"), ids=lambda r: r["theta_i"]
)
def test_lattice_of_drops_by_class_of_events(row):
    drop = Drops.at(
        [[0.5, 0.5]], volume=0.01523597, contact_angle=np.deg2rad(row["contact_angle"]),
        material=WATER,
    )  # fmt: skip
    result = simulate(
        Scene(HeightMap.flat(size=(1.0, 1.0)), Material(1.5), drop),
        np.deg2rad(row["theta_i"]), n_rays=2_000_000, n_theta=9, n_dphi=4,
    )  # fmt: skip
    albedo, stderr = result.albedo.values[:, 0], result.albedo_stderr.values[:, 0]
    expected = [row["plane_only"] + row["d1"], row["d2"], row["d3plus"]]
    extra = [np.hypot(row["se"], row["se.2"]), row["se.3"], row["se.4"]]
    assert_within(albedo, stderr, expected, limit=4.0, extra=np.array(extra))
    flux = (result.brdf_total * result.projected_solid_angle).sum(("theta_s", "dphi"))
    assert_within(
        flux.values[0, 1, 0], 0.0, row["Qhemi_total"], limit=4.0, extra=row["se.5"]
    )
    assert_within(albedo.sum(), 0.0, row["albedo_total"], limit=4.0, extra=row["se"])
    clean_counters(result)

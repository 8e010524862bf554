"""Switches that may change the time of a run but not its answer."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from pbrdf import GaussianSurface, HeightMap, Material, Scene, simulate

# Runs are compared ray for ray, over surfaces small and steep on purpose
pytestmark = pytest.mark.filterwarnings("ignore:A period of:pbrdf.errors.AccuracyWarning")
BINS = {"n_theta": 18, "n_dphi": 24}
SURFACE = GaussianSurface(
    shape=(128, 96), spacing=(1.0, 1.2), corr_length=(12.0, 16.0), slope_rms=0.4
)
ANGLES = np.deg2rad([0.0, 35.0, 80.0])


def run(surface, material=None, theta_i=ANGLES, **options):
    material = Material(0.958, 6.69) if material is None else material
    options = BINS | {"n_rays": 1000, "realizations": 8, "phi_i": 0.4} | options
    return simulate(Scene(surface, material), theta_i, **options)


def rays_in_bins(result):
    """Whole numbers of rays: every path of a perfect mirror carries 1."""
    flux = result.brdf.isel(stokes_out=0, stokes_in=0) * result.projected_solid_angle
    counts = flux.values * result.attrs["rays_per_direction"]
    assert_allclose(counts, np.rint(counts), atol=1e-6)
    return np.rint(counts)


@pytest.mark.parametrize(
    ("slope", "periodic"),
    [(slope, periodic) for slope in (0.05, 0.3, 0.47) for periodic in (True, False)],
)
@pytest.mark.filterwarnings("ignore:.*left the finite map sideways")
def test_walk_and_embree_send_the_same_rays_the_same_way(slope, periodic):
    drawn = GaussianSurface(
        shape=(200, 160), spacing=1.0, corr_length=16.0, slope_rms=slope
    )
    surface = HeightMap(drawn.sample(4).heights, 1.0, periodic=periodic)
    options = {"stokes": "unpolarized", "n_rays": 20_000, "material": Material.mirror()}
    options |= {"theta_i": np.deg2rad([10.0, 60.0])}
    # Facets give the single bounces otherwise
    options |= {"variance_reduction": False}
    walked = run(surface, skips=True, **options)
    traced = run(surface, skips=False, **options)
    rays = 2 * walked.attrs["rays_per_direction"]
    if periodic:
        elsewhere = np.abs(rays_in_bins(walked) - rays_in_bins(traced)).sum() / 2
        # Embree's rays are lifted by 1e-4 cell: beside some 3 cell lengths of edge a cell,
        # that many carry a ray past an edge on to another facet
        assert elsewhere <= 5e-4 * rays, elsewhere
    sides = np.subtract(
        walked.attrs["rays_left_sideways"], traced.attrs["rays_left_sideways"]
    )
    assert np.abs(sides).sum() <= 5e-4 * rays
    assert traced.attrs["self_hits"] == 0
    assert max(traced.attrs["rays_leaked"]) == 0
    assert max(walked.attrs["rays_leaked"]) == 0
    assert_allclose(walked.albedo, traced.albedo, atol=3e-4)


def test_walk_and_embree_agree_on_a_labelled_diffuse_surface():
    surface = SURFACE.sample(4)
    labels = (np.indices((128, 96)).sum(axis=0) % 16 < 8).astype(np.uint8)
    patched = HeightMap(surface.heights, surface.spacing, periodic=True, labels=labels)
    materials = [Material(1.5, diffuse_albedo=0.5), Material(0.958, 6.69)]
    options = {"material": materials, "theta_i": [1.0], "n_rays": 20_000}
    walked, traced = (run(patched, skips=skips, **options) for skips in (True, False))
    flux = (walked.brdf - traced.brdf) * walked.projected_solid_angle
    # Up to one ray in 2000 takes another way; a path carries at most 1
    assert np.abs(flux.isel(stokes_in=0, stokes_out=0)).sum() <= 2 * 5e-4
    assert_allclose(walked.albedo, traced.albedo, atol=3e-4)


@pytest.mark.parametrize("skips", [True, False])
@pytest.mark.parametrize("fixed", [True, False])
@pytest.mark.parametrize("phi_i", [0.4, "uniform"])
def test_any_number_of_workers_gives_the_same_bits(skips, fixed, phi_i):
    surface = SURFACE.sample(1) if fixed else SURFACE
    one, two, five = (
        run(surface, seed=11, workers=n, skips=skips, phi_i=phi_i, n_rays=320)
        for n in (1, 2, 5)
    )
    for other in (two, five):
        assert one.identical(other)


def test_seeds_differ_and_repeat():
    first, again, other = (run(SURFACE, seed=s) for s in (3, 3, 4))
    assert first.identical(again)
    assert (first.albedo != other.albedo).any()


@pytest.mark.parametrize(("stokes", "elements"), [("linear", 3), ("unpolarized", 1)])
@pytest.mark.parametrize("skips", [True, False])
def test_fewer_stokes_elements_are_the_corner_of_all(stokes, elements, skips):
    full = run(SURFACE, skips=skips)
    part = run(SURFACE, skips=skips, stokes=stokes)
    assert part.sizes["stokes_out"] == part.sizes["stokes_in"] == elements
    corner = full.isel(stokes_out=slice(elements), stokes_in=slice(elements))
    for name in ("brdf", "brdf_stderr", "brdf_total", "albedo", "absorbed"):
        assert_allclose(part[name], corner[name], rtol=1e-12, atol=1e-15)


@pytest.mark.filterwarnings("ignore:The tangent plane errs")
def test_wavelengths_together_equal_wavelengths_apart():
    waves = np.array([0.4, 0.55, 0.7])
    material = Material.from_table(
        wavelength=waves, n=[1.5, 0.9, 2.0], kappa=[0.0, 6.0, 0.3]
    )
    together = run(SURFACE, material, wavelength=waves, seed=2)
    assert together.brdf.dims[:3] == ("bounces", "theta_i", "wavelength")
    for k, wave in enumerate(waves):
        alone = run(SURFACE, material, wavelength=wave, seed=2)
        for name in ("brdf", "brdf_stderr", "albedo", "absorbed", "truncated"):
            assert_allclose(
                together[name].isel(wavelength=k), alone[name], rtol=1e-12, atol=1e-15
            )
    assert_allclose(alone.brdf, run(SURFACE, Material(2.0, 0.3), seed=2).brdf, rtol=1e-12)


def test_angles_together_see_the_same_surfaces_as_alone():
    """The mesh is shared; entry points of an angle may depend on its place in the list."""
    together = run(SURFACE, seed=5, theta_i=[0.3])
    alone = run(SURFACE, seed=5, theta_i=0.3)
    assert_array_equal(together.brdf, alone.brdf)


@pytest.mark.parametrize("phi_i", [0.0, 1.3])
def test_coarse_bins_are_sums_of_fine_ones(phi_i):
    """Bins nest where the number in azimuth is divided by an odd number.

    Those of rays; other bins are looked into by other looks.
    """
    options = {"phi_i": phi_i, "variance_reduction": False}
    coarse = run(SURFACE, n_theta=6, n_dphi=12, **options)
    fine = run(SURFACE, n_theta=18, n_dphi=36, **options)

    def flux(result):
        return (result.brdf_total * result.projected_solid_angle).transpose(
            "theta_i", "stokes_out", "stokes_in", "theta_s", "dphi"
        ).values  # fmt: skip

    by_three = (
        np.roll(flux(fine), 1, axis=-1).reshape(3, 4, 4, 6, 3, 12, 3).sum(axis=(4, 6))
    )
    assert_allclose(flux(coarse), by_three, rtol=1e-10, atol=1e-15)

"""Reciprocity, mirror symmetry, and the physics of every Mueller matrix."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from pbrdf import GaussianSurface, HeightMap, Material, Scene, simulate

GOLD_LIKE = Material(0.958, 6.69)
FLIPPED_BY_MIRROR = np.ones((4, 4))
for _row, _column in ((0, 2), (0, 3), (1, 2), (1, 3)):
    FLIPPED_BY_MIRROR[_row, _column] = FLIPPED_BY_MIRROR[_column, _row] = -1

# Coherency matrix of a Mueller matrix: sum of M_ij sigma_i x sigma_j* / 4 (Cloude)
PAULI = np.array(
    [[[1, 0], [0, 1]], [[1, 0], [0, -1]], [[0, 1], [1, 0]], [[0, -1j], [1j, 0]]]
)


def cloude_eigenvalues(mueller):
    """Eigenvalues (..., 4), rising, of the coherency matrices; their sum is M00."""
    kron = np.einsum("iab,jcd->ijacbd", PAULI, PAULI.conj()).reshape(4, 4, 4, 4)
    return np.linalg.eigvalsh(np.einsum("...ij,ijab->...ab", mueller, kron) / 4)


@settings(max_examples=25)
@given(
    st.floats(0.2, 4.0), st.floats(0.0, 8.0), st.floats(0.0, 0.9), st.floats(0, 6.2),
    st.floats(-0.2, 0.2), st.floats(-0.2, 0.2),
)  # fmt: skip
def test_b12_single_facet_is_pure_and_passive(n, kappa, theta_i, phi_i, slope_x, slope_y):
    x, y = np.arange(40)[:, None], np.arange(40)[None, :]
    surface = HeightMap(slope_x * x + slope_y * y, 1.0, periodic=False)
    result = simulate(
        Scene(surface, Material(n, kappa)), theta_i, phi_i=phi_i,
        n_rays=320, n_theta=2, n_dphi=2,
    )  # fmt: skip
    flux = result.brdf_total * result.projected_solid_angle
    mueller = flux.sum(("theta_s", "dphi")).values[0]
    if mueller[0, 0] < 1e-12:
        return
    eigenvalues = cloude_eigenvalues(mueller / mueller[0, 0])
    assert_allclose(eigenvalues, [0, 0, 0, 1], atol=1e-6)
    # Passive: no polarisation gains
    assert mueller[0, 0] + np.linalg.norm(mueller[0, 1:]) <= 1 + 1e-9


def test_b12_every_bin_is_a_sum_of_pure_matrices(measured):
    """Of rays to rounding; of looks less looks to far within the stated error."""
    surface = GaussianSurface(
        shape=(128, 128), spacing=1.0, corr_length=8.0, slope_rms=0.47
    )
    for reduced in (False, True):
        result = simulate(
            Scene(surface, GOLD_LIKE), np.deg2rad([20.0, 70.0]), n_rays=4000,
            realizations=8, phi_i=1.0, n_theta=18, n_dphi=36, variance_reduction=reduced,
        )  # fmt: skip
        for name in ("brdf", "brdf_total"):
            mueller, error = result[name].values, result[f"{name}_stderr"].values
            scale = mueller[..., 0, 0].clip(1e-300)
            what, bound = "over M00", 1e-9
            if reduced:
                # A cell of a bin may count less than nothing by chance
                scale = np.maximum(scale * 1e-6, error[..., 0, 0])
                what, bound = "over the error of M00", 1e-3
            lowest = cloude_eigenvalues(mueller) / scale[..., None]
            measured("B12", f"Cloude eigenvalues below 0, {what}", -lowest.min(), bound)
            excess = np.linalg.norm(mueller[..., 1:, 0], axis=-1) - mueller[..., 0, 0]
            assert (excess <= scale * (bound if reduced else 1e-12)).all()


def test_mirror_symmetry_of_an_isotropic_surface():
    """Two independent runs: within one, both sides of the plane share their surfaces.

    By rays: single bounces without them resolve the diagonal of the cells, which bends the
    law of the slopes by 1/(2 m²), m cells a correlation length; see the next test.
    """
    surface = GaussianSurface(
        shape=(256, 256), spacing=1.0, corr_length=16.0, slope_rms=0.3
    )
    one, other = (
        simulate(
            Scene(surface, GOLD_LIKE), np.deg2rad([15.0, 50.0]), n_rays=4000, seed=seed,
            realizations=64, phi_i=0.7, n_theta=9, n_dphi=12, variance_reduction=False,
        )
        for seed in (1, 2)
    )  # fmt: skip
    value, stderr = one.brdf_total.values, one.brdf_total_stderr.values
    mirrored = other.brdf_total.values[:, :, (-np.arange(12)) % 12] * FLIPPED_BY_MIRROR
    mirrored_error = other.brdf_total_stderr.values[:, :, (-np.arange(12)) % 12]
    lit = (stderr > 0) & (value[..., :1, :1] > 10 * stderr[..., :1, :1])
    lit &= mirrored_error > 0
    z = ((value - mirrored)[lit]) / np.hypot(stderr, mirrored_error)[lit]
    assert z.size > 1000
    assert np.abs(z).max() < 5
    # The flipped elements are there, far above the noise
    size = np.abs(value[..., 0, 2])[lit[..., 0, 2]] / stderr[..., 0, 2][lit[..., 0, 2]]
    assert size.max() > 20


@pytest.mark.parametrize("phi_i", [0.3, 1.2])
def test_a_mirror_along_the_diagonal_of_the_cells_changes_nothing(phi_i):
    """The symmetry that the mesh has: x and y exchanged, phi_i to pi/2 - phi_i."""
    surface = GaussianSurface(shape=(64, 64), spacing=1.0, corr_length=5.0, slope_rms=0.3)
    one, other = (
        simulate(
            Scene(surface, GOLD_LIKE), np.deg2rad([15.0, 60.0]), n_rays=1000, seed=seed,
            realizations=32, phi_i=azimuth, n_theta=6, n_dphi=12,
        )
        for seed, azimuth in ((1, phi_i), (2, np.pi / 2 - phi_i))
    )  # fmt: skip
    value, stderr = one.brdf_total.values, one.brdf_total_stderr.values
    mirrored = other.brdf_total.values[:, :, (-np.arange(12)) % 12] * FLIPPED_BY_MIRROR
    mirrored_error = other.brdf_total_stderr.values[:, :, (-np.arange(12)) % 12]
    error = np.hypot(stderr, mirrored_error)
    lit = (error > 1e-9 * value.max()) & (value[..., :1, :1] > 10 * stderr[..., :1, :1])
    z = (value - mirrored)[lit] / error[lit]
    assert z.size > 500
    assert np.abs(z).max() < 5.5


def average(scene, zeniths, target, seed):
    """Mean Mueller BRDF of sources spread over zenith angles, into a band of zenith bins.

    Both means weigh with cos(theta) sin(theta); shape (n_dphi, 4, 4).
    """
    result = simulate(
        scene, zeniths, n_rays=1500, realizations=8, seed=seed, n_theta=18, n_dphi=12,
        phi_i="uniform", variance_reduction=False,
    )  # fmt: skip
    over_source = result.brdf_total.weighted(
        np.cos(result.theta_i) * np.sin(result.theta_i)
    ).mean("theta_i")
    band = over_source.isel(theta_s=target)
    weight = result.projected_solid_angle.isel(theta_s=target, dphi=0)
    return band.weighted(weight).mean("theta_s").transpose("dphi", ...).values


def test_b13_reciprocity_of_10_and_60_degrees_with_matched_bins(measured):
    """Source and detector both cover 5..15 degrees, and 55..65: then the law is exact.

    By rays: single bounces without them tell the four zeniths of the source from a band.
    """
    surface = GaussianSurface(shape=(160, 160), spacing=1.0, corr_length=8.0, slope_rms=0.3)
    scene = Scene(surface, GOLD_LIKE)
    steps = (np.arange(4) + 0.5) / 4 * 10
    swap = np.diag([1.0, 1.0, -1.0, 1.0])
    there, back = [], []
    for seed in range(20):
        there.append(average(scene, np.deg2rad(5 + steps), slice(11, 13), 2 * seed))
        back.append(average(scene, np.deg2rad(55 + steps), slice(1, 3), 2 * seed + 1))
    there, back = np.array(there), np.array(back)
    # dphi -> -dphi, transpose, P M P
    back = np.roll(back[:, ::-1], 1, axis=1).swapaxes(-1, -2)
    back = swap @ back @ swap
    difference = there.mean(axis=0) - back.mean(axis=0)
    stderr = np.sqrt((there.var(axis=0, ddof=1) + back.var(axis=0, ddof=1)) / 20)
    value = there.mean(axis=0)
    lit = np.abs(value[:, 0, 0]) > 5 * stderr[:, 0, 0]
    assert lit.sum() >= 10
    z = (difference / stderr)[lit]
    # 38 degrees of freedom a number; false-alarm level of the largest about 0.002
    what = "reciprocity of 10 and 60 degrees: largest deviation [standard errors]"
    measured("B13", what, np.abs(z).max(), 5)
    assert 0.4 < np.mean(z**2) < 1.9
    # An element that the law moves and flips is well seen
    assert np.abs(value / stderr)[:, 2, 1].max() > 10


@pytest.mark.parametrize("phi_i", [0.0, 2.0])
def test_a_turn_of_the_whole_scene_changes_nothing(phi_i):
    """Isotropic surfaces: the source's azimuth does not matter, as far as rays tell."""
    surface = GaussianSurface(shape=(128, 128), spacing=1.0, corr_length=8.0, slope_rms=0.3)
    options = {"n_rays": 2000, "realizations": 48, "n_theta": 6, "n_dphi": 8}
    options["variance_reduction"] = False
    fixed = simulate(Scene(surface, GOLD_LIKE), 0.9, phi_i=phi_i, seed=1, **options)
    spread = simulate(Scene(surface, GOLD_LIKE), 0.9, phi_i="uniform", seed=2, **options)
    stderr = np.hypot(fixed.brdf_total_stderr, spread.brdf_total_stderr)
    z = ((fixed.brdf_total - spread.brdf_total) / stderr).values
    lit = (fixed.brdf_total > 10 * fixed.brdf_total_stderr).values[..., :1, :1]
    z = z[np.broadcast_to(lit, z.shape) & (stderr.values > 0)]
    assert z.size > 300
    assert np.abs(z).max() < 5

"""What every wave form owes to physics: reciprocity, mirror symmetry, realisability."""

import warnings

import numpy as np
import pytest

from pbrdf import AccuracyWarning, Material, WaveModel
from pbrdf.optics import coherency_eigenvalues
from pbrdf.wave import METHODS

MATERIALS = {
    "glass": Material(1.5),
    "metal": Material(1.2, 6.9),
    "mirror": Material.mirror(),
    "matched": Material.black(),
}
ROUGHNESS = {"polished": (0.01, 1.0), "satin": (0.12, 0.9), "rough": (1.5, 9.0)}
SURFACES = [
    {"autocorrelation": "exponential"},
    {"autocorrelation": "gaussian"},
    {"autocorrelation": "k-correlation", "exponent": 3.6},
]


def directions(count: int, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Random geometries, with the special ones among them."""
    rng = np.random.default_rng(seed)
    theta_i, theta_s = rng.uniform(0, 1.55, (2, count))
    dphi = rng.uniform(0, 2 * np.pi, count)
    theta_s[:20] = theta_i[:20]
    dphi[:10], dphi[10:20] = np.pi, 0.0
    theta_i[20:30] = 0.0
    theta_s[26:36] = 0.0
    return theta_i, theta_s, dphi


def check_laws(model: WaveModel, seed: int) -> None:
    theta_i, theta_s, dphi = directions(300, seed)
    found = model.brdf(theta_i, theta_s, dphi, 0.6)
    scale = np.maximum(found[:, :1, :1], 1e-250)
    assert np.isfinite(found).all()

    back = model.brdf(theta_s, theta_i, -dphi, 0.6)
    p = np.diag([1.0, 1.0, -1.0, 1.0])
    assert (np.abs(back - p @ found.swapaxes(1, 2) @ p) / scale).max() < 2e-12

    mirrored = model.brdf(theta_i, theta_s, -dphi, 0.6)
    flip = np.ones((4, 4))
    flip[:2, 2:] = flip[2:, :2] = -1
    assert (np.abs(mirrored - flip * found) / scale).max() < 1e-12
    assert coherency_eigenvalues(found / scale).min() > -1e-13


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("roughness", ROUGHNESS)
@pytest.mark.parametrize("material", MATERIALS)
def test_gaussian_surfaces_obey_the_laws(material, roughness, method) -> None:
    height, length = ROUGHNESS[roughness]
    check_laws(
        WaveModel(
            MATERIALS[material], height_rms=height, corr_length=length, method=method
        ),
        seed=3,
    )


@pytest.mark.parametrize("surface", SURFACES, ids=lambda s: s["autocorrelation"])
def test_other_surfaces_obey_the_laws(surface) -> None:
    for method in ("auto", "order-weighted"):
        check_laws(
            WaveModel(
                MATERIALS["metal"],
                height_rms=0.03,
                corr_length=1.1,
                method=method,
                **surface,
            ),
            seed=5,
        )


@pytest.mark.filterwarnings("ignore:The beam is known to second order")
def test_the_mean_field_is_a_mueller_matrix_of_its_own() -> None:
    theta = np.linspace(0.0, 1.5, 7)
    for material in MATERIALS.values():
        model = WaveModel(material, height_rms=0.05, corr_length=0.5)
        found = model.coherent(theta, 0.6)
        assert coherency_eigenvalues(found).min() > -1e-15
        assert (found[:, 0, 0] + np.abs(found[:, 0, 1]) <= 1.0).all()


@pytest.mark.parametrize("material", MATERIALS)
@pytest.mark.parametrize("roughness", [(0.003, 0.1), (0.1, 0.9)])
def test_light_along_the_surface_obeys_the_laws(material, roughness) -> None:
    """Where waves have almost no normal part, and so few digits."""
    height, length = roughness
    model = WaveModel(MATERIALS[material], height_rms=height, corr_length=length)
    low = np.pi / 2 - np.array([0.0, 1e-9, 1e-6, 1e-4])
    theta_i, theta_s = (a.ravel() for a in np.meshgrid(low, np.r_[low, 0.0, 0.7]))
    dphi = np.resize([2.9, 0.8, np.pi, 0.0, 5.0], theta_i.size)
    found = model.brdf(theta_i, theta_s, dphi, 0.6)
    back = model.brdf(theta_s, theta_i, -dphi, 0.6)
    scale = np.maximum(found[:, :1, :1], 1e-250)
    p = np.diag([1.0, 1.0, -1.0, 1.0])
    assert (np.abs(back - p @ found.swapaxes(1, 2) @ p) / scale).max() < 1e-12
    assert coherency_eigenvalues(found / scale).min() > -1e-13


@pytest.mark.parametrize("material", MATERIALS)
def test_the_beam_is_no_brighter_than_light(material) -> None:
    """Far beyond second order, too; it said up to 76 times the light."""
    theta = np.r_[0.0, 0.8, 1.3, 1.5, np.pi / 2 - np.array([1e-3, 1e-7, 0.0])]
    for height, length, form in ((0.1, 0.15, "gaussian"), (3.0, 3.0, "exponential")):
        model = WaveModel(
            MATERIALS[material], height_rms=height, corr_length=length, autocorrelation=form
        )
        for wavelength in (0.5, 20.0):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", AccuracyWarning)
                found = model.coherent(theta, wavelength)
                rough = WaveModel(
                    MATERIALS[material],
                    height_rms=height,
                    corr_length=(length, 0.4 * length),
                )
                turned = rough.coherent(theta, wavelength, phi_i=0.3)
            assert (turned[:, 0, 0] <= 1.0 + 1e-12).all()
            most = np.linalg.norm(turned[:, 0, 1:], axis=1) + turned[:, 0, 0]
            assert (most <= 1.0 + 1e-12).all()
            assert np.isfinite(found).all()
            assert (found[:, 0, 0] + np.abs(found[:, 0, 1]) <= 1.0 + 1e-12).all()
    if material == "metal":
        with pytest.warns(AccuracyWarning, match="no small change"):
            model.coherent(1.3, 20.0)

"""Readings through what light goes through: counted rays against closed forms."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf import (
    Drops,
    Film,
    GaussianSurface,
    HeightMap,
    Material,
    MeshSurface,
    Scene,
    observe,
)
from tests.meshes.shapes import joined

ROUGH = GaussianSurface(shape=(24, 20), spacing=0.5, corr_length=2.0, slope_rms=0.4)
METAL = Material(1.4, 0.8)
SCAN = {
    "theta_i": np.array([0.6, 0.6, 0.3]),
    "theta_s": np.array([0.5, 0.3, 0.9]),
    "dphi": np.array([2.7, 1.2, 4.0]),
    "phi_i": 0.3,
    "source_half_angle": 0.15,
    "detector_half_angle": 0.2,
    "estimator": "count",
}


def pane(period, low, high):
    """A closed layer that fills a period, from one height to another."""
    lx, ly = period
    square = np.array([[0.0, 0.0], [lx, 0.0], [lx, ly], [0.0, ly]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    top, base = (np.column_stack([square, np.full(4, z)]) for z in (high, low))
    return joined((top, faces), (base, faces[:, ::-1]))


def test_a_pane_of_index_one_changes_no_reading_of_the_ground_below():
    """The same 16 elements by beams with their media, and by paths over the facets."""
    bare = MeshSurface.of_map(ROUGH.sample(2))
    top = bare.bounds[1, 2]
    vertices, faces = joined(
        (bare.vertices, bare.faces), pane(bare.period, top + 0.5, top + 1.0)
    )
    labels = np.repeat([0, 1], [len(bare.faces), 4])
    under = MeshSurface((vertices, faces), bare.period, labels, transparent=[1])
    seen = observe(Scene(bare, METAL), start="source", n_rays=60_000, **SCAN)
    through = observe(Scene(under, [METAL, Material(1.0)]), n_rays=60_000, **SCAN)
    assert through.attrs["rays_leaked"] == 0
    assert through.attrs["start"] == "source"
    combined = np.hypot(seen.brdf_total_stderr, through.brdf_total_stderr)
    assert (np.abs(through.brdf_total - seen.brdf_total) < 4.5 * combined + 1e-12).all()
    # The frames matter: elements that change sign with them stand far out of the noise
    signed = np.abs(through.brdf_total) > 10.0 * combined
    for element in ("IQ", "QI", "QU", "UQ", "QQ", "UU", "VV"):
        out, into = element
        assert signed.sel(stokes_out=out, stokes_in=into).any(), element


def amplitudes(cos_in, before, behind):
    """Reflection of s and p at an interface, from the text of the conventions."""
    ratio = behind / before
    cos_out = np.sqrt(1.0 - (1.0 - cos_in**2) / ratio**2 + 0j)
    r_s = (cos_in - ratio * cos_out) / (cos_in + ratio * cos_out)
    r_p = (ratio * cos_in - cos_out) / (ratio * cos_in + cos_out)
    return r_s, r_p, cos_out


def test_a_flat_film_shows_the_source_by_the_powers_of_its_two_faces():
    """All orders inside of the film leave into the detector, which holds all of them."""
    theta, index, base = 0.7, 1.4, 1.5 + 0.9j
    outer = amplitudes(np.cos(theta), 1.0, index)
    inner = amplitudes(outer[2], index, base)
    first, second = (np.abs(np.array(one[:2])) ** 2 for one in (outer, inner))
    r_s, r_p = first + (1.0 - first) ** 2 * second / (1.0 - first * second)
    scene = Scene(
        HeightMap.flat(), Material(1.5, 0.9), Film(thickness=20.0, material=Material(index))
    )
    seen = observe(
        scene, theta, theta, np.pi, estimator="count", n_rays=20_000,
        source_half_angle=0.005, detector_half_angle=0.05,
    )  # fmt: skip
    power = seen.brdf_total[0] * seen.detector_solid_angle.item()
    error = seen.brdf_total_stderr[0, 0, 0] * seen.detector_solid_angle.item()
    # Beams that chance ends make the noise; the cone of the source bends R by its square
    expected = 0.5 * np.array([[r_s + r_p, r_s - r_p], [r_s - r_p, r_s + r_p]])
    assert_allclose(power[:2, :2], expected, atol=4 * error.item() + 2e-5)
    assert abs(power[0, 1].item()) > 0.04


def test_what_goes_through_bodies_is_counted_only():
    drops = Drops.at([(5.0, 4.0)], volume=4.0, contact_angle=1.2, material=Material(1.33))
    scene = Scene(HeightMap.flat(size=(10.0, 8.0)), METAL, drops)
    with pytest.raises(ValueError, match='estimator must be "count" where light goes'):
        observe(scene, 0.3, 0.2, 0.0, wavelength=0.5)
    seen = observe(scene, 0.3, 0.2, 0.0, n_rays=3200, estimator="count")
    assert seen.attrs["further_bounces"] == "counted"
    # Bodies may catch light for long
    assert seen.attrs["max_bounces"] == 1024

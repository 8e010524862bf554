"""Films that are thin and absorb: the warning, with the wave solution beside."""

import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf import Film, HeightMap, Material, Scene, simulate
from pbrdf.tracer.thin_films import coherent_reflectance, incoherent_reflectance
from tests.slab_reference import airy, slab

BASES = {"mirror": np.inf, "glass": 1.62, "aluminium": 0.95 + 6.4j}


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("theta", [0.0, 0.8, 1.3])
def test_both_reflectances_of_a_flat_film(base, theta):
    index = complex(BASES[base])
    given = (np.inf, 0.0) if base == "mirror" else (index.real, index.imag)
    below = np.inf if base == "mirror" else index
    for n, kappa, thickness in ((1.33, 0.0, 0.4), (1.4, 0.3, 0.1), (1.2, 4.0, 0.02)):
        film = (n, kappa)
        powers = slab(theta, complex(*film), below, thickness, 0.6)[0, 0]
        waves = np.mean(airy(theta, complex(*film), below, thickness, 0.6))
        args = (theta, film, given, thickness, 0.6)
        assert_allclose(incoherent_reflectance(*args), powers, rtol=1e-9)
        assert_allclose(coherent_reflectance(*args), waves, rtol=1e-9)


def notes_of(film, wavelength=0.6):
    scene = Scene(HeightMap.flat(), Material(1.62), film)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        result = simulate(scene, [0.1, 0.9], wavelength=wavelength, n_rays=64)
    said = result.attrs["warnings"]
    found = [note for note in said if "waves overlap" in note]
    # Once is enough
    assert len(found) + sum("it interferes" in note for note in said) == 1
    return found


def test_the_warning_gives_both_values():
    (note,) = notes_of(Film(thickness=0.1, material=Material(1.4, 0.3)))
    found = max(
        (slab(t, 1.4 + 0.3j, 1.62, 0.1, 0.6)[0, 0] for t in (0.1, 0.9)),
        key=lambda traced: abs(traced),
    )
    waves = np.mean(airy(0.9, 1.4 + 0.3j, 1.62, 0.1, 0.6))
    assert f"{found:.4g} as traced and {waves:.4g} by its waves" in note
    assert "optical depth of 0.63" in note


@pytest.mark.parametrize(
    ("kappa", "thickness"), [(0.04, 0.1), (0.3, 0.2), (0.0, 0.1)], ids=str
)
def test_no_warning_for_weak_or_deep_absorbers(kappa, thickness):
    assert notes_of(Film(thickness=thickness, material=Material(1.4, kappa))) == []

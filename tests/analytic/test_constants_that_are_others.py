"""Columns of constants that a unit, a remark or a state of the sample makes others."""

# One table a line
# ruff: noqa: E501

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf import materials
from pbrdf.errors import DataFileError

WAVES = np.array([400.0, 600.0, 800.0])
INDEX, KAPPA = np.array([1.6, 1.5, 1.4]), np.array([0.3, 0.2, 0.1])


def table(head, *columns, mark=","):
    rows = zip(*columns, strict=True)
    return "\n".join([head, *(mark.join(map(str, row)) for row in rows)]) + "\n"


def read(tmp_path, text, **more):
    (tmp_path / "paint.csv").write_text(text, encoding="utf-8")
    return materials.read(tmp_path / "paint.csv", **more)


UNITS = [
    "1/mm", "um^-1", "1/um", "mm^-1", "m^-1", "nm^-1", "cm^-1", "cm", "%", "x1000", "*10^3",
    "10^-3", "E-3", "1e-3", "dB/cm", "[1/m]", "mm⁻¹",
]  # fmt: skip


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("units", ["nm;-;{}", "nm;;{}"])
def test_a_unit_below_k_is_refused(tmp_path, unit, units):
    text = table(
        f"Wavelength;n;k\n{units.format(unit)}", WAVES, INDEX, 10 * KAPPA, mark=";"
    )
    with pytest.raises(
        DataFileError, match=r"line 2, column k: expected a number without a unit, got "
    ) as error:
        read(tmp_path, text)
    assert repr(unit) in str(error.value)
    assert ("k = a wavelength/(4 pi)" in str(error.value)) == ("m" in unit)
    assert ("divide by 4.343" in str(error.value)) == ("dB" in unit)


def test_the_cure_of_an_absorption_coefficient(tmp_path):
    """A thickness of 1/a lets 1/e of the power through: k = a wavelength / (4 pi)."""
    per_mm = 4 * np.pi * KAPPA / (WAVES * 1e-6)
    cured = per_mm * WAVES * 1e-6 / (4 * np.pi)
    material = read(tmp_path, table("Wavelength;n;k\nnm;-;", WAVES, INDEX, cured, mark=";"))
    assert_allclose(material.indices(WAVES / 1e3)[1], KAPPA)


@pytest.mark.parametrize(
    "head",
    [
        "Wavelength,n,k\nnm,-,-", "Wavelength,n,k\n[nm],[-],[-]", "wavelength_nm,n,k\nnm,,",
        "wavelength_nm,n,k\n-,-,1", "sep=,\nwavelength_nm,n,k", "Wavelength,n,k\nnm,1,1",
        "# N = n + i k, not n(1 + a)\nwavelength_nm,n,k",
    ],
)  # fmt: skip
def test_numbers_without_units_are_read(tmp_path, head):
    assert_allclose(
        read(tmp_path, table(head, WAVES, INDEX, KAPPA)).indices(WAVES / 1e3),
        (INDEX, KAPPA),
    )


@pytest.mark.parametrize(
    "law",
    ["N = n(1 - i k)", "complex index n(1+i kappa)", "n*(1 - j*k)", "N = n (1 \u2212 ik)"],
)
def test_an_attenuation_index_is_no_kappa(tmp_path, law):
    text = table(f"# {law}\nwavelength_nm,n,k", WAVES, INDEX, KAPPA / INDEX)
    with pytest.raises(
        DataFileError,
        match=r"line 1: expected k of N = n \+ i k, a remark says 'n.*Write n times k",
    ):
        read(tmp_path, text)
    cured = table("# N = n + i k\nwavelength_nm,n,k", WAVES, INDEX, INDEX * (KAPPA / INDEX))
    assert_allclose(read(tmp_path, cured).indices(WAVES / 1e3), (INDEX, KAPPA))
    # Without a k there is nothing to define
    assert_allclose(
        read(tmp_path, table(f"# {law}\nwavelength_nm,n", WAVES, INDEX)).indices(
            WAVES / 1e3
        )[0],
        INDEX,
    )


def test_rows_of_two_temperatures_are_not_one_material(tmp_path):
    waves = np.arange(400, 810, 10)
    index = 1.6 - 0.2 * (waves - 400) / 400
    hot = np.arange(waves.size) % 2 == 1
    state = np.where(hot, 600, 293)
    head = "wavelength_nm,n,k,T"
    text = table(head, waves, index + 0.3 * hot, 0 * waves, state)
    with pytest.raises(
        DataFileError,
        match=r"column T: expected rows of one T, which is left out, got 293, 600: n changes",
    ) as error:
        read(tmp_path, text, ignore=["T"])
    assert "Keep the rows of one T" in str(error.value)
    cold = table(head, waves[~hot], index[~hot], 0 * waves[~hot], state[~hot])
    assert_allclose(
        read(tmp_path, cold, ignore=["T"]).indices(waves[~hot] / 1e3)[0], index[~hot]
    )
    # What does not matter, and what takes turns by itself, is left out as before
    noise = 0.01 * np.random.default_rng(7).normal(size=waves.size)
    for values in (index, index + noise):
        assert_allclose(
            read(
                tmp_path, table(head, waves, values, 0 * waves, state), ignore=["T"]
            ).indices(waves / 1e3)[0],
            values,
        )

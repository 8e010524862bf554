"""Scans of one side of the normal, read with forward and backward exchanged."""

import numpy as np
import pytest
import xarray as xr

from data_io import write_goniometer
from fitting import PhysicsError, check_scan, fit
from pbrdf import Material, MicrofacetModel
from pbrdf.cli import main


def one_side(side, *, slope=0.25, albedo=0.4, stated=True, noise=0.02, incidences=(30, 60)):
    """A scan of one side, as it should be read and as it should not, and its model."""
    model = MicrofacetModel(
        Material(1.5), slope_rms=slope, specular_gain=0.9, diffuse_albedo=albedo
    )
    theta_i, theta_s = (
        np.radians(a.ravel()) for a in np.meshgrid(incidences, np.arange(0, 76, 5))
    )
    dphi = np.full(theta_i.size, np.pi if side > 0 else 0.0)
    m00 = model.brdf(theta_i, theta_s, dphi)[:, 0, 0]
    spread = noise * m00
    m00 = m00 + spread * np.random.default_rng(3).standard_normal(m00.size)
    angles = {"theta_i": theta_i, "theta_s": theta_s, "dphi": dphi}
    coords = {name: ("geometry", values) for name, values in angles.items()}
    scan = xr.Dataset({"M00": ("geometry", m00)}, coords)
    if stated:
        scan["M00_stderr"] = "geometry", spread
    return scan, scan.assign_coords(dphi=np.pi - scan.dphi), model


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("stated", [True, False])
def test_a_scan_that_fits_the_other_side_is_poor_and_names_the_option(side, stated):
    right, turned, model = one_side(side, stated=stated)
    result = fit(right, model)
    assert result.misfit.verdict == "good"
    assert not result.fits_the_other_side
    wrong = fit(turned, model)
    assert wrong.misfit.verdict == "poor"
    assert "fit far better" in wrong.warnings[0]
    assert "--azimuth-of-forward" in wrong.warnings[0]
    assert ("forward side, and" in wrong.warnings[0]) == (side < 0)
    # Said to be meant, it is judged by its misfit alone
    assert not fit(turned, model, accept=("exchanged",)).fits_the_other_side


@pytest.mark.parametrize("albedo", [0.0, 0.1, 0.4])
@pytest.mark.parametrize("slope", [0.05, 0.15, 0.4, 0.7])
def test_a_scan_read_right_raises_no_doubt(slope, albedo):
    for side in (1, -1):
        right, _, model = one_side(side, slope=slope, albedo=albedo, stated=False)
        assert not any(one.name == "exchanged" for one in check_scan(right))
        assert not fit(right, model).fits_the_other_side


def test_near_the_normal_and_with_both_sides_nothing_is_compared():
    right, turned, model = one_side(1, incidences=(5,))
    assert not fit(turned, model).fits_the_other_side
    both = xr.concat([right, turned], "geometry")
    assert not fit(both, model, accept=("all",)).fits_the_other_side


def test_a_lobe_on_the_side_of_the_source_is_an_error_of_physics(tmp_path, capsys):
    right, turned, model = one_side(1, slope=0.1, albedo=0.1)
    with pytest.raises(PhysicsError, match=r"\[exchanged\].*brighter than at its ends"):
        fit(turned, model)
    write_goniometer(right, tmp_path / "scan.csv")
    words = ["--azimuth-of-forward", "0"]
    assert main(["check", str(tmp_path / "scan.csv"), *words]) == 1
    assert main(["check", str(tmp_path / "scan.csv")]) == 0
    assert "[exchanged]" in capsys.readouterr().out


def test_a_reading_along_the_normal_has_no_side():
    right, _, model = one_side(-1)
    normal = right.theta_s < 1e-9
    # As signed views of 0 are read
    right = right.assign_coords(dphi=np.where(normal, np.pi, right.dphi) + 0 * right.dphi)
    turned = right.assign_coords(dphi=np.mod(right.dphi + np.pi, 2 * np.pi))
    assert "forward side, and" in fit(turned, model).warnings[0]
    wrong, _, _ = one_side(1)
    wrong = wrong.assign_coords(dphi=np.where(normal, np.pi, 0.0) + 0 * wrong.dphi)
    assert "all readings lie on the source's side" in fit(wrong, model).warnings[0]

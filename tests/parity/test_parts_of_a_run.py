"""Directions simulated some at a time are those of the whole run, bit for bit."""

import numpy as np
import pytest
import xarray as xr

import pbrdf
from pbrdf.errors import AccuracyWarning
from pbrdf.simulation import simulate_parts

ANGLES = np.linspace(0.0, 1.3, 5)


def rough(slope_rms: float) -> pbrdf.GaussianSurface:
    return pbrdf.GaussianSurface(
        shape=(64, 64), spacing=1.0, corr_length=8.0, slope_rms=slope_rms
    )


GLASS = pbrdf.Material(1.5)
WATER = pbrdf.Drops(
    contact_angle=1.0, volume_per_area=1.0, number_density=2e-3,
    material=pbrdf.Material(1.33),
)  # fmt: skip
RUNS = {
    "looks": (
        pbrdf.Scene(rough(0.3), GLASS), {"realizations": 9, "wavelength": [0.5, 0.6]},
    ),
    # Nothing hides anything at some angles, something at others
    "hardly rough": (pbrdf.Scene(rough(0.05), GLASS), {"realizations": 4}),
    "spectrum": (
        pbrdf.Scene(rough(0.3), GLASS),
        {"realizations": 4, "wavelength": np.linspace(0.4, 0.8, 6)},
    ),
    "azimuths and a disc": (
        pbrdf.Scene(rough(0.3).sample(1), pbrdf.Material(1.5, diffuse_albedo=0.3)),
        {"source_half_angle": 0.02, "phi_i": [0.0, 1.0]},
    ),
    "drops": (
        pbrdf.Scene(rough(0.3), GLASS, WATER),
        {"realizations": 4, "phi_i": "uniform", "fold": True},
    ),
    "one surface": (pbrdf.Scene(rough(0.3), GLASS), {"realizations": 1, "n_rays": 320}),
}  # fmt: skip

FEW = (
    pbrdf.Scene(rough(0.3).sample(1), pbrdf.Material(1.5, diffuse_albedo=0.3)),
    {"wavelength": [0.5, 0.6, 0.7], "phi_i": [0.0, 1.0]},
)


@pytest.mark.filterwarnings("ignore::pbrdf.errors.AccuracyWarning")
@pytest.mark.parametrize("name", RUNS)
def test_parts_are_those_of_the_whole(name):
    scene, given = RUNS[name]
    given = {"n_theta": 9, "n_dphi": 12, "n_rays": 640, "workers": 2, **given}
    whole = pbrdf.simulate(scene, ANGLES, **given)
    parts = list(simulate_parts(scene, ANGLES, at_once=2, **given))
    assert [part.sizes["theta_i"] for part in parts] == [2, 2, 1]
    for variable in whole.variables:
        dims = whole[variable].dims
        if "theta_i" in dims:
            put = np.concatenate([p[variable].values for p in parts], dims.index("theta_i"))
            np.testing.assert_array_equal(put, whole[variable].values, str(variable))
    assert sum(p.attrs["path_segments"] for p in parts) == whole.attrs["path_segments"]


@pytest.mark.filterwarnings("ignore::pbrdf.errors.AccuracyWarning")
@pytest.mark.parametrize("name", ["looks", "spectrum", "few over a map", "drops"])
def test_wavelengths_apart_are_those_of_the_whole(name):
    scene, given = RUNS.get(name, FEW)
    if name == "drops":
        given = {**given, "wavelength": [0.5, 0.55, 0.7]}
    given = {"n_theta": 9, "n_dphi": 12, "n_rays": 640, "workers": 2, **given}
    whole = pbrdf.simulate(scene, ANGLES[:3], **given)
    waves = whole.sizes["wavelength"]
    by = 1 if waves < 4 else 4
    parts = list(simulate_parts(scene, ANGLES[:3], at_once=2, waves_at_once=by, **given))
    groups = -(-waves // by)
    assert len(parts) == 2 * groups
    assert parts[1].encoding["first"] == {"theta_i": 0, "wavelength": by}
    for variable in whole.variables:
        rows = [
            joined(parts[groups * k : groups * (k + 1)], variable, "wavelength")
            for k in (0, 1)
        ]
        put = rows[0]
        if "theta_i" in put.dims:
            put = xr.Variable.concat(rows, "theta_i").transpose(*put.dims)
        np.testing.assert_array_equal(put, whole[variable].values, str(variable))


def joined(parts, name, dim):
    first = parts[0][name].variable
    if dim not in first.dims:
        return first
    return xr.Variable.concat([p[name].variable for p in parts], dim).transpose(*first.dims)


def test_a_target_is_for_all_directions_together():
    with pytest.raises(ValueError, match="target_rel_error must be left out here"):
        next(simulate_parts(RUNS["looks"][0], ANGLES, target_rel_error=0.1))


def test_progress_counts_on(monkeypatch):
    heard = []
    scene, given = RUNS["hardly rough"]
    with pytest.warns(AccuracyWarning, match="too few"):
        list(
            simulate_parts(
                scene, ANGLES[:3], at_once=2, n_theta=4, n_dphi=4, n_rays=64, workers=1,
                progress=lambda done, total: heard.append((done, total)), **given,
            )
        )  # fmt: skip
    assert heard == [(k, 8) for k in range(1, 9)]

"""Points that differ in material alone share a trace, and are what they are alone."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_array_equal

from pbrdf.simulation import parts, run, simulate_together
from pbrdf.sweeps import load_sweep, run_sweep
from tests.sweeps.scenes import SCENE, SWEEP, by_points, opened, written

pytestmark = pytest.mark.filterwarnings("ignore:.*:pbrdf.AccuracyWarning")
LIST = """
scene = "scene.toml"
[design]
kind = "list"
[vary]
"surface.slope_rms" = [0.1, 0.1, 0.1, 0.3]
"substrate.material" = ["bk7", "gold", "bk7", "bk7"]
wavelength_um = [0.5, 0.5, 0.7, 0.5]
[simulate]
n_rays = 200
realizations = 8
n_theta = 6
n_dphi = 8
"""


@pytest.fixture
def traces(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many indices each trace served."""
    counted: list[int] = []
    for module in (parts, run):
        traced = module.trace_samples

        def counting(ready: Any, plans: Any, single: Any, traced: Any = traced) -> Any:
            counted.append(len(plans[0].n))
            return traced(ready, plans, single)

        monkeypatch.setattr(module, "trace_samples", counting)
    return counted


def both_ways(
    folder: Path, sweep: str, scene: str, traces: list[int]
) -> tuple[xr.Dataset, xr.Dataset, list[int]]:
    """Store of shared traces, store point by point, and what the traces served."""
    few = sweep.replace("[0.05, 0.1, 0.2]", "[0.1, 0.2]") + "phi_i_deg = 10\n"
    described = load_sweep(written(folder, few, scene))
    with by_points():
        run_sweep(described, folder / "alone.zarr", workers=1)
    traces.clear()
    run_sweep(described, folder / "joint.zarr", workers=1)
    # The first one told the shapes
    return opened(folder / "joint.zarr"), opened(folder / "alone.zarr"), traces[1:]


@pytest.mark.parametrize("more", ["", "variance_reduction = false\n", 'wave = "auto"\n'])
def test_materials_of_a_grid_share_a_trace_bit_for_bit(
    tmp_path: Path, traces: list[int], more: str
) -> None:
    text = SWEEP.replace("n = [1.4, 1.6]", "n = [1.4, 2.2]\nkappa = [0.0, 1.5]")
    text += more + ("wavelength_um = 0.2\n" if "wave" in more else "")
    joint, alone, served = both_ways(tmp_path, text, SCENE, traces)
    assert served == [4, 4]
    for name in alone.variables:
        assert_array_equal(joint[name], alone[name], err_msg=str(name))
    assert joint.attrs["warnings"] == alone.attrs["warnings"]


def test_a_list_shares_traces_among_points_of_one_surface(
    tmp_path: Path, traces: list[int]
) -> None:
    scene = SCENE.replace("n = 1.5", 'material = "bk7"')
    joint, alone, served = both_ways(tmp_path, LIST, scene, traces)
    assert served == [3, 1]
    assert_array_equal(joint.brdf_total, alone.brdf_total)
    assert_array_equal(joint.brdf_stderr, alone.brdf_stderr)
    assert np.unique(joint.albedo.sum("bounces")).size == 4


def test_spectra_share_a_trace_within_what_sums_by_bin_keep_to(
    tmp_path: Path, traces: list[int]
) -> None:
    text = SWEEP.replace("n = [1.4, 1.6]", 'material = ["bk7", "gold"]')
    text += "wavelength_um = [0.5, 0.55, 0.6, 0.65]\n"
    scene = SCENE.replace("n = 1.5", 'material = "bk7"')
    joint, alone, served = both_ways(tmp_path, text, scene, traces)
    assert served == [8, 8]
    apart = np.abs(joint.brdf_total - alone.brdf_total).max(["stokes_out", "stokes_in"])
    assert (apart <= 2e-8 * alone.brdf_total[..., 0, 0]).all()
    assert float(alone.brdf_total[..., 0, 0].max()) > 0


def test_a_material_that_cannot_be_leaves_the_others_as_they_are(
    tmp_path: Path, traces: list[int]
) -> None:
    """The library knows no PVC so far out: the point fails, its neighbours do not."""
    text = SWEEP.replace("n = [1.4, 1.6]", 'material = ["bk7", "gold", "pvc"]')
    text += "wavelength_um = 0.35\n"
    scene = SCENE.replace("n = 1.5", 'material = "bk7"')
    joint, alone, served = both_ways(tmp_path, text, scene, traces)
    assert joint.state.values.tolist() == alone.state.values.tolist()
    assert joint.state.values.tolist() == [[1, 1, 2]] * 2
    assert_array_equal(joint.brdf_total, alone.brdf_total)
    assert set(served) == {1}


def test_films_and_target_errors_have_traces_of_their_own(tmp_path: Path) -> None:
    wet = SCENE + '[[contaminants]]\ntype = "film"\nthickness_um = 5\n'
    wet += "material = { n = 1.33 }\n"
    assert load_sweep(written(tmp_path, scene=wet)).joint == ()
    towards = SWEEP + "target_rel_error = 0.1\n"
    assert load_sweep(written(tmp_path, towards)).joint == ()
    names = [axis.name for axis in load_sweep(written(tmp_path)).joint]
    assert names == ["n"]


def test_lights_that_need_other_paths_are_refused() -> None:
    import pbrdf

    flat = pbrdf.HeightMap.flat(size=(1.0, 1.0))
    glass, paint = pbrdf.Material(1.5), pbrdf.Material(1.5, diffuse_albedo=0.5)
    with pytest.raises(ValueError, match=r"lights must be of opaque .* at index 1"):
        simulate_together(flat, 0.1, [(glass, None), (paint, None)], n_rays=320)
    with pytest.raises(ValueError, match=r"target_rel_error must be left out"):
        simulate_together(flat, 0.1, [(glass, None)], target_rel_error=0.1)

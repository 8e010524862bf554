"""What a sweep file says: paths, designs and settings, and what is refused."""

import re
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pbrdf.errors import DataFileError
from pbrdf.sweeps import Sweep, load_sweep
from tests.sweeps.scenes import SCENE, SWEEP, written

DROPS = (
    SCENE
    + """
[[contaminants]]
type = "drops"
contact_angle_deg = 60
coverage = 0.1
number_density_per_mm2 = 4000
material = { n = 1.333 }
"""
)


def with_vary(folder: Path, lines: str, more: str = "", scene: str = SCENE) -> Sweep:
    path = written(folder, f'scene = "scene.toml"\n[vary]\n{lines}\n{more}', scene)
    return load_sweep(path)


def test_a_grid_has_every_value_with_every_other(tmp_path: Path) -> None:
    sweep = load_sweep(written(tmp_path))
    assert sweep.design.shape == {"slope_rms": 3, "n": 2}
    scene, given = sweep.at({"slope_rms": 2, "n": 0})
    assert (scene.surface.slope_rms, scene.substrate.n) == (0.2, 1.4)
    assert given["seed"] == 3
    assert_allclose(given["theta_i"], np.deg2rad([20, 50]))


def test_the_scene_may_stand_in_the_sweep_file(tmp_path: Path) -> None:
    path = tmp_path / "both.toml"
    path.write_text(SCENE + '[vary]\n"surface.corr_length_um" = [4.0, 6.0]\n')
    assert load_sweep(path).at({"corr_length_um": 1})[0].surface.corr_length == 6.0


@pytest.mark.parametrize(
    ("line", "name", "value"),
    [
        ('"contaminants[0].contact_angle_deg" = [30, 90]', "contact_angle_deg", 90),
        ('"contaminants[0].material.n" = [1.3, 1.4]', "n", 1.4),
        ('"contaminants[0].seed" = [1, 2]', "seed", 2),
        ("spacing_um = [1.2, 1.1]", "spacing_um", 1.1),
        ("[vary.surface]\nheight_rms_um = [0.2, 0.3]", "height_rms_um", 0.3),
        ("seed = [1, 2]", "seed", 2),
        ('material = ["pvc", { n = 1.7, kappa = 0.2 }]', "material", 1.7),
    ],
)
def test_any_value_varies_by_its_path(
    tmp_path: Path, line: str, name: str, value: float
) -> None:
    scene = DROPS.replace("[substrate]\nn = 1.5", '[substrate]\nmaterial = "bk7"')
    if name == "material":
        line = line.replace("material", '"contaminants[0].material"')
    sweep = with_vary(tmp_path, line, scene=scene)
    assert sweep.design.shape == {name: 2}
    here, given = sweep.at({name: 1})
    drops = here.contaminants[0]
    found = {
        "contact_angle_deg": np.rad2deg(drops.contact_angle), "n": drops.material.n,
        "material": drops.material.n, "spacing_um": here.surface.spacing,
        "height_rms_um": here.surface.height_rms,
        "seed": drops.seed if "contaminants" in line else given["seed"],
    }  # fmt: skip
    assert_allclose(found[name], value)


def test_light_varies_within_a_run_of_a_grid_and_by_point_elsewhere(
    tmp_path: Path,
) -> None:
    lines = "n = [1.4, 1.6]\nwavelength_um = [0.5, 0.6]\ntheta_i_deg = [10, 20]"
    grid = with_vary(tmp_path, lines)
    assert grid.design.shape == {"n": 2}
    assert grid.at({"n": 0})[1]["wavelength"] == [0.5, 0.6]
    listed = with_vary(tmp_path, lines, '[design]\nkind = "list"')
    assert listed.design.shape == {"point": 2}
    scene, given = listed.at({"point": 1})
    assert (scene.substrate.n, given["wavelength"]) == (1.6, 0.6)
    assert_allclose(given["theta_i"], np.deg2rad(20))


@pytest.mark.parametrize("kind", ["latin-hypercube", "sobol"])
def test_sampled_designs_fill_their_ranges(tmp_path: Path, kind: str) -> None:
    sweep = with_vary(
        tmp_path,
        'slope_rms = { from = 0.02, to = 0.5, scale = "log" }\n'
        "n = { from = 1.3, to = 1.7 }\n",
        f'[design]\nkind = "{kind}"\npoints = 16\nseed = 7',
    )
    assert sweep.design.shape == {"point": 16}
    scenes = [sweep.at({"point": k})[0] for k in range(16)]
    slopes = np.log([s.surface.slope_rms for s in scenes])
    shares = (slopes - np.log(0.02)) / np.log(0.5 / 0.02)
    # One point in each sixteenth of the range: of each axis, not only of the first
    assert sorted(np.floor(16 * shares)) == list(range(16))
    indices = (np.array([s.substrate.n for s in scenes]) - 1.3) / 0.4
    assert sorted(np.floor(16 * indices)) == list(range(16))
    assert np.argsort(shares).tolist() != np.argsort(indices).tolist()


@pytest.mark.parametrize(
    ("lines", "more", "told"),
    [
        (
            "theta_i_deg = [20, 90]\nn = [1.4]",
            "",
            "theta_i_deg must lie in [0, 90), got [20, 90]",
        ),
        ('"surface.type" = ["gaussian"]', "", "surface.type cannot vary"),
        ("slope_rsm = [0.1]", "", "slope_rms"),
        ('"contaminants[0].coverage" = [0.1]', "", "must be the path"),
        ("n = [1.4, -1.0]", "", "n must be"),
        ("n = [1.4, 1.4]", "", "each value once"),
        ("n = [2, 2.0]", "", "each value once, got 2 again"),
        ("theta_i_deg = [20, 20.0]\nn = [1.4]", "", "theta_i_deg must have each value"),
        ("n = [1.4]", "[simulate]\nwavelength_um = [0.5, 0.5]", "wavelength_um must have"),
        ("n = [1.4, 1.5]", "[design]\npoints = 5", "points belongs to latin-hypercube"),
        ("n = { from = 1.3, to = inf }", '[design]\nkind = "sobol"\npoints = 4', "finite"),
        ("n = []", "", "at least one"),
        ("n = { from = 1.3, to = 1.5 }", "", "latin-hypercube"),
        ("n = { from = 1.6, to = 1.5 }", '[design]\nkind = "sobol"\npoints = 4', "below"),
        ("n = [1.4]", '[design]\nkind = "sobol"\npoints = 10', "power of 2"),
        ("n = [1.4]", '[design]\nkind = "random"', "kind must be one of"),
        ("n = [1.4]", "[design]\nnumber = 4", "unknown key 'number'"),
        ("n = [1.4]", '[design]\nkind = "sobol"', "points must be"),
        ("n = [1.4]", '[design]\nkind = "sobol"\npoints = 8.5', "whole number from 1"),
        ("n = [1.4]", '[design]\nkind = "sobol"\npoints = "8"', "got '8'"),
        ("n = [1.4]", '[design]\nkind = "sobol"\npoints = 8\nseed = -1', "seed must be"),
        (
            "seed = { from = 1, to = 9 }",
            '[design]\nkind = "sobol"\npoints = 8',
            "seed must be whole numbers",
        ),
        (
            'n = { from = 1.3, to = 1.5, scal = "log" }',
            '[design]\nkind = "sobol"\npoints = 8',
            "n: unknown key 'scal'",
        ),
        ("n = [1.4]\nkappa = [0.0, 0.1]", '[design]\nkind = "list"', "as many"),
        ("n = [1.4]", "[simulate]\nrays = 10", "unknown key 'rays'"),
        ("n = [1.4]", '[simulate]\ntheta_i_deg = "steep"', "theta_i"),
        ("n_theta = [4, 5]", "", "same in the whole sweep"),
        ("theta_i_deg = [4, 5]", "", "vary more than the light"),
        ('n = [1.4]\n"substrate.n" = [1.5]', "", "must vary once"),
    ],
)
def test_what_cannot_be_swept_is_refused_by_name(
    tmp_path: Path, lines: str, more: str, told: str
) -> None:
    with pytest.raises(ValueError, match=re.escape(told)):
        with_vary(tmp_path, lines, more)


def test_no_table_vary_no_scene_and_strange_tables(tmp_path: Path) -> None:
    for text, told in (
        ('scene = "scene.toml"', "[vary]"),
        (SWEEP.replace("scene.toml", "gone.toml"), "gone.toml"),
        (SWEEP + "[colour]\nred = 1", "colour"),
        (SWEEP.replace('scene = "scene.toml"', "scene = 1"), "'scene'"),
    ):
        with pytest.raises(DataFileError, match=re.escape(told)):
            load_sweep(written(tmp_path, text))


def test_the_digest_tells_what_changes_numbers(tmp_path: Path) -> None:
    digests = [
        load_sweep(written(tmp_path, sweep, scene)).digest
        for sweep, scene in (
            (SWEEP, SCENE),
            (SWEEP.replace("seed = 3", "seed = 4"), SCENE),
            (SWEEP.replace("0.05", "0.06"), SCENE),
            (SWEEP, SCENE.replace("5.0", "6.0")),
        )
    ]
    assert len(set(digests)) == 4
    heights = np.zeros((4, 4))
    scene = SCENE.split("[substrate]")[1]
    scene = (
        '[surface]\ntype = "height_map"\nfile = "h.npy"\nspacing_um = 1\n[substrate]'
        + scene
    )
    sweep = SWEEP.replace('"surface.slope_rms" = [0.05, 0.1, 0.2]', "")
    files = []
    for value in (0.0, 0.5):
        np.save(tmp_path / "h.npy", heights + value)
        files.append(load_sweep(written(tmp_path, sweep, scene)).digest)
    assert files[0] != files[1]

"""The command line as a shell sees it: help, words, quiet runs, starter scenes."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import trimesh
import typer
import xarray as xr
from numpy.testing import assert_allclose

import data_io
from data_io.reflectance.table_accuracy import GRAZING
from pbrdf import Material, MicrofacetModel, load_scene
from pbrdf.cli import app, main
from pbrdf.cli.converted import in_convention
from pbrdf.cli.progress import StageBars, Talk, talk
from pbrdf.cli.showing.doctor import self_test
from pbrdf.cli.showing.export import _accuracy_lines
from pbrdf.cli.showing.init import Kind
from pbrdf.cli.wording import in_options, options_of
from pbrdf.errors import AccuracyWarning
from pbrdf.optics.exchange import convert_brdf


@pytest.mark.parametrize("name", app.COMMANDS)
@pytest.mark.parametrize("flag", ["-h", "--help"])
def test_every_command_has_help(name, flag, capsys):
    assert main([name, flag]) == 0
    text = capsys.readouterr().out
    assert f"pbrdf {name}" in text
    # Help says what each option is for
    assert "Options:" in text


def test_every_option_says_what_it_is_for():
    whole = typer.main.get_command(app.app)
    silent = [
        f"{name} {option.opts[0]}"
        for name, command in whole.commands.items()
        for option in command.params
        if not getattr(option, "help", None)
    ]
    assert not silent


@pytest.mark.parametrize("kind", sorted(set(Kind) - {Kind.map, Kind.mesh}))
def test_starter_scenes_are_scenes(kind, tmp_path, capsys):
    path = tmp_path / "scene.toml"
    assert main(["init", str(path), "--kind", kind.value]) == 0
    assert "pbrdf simulate" in capsys.readouterr().out
    scene = load_scene(path)
    assert bool(scene.contaminants) == (kind in (Kind.dew, Kind.film))
    # Fine enough for the accuracy that the engine states
    assert np.min(scene.surface.corr_length) >= 16 * np.max(scene.surface.spacing)
    assert main(["init", str(path)]) == 2
    assert "--force" in capsys.readouterr().err


def test_a_starter_map_takes_the_heights_beside_it(tmp_path):
    np.save(tmp_path / "heights.npy", np.random.default_rng(1).standard_normal((20, 30)))
    assert main(["init", str(tmp_path / "scene.toml"), "--kind", "map"]) == 0
    assert load_scene(tmp_path / "scene.toml").surface.heights.shape == (20, 30)


def test_a_starter_mesh_takes_the_file_beside_it_and_all_that_it_remarks_on(tmp_path):
    path = tmp_path / "scene.toml"
    trimesh.creation.box((0.03, 0.03, 0.002)).export(tmp_path / "mesh.stl")
    assert main(["init", str(path), "--kind", "mesh"]) == 0
    # Thirty micrometres in millimetres, of which the file says nothing
    with pytest.warns(AccuracyWarning, match="no unit is named"):
        assert load_scene(path).surface.kind == "bodies"
    text = path.read_text()
    for key in ("unit", "period_um", "labels"):
        text = text.replace(f"# {key} =", f"{key} =")
    path.write_text(text.replace("# transparent = [1]", "transparent = true"))
    surface = load_scene(path).surface
    assert_allclose(surface.size, (40.0, 40.0))
    assert surface.transparent == (0,)


def test_a_dash_is_standard_output(tmp_path, capsys):
    assert main(["init", "-", "--kind", "vinyl"]) == 0
    assert "[substrate]" in capsys.readouterr().out
    profile = tmp_path / "profile.csv"
    x = np.arange(300) * 0.5
    z = np.sin(x / 7) + 0.3 * np.sin(x / 2.3)
    rows = zip(x, z, strict=True)
    profile.write_text("x_um,z_um\n" + "".join(f"{a},{b}\n" for a, b in rows))
    assert main(["--quiet", "statistics", str(profile), "--json", "-"]) == 0
    assert json.loads(capsys.readouterr().out)["slope_rms"]["value"] > 0
    assert not Path("-").exists()


def test_messages_name_options(tmp_path, capsys):
    np.save(tmp_path / "map.npy", np.zeros((8, 8)))
    assert main(["statistics", str(tmp_path / "map.npy")]) == 2
    message = capsys.readouterr().err
    assert "--spacing-um" in message
    assert "spacing=" not in message


def test_arguments_become_options_and_nothing_else_does():
    parsed = typer.main.get_command(app.app).commands["simulate"]
    options = options_of(parsed.params)
    assert options["source_half_angle"] == "--source-half-angle-deg"
    assert options["target_rel_error"] == "--target-rel-error"
    told = in_options("seed must be >= 0, got -1. The seed= of it; theta_i=[1].", options)
    assert told == "--seed must be >= 0, got -1. The --seed of it; --theta-i-deg [1]."
    kept = "n-seed=1 is kept, reseed=2 too, and --seed-bank"
    assert in_options(kept, options) == kept


def test_an_angle_beyond_the_horizon_is_refused_in_degrees(tmp_path, capsys):
    path = tmp_path / "scene.toml"
    main(["init", str(path)])
    capsys.readouterr()
    assert main(["simulate", str(path), "--theta-i-deg", "30,95"]) == 2
    assert "--theta-i-deg must lie in [0, 90) degrees, got 95" in capsys.readouterr().err


@pytest.mark.parametrize("kind", Kind)
def test_starter_scenes_have_a_remark_on_each_number(kind, capsys):
    assert main(["init", "-", "--kind", kind.value]) == 0
    lines = capsys.readouterr().out.splitlines()
    numbers = [line for line in lines if re.search(r"^\w+ = [\[\d]", line)]
    assert numbers
    assert [line for line in numbers if not re.search(r"# \w+", line)] == []


def test_an_export_says_whether_its_error_at_grazing_matters():
    names = ["above 10 %", GRAZING]
    error = np.full((2, 2, 1, 1), 0.004)
    error[1, 1] = 3700.0
    found = xr.Dataset(
        {"error": (("brightness", "quantile", "stokes_out", "stokes_in"), error),
         "count": ("brightness", [10, 10])},
        {"brightness": names, "quantile": ["median", "worst"]},
    )  # fmt: skip
    _, bright, grazing, remark = _accuracy_lines(found)
    assert "worst 0.4 %" in bright
    assert "worst 3.7e+03 times M00" in grazing
    # What a Lambertian surface sends beyond 85 degrees
    share = np.cos(np.deg2rad(85.0)) ** 2
    assert (
        f"matters only where the light or the viewer grazes: {100 * share:.1f} %" in remark
    )


def test_a_model_becomes_a_table(tmp_path):
    model = MicrofacetModel(Material(1.5, 0.2), slope_rms=0.2, diffuse_albedo=0.1)
    data_io.write_model(model, tmp_path / "model.toml")
    out = tmp_path / "table.csv"
    command = [
        "export",
        str(tmp_path / "model.toml"),
        "-o",
        str(out),
        "--theta-i-deg",
        "20",
    ]
    assert main(command) == 0
    scan = data_io.read_goniometer(out)
    row = scan.isel(geometry=700)
    expected = model.brdf(row.theta_i.item(), row.theta_s.item(), row.dphi.item())
    np.testing.assert_allclose(row.M21.item(), expected[2, 1], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(np.degrees(row.theta_i.item()), 20.0)


def test_progress_is_a_line_now_and_then_where_there_is_no_terminal(capsys, monkeypatch):
    monkeypatch.setattr("pbrdf.cli.progress.EVERY", 0.0)
    with StageBars() as bars:
        bars.update("tracing", 3, 10)
        assert capsys.readouterr().err == "tracing: 3 of 10\n"
        talk(Talk.QUIET)
        bars.update("tracing", 4, 10)
        talk(Talk.NORMAL)
    assert capsys.readouterr().err == ""


def test_shell_completion_is_offered():
    # Else it is for the shell that started the tests, if any did
    named = {"_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"}
    run = subprocess.run(
        [sys.executable, "-m", "pbrdf", "--show-completion", "bash"],
        capture_output=True, text=True, check=False, env=os.environ | named,
    )  # fmt: skip
    assert "complete" in run.stdout.lower() or "complete" in run.stderr.lower()


@pytest.mark.parametrize("convention", ["scatmech", "mitsuba", "paper"])
def test_a_table_in_another_convention_holds_its_signs(convention, tmp_path, capsys):
    model = MicrofacetModel(Material(1.37, 7.62), slope_rms=(0.2, 0.35))
    data_io.write_model(model, tmp_path / "m.toml")
    words = ["export", str(tmp_path / "m.toml"), "-o", str(tmp_path / "t.csv"),
             "--theta-i-deg", "35", "--convention", convention]  # fmt: skip
    assert main(words) == 0
    table = pd.read_csv(tmp_path / "t.csv", comment="#").sample(40, random_state=1)
    names = [f"{convention}_M{i}{j}" for i in range(4) for j in range(4)]
    theirs = table[names].to_numpy().reshape(-1, 4, 4)
    angles = np.deg2rad(table[["theta_i_deg", "theta_s_deg", "phi_deg"]].to_numpy()).T
    ours, dphi = convert_brdf(theirs, *angles, source=convention)
    expected = model.brdf(angles[0], angles[1], dphi)
    assert_allclose(ours, expected, rtol=1e-5, atol=1e-7 * expected.max())
    # Nobody takes the table for one of this package
    assert main(["plot", str(tmp_path / "t.csv")]) == 2
    assert main([*words[:3], str(tmp_path / "m.pbsdf"), *words[4:]]) == 2
    assert "--convention must be left out" in capsys.readouterr().err


def test_errors_turn_with_the_frame():
    # One element known to 0.1: in a turned frame the same error spreads over four
    names = [f"M{i}{j}" for i in range(4) for j in range(4)]
    rows = xr.Dataset(
        {n: ("geometry", [1.0]) for n in names}
        | {f"{n}_stderr": ("geometry", [0.1 if n == "M10" else 0.0]) for n in names},
        {"theta_i": ("geometry", [0.5]), "theta_s": ("geometry", [0.9]),
         "dphi": ("geometry", [2.2])},
    )  # fmt: skip
    found = in_convention(rows, "mitsuba").iloc[0]
    parts = [found[f"mitsuba_{n}_stderr"] for n in ("M10", "M20")]
    assert_allclose(np.hypot(*parts), 0.1, rtol=1e-12)
    assert min(parts) > 0.005
    assert found["mitsuba_M00_stderr"] == 0.0


@pytest.mark.filterwarnings("ignore:.*:pbrdf.AccuracyWarning")
def test_the_self_test_ends_and_finds_nothing():
    # Its glass is nearly flat, a slope at which an integral over slopes would never end
    assert list(self_test()) == []


def test_quiet_may_stand_after_the_command(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["init", "paint.toml", "--quiet"]) == 0
    assert talk() is Talk.QUIET
    talk(Talk.NORMAL)

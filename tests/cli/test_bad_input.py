"""Bad input: one clear line, exit code 2, and nothing half written."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from pbrdf.cli import main
from tests.cli.scenes import SCENE

PROFILE = "x_um,z_um\n" + "".join(f"{x},{np.sin(x / 3):.6f}\n" for x in range(60))
SCAN = "theta_i_deg,theta_view_deg,M00,M10\n" + "".join(
    f"30,{view},{0.05 + 1e-4 * view},{0.01}\n" for view in range(-70, 75, 10)
)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with a good profile, scan and scene."""
    (tmp_path / "profile.csv").write_text(PROFILE)
    (tmp_path / "scan.csv").write_text(SCAN)
    (tmp_path / "scene.toml").write_text(SCENE)
    monkeypatch.chdir(tmp_path)
    # However slow the machine, progress takes no line among the messages
    monkeypatch.setattr("pbrdf.cli.progress.EVERY", float("inf"))
    return tmp_path


def refusal(
    folder: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], code: int = 2
) -> str:
    """Run a command that must fail; return the one line that it says."""
    before = sorted(folder.rglob("*"))
    assert main(arguments) == code
    lines = [
        line
        for line in capsys.readouterr().err.splitlines()
        if not line.startswith(("warning: ", "note: "))
    ]
    assert len(lines) == 1, lines
    assert lines[0].startswith("error: ")
    assert lines[0].endswith((".", "`."))
    assert sorted(folder.rglob("*")) == before
    return lines[0]


def truncated_scan() -> str:
    return SCAN[: SCAN.rindex(",")]


def with_cell(row: int, column: int, value: str) -> str:
    """The good scan with one cell replaced."""
    lines = SCAN.splitlines()
    cells = lines[row].split(",")
    cells[column] = value
    lines[row] = ",".join(cells)
    return "\n".join(lines) + "\n"


BAD_SCANS: dict[str, tuple[Callable[[], str | bytes], str]] = {
    "empty": (lambda: "", "scan.csv"),
    "header only": (lambda: SCAN.splitlines()[0] + "\n", "scan.csv"),
    "truncated": (truncated_scan, "line 16"),
    "binary": (lambda: bytes(range(256)) * 4, "scan.csv"),
    "not a number": (lambda: with_cell(3, 2, "1x"), "line 4, column M00"),
    "infinite": (lambda: with_cell(3, 2, "inf"), "line 4, column M00"),
    "negative": (lambda: with_cell(5, 2, "-0.3"), "line 6, column M00"),
    "below the horizon": (lambda: with_cell(5, 1, "95"), "line 6, column theta_view_deg"),
    "contradictory": (lambda: SCAN + "30,-40,0.09,0.01\n", "line 17"),
    "wrong delimiter": (lambda: SCAN.replace(",", "~"), "scan.csv"),
    "no angles": (lambda: SCAN.replace("theta_view_deg", "position"), "scan.csv"),
    "column twice": (lambda: SCAN.replace("M10", "M00"), "column M00"),
    "in radians": (
        lambda: (
            "theta_i_deg,theta_view_deg,M00\n"
            + "".join(f"0.52,{view},0.05\n" for view in (-1.2, -0.6, 0.0, 0.6, 1.2))
        ),
        "radians",
    ),
    "wavelength in nm": (
        lambda: (
            "theta_i_deg,theta_view_deg,wavelength_um,M00\n"
            + "".join(f"30,{view},532,0.05\n" for view in range(-60, 61, 20))
        ),
        "wavelength_um",
    ),
}


@pytest.mark.parametrize("kind", BAD_SCANS)
def test_a_bad_scan_names_its_place(
    kind: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    make, expected = BAD_SCANS[kind]
    content = make()
    content = content if isinstance(content, bytes) else content.encode()
    (folder / "scan.csv").write_bytes(content)
    line = refusal(folder, capsys, ["fit", "scan.csv", "--n", "1.5", "--slope-rms", "0.2"])
    assert expected in line


def png_of_text() -> bytes:
    return b"This is a letter, not a picture."


BAD_SURFACES: dict[str, tuple[str, bytes, list[str], str]] = {
    "missing": ("none.csv", b"", [], "none.csv"),
    "empty": ("surface.csv", b"", [], "surface.csv"),
    "binary": ("surface.csv", bytes(range(256)) * 4, [], "surface.csv"),
    "word among numbers": (
        "surface.csv",
        PROFILE.replace("\n7,", "\nseven,").encode(),
        [],
        "line 9",
    ),
    "nan position": (
        "surface.csv",
        PROFILE.replace("\n7,", "\nnan,").encode(),
        [],
        "line 9",
    ),
    "unknown unit": (
        "surface.csv",
        PROFILE.replace("x_um,z_um", "x_ell,z_ell").encode(),
        ["--unit", "ell"],
        "ell",
    ),
    "flat": (
        "surface.csv",
        ("x_um,z_um\n" + "".join(f"{x},1\n" for x in range(40))).encode(),
        [],
        "vary",
    ),
    "letter as picture": ("edge.png", png_of_text(), ["--um-per-pixel", "0.5"], "edge.png"),
    "picture without scale": ("edge.png", png_of_text(), [], "--um-per-pixel"),
    "scale of a profile": (
        "surface.csv",
        PROFILE.encode(),
        ["--um-per-pixel", "1"],
        "profile",
    ),
    "truncated map": (
        "map.npy",
        b"\x93NUMPY\x01\x00v\x00{'desc",
        ["--spacing-um", "1"],
        "map",
    ),
    "map without step": ("map.csv", b"0,1,0,2\n1,0,1,2\n0,1,0,2\n", [], "spacing"),
    "unknown form": ("surface.csv", PROFILE.encode(), ["--form", "curvy"], "curvy"),
}


@pytest.mark.parametrize("kind", BAD_SURFACES)
def test_a_bad_surface_is_refused(
    kind: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    name, content, extra, expected = BAD_SURFACES[kind]
    if kind != "missing":
        (folder / name).write_bytes(content)
    assert expected in refusal(folder, capsys, ["statistics", name, *extra])


PIPELINE = ["pipeline", "profile.csv", "scan.csv", "--n", "1.5"]
BAD_OPTIONS: dict[str, tuple[list[str], str]] = {
    "negative kappa": ([*PIPELINE, "--kappa", "-0.5"], "--kappa"),
    "nan index": (["pipeline", "profile.csv", "scan.csv", "--n", "nan"], "'nan'"),
    "zero index": (["pipeline", "profile.csv", "scan.csv", "--n", "0"], "--n"),
    "index in words": (["pipeline", "profile.csv", "scan.csv", "--n", "glass"], "glass"),
    "no index": (["pipeline", "profile.csv", "scan.csv"], "--n"),
    "no rays": ([*PIPELINE, "--n-rays", "0"], "--n-rays"),
    "no realisation": ([*PIPELINE, "--realizations", "0"], "--realizations"),
    "unknown shadowing": ([*PIPELINE, "--shadowing", "dusk"], "dusk"),
    "unknown parameter": ([*PIPELINE, "--free", "gloss"], "gloss"),
    "nothing free": ([*PIPELINE, "--free", ","], "free"),
    "unknown option": ([*PIPELINE, "--speed", "11"], "--speed"),
    "unknown command": (["polish"], "polish"),
    "output in no folder": ([*PIPELINE, "-o", "no/such/place"], "folder"),
    "output is a file": ([*PIPELINE, "-o", "scan.csv"], "scan.csv"),
    "wavelength not there": ([*PIPELINE, "--wavelength-um", "0.5"], "--wavelength-um"),
    "incidence beyond grazing": (
        ["simulate", "scene.toml", "--theta-i-deg", "95"],
        "--theta-i-deg",
    ),
    "incidence in words": (["simulate", "scene.toml", "--theta-i-deg", "steep"], "steep"),
    "a store that is not written": (
        ["sweep", "scene.toml", "--vary", "slope_rms=0.1", "-o", "out.h5"],
        ".zarr",
    ),
    "odd azimuth bins": (["simulate", "scene.toml", "--n-dphi", "45"], "--n-dphi"),
    "unknown stokes": (["simulate", "scene.toml", "--stokes", "V"], "--stokes"),
    "scene that is none": (["simulate", "scan.csv"], "scan.csv"),
    "sweep of nothing": (["sweep", "scene.toml", "--vary", "gloss=1"], "gloss"),
    "sweep out of range": (["sweep", "scene.toml", "--vary", "kappa=-1"], "kappa"),
    "plot of nothing": (["plot", "profile.csv"], "profile.csv"),
    "export to nowhere": (["export", "scene.toml", "-o", "scene.obj"], ".pbsdf"),
    "scan from a pipe": (["check", "-"], "standard input is not read. Save it"),
    "export to a pipe": (["export", "scene.toml", "-o", "-"], "to standard output"),
    "incidences for a renderer": (
        ["export", "scene.toml", "-o", "a.pbsdf", "--theta-i-deg", "10"],
        "--theta-i-deg is not used for .pbsdf",
    ),
    "incidences of a result": (
        ["export", "result.nc", "-o", "a.csv", "--theta-i-deg", "10"],
        "--theta-i-deg is not used for result.nc",
    ),
    "a wavelength of a result": (
        ["export", "result.nc", "-o", "a.csv", "--wavelength-um", ".5"],
        "--wavelength-um is not used for result.nc",
    ),
    "a seed of a table": (
        ["export", "scene.toml", "-o", "a.csv", "--seed", "1"],
        "--seed is not used for .csv, only for meshes",
    ),
    "incidences of a mesh": (
        ["export", "scene.toml", "-o", "a.stl", "--theta-i-deg", "10"],
        "--theta-i-deg is not used for a mesh",
    ),
    "dew beyond 180 degrees": (
        ["dew", "--contact-angles-deg", "15,200"],
        "--contact-angles-deg",
    ),
    "dew on what is no scene": (["dew", "--scene", "scan.csv"], "scan.csv"),
    "dew of an unknown kind": (["dew", "--sizes", "gamma"], "sizes"),
    "dew without room": (["dew", "--volume-per-area-um", "100"], "room"),
}


@pytest.mark.parametrize("kind", BAD_OPTIONS)
def test_a_bad_option_is_refused(
    kind: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments, expected = BAD_OPTIONS[kind]
    assert expected in refusal(folder, capsys, arguments)


def test_a_scene_error_names_the_key(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "scene.toml").write_text(SCENE.replace("slope_rms", "sigma"))
    line = refusal(folder, capsys, ["simulate", "scene.toml"])
    assert "sigma" in line
    assert "slope_rms" in line


def test_the_shell_sees_exit_code_two(folder: Path) -> None:
    run = subprocess.run(
        [sys.executable, "-c", "import sys; from pbrdf.cli import main; sys.exit(main())",
         "fit", "none.csv", "--n", "1.5", "--slope-rms", "0.2"],
        capture_output=True, text=True, check=False,
        env={key: value for key, value in os.environ.items() if key != "PBRDF_TRACEBACK"},
    )  # fmt: skip
    assert run.returncode == 2
    assert run.stdout == ""
    assert len(run.stderr.splitlines()) == 1

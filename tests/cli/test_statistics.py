"""The options of `pbrdf statistics` that belong to micrographs, and those of meshes."""

import json
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh
from skimage import io

from examples.micrograph import Camera, gaussian_edge, photograph
from pbrdf.cli import main
from tests.meshes.shapes import plate

CAMERA = Camera(um_per_pixel=0.5, dust=0.0)
BAR = 80


@pytest.fixture
def picture(tmp_path: Path) -> Path:
    """A lamella with two edges, the upper one rough, and a scale bar of 40 um."""
    rng = np.random.default_rng(4)
    edge = gaussian_edge(rng, 250.0, 1 / 16, height_rms=1.5, corr_length=9.0)
    upper = photograph(edge, CAMERA, rng)
    smooth = gaussian_edge(rng, 250.0, 1 / 16, height_rms=0.4, corr_length=9.0)
    lower = photograph(smooth, CAMERA, rng)[::-1]
    columns = min(upper.shape[1], lower.shape[1])
    both = np.concatenate([upper[:, :columns], lower[:, :columns]])
    both[10:14, 20 : 20 + BAR] = 255
    path = tmp_path / "lamella.png"
    io.imsave(path, both, check_contrast=False)
    return path


def height_of(picture: Path, *options: str) -> float:
    report = picture.with_suffix(".json")
    assert (
        main(["statistics", str(picture), "--json", str(report), "--force", *options]) == 0
    )
    return json.loads(report.read_text())["height_rms"]["value"]


def test_edge_scale_bar_and_overlay_reach_the_reader(picture: Path) -> None:
    overlay = picture.with_name("overlay.png")
    rough = height_of(picture, "--um-per-pixel", "0.5", "--edge", "0")
    smooth = height_of(
        picture, "--um-per-pixel", "0.5", "--edge", "1", "--overlay", str(overlay)
    )
    assert rough > 2.5 * smooth
    by_bar = height_of(picture, "--scale-bar-um", str(BAR / 2), "--edge", "0")
    assert by_bar == pytest.approx(rough, rel=0.02)
    # Green only where the edge of this profile runs: in the lower half
    drawn = io.imread(overlay).astype(int)
    green = drawn[..., 1] > drawn[..., 0] + 50
    assert green[: len(green) // 3].sum() == 0 < green[len(green) // 3 :].sum()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--edge", "0"], "--edge does not belong to a profile"),
        (["--scale-bar-um", "5"], "--scale-bar-um does not belong to a profile"),
        (["--overlay", "over.png"], "--overlay needs a micrograph"),
    ],
)
def test_options_of_pictures_are_refused_with_profiles(tmp_path, capsys, options, message):
    profile = tmp_path / "profile.csv"
    profile.write_text("x_um,z_um\n" + "".join(f"{x},{np.sin(x):.5f}\n" for x in range(60)))
    assert main(["statistics", str(profile), *options]) == 2
    assert message in capsys.readouterr().err


def test_an_x3p_or_comma_profile_is_known_without_being_told(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    z = np.convolve(rng.normal(size=640), np.hanning(31), "valid")
    comma = tmp_path / "profile.txt"
    rows = "".join(f"{0.5 * i}\t{h:.6f}\n".replace(".", ",") for i, h in enumerate(z))
    comma.write_text("x [µm]\tz [µm]\n" + rows, encoding="utf-16")
    line = tmp_path / "line.x3p"
    axis = "<C{}><AxisType>I</AxisType><Increment>{}</Increment></C{}>"
    data = "".join(f"<Datum>{h * 1e-6:.12f}</Datum>" for h in z)
    with zipfile.ZipFile(line, "w") as archive:
        archive.writestr(
            "main.xml",
            f"<a><Record1><Axes>{axis.format('X', 0.5e-6, 'X')}</Axes></Record1><Record3>"
            f"<MatrixDimension><SizeX>{z.size}</SizeX><SizeY>1</SizeY></MatrixDimension>"
            f"<DataList>{data}</DataList></Record3></a>",
        )
    assert height_of(comma) == pytest.approx(height_of(line), rel=1e-5)


def test_a_channel_belongs_to_a_map(tmp_path, capsys):
    profile = tmp_path / "profile.csv"
    profile.write_text("x_um,z_um\n" + "".join(f"{x},{np.sin(x):.5f}\n" for x in range(60)))
    assert main(["statistics", str(profile), "--channel", "Height"]) == 2
    assert "--channel does not belong to a profile" in capsys.readouterr().err


def test_a_mesh_prints_what_a_map_cannot_hold(tmp_path, capsys):
    """A ball over a plate: area and overhang from its radius; tilts add to one."""
    ball = trimesh.creation.icosphere(subdivisions=3, radius=1.5)
    ball.apply_translation([5.0, 4.0, 2.0])
    whole = trimesh.util.concatenate(trimesh.Trimesh(*plate(), process=False), ball)
    whole.vertices *= 1e-3
    path, told, tilts = (tmp_path / name for name in ("ball.ply", "told.json", "tilts.csv"))
    whole.export(path)
    options = ["--kind", "mesh", "--unit", "mm", "--period-um", "10,8", "--json", str(told)]
    assert main(["statistics", str(path), *options, "--slopes", str(tilts)]) == 0
    assert "overhang_share" in capsys.readouterr().out
    found = json.loads(told.read_text())
    area = 4 * np.pi * 1.5**2
    assert found["area_ratio"]["value"] == pytest.approx(1 + area / 80, rel=0.01)
    share = area / 2 / (80 + area)
    assert found["overhang_share"]["value"] == pytest.approx(share, rel=0.06)
    low, high, part = np.loadtxt(tilts, delimiter=",", skiprows=1).T
    assert (high[-1], part.sum()) == (180.0, pytest.approx(1.0))
    assert part[low >= 90.0].sum() == pytest.approx(share, rel=0.06)

    scene = tmp_path / "scene.toml"
    scene.write_text(
        '[surface]\ntype = "mesh"\nfile = "ball.ply"\nunit = "mm"\nperiod_um = [10, 8]\n'
        "[substrate]\nn = 1.5\n"
    )
    assert main(["statistics", str(scene), "--json", str(tmp_path / "scene.json")]) == 0
    assert json.loads((tmp_path / "scene.json").read_text()) == found


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (
            ["--kind", "mesh", "--form", "none"],
            "--form is not used for",
        ),
        (["--period-um", "10,8"], "--period-um is not used without --kind mesh"),
        (["--kind", "mesh", "--period-um", "10"], "must be two lengths, as in 40,40"),
        (["--unit", "um"], "pbrdf statistics --kind mesh"),
    ],
)
def test_what_statistics_of_a_mesh_cannot_use_is_refused(
    tmp_path, capsys, options, expected
):
    path = tmp_path / "ball.stl"
    trimesh.creation.icosphere(subdivisions=2).export(path)
    assert main(["--quiet", "statistics", str(path), *options]) == 2
    assert expected in capsys.readouterr().err

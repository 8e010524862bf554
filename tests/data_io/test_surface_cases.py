"""Surface files of the kinds people have: each read right, or refused by name."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from data_io import holds_profile, read_height_map, read_profile
from pbrdf.cli.app import main
from pbrdf.errors import DataFileError

CASES = Path(__file__).parents[1] / "cases" / "surface"
# Heights of one made profile that most of the tables hold, 600 points of 0.5 um
FIRST, LAST, POINTS = [-0.34472, -0.34776, -0.34944], -1.26225, 600


@pytest.mark.parametrize(
    ("name", "step", "points"),
    [
        ("index_pos_height.csv", 0.5, POINTS),
        ("index_x_z.csv", 0.5, POINTS),
        ("dektak_like.csv", 0.156, POINTS),
        ("repeat_header.dat", 0.5, POINTS),
        ("single_column_z.txt", 0.5, POINTS),
        ("profile_gap.csv", 0.5, POINTS - 4),
    ],
)
def test_tables_of_any_shape_give_their_profile(name, step, points):
    profile = read_profile(CASES / name)
    assert holds_profile(CASES / name)
    assert profile.size == points
    assert_allclose(profile.z[:3], FIRST)
    assert profile.z[-1] == LAST
    # The header of the stylus file rounds its step to three digits
    assert_allclose(profile.length, step * (POINTS - 1), rtol=2e-3)
    assert_allclose(profile.x[:3], [0, step, 2 * step], atol=2e-3)
    assert profile.slope is None


def test_decimal_commas_and_two_units():
    profile = read_profile(CASES / "mm_um_decimal_comma.txt")
    assert_allclose(profile.x[[0, 1, -1]], [0, 0.5, 79.5])
    assert_allclose(profile.z[[0, 1, -1]], [-1.1734, -1.1409, -1.1826])


@pytest.mark.parametrize("name", ["slope_named_unit.dat", "slope_as_height.dat"])
def test_slopes_are_read_as_slopes_and_never_as_heights(name):
    profile = read_profile(CASES / name)
    assert profile.slope is not None
    assert_allclose(profile.slope[[1, -1]], [2.5244e-6, 1.9102e-6], rtol=1e-6)
    assert_allclose(profile.x[[0, 1, -1]], [0, 200, 11_800])
    # The trapezium of the first two points, 200 um apart
    assert_allclose(profile.z[:2], [0, 2.5244e-6 * 100], rtol=1e-6)


def test_a_column_without_unit_is_asked_for():
    path = CASES / "microns_first_only.csv"
    with pytest.raises(DataFileError, match=r"unit for both columns.*--units mm,um"):
        read_profile(path)
    assert read_profile(path, unit="um").size == POINTS


def write(folder, text, name="table.csv"):
    path = folder / name
    path.write_text(text)
    return path


ROWS = [(0.0, 1.5), (0.5, -2.0), (1.0, 0.25), (1.5, 0.75)]


def rows(pattern, separator="\n"):
    return separator.join(pattern.format(i=i, x=x, z=z) for i, (x, z) in enumerate(ROWS))


@pytest.mark.parametrize(
    "text",
    [
        "Nr;Weg [µm];Höhe [µm]\n" + rows("{i};{x};{z}"),
        "Point\tDistance (um)\tRaw (um)\tNote\n" + rows("{i}\t{x}\t{z}\tok"),
        "x [um]  intensity [a.u.]  z [um]\n" + rows("{x} 7 {z}"),
        "Length 3 mm\nRa 0.2 Rq 0.3\n\nX (um),Z (um),,\n" + rows("{x},{z},,"),
        "x_um,z_um,z_stderr_um\n" + rows("{x},{z},0.1"),
        "x (um), height (um)\n" + rows("{x}\t{z}"),
        "Step size: 500 nm\nz_um\n" + rows("{z}"),
        "No.,z_um\n# dx_um = 0.5\n" + rows("{i},{z}"),
        "z [um], slope [mrad], x [um]\n" + rows("{z}, 9, {x}"),
        "x um,z um\n" + rows("{x},{z}").replace("\n0.5", "\n\nx um,z um\n0.5"),
    ],
)
def test_columns_are_found_by_name_and_unit(tmp_path, text):
    profile = read_profile(write(tmp_path, text))
    assert_allclose(profile.x, [x for x, _ in ROWS])
    assert_allclose(profile.z, [z for _, z in ROWS])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x [mm]  intensity [a.u.]\n" + rows("{x} {z}"), "heights or slopes.*--columns"),
        ("time [s],z [um]\n" + rows("{x},{z}"), "a column of positions.*--columns"),
        ("x [mm]  height [V]\n" + rows("{x} {z}"), r"height \[V\].*length unit, got 'V'"),
        ("x [mm]  slope [um]\n" + rows("{x} {z}"), "a unit of angle.*got 'um'"),
        ("x [mm]  height [urad]\n" + rows("{x} {z}"), "length unit, got 'urad'"),
        ("# slope along the axis\n" + rows("{x} {z}"), "speaks of 'slope' only.*--units"),
        ("x_um,height_um,residual height_um\n" + rows("{x},{z},{z}"), r"\(2\).*\(3\).*--c"),
        ("x [um/mm]  z [um]\n" + rows("{x} {z}"), "length unit, got 'um/mm'"),
        ("foo,bar\n" + rows("{x},{z}"), "names 'foo', 'bar'.*--columns"),
        (
            f"a\n{rows('{x} {z}')}\nb\n{rows('{x} {z}')}\n",
            "found 2: lines 2 to 5, lines 7 to 10.*--block",
        ),
        ("z_um\n" + rows("{z}"), "distance of points.*--spacing-um"),
    ],
)
def test_what_is_no_height_is_refused_with_the_option_that_mends_it(
    tmp_path, text, message
):
    with pytest.raises(DataFileError, match=message):
        read_profile(write(tmp_path, text))


@pytest.mark.parametrize(
    ("text", "options"),
    [
        ("foo,bar,z\n" + rows("{z},{x},9"), {"columns": "2,1", "unit": "um"}),
        ("a um,b um,c um\n" + rows("{x},9,{z}"), {"columns": ("a um", "c um")}),
        (rows("{x} {i} {z}"), {"columns": [1, 3], "unit": "um"}),
        (rows("{i} {z}"), {"columns": "2", "unit": "um", "spacing": 0.5}),
        (
            f"x_um z_um\n9 9\n8 8\n7 7\nx_um z_um\n{rows('{x} {z}')}\n",
            {"block": 2},
        ),
    ],
)
def test_columns_and_blocks_are_had_for_the_asking(tmp_path, text, options):
    profile = read_profile(write(tmp_path, text), **options)
    assert_allclose(profile.x, [x for x, _ in ROWS])
    assert_allclose(profile.z, [z for _, z in ROWS])


def test_slopes_by_the_units_given_and_from_right_to_left(tmp_path):
    rising = write(tmp_path, "0 100\n1 300\n3 100\n", "a.txt")
    falling = write(tmp_path, "3 100\n1 300\n0 100\n", "b.txt")
    for path in (rising, falling):
        profile = read_profile(path, unit=("mm", "mrad"))
        # dz/dx is the tangent of the angle
        assert_allclose(profile.slope, np.tan([0.1, 0.3, 0.1]))
        assert_allclose(profile.x, [0, 1000, 3000])
        assert_allclose(np.diff(profile.z), np.tan(0.1) + np.tan(0.3), rtol=2000)
        steps = np.diff(profile.x) * (np.tan(0.1) + np.tan(0.3)) / 2
        assert_allclose(np.diff(profile.z), steps)


def test_lists_of_maps_have_further_columns_too(tmp_path):
    text = "n,x_um,y_um,z_um,intensity\n" + "\n".join(
        f"{4 * j + i},{0.5 * i},{2 * j},{i - 10 * j},7" for j in range(3) for i in range(4)
    )
    path = write(tmp_path, text)
    assert not holds_profile(path)
    surface = read_height_map(path)
    assert_allclose(surface.spacing, (0.5, 2))
    assert_allclose(surface.heights, np.arange(4)[:, None] - 10 * np.arange(3))
    # A number of the row, a position and a height make no grid
    table = "n um,x um,z um\n" + "\n".join(f"{i},{i / 2},{i % 7}" for i in range(200))
    with pytest.raises(DataFileError, match=r"200 points span 200 x 200 nodes.*--columns"):
        read_height_map(write(tmp_path, table), columns="1,2,3")


def test_the_command_line_takes_columns_units_and_blocks(tmp_path, capsys):
    z = np.sin(np.arange(200) / 3).round(4)
    text = "\n".join(f"{i},{i / 2000},{1e3 * h},1" for i, h in enumerate(z))
    path = write(tmp_path, text)
    options = ["--kind", "profile", "--columns", "2,3", "--units", "mm,nm"]
    assert main(["statistics", str(path), *options]) == 0
    assert "height_rms  0.7" in capsys.readouterr().out
    assert main(["statistics", str(path), "--kind", "profile", "--units", "mm,nm,um"]) == 2
    assert "--units" in capsys.readouterr().err

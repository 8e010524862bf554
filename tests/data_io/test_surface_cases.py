"""Surface files of the kinds people have: each read right, or refused by name."""

import warnings
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from data_io import (
    CoordinatesWarning,
    MendedMap,
    MendedProfile,
    MendWarning,
    MissingUnitWarning,
    OverhangWarning,
    Profile,
    ScaleWarning,
    holds_profile,
    mend_profile,
    read_height_map,
    read_profile,
)
from fitting import surface_statistics
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
    with pytest.raises(DataFileError, match=r"unit for both columns.*unit="):
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
        ("x [mm]  intensity [a.u.]\n" + rows("{x} {z}"), "heights or slopes.*columns="),
        ("time [s],z [um]\n" + rows("{x},{z}"), "a column of positions.*columns="),
        ("x [mm]  height [V]\n" + rows("{x} {z}"), r"height \[V\].*length unit, got 'V'"),
        ("x [mm]  slope [um]\n" + rows("{x} {z}"), "a unit of angle.*got 'um'"),
        ("x [mm]  height [urad]\n" + rows("{x} {z}"), "length unit, got 'urad'"),
        ("# slope along the axis\n" + rows("{x} {z}"), "speaks of 'slope' only.*unit="),
        (
            "x_um,height_um,residual height_um\n" + rows("{x},{z},{z}"),
            r"\(2\).*\(3\).*columns=",
        ),
        ("x [um/mm]  z [um]\n" + rows("{x} {z}"), "length unit, got 'um/mm'"),
        ("foo,bar\n" + rows("{x},{z}"), "names 'foo', 'bar'.*columns="),
        (
            f"a\n{rows('{x} {z}')}\nb\n{rows('{x} {z}')}\n",
            "found 2: lines 2 to 5, lines 7 to 10.*block=",
        ),
        ("z_um\n" + rows("{z}"), "distance of points.*spacing="),
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
        steps = np.diff(profile.x) * (np.tan(0.1) + np.tan(0.3)) / 2
        assert_allclose(np.diff(profile.z), steps)


@pytest.mark.parametrize(
    ("unit", "size"), [("um/um", 1), ("um/m", 1e-6), ("nm/mm", 1e-6), ("mm/m", 1e-3)]
)
def test_slopes_that_are_ratios_are_no_angles(tmp_path, unit, size):
    path = write(tmp_path, f"x [mm],slope [{unit}]\n" + rows("{x},{z}"))
    assert_allclose(read_profile(path).slope, [z * size for _, z in ROWS])
    plain = write(tmp_path, "x_mm,gradient\n" + rows("{x},{z}"))
    with pytest.raises(DataFileError, match=r"for plain ratios unit=\('mm', 'mm/mm'\)"):
        read_profile(plain)
    assert_allclose(read_profile(plain, unit=("mm", unit)).slope[0], 1.5 * size)


def test_of_several_heights_those_in_counts_are_none(tmp_path):
    path = write(tmp_path, "x[um] raw[counts] z[um]\n" + rows("{x} 77 {z}"))
    assert_allclose(read_profile(path).z, [z for _, z in ROWS])


MATRIX = np.random.default_rng(5).normal(size=(12, 9)).round(3)


def matrix(values):
    return "\n".join(",".join(f"{v:g}" for v in row) for row in values)


@pytest.mark.parametrize("left", [True, False])
@pytest.mark.parametrize("top", [True, False])
def test_positions_beside_a_matrix_are_no_heights(tmp_path, left, top):
    values = MATRIX
    if top:
        values = np.concatenate([[0.5 * np.arange(9)], values])
    if left:
        down = np.arange(len(values))[::-1, None] * 2.0
        values = np.concatenate([down, values], axis=1)
    path = write(tmp_path, matrix(values))
    options = {"spacing": 0.5, "unit": "um"}
    if not left and not top:
        assert_allclose(read_height_map(path, **options).heights.T, MATRIX)
        return
    with pytest.warns(CoordinatesWarning, match="positions or numbers of lines"):
        found = read_height_map(path, **options)
    assert_allclose(found.heights.T, MATRIX)


def test_a_plane_and_a_stair_have_no_column_of_positions(tmp_path):
    for values in (
        np.add.outer(np.arange(12), 2 * np.arange(9)),
        np.repeat(np.arange(12)[:, None] // 3, 9, axis=1) + MATRIX,
    ):
        found = read_height_map(write(tmp_path, matrix(values)), spacing=1.0, unit="um")
        assert_allclose(found.heights.T, values)


def test_maps_that_follow_each_other_are_chosen_by_block(tmp_path):
    text = f"# forwards\n{matrix(MATRIX)}\n\n# backwards\n{matrix(-MATRIX)}\n"
    path = write(tmp_path, text)
    options = {"spacing": 0.5, "unit": "um"}
    with pytest.raises(
        DataFileError, match=r"found 2 of equal size: lines 2 to 13, .*block="
    ):
        read_height_map(path, **options)
    for block, sign in ((1, 1), (2, -1)):
        found = read_height_map(path, block=block, **options)
        assert_allclose(found.heights.T, sign * MATRIX)
    with pytest.raises(DataFileError, match="block of data from 1 to 2, got 3"):
        read_height_map(path, block=3, **options)


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
    with pytest.raises(DataFileError, match=r"200 points span 200 x 200 nodes.*columns="):
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


def heights_of(path, **options):
    return read_height_map(path, **options).heights


def test_a_file_that_is_open_elsewhere_is_not_called_damaged():
    import h5py

    options = {"spacing": 0.5, "unit": "um"}
    with h5py.File(CASES / "height.h5", "r"):
        once = heights_of(CASES / "height.h5", **options)
    assert_allclose(heights_of(CASES / "height.h5", **options), once)


def test_instruments_meshes_pictures_and_arrays_hold_one_map():
    wanted = np.load(CASES / "inf.npy").T
    hidden = np.isinf(wanted)
    assert hidden.any()
    options = {"spacing": 0.5, "unit": "um"}
    for name in ("height.h5", "height.mat"):
        found = heights_of(CASES / name, **options)
        # These have the first axis x
        assert_allclose(found.T[~hidden], wanted[~hidden], atol=1e-6)
        with pytest.raises(DataFileError, match=r"unit and steps, .*unit= and spacing="):
            read_height_map(CASES / name)
    for name in ("height32.tif", "height32.tiff"):
        found = heights_of(CASES / name, um_per_level=1.0, spacing=0.5)
        assert_allclose(found[~hidden], wanted[~hidden], atol=1e-6)
        with pytest.raises(DataFileError, match="um_per_level="):
            read_height_map(CASES / name)
    for name in ("inf.npy", "inf.csv"):
        found = read_height_map(
            CASES / name, **({"spacing": 0.5} if "npy" in name else {"unit": "um"})
        )
        assert found.spacing == (0.5, 0.5)
        assert_array_equal(np.isnan(found.heights), hidden)
        slopes = np.concatenate([s[np.isfinite(s)].ravel() for s in found.slopes()])
        assert_allclose(np.sqrt(np.mean(slopes**2)), 0.2, rtol=0.01)


@pytest.mark.parametrize("name", ["surf.stl", "surf.ply", "surf.obj"])
def test_meshes_on_a_grid_keep_it(name):
    surface = read_height_map(CASES / name, unit="um")
    assert_allclose(surface.spacing, (0.5, 0.5), rtol=1e-6)
    lines = (CASES / "surf.obj").read_text().splitlines()
    z = [float(line.split()[3]) for line in lines if line.startswith("v ")]
    assert_allclose(surface.heights, np.reshape(z, (60, 60)), atol=1e-6)
    with pytest.warns(MissingUnitWarning):
        read_height_map(CASES / name)


def test_an_overhang_is_counted_and_the_map_is_its_top(tmp_path):
    step = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0], [4, 4, 0]], dtype=float)
    roof = np.array([[1, 1, 2], [3, 1, 2], [1, 3, 2], [3, 3, 2]], dtype=float)
    points = np.concatenate([step, roof])
    faces = [[0, 1, 2], [1, 3, 2], [4, 5, 6], [5, 7, 6]]
    text = "".join(f"v {x} {y} {z}\n" for x, y, z in points)
    text += "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in faces)
    with pytest.warns(OverhangWarning, match="hangs over at 9 of 25 nodes"):
        surface = read_height_map(write(tmp_path, text, "roof.obj"), unit="um", spacing=1.0)
    wanted = np.zeros((5, 5))
    wanted[1:4, 1:4] = 2
    assert_allclose(surface.heights, wanted)


def test_the_pitch_of_a_confocal_microscope_is_nanometres():
    with pytest.warns(ScaleWarning, match=r"312.5, is taken as nanometres.* 312500 um"):
        surface = read_height_map(CASES / "tiny.nms")
    assert surface.spacing == (0.3125, 0.3125)
    assert surface.missing == 0


def test_text_of_iso_25178_is_in_metres():
    surface = read_height_map(CASES / "sdf_like.sdf")
    assert_allclose(surface.spacing, (0.5, 0.5))
    assert surface.shape == (40, 40)
    assert round(surface.missing * 1600) == 44
    assert_allclose(surface.heights[1, 0], -1.203)


def test_measurement_standards(tmp_path):
    for name in ("profile_like.smd", "wa.prf"):
        with pytest.raises(DataFileError, match="expected 400 heights as CZ says, got 160"):
            read_profile(CASES / name)
        text = (
            (CASES / name).read_text().replace("4.0E+02", "1.6E+02").replace("400", "160")
        )
        profile = read_profile(write(tmp_path, text, name))
        assert_allclose(profile.x[:3], [0, 1e3, 2e3])
        assert_allclose(profile.z[:2], [-1.221515, -1.201878], atol=1e-3)


def test_a_field_of_metres_is_refused_with_both_readings(tmp_path):
    # A SUR or HGT file would do as well; this one is a map whose steps are metres
    path = write(
        tmp_path, "# spacing_um = 2.5e6\n# unit: um\n" + "0,1,0\n1,0,2\n0,1,1\n" * 22
    )
    message = r"got 165 m with a pixel of 2.5 m; .*165 um"
    with pytest.raises(DataFileError, match=message):
        read_height_map(path)
    # The caller may correct the file, or stand by it with a warning
    assert read_height_map(path, spacing=2.5).spacing == (2.5, 2.5)
    with pytest.warns(ScaleWarning, match=message):
        assert read_height_map(path, spacing=2.5e6).spacing == (2.5e6, 2.5e6)


@pytest.mark.parametrize("factor", [1.0, 1e6])
def test_every_format_that_names_its_scale_is_judged_alike(tmp_path, factor):
    """Metres of SDF, lists of x, y, z, and steps of a matrix; right ones may not change."""
    z = np.add.outer(np.arange(5) % 2, np.arange(6) % 3) * factor
    step = 0.5 * factor
    texts = {
        "a.sdf": "aISO-1.0\nNumPoints = 6\nNumProfiles = 5\n"
        f"Xscale = {step * 1e-6}\nYscale = {step * 1e-6}\nZscale = {1e-6}\n*\n"
        + "\n".join(" ".join(map(str, row)) for row in z) + "\n*\n",
        "b.csv": "x_um,y_um,z_um\n" + "\n".join(
            f"{i * step},{j * step},{z[j, i]}" for j in range(5) for i in range(6)),
        "c.csv": f"# spacing_um = {step}\n# unit: um\n" + "\n".join(
            ",".join(map(str, row)) for row in z),
    }  # fmt: skip
    for name, text in texts.items():
        path = write(tmp_path, text, name)
        if factor == 1:
            assert_allclose(read_height_map(path).spacing, (0.5, 0.5))
            with pytest.raises(DataFileError, match=r"names its own: 0.5 x 0.5 um"):
                read_height_map(path, spacing=0.7)
        else:
            with pytest.raises(
                DataFileError, match=r"got 3 m with a pixel of 500 mm; .*um"
            ):
                read_height_map(path)
            with pytest.warns(ScaleWarning, match="expected slopes"):
                assert read_height_map(path, spacing=0.5).spacing == (0.5, 0.5)


def test_profiles_leave_sentinels_and_spikes_out_or_name_them(tmp_path):
    rng = np.random.default_rng(7)
    x = 0.5 * np.arange(900)
    z = 20 + np.cumsum(rng.normal(size=900)) / 10 + 0.01 * rng.normal(size=900)
    true = z.copy()
    z[100:120], z[300], z[700:703] = 0, 1e38, -9999
    # A spike within the range of the heights
    z[500] += 3
    text = "x_um,z_um\n" + "\n".join(
        f"{a},{b!r}" for a, b in zip(x, z.tolist(), strict=True)
    )
    path = write(tmp_path, text)
    with pytest.warns(MendWarning) as caught:
        found = read_profile(path)
    said = " ".join(str(one.message) for one in caught)
    assert "24 of 900 points are -9999, 1e+38, 0, far from the rest" in said
    assert "1 of 900 points jumps from both neighbours; they are taken as missing" in said
    kept = np.isin(x, found.x)
    assert isinstance(found, MendedProfile)
    assert np.count_nonzero(~kept) == 25
    assert_allclose(found.z, true[kept])
    assert_allclose(found.raw.z, z)
    assert [one.kind for one in found.mends] == ["sentinels", "spikes"]
    with pytest.warns(MendWarning) as caught:
        left = read_profile(path, mend="sentinels")
    assert {one.filename for one in caught} == {__file__}
    assert "left as they are; mend='spikes'" in str(caught[-1].message)
    assert left.size == 876
    # An edge is no spike, a flat step no sentinel, a random surface sound
    sound = np.where(x > 200, 3.0, 0.0) + 0.01 * rng.normal(size=900)
    for heights in (sound, np.sign(np.sin(x / 9)), true, rng.normal(size=900)):
        assert mend_profile(Profile(x, heights)).size == 900


def test_slopes_are_mended_before_they_are_integrated():
    x = np.arange(400.0)
    slope = 0.1 * np.sin(x / 9) + 1e-4 * np.random.default_rng(1).normal(size=400)
    slope[200] = 0.3
    with pytest.warns(MendWarning, match="1 of 400 points jumps"):
        found = mend_profile(Profile.from_slope(x, slope))
    assert found.size == 399
    assert np.abs(found.slope).max() < 0.11
    assert_allclose(np.ptp(found.z), 2 * 0.1 * 9, rtol=0.02)


def test_a_profile_of_kilometres_is_named(tmp_path):
    text = "x_m,z_um\n" + "\n".join(f"{50 * i},{i % 7}" for i in range(300))
    with pytest.warns(ScaleWarning, match=r"length of an instrument, got 1.495e\+04 m"):
        read_profile(write(tmp_path, text))


def test_sentinels_are_missing_by_default_and_left_by_choice():
    with pytest.warns(MendWarning, match="16 of 25600 heights are 0, far from the rest"):
        surface = read_height_map(CASES / "zeros.npy", spacing=0.5)
    assert isinstance(surface, MendedMap)
    assert surface.mends[0].kind == "sentinels"
    assert surface.mends[0].where.sum() == 16 == round(surface.missing * 25600)
    assert_allclose(surface_statistics(surface).slope_rms.value, 0.2, rtol=0.05)
    with pytest.warns(MendWarning, match="left as they are; mend='sentinels'"):
        left = read_height_map(CASES / "zeros.npy", spacing=0.5, mend="none")
    assert left.missing == 0
    assert left.heights.min() == 0


@pytest.mark.filterwarnings("always::data_io.MendWarning")
def test_the_command_line_reads_pictures_of_heights_and_leaves_faults(tmp_path, capsys):
    picture = str(CASES / "height32.tif")
    options = ["--um-per-level", "1", "--spacing-um", "0.5"]
    assert main(["statistics", picture, *options]) == 0
    assert "slope_rms  0.198" in capsys.readouterr().out
    assert main(["statistics", picture]) == 2
    assert "--um-per-level" in capsys.readouterr().err
    zeros = str(CASES / "zeros.npy")
    assert main(["statistics", zeros, "--spacing-um", "0.5", "--mend", "none"]) == 0
    assert "--mend 'sentinels' mends" in capsys.readouterr().err
    assert main(["statistics", str(CASES / "height.mat")]) == 2
    assert "--unit" in capsys.readouterr().err


def test_a_flank_beside_a_gap_is_no_spike():
    x = np.delete(np.arange(400) * 0.25, np.arange(101, 140))
    # Rising into the gap, and low behind it
    z = np.sin((x - 25.0) / 2.13)
    profile = Profile(x, z)
    with warnings.catch_warnings():
        warnings.simplefilter("error", MendWarning)
        assert mend_profile(profile).size == x.size
    z = z.copy()
    z[200] += 5
    with pytest.warns(MendWarning, match="1 of 361 points jumps"):
        assert mend_profile(Profile(x, z)).size == x.size - 1

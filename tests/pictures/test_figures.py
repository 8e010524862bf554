"""Figures as they are drawn: where things stand, what sets the scale, what is not drawn."""

import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import Normalize, SymLogNorm
from matplotlib.patches import PathPatch
from numpy.testing import assert_allclose

from data_io import Profile, in_plane, read_goniometer, write_goniometer, write_result
from fitting import surface_statistics
from fitting.report.surface import surface_figure
from pbrdf import GaussianSurface, Material, MicrofacetModel
from pbrdf.cli import main
from pbrdf.cli.showing.export import model_rows
from pbrdf.cli.showing.plot import _origin
from pbrdf.derived.places import choose
from pbrdf.plots import hemisphere, new_figure, plane_cuts, scan_figure
from pbrdf.plots.limits import look_of, reach_of
from pbrdf.plots.scans import residuals
from pbrdf.plots.sheet import in_lines
from tests.pictures.readable import unreadable
from tests.pictures.results import hand_made


def words_of(figure) -> str:
    texts = figure.findobj(lambda artist: hasattr(artist, "get_text"))
    return "\n".join(text.get_text() for text in texts)


def test_forward_is_right_and_the_source_left():
    result = hand_made().isel(wavelength=0)
    result.brdf_total[:] = 0.01
    # One bright cell: dphi = pi, second ring
    result.brdf_total[1, 1, 4, 0, 0] = 5.0
    figure = hemisphere(result, ("M00",), theta_i=0.9)
    axis = figure.axes[0]
    mesh = next(one for one in axis.collections if one.get_array() is not None)
    bright = int(np.argmax(mesh.get_array()))
    # Corners of a piece of that cell on the sheet, from the axis's own projection
    wide = mesh.get_array().shape[1]
    ring, sector = divmod(bright, wide)
    corners = mesh.get_coordinates()[ring : ring + 2, sector : sector + 2]
    x = axis.transData.transform(corners.reshape(-1, 2))[:, 0].mean()
    centre = axis.transData.transform((0.0, 0.0))[0]
    assert x > centre
    star, plus = (
        next(line for line in axis.lines if line.get_marker() == marker) for marker in "*+"
    )
    places = [axis.transData.transform(line.get_xydata())[0, 0] for line in (star, plus)]
    assert places[0] < centre < places[1]
    assert_allclose([star.get_ydata()[0], plus.get_ydata()[0]], np.rad2deg(0.9))
    words = words_of(figure)
    assert "incidence 51.57°, 0.45 µm" in words
    assert "★ source" in words


def test_a_noisy_rim_cell_does_not_set_the_scale():
    value, error = np.full((5, 8), 0.3), np.full((5, 8), 0.01)
    value[2, 4] = 0.8
    value[4, 1], error[4, 1] = 40.0, 39.0
    assert reach_of(value, error) == 0.8
    error[4, 1] = 0.5
    assert reach_of(value, error) == 40.0


def narrow_lobe() -> xr.Dataset:
    """Return a lobe of four noisy bins on a base that is well known, and a rim cell."""
    result = hand_made(n_theta=18, n_dphi=36).isel(wavelength=0, theta_i=0)
    result.brdf_total[:] = 0.0
    result.brdf_total[..., 0, 0] = 0.04
    result.brdf_total[..., 1, 0] = 0.004
    result.brdf_total_stderr[:] = 4e-4
    result.brdf_total[3:5, 17:19, 0, 0] = 0.9
    result.brdf_total[3:5, 17:19, 1, 0] = 0.8
    result.brdf_total_stderr[3:5, 17:19] = 0.3
    result.brdf_total[17, 2, :2, 0] = 5.0
    result.brdf_total_stderr[17, 2] = 4.9
    return result


def test_a_narrow_lobe_sets_the_scale_and_a_rim_cell_does_not():
    figure = hemisphere(narrow_lobe(), ("M00", "M10", "DOLP"))
    tops = [
        axis.collections[0].get_clim()[1] for axis in figure.axes if axis.name == "polar"
    ]
    assert_allclose(tops, [0.9, 0.8, 0.8 / 0.9], rtol=1e-6)
    # The rim cell is lost in its own error: its polarisation is not known
    dolp = [axis for axis in figure.axes if axis.name == "polar"][2].collections[0]
    unknown = dolp.get_array().mask
    assert np.unique(np.argwhere(unknown)[:, 0]).tolist() == [17]
    assert unknown.sum() == unknown.shape[1] / 36


def test_a_difference_has_errors_and_no_scale_below_them():
    one = hand_made().isel(wavelength=0, theta_i=0)
    one.brdf_total_stderr[:] = 0.3
    states = xr.concat(
        [one, one * 1.0], xr.DataArray(["dry", "30 deg"], dims="state", name="state"),
        data_vars="all",
    ).assign_coords(contact_angle=("state", [np.nan, np.deg2rad(30)]))  # fmt: skip
    states.brdf_total[1] = 1.01 * states.brdf_total[0]
    figure = hemisphere(states, ("M00",), minus="dry", errors=True, width_mm=170.0)
    polar = {a.get_title(): a for a in figure.axes if a.name == "polar"}
    words = [title.replace("\n", " ") for title in polar]
    assert words[-2:] == [
        "M00, contact angle 30 deg minus dry [1/sr]",
        "error of M00, contact angle 30 deg minus dry [1/sr]",
    ]
    difference, error = (a.collections[0] for a in list(polar.values())[-2:])
    assert_allclose(np.unique(error.get_array()), np.hypot(0.3, 0.3))
    assert difference.get_clim()[1] >= 2 * 0.3 * np.sqrt(2) - 1e-9


def test_uncertain_cells_are_hatched_and_unknown_ones_left_out():
    result = hand_made().isel(wavelength=0, theta_i=0)
    result.brdf_total_stderr[3, 5, 0, 0] = 9.0
    result.brdf_total[2, 2] = np.nan
    figure = hemisphere(result, ("M00",))
    axis = figure.axes[0]
    unknown = axis.collections[0].get_array().mask
    pieces = unknown.shape[1] // 8
    assert unknown[2, 2 * pieces : 3 * pieces].all()
    assert unknown.sum() == pieces
    (outline,) = [patch for patch in axis.findobj(PathPatch) if patch.get_hatch()]
    # The dark cell and no other: dphi = 0 is drawn to the left, half a bin each side
    shape = result.brdf_total.shape[:2]
    inside = [
        outline.get_path().contains_point(
            (np.pi + dphi * 2 * np.pi / shape[1], (theta + 0.5) * 90 / shape[0])
        )
        for theta, dphi in np.ndindex(shape)
    ]
    assert list(np.flatnonzero(inside)) == [3 * shape[1] + 5]


def test_states_of_one_element_share_a_colour_bar():
    two = hand_made().isel(wavelength=0, theta_i=0)
    states = xr.concat(
        [two, 1.5 * two], xr.DataArray(["dry", "90 deg"], dims="state", name="state"),
        data_vars="all",
    )  # fmt: skip
    figure = hemisphere(states, ("M00", "M10"), minus="dry")
    polar = [axis for axis in figure.axes if axis.name == "polar"]
    assert len(polar) == 6
    # One for both states, one for the difference, of each element
    assert len(figure.axes) - len(polar) == 4
    for dry, wet in ((polar[0], polar[1]), (polar[3], polar[4])):
        limits = [axis.collections[0].get_clim() for axis in (dry, wet)]
        assert limits[0] == limits[1]


def test_printed_letters_keep_their_size(tmp_path):
    result = hand_made().isel(wavelength=0, theta_i=0)
    for width in (85.0, 170.0):
        figure = hemisphere(result, ("M00", "M10", "DOLP"), width_mm=width, errors=True)
        assert_allclose(figure.get_size_inches()[0] * 25.4, width)
        sizes = [t.get_fontsize() for t in figure.findobj(lambda a: hasattr(a, "get_text"))
                 if t.get_text()]  # fmt: skip
        assert min(sizes) >= 7.0
    figure.savefig(tmp_path / "vector.svg")
    assert "★ source" in (tmp_path / "vector.svg").read_text(encoding="utf-8")
    with pytest.raises(ValueError, match="width_mm must lie in"):
        hemisphere(result, width_mm=5.0)


def test_wet_minus_dry_is_what_it_says():
    two = hand_made().isel(wavelength=0, theta_i=0, drop=True)
    states = xr.concat(
        [two, 1.5 * two], xr.DataArray(["dry", "90 deg"], dims="state", name="state"),
        data_vars="all",
    ).assign_coords(theta_i=0.3)  # fmt: skip
    figure = hemisphere(states, ("M00",), minus="dry")
    titles = [axis.get_title() for axis in figure.axes if axis.name == "polar"]
    assert titles == [
        "M00, dry [1/sr]", "M00, 90 deg [1/sr]", "M00, 90 deg minus dry [1/sr]"
    ]  # fmt: skip
    last = [axis for axis in figure.axes if axis.name == "polar"][-1].collections[0]
    pieces = last.get_array().shape[1] // 8
    assert_allclose(last.get_array()[:, ::pieces], 0.5 * two.brdf_total[..., 0, 0])
    with pytest.raises(ValueError, match="minus must be one of dry, 90 deg"):
        hemisphere(states, ("M00",), minus="wet")


def test_cuts_break_where_nothing_is_known():
    result = hand_made()
    result.brdf_total[0, 0, 3, 4] = np.nan
    figure = plane_cuts(result, ("M00",), wavelength=0.45)
    curve = figure.axes[0].lines[0]
    assert np.isnan(curve.get_ydata()).sum() == 1
    assert "wavelength 0.45 um" in words_of(figure)


def scan(angles=(0.3, 1.2), wavelengths=(0.5, 0.8)) -> xr.Dataset:
    view = np.deg2rad([-40.0, -20.0, 20.0, 40.0])
    a, w, v = (x.ravel() for x in np.meshgrid(angles, wavelengths, view, indexing="ij"))
    return xr.Dataset(
        {
            "M00": ("geometry", 2.0 + v + a), "M00_stderr": ("geometry", 0.1 + 0 * v),
            "M10": ("geometry", 0.5 + v),
        },
        {
            "theta_i": ("geometry", a), "wavelength": ("geometry", w),
            "theta_view": ("geometry", v), "theta_s": ("geometry", abs(v)),
        },
    )  # fmt: skip


def curves_of(*angles: float) -> xr.Dataset:
    return xr.Dataset(
        {f"analytic_{n}": (("theta_i", "theta_view"), np.ones((len(angles), 3)))
         for n in ("M00", "M10", "m10")},
        {"theta_i": list(angles), "theta_view": [-1.5, 0.0, 1.5]},
    )  # fmt: skip


def test_residuals_are_points_in_standard_errors():
    view = np.deg2rad(np.arange(-30.0, 81.0))
    curve = xr.Dataset(
        {"monte_carlo_M00": ("theta_view", 2.0 + 0 * view),
         "monte_carlo_M00_stderr": ("theta_view", 0.075 + 0 * view)},
        {"theta_view": view},
    )  # fmt: skip
    here = scan().isel(geometry=slice(0, 4))
    found, unit = residuals("M00", here, curve, "monte_carlo")
    assert unit == "standard errors"
    # Where the curve does not reach there is no residual
    assert np.isnan(found[0])
    expected = (np.deg2rad([-20.0, 20.0, 40.0]) + 0.3) / np.hypot(0.1, 0.075)
    assert_allclose(found[1:], expected)


def test_a_table_of_a_model_is_one_cut_and_called_so(tmp_path):
    rows = model_rows(MicrofacetModel(Material(1.5), slope_rms=0.2), [0.5], None)
    write_goniometer(rows, tmp_path / "t.csv")
    cut = in_plane(read_goniometer(tmp_path / "t.csv"))
    assert _origin(cut) == "model"
    figure = scan_figure(cut, label=_origin(cut))
    points = figure.axes[0].lines[0].get_xdata()
    # At the zenith both azimuths of the plane are one direction
    assert np.sum(np.abs(points) < 1e-3) == 2
    assert len(points) == 2 * 17
    (words,) = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == "model"


def test_each_incidence_and_wavelength_has_its_panel():
    figure = scan_figure(scan(), curves_of(0.3, 1.2))
    titles = {axis.get_title() for axis in figure.axes} - {""}
    assert len(titles) == 3 * 4
    assert "M00 [1/sr]\nincidence 68.75°, 0.8 µm" in titles
    lower = [axis for axis in figure.axes if "std. errors" in axis.get_ylabel()]
    assert len(lower) == 4
    assert all(line.get_linestyle() == "None" for line in lower[0].lines[1:])


def test_the_command_draws_only_what_was_computed(tmp_path, capsys):
    write_result(hand_made(), tmp_path / "r.nc")
    source, target = str(tmp_path / "r.nc"), tmp_path / "r.pdf"
    for wrong, words in (
        (["--theta-i-deg", "90", "--wavelength-um", "0.45"], "got 90 deg"),
        (["--wavelength-um", "5"], "one of 0.45 um, 0.85 um"),
        ([], "Give --wavelength-um, one of 0.45 um, 0.85 um"),
        (["--theta-i-deg", "40"], "got 40 deg"),
        (["--at", "wavelength=0.5"], "got 0.5 um"),
        (["--at", "wavelength_um=0.5"], "got 0.5 um"),
        (["--at", "theta_i=51.5"], "theta_i of value 51.5. Give --theta-i-deg"),
        (["--at", "theta_i_deg=51.5"], "Give --theta-i-deg"),
        (["--at", "phi_i=1"], "phi_i_deg=VALUE"),
        (["--at", "dphi=0"], "must not name what the figure shows"),
        (["--at", "slope=1"], "further dimension of the result, here none, got 'slope'"),
        (["--at", "wavelength=0.45", "--at", "wavelength_um=0.85"], "once for each name"),
        (["--at", "wavelength=0.45", "--wavelength-um", "0.85"], "must be given once"),
        (["--at", "wavelength=0.45", "--elements", "m10"], "Did you mean M10?"),
        (["--at", "wavelength=0.45", "--elements", "M99"], "--elements must be one of"),
    ):
        assert main(["plot", source, *wrong, "-o", str(target)]) == 2
        assert words in capsys.readouterr().err
        assert not target.exists()
    good = ["--at", "wavelength=0.85", "--elements", "M10,M33", "--width-mm", "85"]
    assert main(["plot", source, *good, "--scale", "symlog", "-o", str(target)]) == 0
    assert target.read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize("name", ["-", "noext", "figure.xyz"])
def test_a_figure_has_an_ending_that_figures_have(tmp_path, monkeypatch, capsys, name):
    monkeypatch.chdir(tmp_path)
    write_result(hand_made(), tmp_path / "r.nc")
    assert main(["plot", "r.nc", "--wavelength-um", "0.45", "-o", name]) == 2
    told = capsys.readouterr().err
    assert "--output must end in .png" in told
    assert repr(name) in told
    assert "part-" not in told


def test_a_state_is_chosen_by_its_contact_angle(tmp_path, capsys):
    one = hand_made().isel(wavelength=0, theta_i=0)
    states = states_of(one).assign_coords(
        contact_angle=("state", [np.nan, 0.2, 3.0], {"units": "rad"})
    )
    cut = choose(states, {"contact_angle": 0.2})
    assert str(cut.state.values) == "15 deg"
    write_result(states, tmp_path / "r.nc")
    for place, words in (
        ("contact_angle=0.2", "contact_angle_deg=VALUE"),
        ("contact_angle_deg=0.2", "contact_angle must be one of"),
        ("state=wet", "state must be one of dry, 15 deg, 179 deg"),
        ("theta_i=17", "Give --theta-i-deg"),
    ):
        assert main(["plot", str(tmp_path / "r.nc"), "--at", place]) == 2
        assert words in capsys.readouterr().err


def test_histograms_agree_with_the_table():
    from fitting import surface_statistics
    from pbrdf import GaussianSurface

    surface = GaussianSurface(
        shape=(96, 96), spacing=1.0, corr_length=(12.0, 6.0), height_rms=1.0
    )
    found = surface_statistics(surface.sample(3))
    shown = found.histograms()
    assert [one.quantity for one in shown] == ["height", "slope along x", "slope along y"]
    table = found.to_frame().value
    for one, row in zip(shown, ("height_rms", "slope_rms_x", "slope_rms_y"), strict=True):
        assert one.rms == table[row]
    assert shown[2].rms > 1.5 * shown[1].rms


def states_of(one: xr.Dataset) -> xr.Dataset:
    names = xr.DataArray(["dry", "15 deg", "179 deg"], dims="state", name="state")
    return xr.concat([one, 1.5 * one, 0.9 * one], names, data_vars="all")


def profile() -> Profile:
    """Return a short one: its spectrum spans a decade."""
    heights = GaussianSurface(shape=(48, 48), spacing=1.0, corr_length=4.0, slope_rms=0.3)
    return Profile(np.arange(48.0), heights.sample(2).heights[:, 5])


def decades() -> xr.Dataset:
    """Return a result that is drawn logarithmically, of both signs."""
    result = hand_made().isel(wavelength=0)
    ring = xr.DataArray(10.0 ** -np.arange(6.0), dims="theta_s")
    signed = result.brdf_total * ring * np.cos(result.dphi)
    return result.assign(brdf_total=signed.transpose(*result.brdf_total.dims))


@pytest.mark.parametrize(
    "drawn",
    [
        lambda: hemisphere(
            states_of(hand_made().isel(wavelength=0, theta_i=0)), ("M00",),
            minus="dry", width_mm=85.0,
        ),
        lambda: hemisphere(decades(), ("M00", "M10"), theta_i=0.3, width_mm=85.0),
        lambda: hemisphere(
            states_of(decades().isel(theta_i=0, drop=False)).drop_vars("wavelength"),
            ("M10",), minus="dry", width_mm=85.0,
        ),
        lambda: plane_cuts(decades(), ("M10",), width_mm=85.0),
        lambda: plane_cuts(hand_made(), ("M00", "AOLP"), width_mm=85.0),
        lambda: scan_figure(scan((0.3,)), curves_of(0.3), width_mm=85.0),
        lambda: surface_figure(profile(), surface_statistics(profile()), width_mm=85.0),
    ],
    ids=[
        "states", "decades", "states-of-decades", "cuts-of-decades", "cuts", "scan",
        "surface",
    ],
)  # fmt: skip
def test_every_label_is_readable_as_printed(drawn):
    assert unreadable(drawn()) == []


def test_polarisation_and_its_difference_are_drawn_on_even_scales():
    values = np.array([[0.5, 1e-3, 2e-3, 1e-3, -2e-3]])
    for name in ("DOLP", "difference of DOLP", "error of DOLP"):
        norm, _, _ = look_of(name, values, None if "error" in name else 0.01 * abs(values))
        assert type(norm) is Normalize
    # While elements have decades
    assert type(look_of("difference of M10", values, 0.01 * abs(values))[0]) is SymLogNorm


def test_a_long_title_is_broken_at_commas():
    place = "incidence 40°, wavelength not given, folded about the plane"
    assert in_lines([place], 170 / 25.4) == place
    assert in_lines([place, "", "note"], 85 / 25.4) == (
        "incidence 40°, wavelength not given,\nfolded about the plane\nnote"
    )


def test_cuts_mark_their_angles_and_leave_noise_small():
    result = hand_made(waves=(0.45,), n_theta=18, n_dphi=36)
    rng = np.random.default_rng(3)
    result.brdf_total[..., 2, 0] = 1e-4 * rng.normal(size=result.brdf_total.shape[:-2])
    result.brdf_total[:, :, 4, :, 2, 0] *= 40
    result.brdf_total_stderr[..., 2, 0] = 1e-4
    result.brdf_total_stderr[:, :, 4, :, 2, 0] *= 40
    figure = plane_cuts(result, ("M00", "M10", "M20", "DOLP"))
    assert "wavelength 0.45 um" in words_of(figure)
    assert all(axis.get_visible() for axis in figure.axes)
    assert figure.axes[0].get_subplotspec().get_geometry()[:2] == (2, 2)
    for axis in figure.axes:
        angles = {mark: [] for mark in "*+"}
        for line in axis.lines:
            if line.get_marker() in angles:
                angles[line.get_marker()].append(line.get_xdata()[0])
        assert_allclose(angles["+"], np.rad2deg([0.3, 0.9]))
        assert_allclose(angles["*"], -np.rad2deg([0.3, 0.9]))
    # By symmetry zero: no decades of noise
    assert figure.axes[2].get_yscale() == "linear"
    assert figure.axes[2].get_ylim()[1] > 2e-4


def test_letters_over_letters_and_off_the_sheet_are_seen():
    figure, axes = new_figure(1, 1, (3.0, 2.0))
    assert unreadable(figure) == []
    axes[0, 0].text(0.5, 0.5, "one")
    axes[0, 0].text(0.51, 0.5, "two")
    figure.text(0.95, 0.5, "far away")
    over, off = sorted(unreadable(figure), key=len)
    assert "'one' and 'two' overlap" in over + off
    assert "'far away' leaves the sheet" in over + off


def test_the_specular_beam_is_shown_apart():
    result = hand_made()
    beam = np.zeros((result.sizes["theta_i"], result.sizes["wavelength"], 4, 4))
    beam[..., 0, 0] = 0.04
    light = ("theta_i", "wavelength", "stokes_out", "stokes_in")
    figure = plane_cuts(result.assign(coherent=(light, beam)), ("M00",), wavelength=0.45)
    assert "specular beam (dotted), not in the BRDF: reflectance 0.04" in words_of(figure)
    marks = [line for line in figure.axes[0].lines if line.get_linestyle() == ":"]
    assert marks[0].get_xdata()[0] == pytest.approx(np.rad2deg(result.theta_i.values[0]))
    none = plane_cuts(result.assign(coherent=(light, 0 * beam)), ("M00",), wavelength=0.45)
    assert "specular beam" not in words_of(none)

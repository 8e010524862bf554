"""The page of a result in Chromium: it works, is readable and fits a telephone."""

import re
from itertools import pairwise

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

from fitting.report import html
from fitting.report.explorer import page_of
from fitting.report.layers import model_of
from pbrdf.derived import element
from pbrdf.derived.bins import on_bins
from pbrdf.plots.limits import look_of
from tests.pictures.browser import WIDTHS, asked, assert_sound
from tests.pictures.results import hand_made

SCENE = """
[surface]
type = "gaussian"
shape = [64, 64]
spacing_um = 1.0
corr_length_um = 12.0
slope_rms = 0.3

[substrate]
n = 1.5
kappa = 0.2
"""
BINS = (6, 8)


def bounced() -> xr.Dataset:
    """A result by bounces whose parts and errors are known."""
    result = hand_made(n_theta=BINS[0], n_dphi=BINS[1]).assign_attrs(scene=SCENE)
    share = xr.DataArray([0.6, 0.3, 0.1], {"bounces": ["1", "2", "3+"]}, "bounces")
    # Of two bounces more towards the horizon, at the cost of one
    more = xr.DataArray([-0.1, 0.1, 0.0], share.coords) * np.sin(result.theta_s)
    share = share + more
    error = 0.01 * share * xr.ones_like(result.brdf_total)
    return result.assign(brdf=share * result.brdf_total, brdf_stderr=error)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    result = bounced()
    first = {"element": "M10 [1/sr]", "dim0": "51.5662 deg", "dim1": "0.45 um"}
    asks = [
        (first, 2, 3),
        ({"bounces": "2"}, 2, 3),
        ({"show": "analytical model"}, 2, 3),
        ({"show": "Monte Carlo - model"}, 2, 3),
        ({"show": "difference in standard errors", "bounces": "all"}, 2, 3),
        ({"show": "Monte Carlo", "element": "AOLP [deg]"}, 4, 5),
        ({"element": "M00 [1/sr]", "dim1": "0.85 um"}, 5, 4),
        ({"scale": "logarithmic"}, 5, 4),
        ({"element": "M20 [1/sr]"}, 1, 7),
    ]  # fmt: skip
    page = page_of(result, "r.nc")
    ask = [(*one, *BINS) for one in asks]
    return result, asked(page, ask, tmp_path_factory.mktemp("page"))


def test_the_page_is_sound_on_a_desk_and_in_a_hand(found):
    _, answers = found
    assert_sound(answers)
    for width in WIDTHS:
        assert len(answers[width]["lettered"]) > 20
        assert "view angle [deg], + forward" in answers[width]["lettered"]


def number(text: str) -> list[float]:
    return [float(word) for word in re.findall(r"= (\S+) (?:± (\S+) )?", text)[0] if word]


def test_the_value_under_the_finger_is_that_of_the_result(found):
    result, answers = found
    model = on_bins(model_of(result), result.brdf_total).brdf_total
    at = {"theta_i": 1, "wavelength": 0, "theta_s": 2, "dphi": 3}
    share = 0.3 + 0.1 * float(np.sin(result.theta_s[2]))
    all_m10 = float(element(result, "M10").value[at])
    model_m10 = float(model[at].sel(stokes_out="Q", stokes_in="I"))
    far = dict(zip(at, (1, 0, 4, 5), strict=True))
    aolp = element(result, "AOLP")
    rim = dict(zip(at, (1, 1, 5, 4), strict=True))
    expected = [
        [all_m10, 0.02],
        [share * all_m10, 0.01 * share],
        [model_m10],
        [share * all_m10 - model_m10, 0.01 * share],
        [(all_m10 - model_m10) / 0.02],
        [np.rad2deg(float(part[far])) for part in aolp],
        [float(element(result, "M00").value[rim]), 0.02],
    ]
    for width in WIDTHS:
        for numbers, (text, *_) in zip(expected, answers[width]["answers"], strict=False):
            np.testing.assert_allclose(number(text), numbers, rtol=6e-3, err_msg=text)
        assert "zenith 37.5°" in answers[width]["answers"][0][0]
        assert "azimuth from the source 135.0°" in answers[width]["answers"][0][0]


def test_each_control_changes_the_picture(found):
    _, answers = found
    for width in WIDTHS:
        discs = [disc for _, disc, _ in answers[width]["answers"]]
        cuts = [cut for *_, cut in answers[width]["answers"]]
        assert all(a != b for a, b in pairwise(discs))
        assert all(a != b for a, b in pairwise(cuts))
        names = [name for name, _ in answers[width]["controls"]]
        assert names == [
            f"pick-{n}" for n in ("element", "dim0", "dim1", "bounces", "show", "scale")
        ]


def test_numbers_stay_whole_and_what_scrolls_says_so(tmp_path):
    rows = [
        ("diffuse_albedo_of_the_base", "0.078655", "not determined", "-1.4999", "1e-27")
    ]
    header = ("quantity", "standard error", "value", "95 % from", "to")
    figure = html.figure(html.png(Figure(figsize=(6, 1))), "wide")
    page = html.page("Page", [html.table(header, rows * 3), figure])
    viewer = '<canvas id="disc"></canvas><p id="value"></p>'
    answers = asked(page.replace("</body>", f"{viewer}</body>"), [], tmp_path)
    assert_sound(answers)
    assert answers[390]["scrolling"] == 2
    assert answers[1440]["scrolling"] == 0


def test_the_page_opens_on_the_scale_that_the_plot_chooses(tmp_path):
    flat, peaked = bounced(), bounced()
    peaked["brdf_total"] = peaked.brdf_total.copy()
    peaked.brdf_total[:, :, 3, 4] *= 3000.0
    for number, (result, scale) in enumerate([(flat, "linear"), (peaked, "log")]):
        value = element(result.isel(theta_i=0, wavelength=0), "M00").value.values
        norm = type(look_of("M00", value, None)[0]).__name__
        assert norm == {"linear": "Normalize", "log": "LogNorm"}[scale]
        word = {"linear": "linear", "log": "logarithmic"}
        other = word["log" if scale == "linear" else "linear"]
        first = {"element": "M00 [1/sr]"}
        asks = [(p, 2, 3, *BINS) for p in (first, {"scale": word[scale]}, {"scale": other})]
        folder = tmp_path / str(number)
        folder.mkdir()
        for out in asked(page_of(result, "r.nc"), asks, folder).values():
            opened, same, differs = (disc for _, disc, _ in out["answers"])
            assert opened == same != differs


def test_the_cut_has_room_for_its_bars(tmp_path):
    result = bounced()
    result["brdf_total_stderr"] = xr.full_like(result.brdf_total, 0.25)
    for answer in asked(page_of(result, "r.nc"), [], tmp_path).values():
        cut = result.brdf_total[0, 0, :, [0, 4], 0, 0]
        ends = float(cut.max()) + 2 * 0.25
        assert f"{ends:.3g}" in answer["lettered"]


def test_wet_minus_dry_is_offered_and_told(tmp_path):
    dry = hand_made(waves=(0.45,), n_theta=BINS[0], n_dphi=BINS[1])
    wet = dry.assign(brdf_total=1.25 * dry.brdf_total)
    both = xr.concat([dry, wet], xr.Variable("state", ["dry", "30 deg"]))
    page = page_of(both, "dew.nc")
    assert "at Show “minus dry”, for what water changes" in page
    assert "minus dry" not in re.sub(
        "<script>.*?</script>", "", page_of(dry, "r.nc"), flags=re.S
    )
    asks = [({"dim0": "30 deg", "show": "minus dry"}, 2, 3, *BINS)]
    added = 0.25 * float(element(dry, "M00").value[0, 0, 2, 3])
    for out in asked(page, asks, tmp_path).values():
        assert out["errors"] == []
        np.testing.assert_allclose(number(out["answers"][0][0])[0], added, rtol=6e-3)

"""The page of a result: whole without a network, its numbers those of the result."""

import base64
import json
import re
from types import SimpleNamespace

import numpy as np
from numpy.testing import assert_allclose
from scipy.ndimage import gaussian_filter, gaussian_filter1d

from data_io import Profile, read_goniometer, write_result
from fitting.checks.unread import what_hangs_together
from fitting.quick import run_quick
from fitting.report import html
from fitting.report.explorer import fit_summary, origin, page_of
from fitting.report.quick_page import write_quick
from fitting.report.surface import surface_figure
from fitting.statistics.surface import surface_statistics
from pbrdf import HeightMap, Material
from pbrdf.cli import main
from tests.fits.test_pipeline import write_scan
from tests.pictures.results import hand_made


def fit(verdict: str, gain: float) -> dict:
    return {
        "parameters": {"specular_gain": {"value": gain, "stderr": 0.01}},
        "misfit": {"verdict": verdict}, "dof": 17, "noise": "stated", "warnings": [],
        "correlation": [[1.0]],
    }  # fmt: skip


def test_the_page_stands_alone(tmp_path, capsys):
    write_result(hand_made(), tmp_path / "r.nc")
    assert main(["report", str(tmp_path)]) == 0
    page = (tmp_path / "r.html").read_text(encoding="utf-8")
    assert 'name="viewport"' in page
    assert "@media print" in page
    assert not re.findall(r'(?:src|href)="(?!data:)', page)
    assert "http" not in page
    assert len(page) < 5_000_000
    sizes = [float(px) for px in re.findall(r"font[^;}]*?(\d+)px", page)]
    assert min(sizes) >= 12
    assert main(["report", str(tmp_path)]) == 2
    assert "--force" in capsys.readouterr().err


def test_the_viewer_holds_the_values_of_the_result():
    result = hand_made()
    result.brdf_total[1, 0, 2, 3] = np.nan
    page = page_of(result, "r.nc")
    text = re.search(r'id="hemisphere-data">(.*?)</script>', page, re.S)[1]
    held = json.loads(text)
    assert [d["values"] for d in held["dims"]] == [
        ["17.1887 deg", "51.5662 deg"], ["0.45 um", "0.85 um"],
    ]  # fmt: skip
    layer = held["monte_carlo"][2][0][1]
    value, error = (
        factor * np.frombuffer(base64.b64decode(text), "<f2").astype(float).reshape(6, 8)
        for factor, text in layer[:2]
    )
    assert_allclose(value, result.brdf_total[1, 0, :, :, 1, 0], rtol=2**-11)
    assert np.isnan(value[2, 3])
    assert_allclose(error, 0.02, rtol=2**-11)


def test_the_download_is_the_cut():
    page = page_of(hand_made(), "r.nc")
    data = re.search(r"data:text/plain;base64,([^\"]+)", page)[1]
    lines = base64.b64decode(data).decode().splitlines()
    assert set(lines[0].split(",")) >= {"theta_i_deg", "theta_view_deg", "wavelength_um"}
    assert len(lines) == 1 + 2 * 2 * 12


def test_the_summary_names_verdict_answer_and_file():
    said = fit_summary(
        {"Analytical": fit("fair", 0.836), "Monte Carlo": fit("good", 0.801)}
    )
    text = " ".join(said)
    assert "verdict “good”" in text
    assert "0.801 ± 0.01" in text
    assert "model.toml holds the analytical fit" in text
    assert text.index("0.801") < text.index("0.836")


def test_the_origin_names_hashes_and_command():
    record = {
        "program": "pbrdf 1", "command": "pipeline", "options": {"n": 1.5, "n_rays": 10},
        "inputs": [{"role": "scan", "name": "my scan.csv", "sha256": "ab" * 32}],
        "typed": ["pbrdf", "pipeline", "my scan.csv", "--n", "1.5"],
    }  # fmt: skip
    text = origin(record)
    assert "ab" * 32 in text
    assert "pbrdf pipeline &#x27;my scan.csv&#x27; --n 1.5" in text


def test_what_hangs_together_and_whose_error_it_is():
    fit = SimpleNamespace(
        values={"specular_gain": 0.8, "diffuse_albedo": 0.1, "n": 1.5},
        correlation=np.array([[1, -0.9512, 0.1], [-0.9512, 1, np.nan], [0.1, np.nan, 1]]),
        stderr={"specular_gain": 0.05, "diffuse_albedo": 0.01, "n": 0.02},
        stderr_parts={
            "specular_gain": {"noise": 0.03, "slope_rms": 0.04},
            "diffuse_albedo": {"noise": 0.00999, "slope_rms": 0.0005}, "n": {"noise": 0.02},
        },
        warnings=(),
    )  # fmt: skip
    together, error = what_hangs_together(fit)
    assert "specular_gain and diffuse_albedo are correlated at -0.95" in together
    assert "the other is too low" in together
    assert "error of specular_gain is 0.05, of which 0.04 come from" in error
    assert "slope_rms and 0.03 from the noise" in error
    fit.warnings = ("diffuse_albedo and specular_gain are 95 % correlated; fix one",)
    assert list(what_hangs_together(fit)) == [error]


def test_a_first_look_says_what_it_cannot_tell_and_names_the_scan(tmp_path):
    write_scan(tmp_path / "steel.csv", ("M00",))
    x = np.arange(400.0)
    z = gaussian_filter1d(np.random.default_rng(1).standard_normal(400), 6.0) * 8
    result = run_quick(
        Profile(x, z), read_goniometer(tmp_path / "steel.csv"), material=Material(1.5)
    )
    record = {"program": "p", "command": "pipeline", "options": {}, "inputs": []}
    write_quick(result, tmp_path, record=record)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    listed = re.search(r"What these data cannot tell</h2>\s*<ul>(.*?)</ul>", page, re.S)[1]
    assert "Only unpolarised reflectance" in listed
    assert "come from the uncertain slope_rms" in listed
    assert "(M00 of steel.csv" in page
    verdict = result.analytic.misfit.verdict
    assert f"“{verdict}”: half of the readings" in page
    assert "Nothing that this fit can see" in html.told(())


def test_the_page_of_a_simulation_explains_only_what_it_shows():
    result = hand_made()
    result.attrs["made_by"] = {
        "program": "p", "command": "dew", "options": {},
        "inputs": [{"role": "scene", "name": "wet.toml", "sha256": "ab" * 32}],
    }  # fmt: skip
    result.brdf_total_stderr[:] = 1.0
    page = page_of(result, "r.nc")
    explained = page.partition("Glossary")[2]
    assert "DOLP" in explained
    for word in ("chi2", "specular_gain", "diffuse_albedo", "misfit", "kappa"):
        assert word not in explained
    assert "that of wet.toml, see below" in page
    assert "not recorded" not in page
    assert re.search(r"in the median bin and \d+ % in the worst", page)
    fitted = page_of(result.assign_attrs(monte_carlo_fit=fit("good", 0.8)), "r.nc")
    assert "factor on the surface reflection" in fitted


def test_the_spectrum_of_a_smooth_map_is_as_tall_as_its_data():
    heights = np.random.default_rng(2).standard_normal((96, 96))
    surface = HeightMap(gaussian_filter(heights, 6.0, mode="wrap"), 1.0)
    figure = surface_figure(surface, surface_statistics(surface))
    (axis,) = (one for one in figure.axes if "spectrum" in one.get_title())
    dots = np.concatenate(
        [line.get_ydata() for line in axis.lines if line.get_marker() == "."]
    )
    lines = [line.get_ydata() for line in axis.lines if line.get_linestyle() == "-"]
    low, high = axis.get_ylim()
    assert low < dots.min() < dots.max() < high
    assert low > dots.min() / 10
    assert high < 10 * dots.max()
    assert min(line.min() for line in lines) < low

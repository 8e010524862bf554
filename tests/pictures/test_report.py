"""The page of a result: whole without a network, its numbers those of the result."""

import base64
import json
import re

import numpy as np
from numpy.testing import assert_allclose

from data_io import write_result
from fitting.report.explorer import fit_summary, origin, page_of
from pbrdf.cli import main
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

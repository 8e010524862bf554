"""`pbrdf contact-angle`: numbers, overlay and errors in the words of its options."""

import json
from pathlib import Path

import numpy as np
import pytest
from skimage import io

from pbrdf.cli import main

CASES = Path(__file__).parents[1] / "cases" / "surface"
DROP = str(CASES / "drop_inverted_70.png")


def test_numbers_and_overlay(tmp_path, capsys):
    check = tmp_path / "check.png"
    assert main(["contact-angle", DROP, "--json", "-", "--overlay", str(check)]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["left_deg"]["low"] < found["left_deg"]["value"] < found["left_deg"]["high"]
    assert found["right_deg"]["value"] == pytest.approx(70, abs=0.5)
    drawn, photo = io.imread(check).astype(int), io.imread(DROP)
    assert drawn.shape[:2] == photo.shape[:2]
    # The substrate begins at row 300
    green = np.argwhere((drawn[..., 1] > 200) & (drawn[..., 0] < 60))
    top = green[:, 0].min()
    assert top == pytest.approx(300 - found["height_pixels"], abs=1.5)
    # An existing file is not replaced
    assert main(["contact-angle", DROP, "--overlay", str(check)]) == 2


def test_interval_is_printed_with_its_digits(capsys):
    assert main(["contact-angle", DROP]) == 0
    left = capsys.readouterr().out.splitlines()[0]
    low, high = left.split("95 %: ")[1].split(")")[0].split(" .. ")
    assert float(low) < float(high)


def test_given_baseline_and_crop(capsys):
    options = ["--baseline", "300,80,300,560", "--crop", "100,390,100,500"]
    assert main(["contact-angle", DROP, *options, "--json", "-"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["baseline_row_column"][0][0] == pytest.approx(300, abs=0.1)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--baseline", "1,2,3"], "--baseline must be four numbers"),
        (["--baseline", "1,7,3,7"], "--baseline must join two columns"),
        (["--crop", "0,9999,0,10"], "--crop must lie inside"),
        (["--which", "2"], "--which must be 1 to 1, got 2"),
    ],
)
def test_errors_name_options(options, sentence, capsys):
    assert main(["contact-angle", DROP, *options]) == 2
    assert sentence in capsys.readouterr().err


def test_refusals_name_file_and_options(capsys):
    assert main(["contact-angle", str(CASES / "not_a_drop.png")]) == 2
    error = capsys.readouterr().err
    assert "not_a_drop.png" in error
    assert "--baseline" in error
    assert "baseline=" not in error

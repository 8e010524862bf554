"""The notebooks run from top to bottom, without a warning, and find what they say."""

import re

import pytest
from matplotlib.figure import Figure

from docs.notebook_pages import NOTEBOOKS, ran

FIGURES = {"paint_to_polar_plots": 3, "fit_a_scan": 1, "map_to_prediction": 2}


@pytest.mark.parametrize("name", FIGURES)
def test_a_notebook_runs(name):
    cells = list(ran(NOTEBOOKS / f"{name}.ipynb"))
    shown = [value for *_, value in cells if isinstance(value, Figure)]
    assert len(shown) == FIGURES[name]
    values = {source: value for _, source, _, value in cells}
    words = "".join(printed for _, _, printed, _ in cells)
    if name == "fit_a_scan":
        (frame,) = (one for one in values.values() if hasattr(one, "in_errors"))
        assert (frame.in_errors.abs() < 3).all()
    if name == "map_to_prediction":
        inside, of = re.search(r"(\d+) of (\d+) directions inside", words).groups()
        assert int(inside) >= 0.8 * int(of)
        assert 0.9 < float(re.search(r"predicted / simulated = (\S+)", words)[1]) < 1.1


def test_every_notebook_is_tested_and_holds_no_output():
    found = sorted(NOTEBOOKS.glob("*.ipynb"))
    assert {path.stem for path in found} == set(FIGURES)
    for path in found:
        assert '"output_type"' not in path.read_text(encoding="utf-8")

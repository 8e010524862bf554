"""The documentation lists every name that the model accepts."""

from pathlib import Path

import pytest

from docs.name_tables import renewed
from pbrdf.analytic import GRAZING_FORMS, SHADOWING, SLOPE_DISTRIBUTIONS, VOLUME_FORMS

PAGE = Path(__file__).parents[2] / "docs" / "analytic.md"


@pytest.mark.parametrize(
    "name", [*SHADOWING, *SLOPE_DISTRIBUTIONS, *VOLUME_FORMS, *GRAZING_FORMS]
)
def test_name_is_documented_with_its_source(name):
    tables = (SHADOWING, SLOPE_DISTRIBUTIONS, VOLUME_FORMS, GRAZING_FORMS)
    assert all(table[name].source for table in tables if name in table)
    assert name in PAGE.read_text(encoding="utf-8")


def test_the_tables_of_the_page_are_those_of_the_code():
    text = PAGE.read_text(encoding="utf-8")
    assert renewed(text) == text, "run `make docs`, which renews them"
    changed = text.replace("| `gaussian` |", "| `gauss` |")
    assert renewed(changed) == text

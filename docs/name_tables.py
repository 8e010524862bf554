"""The tables of names in docs/analytic.md, written from those that the model accepts.

`make docs` renews them: PYTHONPATH=. python docs/name_tables.py
"""

import re
from pathlib import Path

from pbrdf.analytic import SHADOWING, SLOPE_DISTRIBUTIONS
from pbrdf.analytic.tables import Choice

__all__ = ["renewed"]

PAGE = Path(__file__).parent / "analytic.md"
TABLES = {
    "slope_distribution": ("P(tilt) per solid angle", SLOPE_DISTRIBUTIONS),
    "shadowing": ("factor", SHADOWING),
}


def renewed(page: str) -> str:
    """Return a page with its tables of names as the code has them."""
    for argument, (head, table) in TABLES.items():
        marks = f"<!-- {argument}, by docs/name_tables.py -->\n", "<!-- end -->"
        pattern = re.escape(marks[0]) + ".*?" + re.escape(marks[1])
        text = "".join([marks[0], _table(argument, head, table), marks[1]])
        page, count = re.subn(pattern, lambda _, new=text: new, page, flags=re.DOTALL)
        if count != 1:
            msg = f"the page must have one table of {argument}, got {count}"
            raise ValueError(msg)
    return page


def _table(argument: str, head: str, table: dict[str, Choice]) -> str:
    rows = [f"| `{argument}` | {head} | source |", "|---|---|---|"]
    rows += [f"| `{name}` | `{c.formula}` | {c.source} |" for name, c in table.items()]
    return "\n".join(rows) + "\n"


if __name__ == "__main__":
    PAGE.write_text(renewed(PAGE.read_text(encoding="utf-8")), encoding="utf-8")

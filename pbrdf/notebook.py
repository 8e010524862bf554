"""Tables for notebooks: what an object shows of itself as HTML."""

from collections.abc import Iterable, Sequence
from html import escape

__all__ = ["table"]


def table(title: str, rows: Iterable[Sequence[str]], header: Sequence[str] = ()) -> str:
    """Return a table of plain texts under a title.

    Examples
    --------
    >>> table("Drop", [("angle", "90 < 95")])
    '<b>Drop</b><table><tr><td>angle</td><td>90 &lt; 95</td></tr></table>'
    """
    head = "".join(f"<th>{escape(cell)}</th>" for cell in header)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>"
        for row in rows
    )
    first = f"<tr>{head}</tr>" if head else ""
    return f"<b>{escape(title)}</b><table>{first}{body}</table>"

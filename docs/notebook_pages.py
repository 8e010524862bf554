"""Run the notebooks of examples/notebooks, and make pages of them with what they show."""

import ast
import io
import json
from collections.abc import Iterator
from contextlib import chdir, redirect_stdout
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

NOTEBOOKS = Path(__file__).parents[1] / "examples" / "notebooks"

__all__ = ["NOTEBOOKS", "page", "ran"]


def ran(notebook: Path) -> Iterator[tuple[str, str, str, Any]]:
    """Yield kind and source of each cell, what it printed, and the value it ends with.

    The notebook runs in a folder of its own, as after "Restart and run all".
    """
    cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    names: dict[str, Any] = {"__name__": "__main__"}
    with TemporaryDirectory() as folder:
        for number, cell in enumerate(cells):
            source = "".join(cell["source"])
            if cell["cell_type"] != "code":
                yield "markdown", source, "", None
                continue
            with chdir(folder), redirect_stdout(io.StringIO()) as printed:
                value = _value(source, f"{notebook.name}, cell {number}", names)
            yield "code", source, printed.getvalue(), value


def _value(source: str, place: str, names: dict[str, Any]) -> Any:
    """Run a cell; return the value of its last expression."""
    tree = ast.parse(source, place)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, place, "exec"), names)
    if last is None:
        return None
    return eval(compile(ast.Expression(last.value), place, "eval"), names)


def page(notebook: Path, pictures: Path) -> str:
    """Return a notebook as Markdown with its output; its figures go to a folder."""
    from matplotlib.figure import Figure

    pictures.mkdir(exist_ok=True)
    parts = []
    for number, (kind, source, printed, value) in enumerate(ran(notebook)):
        if kind == "markdown":
            parts.append(source)
            continue
        parts.append(f"```python\n{source}\n```")
        if printed:
            parts.append(f"```text\n{printed.rstrip()}\n```")
        if isinstance(value, Figure):
            name = f"{notebook.stem}_{number}.png"
            value.savefig(pictures / name, dpi=150)
            parts.append(f"![What the cell draws]({pictures.name}/{name})")
        elif hasattr(value, "to_string"):
            parts.append(f"```text\n{value.to_string()}\n```")
        elif hasattr(value, "_repr_html_") and not hasattr(value, "dims"):
            parts.append(value._repr_html_())
        elif value is not None:
            parts.append(f"```text\n{value!r}\n```")
    return "\n\n".join(parts) + "\n"

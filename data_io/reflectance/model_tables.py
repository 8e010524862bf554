"""Tables of model files: keys that are known, and those that must be there."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pbrdf.errors import DataFileError

__all__ = ["checked_table"]


def checked_table(
    document: Mapping[str, Any], name: str, known: set[str], needed: set[str], source: Path
) -> dict[str, Any]:
    """Return a table of a document, refused if a key is unknown or missing."""
    table = document.get(name)
    if not isinstance(table, dict):
        raise DataFileError(
            source, f"expected a table [{name}], got none", "A model needs it."
        )
    for key in table.keys() - known:
        cure = f"Known: {', '.join(sorted(known))}."
        raise DataFileError(source, "unknown key", cure, column=f"[{name}] {key}")
    for key in needed - table.keys():
        raise DataFileError(source, "missing key", "Give it.", column=f"[{name}] {key}")
    return dict(table)

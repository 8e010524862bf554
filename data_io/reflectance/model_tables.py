"""Tables of model files: the index, keys that are known, and those that must be there."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pbrdf.errors import DataFileError

if TYPE_CHECKING:
    from pbrdf.optics.materials import Material

__all__ = ["INDEX_KEYS", "checked_table", "index_table"]

INDEX_KEYS = {"n", "kappa", "name"}


def index_table(material: "Material") -> dict[str, Any]:
    """Return the table of a material, refused if its index is tabulated."""
    if callable(material.n) or callable(material.kappa):
        msg = (
            "material must have a constant index to be written, got a table. "
            "Use Material(*material.index(wavelength))."
        )
        raise ValueError(msg)
    index: dict[str, Any] = {} if material.name is None else {"name": material.name}
    return index | {"n": float(material.n), "kappa": float(material.kappa)}


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

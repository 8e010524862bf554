"""Tables of TOML files: keys that are known, values of the right kind, materials."""

import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from pbrdf.errors import DataFileError
from pbrdf.optics import library
from pbrdf.optics.dispersion import Table
from pbrdf.optics.materials import Material

MATERIAL_KEYS = {"material", "n", "kappa", "diffuse_albedo", "wavelength_um", "name"}


def read_toml(source: Path) -> dict[str, Any]:
    """Parse a TOML file, or raise a DataFileError that says what is wrong with it."""
    try:
        return tomllib.loads(source.read_text(encoding="utf-8"))
    except OSError as error:
        problem, cure = f"cannot be read ({error.strerror})", "Check the path."
    except UnicodeDecodeError:
        problem, cure = "is not a text file", "A scene is a TOML file in UTF-8."
    except tomllib.TOMLDecodeError as error:
        problem, cure = f"is not valid TOML: {error}", "Mend the line named."
    raise DataFileError(source, problem, cure)


def required(document: Mapping[str, Any], name: str, source: Path) -> dict[str, Any]:
    """Return a table of the document that must be there."""
    table = document.get(name)
    if not isinstance(table, dict):
        raise DataFileError(source, f"has no table [{name}]", "A scene needs it.")
    return dict(table)


def check_keys(
    table: Mapping[str, Any], known: Iterable[str], place: str, source: Path
) -> None:
    """Refuse keys that nobody reads."""
    for key in table:
        if key not in known:
            raise DataFileError(
                source,
                f"[{place}]: unknown key {key!r}",
                f"Known: {', '.join(sorted(known))}.",
            )


def check_present(
    table: Mapping[str, Any], keys: Iterable[str], place: str, source: Path
) -> None:
    """Refuse a table without keys that it needs."""
    for key in keys:
        if key not in table:
            raise DataFileError(source, f"[{place}]: key {key!r} is missing", "Give it.")


def kind_of(table: dict[str, Any], known: Iterable[str], place: str, source: Path) -> str:
    """Take the key `type` out of a table; it must name a known kind."""
    kind = table.pop("type", None)
    if not isinstance(kind, str) or kind not in known:
        raise DataFileError(
            source, f"[{place}]: type is {kind!r}", f"Known: {', '.join(known)}."
        )
    return kind


def plain(value: Any) -> Any:
    """Return tuples as lists, which TOML has."""
    return list(value) if isinstance(value, tuple) else value


def material_table(material: Material) -> dict[str, Any]:
    """Write a material by name, or with its constants."""
    if material.name in library.names() and library.get(str(material.name)) == material:
        return {"material": material.name}
    table: dict[str, Any] = {} if material.name is None else {"name": material.name}
    for key, constant in (("n", material.n), ("kappa", material.kappa)):
        if isinstance(constant, Table):
            table["wavelength_um"] = list(constant.wavelength)
            table[key] = list(constant.values)
        elif callable(constant):
            msg = f"{key} must be a number or a table to be written, got {constant!r}."
            raise ValueError(msg)
        else:
            table[key] = constant
    return table | {"diffuse_albedo": material.diffuse_albedo}


def read_material(table: Mapping[str, Any], place: str, source: Path) -> Material:
    """Read a material from its table."""
    check_keys(table, MATERIAL_KEYS, place, source)
    table = dict(table)
    if "material" in table:
        if len(table) > 1:
            raise DataFileError(
                source, f"[{place}]: 'material' stands beside other keys",
                "Name a library material, or give n and kappa.",
            )  # fmt: skip
        return library.get(table["material"])
    if "n" not in table:
        raise DataFileError(source, f"[{place}]: key 'n' is missing", "Or give 'material'.")
    wavelength = table.pop("wavelength_um", None)
    if wavelength is None:
        return Material(**table)
    return Material.from_table(wavelength=wavelength, **table)

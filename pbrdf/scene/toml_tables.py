"""Tables of TOML files: keys that are known, values of the right kind, materials."""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pbrdf.errors import DataFileError
from pbrdf.files import companion
from pbrdf.optics import library
from pbrdf.optics.dispersion import Table
from pbrdf.optics.materials import Material
from pbrdf.optics.published import read, read_constant
from pbrdf.optics.published.formulas import Formula
from pbrdf.optics.published.package import PREFIX, Entry
from pbrdf.optics.published.transparency import warn_if_absorbing

CONSTANTS = ("n", "kappa", "diffuse_albedo")
# Whole numbers beyond this are no measurement; a float of TOML is never larger
LARGEST = 10**300
_OF_A_CONSTANT = ("wavelength_um", "values", "formula", "coefficients", "range_um")
MATERIAL_KEYS = {
    "material", *CONSTANTS, "wavelength_um", "name", "file", "ignore", "absorbs_all",
}  # fmt: skip


def required(document: Mapping[str, Any], name: str, source: Path) -> dict[str, Any]:
    """Return a table of the document that must be there."""
    table = document.get(name)
    if isinstance(table, list):
        cure = f"Write [{name}]"
        if name == "substrate":
            cure += ", several as materials = [{n = 1.5}, {n = 1.3}] in it"
        raise DataFileError(source, f"{name!r} is a list of tables", f"{cure}.")
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


def refused(
    table: Mapping[str, Any], place: str, source: Path, error: Exception
) -> DataFileError:
    """Say what is wrong with an argument in the words of the file: its keys."""
    problem = str(error).rstrip(".")
    for key in table:
        argument = re.sub("_um3?$", "", key)
        problem = re.sub(rf"^{re.escape(argument)} must", f"{key} must", problem)
    return DataFileError(source, f"[{place}]: {problem}", "See the documented keys.")


def check_numbers(
    table: Mapping[str, Any], keys: Iterable[str], place: str, source: Path
) -> None:
    """Refuse values of these keys that are no numbers, nor lists of numbers."""
    for key in keys:
        for value in _leaves(table.get(key, [])):
            number = isinstance(value, int | float) and not isinstance(value, bool)
            if not number or (isinstance(value, int) and abs(value) > LARGEST):
                word = str(value).lower() if isinstance(value, bool) else repr(value)
                raise DataFileError(
                    source, f"[{place}]: {key!r} holds {word}",
                    "Write a number, or a list of numbers.",
                )  # fmt: skip


def _leaves(value: Any) -> Iterator[Any]:
    """Yield what lists hold, however deep."""
    if not isinstance(value, list):
        yield value
        return
    for one in value:
        yield from _leaves(one)


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
    if material.absorbs_all:
        table["absorbs_all"] = True
    n, kappa, albedo = material.n, material.kappa, material.diffuse_albedo
    table["diffuse_albedo"] = _constant_table("diffuse_albedo", albedo)
    if isinstance(n, Entry) and isinstance(kappa, Entry) and kappa.address == n.address:
        return table | {"file": f"{PREFIX}{n.address}"}
    grids = {c.wavelength for c in (n, kappa) if isinstance(c, Table)}
    if len(grids) == 1 and not isinstance(n, Formula):
        table["wavelength_um"] = list(grids.pop())
        return table | {"n": _plain_constant(n), "kappa": _plain_constant(kappa)}
    return table | {"n": _constant_table("n", n), "kappa": _constant_table("kappa", kappa)}


def _plain_constant(constant: Any) -> Any:
    """Write a number, or the values of a table whose wavelengths stand beside it."""
    return list(constant.values) if isinstance(constant, Table) else constant


def _constant_table(key: str, constant: Any) -> Any:
    """Write a constant that has wavelengths of its own, or follows a formula."""
    if isinstance(constant, Table):
        return {"wavelength_um": list(constant.wavelength), "values": list(constant.values)}
    if isinstance(constant, Entry):
        return {"file": f"{PREFIX}{constant.address}"}
    if isinstance(constant, Formula):
        return {
            "formula": constant.number,
            "coefficients": list(constant.coefficients),
            "range_um": list(constant.valid_range),
        }
    if callable(constant):
        msg = (
            f"{key} must be a number, a table or a Formula to be written, got "
            f"{constant!r}. Tabulate it with Material.from_table."
        )
        raise ValueError(msg)
    return constant


def _read_constant(key: str, value: Any, place: str, source: Path) -> Any:
    """Read a constant: a number, a list, a table of its own, a file or a formula."""
    if key == "name":
        return value
    if not isinstance(value, dict):
        check_numbers({key: value}, (key,), place, source)
        return value
    check_numbers(value, _OF_A_CONSTANT, f"{place}.{key}", source)
    try:
        return _of_table(key, value, place, source)
    except (TypeError, ValueError, IndexError) as error:
        raise refused(value, f"{place}.{key}", source, error) from error


def _of_table(key: str, value: dict[str, Any], place: str, source: Path) -> Any:
    """Read a constant from a table of its own."""
    if "file" in value and value.keys() <= {"file", "ignore"}:
        where = f"[{place}] {key}"
        file = _constants_file(value["file"], where, source)
        return read_constant(file, key, _ignored(value, where, source))
    if value.keys() == {"wavelength_um", "values"}:
        return Table.of(key, value["wavelength_um"], value["values"])
    if key == "n" and value.keys() == {"formula", "coefficients", "range_um"}:
        if np.shape(value["range_um"]) != (2,):
            msg = f"range_um must be two wavelengths, got {value['range_um']}."
            raise ValueError(msg)
        low, high = value["range_um"]
        return Formula(value["formula"], tuple(value["coefficients"]), (low, high))
    known = "wavelength_um and values, or file, or file and ignore"
    known += ", or formula, coefficients and range_um" if key == "n" else ""
    msg = f"{key} must have the keys {known}, got {', '.join(map(repr, value))}."
    raise ValueError(msg)


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
    if "file" in table:
        return _material_of_file(table, place, source)
    return _material_of_constants(table, place, source)


def _material_of_constants(table: dict[str, Any], place: str, source: Path) -> Material:
    """Read a material from its constants, each a number, a list or a table of its own."""
    if "n" not in table:
        raise DataFileError(source, f"[{place}]: key 'n' is missing", "Or give 'material'.")
    if "ignore" in table:
        problem = f"[{place}]: 'ignore' stands without 'file'"
        raise DataFileError(source, problem, "It names columns of a file to leave out.")
    for key in CONSTANTS:
        if key in table:
            table[key] = _read_constant(key, table[key], place, source)
    listed = [key for key in CONSTANTS if isinstance(table.get(key), list)]
    if bool(listed) != ("wavelength_um" in table):
        problem = (
            f"{', '.join(map(repr, listed))} without" if listed else "nothing listed by"
        )
        raise DataFileError(
            source, f"[{place}]: {problem} 'wavelength_um'",
            "Write one of n, kappa, diffuse_albedo as a list beside wavelength_um, a value "
            "for each wavelength, or numbers without it.",
        )  # fmt: skip
    check_numbers(table, ("wavelength_um",), place, source)
    try:
        if not listed:
            material = Material(**table)
        else:
            material = Material.from_table(wavelength=table.pop("wavelength_um"), **table)
    except (TypeError, ValueError) as error:
        raise refused(table, place, source, error) from error
    if "kappa" not in table and callable(material.n):
        warn_if_absorbing(f"{source.name} [{place}]", material.n)
    return material


def _material_of_file(table: Mapping[str, Any], place: str, source: Path) -> Material:
    """Read a material from a file of optical constants, named from the scene's folder."""
    beside = set(table) - {"file", "ignore", "kappa", "diffuse_albedo", "name"}
    if beside:
        problem = f"[{place}]: 'file' stands beside {', '.join(sorted(beside))}"
        cure = (
            "The file has the constants; only kappa where it has none, diffuse_albedo, "
            "name and ignore may be added."
        )
        raise DataFileError(source, problem, cure)
    file = _constants_file(table["file"], f"[{place}]", source)
    kappa = table.get("kappa")
    if not isinstance(kappa, int | float | None) or isinstance(kappa, bool):
        problem = f"[{place}]: kappa beside 'file' must be a number, got {kappa!r}"
        raise DataFileError(source, problem, "Or name the file of n: n = { file = ... }.")
    try:
        ignored = _ignored(table, f"[{place}]", source)
        material = read(file, ignore=ignored, kappa=kappa)
    except DataFileError:
        raise
    except ValueError as error:
        raise refused(table, place, source, error) from error
    if "diffuse_albedo" in table and callable(material.diffuse_albedo):
        problem = f"[{place}]: diffuse_albedo stands beside a file that has it"
        raise DataFileError(source, problem, "Leave out one.")
    given = {
        key: _read_constant(key, table[key], place, source)
        for key in ("diffuse_albedo", "name")
        if key in table
    }
    return replace(material, **given)


def _ignored(table: Mapping[str, Any], place: str, source: Path) -> list[str]:
    """Return the columns of a file to leave out."""
    names = table.get("ignore", [])
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        problem = f"{place}: 'ignore' must be a list of names, got {names!r}"
        raise DataFileError(source, problem, "Write ignore = ['T'].")
    return names


def _constants_file(name: Any, place: str, source: Path) -> str | Path:
    """Return a file of optical constants, named from the scene's folder."""
    if not isinstance(name, str):
        problem = f"{place}: 'file' must be a path, got {name!r}"
        raise DataFileError(source, problem, "Write file = 'constants.csv'.")
    return name if name.startswith(PREFIX) else companion(source, name, place)

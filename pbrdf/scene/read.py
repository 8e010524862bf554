"""Scenes in TOML files."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pbrdf.errors import DataFileError
from pbrdf.files import companion, read_array, read_toml
from pbrdf.optics.materials import Material
from pbrdf.scene.contaminant_tables import read_contaminant
from pbrdf.scene.scene import Scene
from pbrdf.scene.toml_tables import (
    MATERIAL_KEYS,
    check_keys,
    check_numbers,
    check_present,
    kind_of,
    read_material,
    refused,
    required,
)
from pbrdf.surface import GaussianSurface, HeightMap, MeasuredSurface, MeshSurface, Surface

SURFACE_KEYS = {
    "gaussian": {"shape", "spacing_um", "corr_length_um", "slope_rms", "height_rms_um"},
    "height_map": {"file", "heights_um", "spacing_um", "periodic", "labels"},
    "mesh": {
        "file", "vertices_um", "faces", "period_um", "labels", "unit", "transparent",
    },
    "flat": {"size_um"},
    "measured": {
        "shape", "spacing_um", "corr_length_um", "height_rms_um",
        "lags", "autocorrelation", "quantiles",
    },
}  # fmt: skip
TABLES = ("surface", "substrate", "contaminants")
# Words and switches; all else is numbers
_WORDS = {"file", "periodic", "transparent", "unit"}


def load_scene(path: str | Path) -> Scene:
    """Read a scene from its TOML file.

    Lengths carry `_um` in their key. Heights come from a .npy file named relative to the
    TOML file, or inline. What lies on the surface stands in tables [[contaminants]].

    Raises
    ------
    DataFileError
        If the file is not TOML, or a key is unknown, missing or has a wrong value.
    """
    source = Path(path)
    return scene_of(read_toml(source), source)


def scene_of(document: Mapping[str, Any], source: Path) -> Scene:
    """Return the scene of a parsed file; `source` is where its other files lie, and named.

    Raises
    ------
    DataFileError
        If a key is unknown, missing or has a wrong value.
    """
    for key in document:
        if key not in TABLES:
            known = "[surface], [substrate] and [[contaminants]]"
            raise DataFileError(source, f"unknown key {key!r}", f"A scene has {known}.")
    surface = required(document, "surface", source)
    substrate = required(document, "substrate", source)
    wrong = TypeError, ValueError, OverflowError, IndexError
    try:
        ground = _read_surface(surface, source)
    except DataFileError:
        raise
    except wrong as error:
        raise refused(surface, "surface", source, error) from error
    try:
        return Scene(
            ground,
            _read_substrate(substrate, source),
            _read_contaminants(document.get("contaminants", []), source),
        )
    except DataFileError:
        raise
    except wrong as error:
        problem = str(error).rstrip(".")
        raise DataFileError(source, problem, "See the documented keys.") from error


def _read_surface(table: dict[str, Any], source: Path) -> Surface:
    kind = kind_of(table, SURFACE_KEYS, "surface", source)
    check_keys(table, SURFACE_KEYS[kind], "surface", source)
    words = _WORDS | {"labels"} if kind == "mesh" else _WORDS
    check_numbers(table, SURFACE_KEYS[kind] - words, "surface", source)
    if kind == "flat":
        return HeightMap.flat(size=_pair(table.get("size_um", 1.0)))
    if kind == "mesh":
        return _read_mesh(table, source)
    if kind == "gaussian":
        check_present(table, ("corr_length_um",), "surface", source)
        # Without them the surface takes a grid of its own
        grid = {"shape": "shape", "spacing_um": "spacing"}
        return GaussianSurface(
            **{name: _pair(table[key]) for key, name in grid.items() if key in table},
            corr_length=_pair(table["corr_length_um"]),
            slope_rms=table.get("slope_rms"),
            height_rms=table.get("height_rms_um"),
        )
    if kind == "measured":
        check_present(table, sorted(SURFACE_KEYS[kind] - {"quantiles"}), "surface", source)
        return MeasuredSurface(
            shape=_pair(table["shape"]),
            spacing=_pair(table["spacing_um"]),
            height_rms=table["height_rms_um"],
            corr_length=_pair(table["corr_length_um"]),
            lags=tuple(table["lags"]),
            autocorrelation=tuple(table["autocorrelation"]),
            quantiles=tuple(table["quantiles"]) if "quantiles" in table else None,
        )
    if ("file" in table) == ("heights_um" in table):
        raise DataFileError(
            source,
            "[surface]: heights come from 'file' or 'heights_um'",
            "Give exactly one.",
        )
    if "spacing_um" not in table:
        raise DataFileError(source, "[surface]: key 'spacing_um' is missing", "Give it.")
    _check_type(table, "periodic", bool, "Write true or false.", source)
    _check_type(table, "file", str, "Name a .npy file.", source)
    heights = table.get("heights_um")
    if heights is None:
        try:
            heights = read_array(companion(source, table["file"], "[surface]"))
        except DataFileError as error:
            if error.path == source:
                raise
            problem, _, cure = str(error).partition(". ")
            raise DataFileError(source, f"[surface]: {problem}", cure) from error
    return HeightMap(
        heights,
        _pair(table["spacing_um"]),
        periodic=bool(table.get("periodic", False)),
        labels=table.get("labels"),
    )


def _read_mesh(table: dict[str, Any], source: Path) -> MeshSurface:
    if ("file" in table) == ("vertices_um" in table):
        raise DataFileError(
            source,
            "[surface]: a mesh comes from 'file', or 'vertices_um' and 'faces'",
            "Give exactly one.",
        )
    _check_type(table, "file", str, "Name a mesh file.", source)
    _check_type(table, "unit", str, 'Name a unit, such as "um".', source)
    labels = table.get("labels")
    options = {key: table[key] for key in ("unit", "transparent") if key in table}
    period = _pair(table["period_um"]) if "period_um" in table else None
    if "file" in table:
        file = companion(source, table["file"], "[surface]")
        return MeshSurface(file, period, labels, **options)
    check_present(table, ("faces",), "surface", source)
    arrays = np.asarray(table["vertices_um"]), np.asarray(table["faces"])
    return MeshSurface(arrays, period, labels, **options)


def _read_substrate(table: dict[str, Any], source: Path) -> Material | list[Material]:
    check_keys(table, {*MATERIAL_KEYS, "materials"}, "substrate", source)
    if "materials" in table:
        return [read_material(entry, "substrate", source) for entry in table["materials"]]
    return read_material(table, "substrate", source)


def _read_contaminants(value: Any, source: Path) -> list[Any]:
    """Read the tables [[contaminants]]."""
    if not isinstance(value, list) or not all(isinstance(one, dict) for one in value):
        raise DataFileError(
            source, "'contaminants' is no list of tables", "Write [[contaminants]]."
        )
    return [read_contaminant(one, source) for one in value]


def _check_type(
    table: Mapping[str, Any], key: str, kind: type, cure: str, source: Path
) -> None:
    if key in table and not isinstance(table[key], kind):
        raise DataFileError(source, f"[surface]: {key!r} is {table[key]!r}", cure)


def _pair(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value

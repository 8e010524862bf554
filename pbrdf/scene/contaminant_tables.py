"""Contaminants in TOML files: degrees, micrometres, drops per square millimetre."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pbrdf.contaminants.drops import Drops
from pbrdf.contaminants.films import Film
from pbrdf.contaminants.spheres import Spheres
from pbrdf.errors import DataFileError
from pbrdf.optics.materials import Material
from pbrdf.scene.toml_tables import (
    check_keys,
    check_numbers,
    check_present,
    kind_of,
    material_table,
    refused,
)
from pbrdf.scene.toml_tables import read_material as read_material_table

PLACE = "contaminants"
KINDS: dict[str, type[Drops | Spheres | Film]] = {
    "drops": Drops, "spheres": Spheres, "film": Film,
}  # fmt: skip

# Key in the file: (field, what a value in the file is in the units of the field)
_KEYS: dict[str, dict[str, tuple[str, float]]] = {
    "drops": {
        "contact_angle_deg": ("contact_angle", np.pi / 180),
        "volume_per_area_um": ("volume_per_area", 1.0),
        "coverage": ("coverage", 1.0),
        "number_density_per_mm2": ("number_density", 1e-6),
        "width": ("width", 1.0),
        "capillary_length_um": ("capillary_length", 1.0),
        "positions_um": ("positions", 1.0),
        "volume_um3": ("volume", 1.0),
    },
    "spheres": {
        "radius_um": ("radius", 1.0),
        "coverage": ("coverage", 1.0),
        "number_density_per_mm2": ("number_density", 1e-6),
        "width": ("width", 1.0),
        "sink": ("sink", 1.0),
        "positions_um": ("positions", 1.0),
    },
    "film": {"thickness_um": ("thickness", 1.0)},
}
# Words, whole numbers and switches, which have no unit
_WORDS = {
    "drops": ("seed", "sizes", "gravity", "roughness"),
    "spheres": ("seed", "sizes"),
    "film": ("level",),
}
_NEEDED = {
    "drops": ("contact_angle_deg",),
    "spheres": ("radius_um", "material"),
    "film": ("thickness_um",),
}


def contaminant_table(contaminant: Drops | Spheres | Film) -> dict[str, Any]:
    """Write a contaminant as a TOML table, without what is as by default."""
    kind = next(name for name, cls in KINDS.items() if isinstance(contaminant, cls))
    table: dict[str, Any] = {"type": kind}
    defaults = {
        name: field.default for name, field in KINDS[kind].__dataclass_fields__.items()
    }
    for key, (name, unit) in _KEYS[kind].items():
        value = getattr(contaminant, name)
        if value is None or (np.ndim(value) == 0 and value == defaults[name]):
            continue
        table[key] = _in_file(value, unit)
    for name in _WORDS[kind]:
        value = getattr(contaminant, name)
        if value is not None and value != defaults[name]:
            table[name] = value
    assert isinstance(contaminant.material, Material)  # names are looked up at once
    material = material_table(contaminant.material)
    return table | {"material": material.get("material", material)}


def read_contaminant(table: Mapping[str, Any], source: Path) -> Drops | Spheres | Film:
    """Read one table [[contaminants]].

    Raises
    ------
    DataFileError
        If a key is unknown, missing or has a wrong value.
    """
    table = dict(table)
    kind = kind_of(table, KINDS, PLACE, source)
    check_keys(table, contaminant_keys(kind), f"{PLACE} {kind}", source)
    check_present(table, _NEEDED[kind], f"{PLACE} {kind}", source)
    check_numbers(table, _KEYS[kind], f"{PLACE} {kind}", source)
    angle = table.get("contact_angle_deg", 0.0)
    if not isinstance(angle, list) and not 0.0 <= angle <= 180.0:
        raise DataFileError(
            source, f"[{PLACE} {kind}]: contact_angle_deg is {angle!r}",
            "It lies between 0 and 180 degrees.",
        )  # fmt: skip
    given: dict[str, Any] = {name: table[name] for name in _WORDS[kind] if name in table}
    material = table.get("material")
    if isinstance(material, dict):
        given["material"] = read_material_table(material, f"{PLACE}.material", source)
    elif material is not None:
        given["material"] = material
    try:
        for key, (name, unit) in _KEYS[kind].items():
            if key in table:
                given[name] = _from_file(key, table[key], unit)
        return KINDS[kind](**given)
    except (TypeError, ValueError) as error:
        raise refused(table, f"{PLACE} {kind}", source, error) from error


def contaminant_keys(kind: str) -> set[str]:
    """Return the keys that a table [[contaminants]] of a kind may have."""
    if kind not in KINDS:
        return set()
    return {"material", *_KEYS[kind], *_WORDS[kind]}


def _in_file(value: Any, unit: float) -> Any:
    """Return a value in the unit of the file, such that reading gives it back."""
    if unit == 1.0:
        return value.tolist() if isinstance(value, np.ndarray) else float(value)
    # 15 digits read well; where they lose the last bit, all of them do not
    short = float(f"{value / unit:.15g}")
    return short if short * unit == value else float(value / unit)


def _from_file(key: str, value: Any, unit: float) -> Any:
    """Return numbers in the unit of the field."""
    try:
        numbers = np.asarray(value, dtype=np.float64)
    except ValueError:
        msg = f"{key!r} is {value!r}, of rows that differ in length."
        raise ValueError(msg) from None
    return numbers * unit if numbers.ndim else float(numbers) * unit

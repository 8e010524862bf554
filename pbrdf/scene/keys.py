"""Which keys the tables of a scene file may have."""

from collections.abc import Iterator, Mapping
from typing import Any

from pbrdf.scene.contaminant_tables import contaminant_keys
from pbrdf.scene.read import SURFACE_KEYS
from pbrdf.scene.toml_tables import MATERIAL_KEYS

__all__ = ["known_keys"]

Place = tuple[str | int, ...]


def known_keys(document: Mapping[str, Any]) -> Iterator[tuple[Place, set[str]]]:
    """Yield the place of each table of a scene document and the keys it may have.

    Tables of no known kind are left out: reading the scene says what is wrong with them.
    """
    surface, substrate = document.get("surface"), document.get("substrate")
    if isinstance(surface, Mapping):
        yield ("surface",), SURFACE_KEYS.get(str(surface.get("type")), set())
    if isinstance(substrate, Mapping):
        if isinstance(substrate.get("materials"), list):
            for number, one in enumerate(substrate["materials"]):
                if isinstance(one, Mapping):
                    yield ("substrate", "materials", number), MATERIAL_KEYS
        else:
            yield ("substrate",), MATERIAL_KEYS
    lying = document.get("contaminants")
    for number, one in enumerate(lying if isinstance(lying, list) else ()):
        if isinstance(one, Mapping):
            yield ("contaminants", number), contaminant_keys(str(one.get("type")))
            if isinstance(one.get("material"), Mapping):
                yield ("contaminants", number, "material"), MATERIAL_KEYS

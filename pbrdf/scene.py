"""A scene: surface, substrate and what lies on it; and its TOML file."""

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from pbrdf.errors import DataFileError
from pbrdf.optics import library
from pbrdf.optics.dispersion import Table
from pbrdf.optics.materials import Material
from pbrdf.surface import (
    Drops,
    Film,
    GaussianSurface,
    HeightMap,
    MeasuredSurface,
    Spheres,
)

Surface = HeightMap | GaussianSurface | MeasuredSurface
Contamination = Drops | Spheres | Film

# A height map up to this many nodes is written into the TOML file itself
INLINE_NODES = 4096

_SURFACE_KEYS = {
    "gaussian": {"shape", "spacing_um", "corr_length_um", "slope_rms", "height_rms_um"},
    "height_map": {"file", "heights_um", "spacing_um", "periodic", "labels"},
    "flat": {"size_um"},
    "measured": {
        "shape", "spacing_um", "corr_length_um", "height_rms_um",
        "lags", "autocorrelation", "quantiles",
    },
}  # fmt: skip
_SUBSTRATE_KEYS = {
    "material", "materials", "n", "kappa", "diffuse_albedo", "wavelength_um", "name",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Scene:
    """A surface of one material, and the contaminants on it.

    Parameters
    ----------
    surface : HeightMap, GaussianSurface or MeasuredSurface
        A fixed surface, or an ensemble of which realisations are drawn.
    substrate : Material or str, or a sequence of them
        Material under the surface, or its name in the library; several where the labels of
        a HeightMap number them.
    contaminants : Drops, Spheres or Film, or a sequence of them
        What lies on the surface; where two overlap, the first rules. One Film at most.

    Raises
    ------
    TypeError
        If the surface or a contaminant is of another type.
    ValueError
        If the library does not know the material, or two contaminants are films.

    Examples
    --------
    >>> from pbrdf.surface import Film
    >>> scene = Scene(HeightMap.flat(size=(10.0, 10.0)), "bk7", Film(thickness=5.0))
    >>> scene.substrate.name, scene.contaminants[0].material.name
    ('bk7', 'water')
    """

    surface: Surface
    substrate: Material | tuple[Material, ...]
    contaminants: tuple[Contamination, ...] = ()

    def __init__(
        self,
        surface: Surface,
        substrate: Material | str | Sequence[Material | str],
        contaminants: Contamination | Sequence[Contamination] = (),
    ) -> None:
        if not isinstance(surface, HeightMap | GaussianSurface | MeasuredSurface):
            msg = (
                f"surface must be a HeightMap, GaussianSurface or MeasuredSurface, got "
                f"{type(surface).__name__}. Wrap an array of heights [um] in HeightMap."
            )
            raise TypeError(msg)
        several = not isinstance(substrate, str | Material)
        listed: Any = substrate if several else (substrate,)
        materials = tuple(library.get(m) if isinstance(m, str) else m for m in listed)
        _check_labels(surface, materials)
        object.__setattr__(self, "surface", surface)
        object.__setattr__(self, "substrate", materials if several else materials[0])
        object.__setattr__(self, "contaminants", _checked(contaminants))

    @property
    def materials(self) -> tuple[Material, ...]:
        """Materials of the substrate, in the order of the labels."""
        return (self.substrate,) if isinstance(self.substrate, Material) else self.substrate

    def to_toml(self, path: str | Path | None = None) -> str:
        """TOML text of the scene, also written to `path` if given.

        The heights of a map beyond 4096 nodes go to `<path>.npy` beside the file.

        Raises
        ------
        ValueError
            If such a map has no path to be written to.
        """
        heights_file = None
        if path is not None:
            target = Path(path)
            heights_file = target.with_suffix(".npy")
        document = {
            "surface": _surface_table(self.surface, heights_file),
            "substrate": (
                _substrate_table(self.substrate)
                if isinstance(self.substrate, Material)
                else {"materials": [_substrate_table(m) for m in self.substrate]}
            ),
        }
        text = tomli_w.dumps(document)
        if path is not None:
            temporary = target.with_name(target.name + ".part")
            temporary.write_text(text, encoding="utf-8")
            temporary.replace(target)
        return text


def _checked(given: Contamination | Sequence[Contamination]) -> tuple[Contamination, ...]:
    """Return the contaminants as a tuple; refuse other types and a second film."""
    listed = (given,) if isinstance(given, Contamination) else tuple(given)
    for number, one in enumerate(listed):
        if not isinstance(one, Contamination):
            msg = (
                "contaminants must be Drops, Spheres or Film, got "
                f"{type(one).__name__} at index {number}. Wrap what lies on the surface "
                "in one of these."
            )
            raise TypeError(msg)
    films = sum(isinstance(one, Film) for one in listed)
    if films > 1:
        msg = f"contaminants must hold at most one Film, got {films}. Leave one out."
        raise ValueError(msg)
    return listed


def _check_labels(surface: Surface, materials: tuple[Material, ...]) -> None:
    """Refuse labels that name no material, and materials that no label can name."""
    for material in materials:
        if not isinstance(material, Material):
            msg = (
                f"substrate must be a Material or the name of one, got "
                f"{type(material).__name__}. Write Material(n, kappa)."
            )
            raise TypeError(msg)
    labels = surface.labels if isinstance(surface, HeightMap) else None
    highest = 0 if labels is None else int(labels.max())
    if highest >= len(materials) or (labels is None and len(materials) != 1):
        msg = (
            f"substrate must have one material for each label, got {len(materials)} for "
            f"labels up to {highest}. Give a list of materials and HeightMap(..., labels=)."
        )
        raise ValueError(msg)


def load_scene(path: str | Path) -> Scene:
    """Read a scene from its TOML file.

    Lengths carry `_um` in their key. Heights come from a .npy file named relative to the
    TOML file, or inline. Tables other than [surface] and [substrate] are left to their
    readers.

    Raises
    ------
    DataFileError
        If the file is not TOML, or a key is unknown, missing or has a wrong value.
    """
    source = Path(path)
    document = read_toml(source)
    surface = _required(document, "surface", source)
    substrate = _required(document, "substrate", source)
    try:
        return Scene(_read_surface(surface, source), _read_substrate(substrate, source))
    except DataFileError:
        raise
    except (TypeError, ValueError) as error:
        problem = str(error).rstrip(".")
        raise DataFileError(source, problem, "See the documented keys.") from error


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


def _required(document: Mapping[str, Any], name: str, source: Path) -> dict[str, Any]:
    table = document.get(name)
    if not isinstance(table, dict):
        raise DataFileError(source, f"has no table [{name}]", "A scene needs it.")
    return dict(table)


def _check_keys(
    table: Mapping[str, Any], known: set[str], place: str, source: Path
) -> None:
    for key in table:
        if key not in known:
            raise DataFileError(
                source,
                f"[{place}]: unknown key {key!r}",
                f"Known: {', '.join(sorted(known))}.",
            )


def _check_type(
    table: Mapping[str, Any], key: str, kind: type, cure: str, source: Path
) -> None:
    if key in table and not isinstance(table[key], kind):
        raise DataFileError(source, f"[surface]: {key!r} is {table[key]!r}", cure)


def _check_present(table: Mapping[str, Any], keys: Iterable[str], source: Path) -> None:
    for key in keys:
        if key not in table:
            raise DataFileError(source, f"[surface]: key {key!r} is missing", "Give it.")


def _pair(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def _surface_table(surface: Surface, file: Path | None) -> dict[str, Any]:
    if isinstance(surface, GaussianSurface):
        table = {
            "type": "gaussian",
            "shape": list(surface.shape),
            "spacing_um": _plain(surface.spacing),
            "corr_length_um": _plain(surface.corr_length),
        }
        if surface.slope_rms is not None:
            return table | {"slope_rms": surface.slope_rms}
        return table | {"height_rms_um": surface.height_rms}
    if isinstance(surface, MeasuredSurface):
        table = {
            "type": "measured",
            "shape": list(surface.shape),
            "spacing_um": _plain(surface.spacing),
            "height_rms_um": surface.height_rms,
            "corr_length_um": _plain(surface.corr_length),
            "lags": list(surface.lags),
            "autocorrelation": list(surface.autocorrelation),
        }
        if surface.quantiles is not None:
            table["quantiles"] = list(surface.quantiles)
        return table
    table = {
        "type": "height_map",
        "spacing_um": list(surface.spacing),
        "periodic": surface.periodic,
    }
    if surface.labels is not None:
        table["labels"] = surface.labels.tolist()
    if surface.heights.size <= INLINE_NODES:
        return table | {"heights_um": surface.heights.tolist()}
    if file is None:
        msg = (
            f"path must be given for a map of {surface.heights.size} nodes, got None. "
            "Its heights are written beside the TOML file."
        )
        raise ValueError(msg)
    with file.open("wb") as stream:
        np.save(stream, surface.heights)
    return table | {"file": file.name}


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


def _substrate_table(material: Material) -> dict[str, Any]:
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


def _read_surface(table: dict[str, Any], source: Path) -> Surface:
    kind = table.pop("type", None)
    if not isinstance(kind, str) or kind not in _SURFACE_KEYS:
        raise DataFileError(
            source, f"[surface]: type is {kind!r}", f"Known: {', '.join(_SURFACE_KEYS)}."
        )
    _check_keys(table, _SURFACE_KEYS[kind], "surface", source)
    if kind == "flat":
        return HeightMap.flat(size=_pair(table.get("size_um", 1.0)))
    if kind == "gaussian":
        _check_present(table, ("shape", "spacing_um", "corr_length_um"), source)
        return GaussianSurface(
            shape=_pair(table["shape"]),
            spacing=_pair(table["spacing_um"]),
            corr_length=_pair(table["corr_length_um"]),
            slope_rms=table.get("slope_rms"),
            height_rms=table.get("height_rms_um"),
        )
    if kind == "measured":
        _check_present(table, sorted(_SURFACE_KEYS[kind] - {"quantiles"}), source)
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
        file = source.parent / table["file"]
        try:
            heights = np.load(file, allow_pickle=False)
        except (OSError, ValueError) as error:
            raise DataFileError(
                source, f"[surface]: file {table['file']!r} cannot be read ({error})",
                "Give a .npy file of heights [um], x first.",
            ) from error  # fmt: skip
    return HeightMap(
        heights,
        _pair(table["spacing_um"]),
        periodic=bool(table.get("periodic", False)),
        labels=table.get("labels"),
    )


def _read_substrate(table: dict[str, Any], source: Path) -> Material | list[Material]:
    _check_keys(table, _SUBSTRATE_KEYS, "substrate", source)
    if "materials" in table:
        return [_read_material(entry, source) for entry in table["materials"]]
    return _read_material(table, source)


def _read_material(table: dict[str, Any], source: Path) -> Material:
    if "material" in table:
        if len(table) > 1:
            raise DataFileError(
                source, "[substrate]: 'material' stands beside other keys",
                "Name a library material, or give n and kappa.",
            )  # fmt: skip
        return library.get(table["material"])
    if "n" not in table:
        raise DataFileError(
            source, "[substrate]: key 'n' is missing", "Or give 'material'."
        )
    wavelength = table.pop("wavelength_um", None)
    if wavelength is None:
        return Material(**table)
    return Material.from_table(wavelength=wavelength, **table)

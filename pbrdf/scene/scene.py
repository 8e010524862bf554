"""A scene: surface, substrate and what lies on it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pbrdf.contaminants import Drops, Film, Spheres
from pbrdf.notebook import table
from pbrdf.optics import library
from pbrdf.optics.materials import Material
from pbrdf.scene.contaminant_tables import KINDS
from pbrdf.scene.refusals import check_clear, check_on_mesh
from pbrdf.scene.write import write_scene
from pbrdf.surface import FixedSurface, MeshSurface, Surface

Contamination = Drops | Spheres | Film


@dataclass(frozen=True, eq=False)
class Scene:
    """A surface of one material, and the contaminants on it.

    Parameters
    ----------
    surface : HeightMap, MeshSurface, GaussianSurface or MeasuredSurface
        A fixed surface, or an ensemble of which realisations are drawn.
    substrate : Material or str, or a sequence of them
        Material under the surface, or its name in the library; several where the labels of
        a HeightMap or MeshSurface number them. Light goes through those that the mesh has
        as `transparent`; where solids overlap, the one with the lowest label rules.
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
    >>> from pbrdf import Film, HeightMap
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
        if not isinstance(surface, Surface):
            msg = (
                "surface must be a HeightMap, MeshSurface, GaussianSurface or "
                f"MeasuredSurface, got {type(surface).__name__}. Wrap an array of "
                "heights [um] in HeightMap."
            )
            raise TypeError(msg)
        several = not isinstance(substrate, str | Material)
        listed: Any = substrate if several else (substrate,)
        materials = tuple(library.get(m) if isinstance(m, str) else m for m in listed)
        _check_labels(surface, materials)
        object.__setattr__(self, "surface", surface)
        object.__setattr__(self, "substrate", materials if several else materials[0])
        lying = _checked(contaminants)
        if isinstance(surface, MeshSurface):
            check_clear(surface, materials)
            check_on_mesh(surface, lying)
        object.__setattr__(self, "contaminants", lying)

    @property
    def materials(self) -> tuple[Material, ...]:
        """Materials of the substrate, in the order of the labels."""
        return (self.substrate,) if isinstance(self.substrate, Material) else self.substrate

    def _repr_html_(self) -> str:
        several = enumerate(self.materials)
        rows = [("surface", repr(self.surface))]
        rows += [(f"substrate {k}" if k else "substrate", m.summary()) for k, m in several]
        rows += [(type(one).__name__.lower(), repr(one)) for one in self.contaminants]
        return table("Scene", rows)

    def to_toml(self, path: str | Path | None = None) -> str:
        """TOML text of the scene, also written to `path` if given.

        The heights of a map beyond 4096 nodes go to a .npy file beside it, named after what
        they are.

        Raises
        ------
        ValueError
            If such a map has no path to be written to.
        """
        return write_scene(
            self.surface,
            self.substrate,
            self.contaminants,
            None if path is None else Path(path),
        )


def _checked(given: Contamination | Sequence[Contamination]) -> tuple[Contamination, ...]:
    """Return the contaminants as a tuple; refuse other types and a second film."""
    known = tuple(KINDS.values())
    listed: tuple[Contamination, ...]
    listed = (given,) if isinstance(given, known) else tuple(given)  # type: ignore[arg-type]
    for number, one in enumerate(listed):
        if not isinstance(one, known):
            *others, last = (kind.__name__ for kind in known)
            msg = (
                f"contaminants must be {', '.join(others)} or {last}, got "
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
    labels = surface.labels if isinstance(surface, FixedSurface) else None
    highest = 0 if labels is None else int(labels.max())
    if highest >= len(materials) or (labels is None and len(materials) != 1):
        msg = (
            f"substrate must have one material for each label, got {len(materials)} for "
            f"labels up to {highest}. Give a list of materials, and labels= of the "
            "HeightMap or MeshSurface."
        )
        raise ValueError(msg)

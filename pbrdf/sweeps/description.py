"""What a sweep is: a scene file, what varies in it, and how it is simulated."""

import hashlib
import json
import math
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from pbrdf._version import __version__
from pbrdf.errors import DataFileError
from pbrdf.files import companion, read_toml
from pbrdf.scene.read import scene_of
from pbrdf.scene.scene import Scene
from pbrdf.sweeps.designs import Axis, Design, require_once
from pbrdf.sweeps.places import changed, resolve, written
from pbrdf.sweeps.settings import FIXED, RUN_KEYS, TOGETHER, WHOLE, arguments

__all__ = ["Sweep", "load_sweep", "sweep_of"]

_TABLES = ("scene", "vary", "simulate", "design", "surface", "substrate", "contaminants")
_RANGE = {"from", "to", "scale"}
# How points are laid out and computed together; another number is another store
_LAYOUT = 2


@dataclass(frozen=True, kw_only=True)
class Sweep:
    """A scene with varied values; `load_sweep` and `sweep_of` make it.

    Attributes
    ----------
    document : dict
        The scene file, and under `simulate` the arguments of each run.
    source : Path
        The scene file; others that it names lie beside it.
    design : Design
        What varies.
    """

    document: dict[str, Any]
    source: Path
    design: Design

    def at(self, place: Mapping[str, int]) -> tuple[Scene, dict[str, Any]]:
        """Return scene and arguments of `simulate` at a point of the design.

        Raises
        ------
        ValueError
            If there can be no such scene.
        """
        document = changed(self.document, self.design.values(place))
        given = arguments(document.pop("simulate"))
        return scene_of(document, self.source), given

    @cached_property
    def joint(self) -> tuple[Axis, ...]:
        """Axes whose values one trace serves: of the substrate of a clean surface.

        By point also the wavelength. Towards a target error each point takes samples of its
        own number, and has its own trace.
        """
        run = self.document["simulate"]
        targets = any(axis.path[-1] == "target_rel_error" for axis in self.design.axes)
        if self.document.get("contaminants") or "target_rel_error" in run or targets:
            return ()
        return tuple(
            axis
            for axis in self.design.ordered
            if axis.path[0] == "substrate" or axis.path == ("simulate", "wavelength_um")
        )

    def alike(self, places: Iterable[Mapping[str, int]]) -> list[list[int]]:
        """Put points together that one trace serves: their numbers among those given."""
        apart = [axis.path for axis in self.design.axes if axis not in self.joint]
        found: dict[str, list[int]] = {}
        for number, place in enumerate(places):
            values = self.design.values(place)
            key = [values[path] for path in apart] if self.joint else number
            found.setdefault(repr(key), []).append(number)
        return list(found.values())

    @cached_property
    def digest(self) -> str:
        """What tells this sweep from every other: scene, files, values, run and version."""
        kept = {
            "version": __version__,
            "layout": _LAYOUT,
            "document": self.document,
            "files": sorted(self._files()),
            "kind": self.design.kind,
            "axes": [
                [axis.name, written(axis.path), self.design.coordinate(axis)]
                for axis in self.design.ordered
            ],
        }
        text = json.dumps(kept, sort_keys=True, default=str)
        return hashlib.sha256(text.encode()).hexdigest()

    def _files(self) -> list[tuple[str, str]]:
        """Names and checksums of the files that the scene and the values name."""
        named: list[Any] = [self.document]
        named += [v for axis in self.design.axes for v in self.design.coordinate(axis)]
        found = []
        while named:
            one = named.pop()
            if isinstance(one, Mapping):
                named += one.values()
            elif isinstance(one, list | tuple):
                named += one
            elif isinstance(one, str) and (self.source.parent / one).is_file():
                with (self.source.parent / one).open("rb") as file:
                    found.append((one, hashlib.file_digest(file, "sha256").hexdigest()))
        return found

    def check(self) -> None:
        """Try every value once, with the first of all others.

        Raises
        ------
        ValueError
            If one is no value that the scene can have.
        """
        first = dict.fromkeys(self.design.shape, 0)
        for name, size in self.design.shape.items():
            for index in range(size if self.design.kind == "grid" else 1):
                self.at(first | {name: index})


def load_sweep(path: str | Path) -> Sweep:
    """Read a sweep from its TOML file.

    `scene` names the scene file, or the scene's own tables stand in this one. [vary] has
    lists of values, or ranges { from, to, scale }, by their path in the scene file;
    [design] says how they go together, [simulate] what each run is asked for.

    Raises
    ------
    DataFileError
        If the file or its scene cannot be used; the message says which key.
    ValueError
        If a value is out of its range.
    """
    source = Path(path)
    document = read_toml(source)
    unknown = [key for key in document if key not in _TABLES]
    if unknown:
        raise DataFileError(
            source, f"unknown key {unknown[0]!r}", f"Known: {', '.join(_TABLES)}."
        )
    vary, design = document.pop("vary", None), document.pop("design", {})
    if not isinstance(vary, dict) or not vary:
        raise DataFileError(source, "has no table [vary]", "Say there what varies.")
    simulate, scene = document.pop("simulate", {}), document.pop("scene", None)
    if scene is not None:
        if document or not isinstance(scene, str):
            problem = "'scene' must name a scene file, and no other scene may stand beside"
            raise DataFileError(source, problem, "Keep one of them.")
        source = companion(source, scene, "scene")
        document = read_toml(source)
    try:
        return sweep_of(document, source, _flat(vary), simulate, design)
    except DataFileError:
        raise
    except (TypeError, ValueError) as error:
        raise DataFileError(path, str(error).rstrip("."), "Mend that line.") from error


def sweep_of(
    document: Mapping[str, Any],
    source: Path,
    vary: Mapping[str, Any],
    simulate: Mapping[str, Any],
    design: Mapping[str, Any] | None = None,
) -> Sweep:
    """Return the sweep of a scene document.

    Parameters
    ----------
    document : mapping
        The parsed scene file.
    source : Path
        Where it lies.
    vary : mapping of str to list or mapping
        Values, or a range, by path or last key.
    simulate : mapping
        Keys of `pbrdf.sweeps.settings`.
    design : mapping, optional
        `kind`, `points` and `seed`; a grid without it.

    Raises
    ------
    ValueError
        If a path, a value or a key is unknown or out of its range.
    """
    whole = {k: document[k] for k in document if k in _TABLES and k != "simulate"}
    whole["simulate"] = dict(simulate)
    about = {"kind": "grid"} | dict(design or {})
    unknown = [key for key in about if key not in ("kind", "points", "seed")]
    if unknown:
        msg = f"[design]: unknown key {unknown[0]!r}. Known: kind, points, seed."
        raise ValueError(msg)
    axes = [_axis(name, given, whole) for name, given in vary.items()]
    for place, count in Counter(axis.path for axis in axes).items():
        if count > 1:
            msg = f"{written(place)} must vary once, got {count} times."
            raise ValueError(msg)
    if about["kind"] == "grid":
        joint = [a for a in axes if a.path[0] == "simulate" and a.path[1] in TOGETHER]
        axes = [axis for axis in axes if axis not in joint]
        # One trace serves them all
        whole["simulate"] |= {str(axis.path[1]): list(axis.values) for axis in joint}
        for key in TOGETHER:
            given = whole["simulate"].get(key)
            if isinstance(given, list):
                require_once(key, given)
        if not axes:
            msg = (
                "a sweep must vary more than the light, got "
                f"{', '.join(axis.name for axis in joint)}. pbrdf simulate takes lists."
            )
            raise ValueError(msg)
    sweep = Sweep(document=whole, source=source, design=Design(axes=_named(axes), **about))
    sweep.check()
    return sweep


def _flat(vary: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    """Join [vary.surface] slope_rms to surface.slope_rms; ranges stay."""
    out: dict[str, Any] = {}
    for key, value in vary.items():
        if isinstance(value, dict) and not value.keys() & {"from", "to"}:
            out |= _flat(value, f"{before}{key}.")
        else:
            out[before + key] = value
    return out


def _axis(name: str, given: Any, document: Mapping[str, Any]) -> Axis:
    path = resolve(name, document, RUN_KEYS)
    if path[0] == "simulate" and path[1] in FIXED:
        msg = f"{name} must be the same in the whole sweep. Set it in [simulate]."
        raise ValueError(msg)
    if isinstance(given, Mapping):
        low, high, scale = given.get("from"), given.get("to"), given.get("scale", "linear")
        unknown = [key for key in given if key not in _RANGE]
        if unknown:
            msg = f"{name}: unknown key {unknown[0]!r}. Known: from, to, scale."
            raise ValueError(msg)
        if path[-1] in WHOLE:
            msg = (
                f"{name} must be whole numbers, got the range {dict(given)}, which has all "
                "numbers. Give a list of values."
            )
            raise ValueError(msg)
        known = scale in ("linear", "log")
        numbers = all(
            type(v) in (int, float) and math.isfinite(v)  # type: ignore[arg-type]
            for v in (low, high)
        )
        if not numbers or not known or not low < high or (scale == "log" and low <= 0):  # type: ignore[operator]
            msg = (
                f"{name} must have from below to, finite, positive for scale = 'log', got "
                f"{dict(given)}."
            )
            raise ValueError(msg)
        return Axis(name=name, path=path, low=low, high=high, log=scale == "log")  # type: ignore[arg-type]
    values = given if isinstance(given, list | tuple) else [given]
    if not values:
        msg = f"{name} must have at least one value, got none."
        raise ValueError(msg)
    return Axis(name=name, path=path, values=tuple(values))


def _named(axes: list[Axis]) -> tuple[Axis, ...]:
    """Name each axis by its last key, or by its path where another has the same."""
    last = [next(s for s in reversed(a.path) if isinstance(s, str)) for a in axes]
    counts = Counter(last)
    names = [
        key if counts[key] == 1 else "_".join(map(str, axis.path))
        for key, axis in zip(last, axes, strict=True)
    ]
    return tuple(replace(a, name=name) for a, name in zip(axes, names, strict=True))

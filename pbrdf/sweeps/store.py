"""The Zarr store of a sweep: bound to it, written group by group, marked when written.

A mark is a file of its own, written after the data, with a checksum of them: without it, or
where the data are not those it speaks of, a group counts as not computed.
"""

import json
import shutil
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from hashlib import blake2b
from pathlib import Path
from typing import Any

import numpy as np
from filelock import FileLock

from pbrdf.errors import of_kind
from pbrdf.files import complete_file, complete_folder
from pbrdf.files.writing import ExistsError
from pbrdf.sweeps.description import Sweep
from pbrdf.sweeps.layout import FAILED, STATE, Layout
from pbrdf.sweeps.wanted import needed

__all__ = ["Mark", "Store", "open_store"]

_BOUND = "pbrdf_sweep"
_MARKS = "marks"


@dataclass(frozen=True, kw_only=True)
class Mark:
    """What is known of a finished group.

    Attributes
    ----------
    digest : str
        Checksum of its data.
    errors : dict of str to str
        Why points failed, by their values.
    warnings : dict of str to int
        What `simulate` warned of, and at how many points.
    seconds : float
        Time it took. [s]
    """

    digest: str
    errors: dict[str, str] = field(default_factory=dict)
    warnings: dict[str, int] = field(default_factory=dict)
    seconds: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Store:
    """An open store.

    Attributes
    ----------
    path : Path
        Its folder.
    layout : Layout
        What is in it and where.
    """

    path: Path
    layout: Layout

    def _array(self, name: str) -> Any:
        return needed("zarr").open_array(self.path / name, mode="r+", zarr_format=3)

    def write(self, group: int, block: dict[str, np.ndarray], mark: dict[str, Any]) -> Mark:
        """Write the results of a group, then its mark.

        A worker may outlive the client that it worked for: what is there already is left.
        """
        made, there = Mark(digest=digest(block), **mark), self.mark(group)
        if there is not None and there.digest == made.digest and self.finished(group):
            return there
        region = self.layout.region(group)
        self._mark_file(group).unlink(missing_ok=True)
        for name, values in block.items():
            self._array(name)[region] = values
        with complete_file(self._mark_file(group)) as stage:
            stage.write_text(json.dumps(vars(made)), encoding="utf-8")
        return made

    def read(self, group: int) -> dict[str, np.ndarray]:
        """Read what a group has."""
        region = self.layout.region(group)
        return {name: self._array(name)[region] for name in self.layout.variables}

    def mark(self, group: int) -> Mark | None:
        """Return the mark of a group; None if it has none that can be read."""
        try:
            return Mark(**json.loads(self._mark_file(group).read_text(encoding="utf-8")))
        except (OSError, ValueError, TypeError):
            return None

    def finished(self, group: int) -> dict[str, np.ndarray] | None:
        """Return the data of a marked group if they are those that were written."""
        mark = self.mark(group)
        if mark is None:
            return None
        # A damaged chunk fails in many ways: by its own checksum, its length, its absence
        with suppress(Exception):
            block = self.read(group)
            if digest(block) == mark.digest:
                return block
        return None

    def marks(self) -> Iterator[tuple[int, Mark]]:
        """Yield the groups that have a mark."""
        for group in range(self.layout.n_groups):
            mark = self.mark(group)
            if mark is not None:
                yield group, mark

    def tell_warnings(self) -> None:
        """Write what all marks warn of into the attributes of the store.

        Parts of one sweep may end together: one writes at a time, and the last knows all.
        """
        root = self.path / "zarr.json"
        with FileLock(self.path / _MARKS / ".lock"):
            counted: Counter[str] = Counter()
            for _, mark in self.marks():
                counted.update(mark.warnings)
            told = said(counted)
            metadata = json.loads(root.read_text(encoding="utf-8"))
            if metadata["attributes"].get("warnings") != told:
                metadata["attributes"]["warnings"] = told
                with complete_file(root) as stage:
                    stage.write_text(json.dumps(metadata, indent=2), encoding="utf-8")

    def _mark_file(self, group: int) -> Path:
        return self.path / _MARKS / f"{group}.json"


def said(warnings: Mapping[str, int]) -> list[str]:
    """Write warnings and at how many points they were said, in one order.

    Of those that differ in their numbers alone the first stands for all.
    """
    lines = []
    for first, *others in of_kind(sorted(warnings)):
        count = warnings[first] + sum(warnings[one] for one in others)
        numbers = ", with other numbers in some" if others else ""
        lines.append(f"{first} ({count} run{'s' * (count > 1)}{numbers})")
    return lines


def digest(block: dict[str, np.ndarray]) -> str:
    """Return a checksum of the data of a group."""
    found = blake2b(digest_size=16)
    for name in sorted(block):
        found.update(name.encode())
        found.update(np.ascontiguousarray(block[name]).tobytes())
    return found.hexdigest()


def complete(block: dict[str, np.ndarray]) -> bool:
    """Whether no point of a group failed."""
    return not (block[STATE] == FAILED).any()


def open_store(
    path: str | Path, sweep: Sweep, *, replace: bool = False, shared: bool = False
) -> Store:
    """Open the store of a sweep, made if there is none; `shared` by parts of the sweep.

    Raises
    ------
    ValueError
        If there is anything else under this name: the store of another sweep, or no store.
        If it is a store that cannot be read.
    """
    path = Path(path)
    if path.exists() and any(path.iterdir() if path.is_dir() else [path]):
        bound = _bound_to(path)
        if bound == sweep.digest:
            if not replace:
                return Store(path=path, layout=Layout.of(sweep))
        elif not replace:
            msg = (
                f"output must be a new store or that of this sweep, got {path}, which is "
                "bound to another one: scene, values, [simulate], files or version differ. "
                + (
                    "Name another, or delete it before the first part."
                    if shared
                    else "Name another, or use --force to replace it."
                )
            )
            raise ValueError(msg)
        shutil.rmtree(path)
    layout = Layout.of(sweep)
    try:
        with complete_folder(path) as stage:
            _make(stage, sweep, layout)
    except ExistsError:
        # Another part of the same sweep has made it meanwhile
        if _bound_to(path) != sweep.digest:
            raise
    return Store(path=path, layout=layout)


def _bound_to(path: Path) -> str:
    """Return the digest of the sweep that a store is bound to."""
    try:
        attributes = json.loads((path / "zarr.json").read_text())["attributes"]
        return str(attributes[_BOUND])
    except (OSError, ValueError, KeyError, TypeError):
        msg = (
            f"output must be a new store or that of this sweep, got {path}, which is no "
            "store of a sweep. Name another."
        )
        raise ValueError(msg) from None


def _make(folder: Path, sweep: Sweep, layout: Layout) -> None:
    """Write the metadata of all variables, and the coordinates."""
    zarr = needed("zarr")
    attributes = {
        _BOUND: sweep.digest,
        "design": sweep.design.kind,
        "sweep": json.dumps(sweep.document, default=str),
        "source": sweep.source.name,
        "warnings": [],
    }
    root = zarr.open_group(folder, mode="w", zarr_format=3, attributes=attributes)
    packed = [zarr.codecs.ZstdCodec(level=3, checksum=True)]
    for name, variable in layout.variables.items():
        root.create_array(
            name,
            shape=(*layout.sizes.values(), *variable.shape),
            chunks=(*layout.chunk, *variable.shape),
            dtype=variable.dtype,
            fill_value=variable.empty,
            dimension_names=(*layout.sizes, *variable.dims),
            compressors=packed,
            attributes=variable.attrs,
        )
    for name, (dims, values, attrs) in layout.coords.items():
        text = values.dtype.kind not in "fiu"
        held = root.create_array(
            name, shape=values.shape, dtype=str if text else values.dtype,
            dimension_names=dims, compressors=packed, attributes=attrs,
        )  # fmt: skip
        held[...] = values.astype(str) if text else values
    (folder / _MARKS).mkdir()
    with warnings.catch_warnings():
        # That readers of other makers may pass over what is consolidated does no harm
        warnings.simplefilter("ignore")
        zarr.consolidate_metadata(folder)

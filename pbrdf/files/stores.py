"""Zarr stores, folders of chunks, checked before anything in them is believed."""

import json
import math
import os
import stat
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from pbrdf.errors import DataFileError

__all__ = ["check_store", "description"]

# What this program writes; others might run anything, or fetch data from elsewhere
_CODECS = {"bytes", "zstd", "vlen-utf8", "crc32c"}
_MOST_FILES, _MOST_METADATA = 200_000, 16 * 2**20
# Of a variable of a result
_MOST_PIECES = 20_000
# Bytes of a piece of texts, whose number says nothing of their length
_MOST_TEXT = 64 * 2**20
_ZSTD = b"\x28\xb5\x2f\xfd"
# A variable may be so much larger than the store
_MOST_EXPANSION = 2000
# Points of a sweep, whose states are read at once
_MOST_POINTS = 10**8
_HOSTILE = "A result holds its own data; do not read it from a stranger."
# What tells of the store and of each variable
_ABOUT = "zarr.json"
# Bytes that a folder takes
_FOLDER = 4096
_DAMAGED = "The file is damaged; copy it again or repeat the run."


def check_store(path: Path, *, sparse: bool = False) -> None:
    """Refuse a store with links, devices, foreign codecs or shapes beyond its files.

    Parameters
    ----------
    path : Path
        The folder.
    sparse : bool
        Whether most of it may be missing, as of a sweep that is not finished.

    Raises
    ------
    DataFileError
        Naming the variable.
    """
    size, files = _walked(path)
    grown: dict[str, float] = {}
    for name, about in _variables(path):
        place = f"variable {name[:80]}"
        try:
            codecs = [str(one["name"]) for one in about["codecs"]]
            count = float(np.prod([float(side) for side in about["shape"]]))
            pieces = [float(side) for side in _pieces(about)]
        except (LookupError, TypeError, ValueError, OverflowError) as error:
            problem = "its shape or its codecs are missing, or no such"
            raise DataFileError(path, problem, _DAMAGED, column=place) from error
        foreign = set(codecs) - _CODECS
        # Each once: a hundred thousand checksums of a piece take minutes
        twice = len(set(codecs)) < len(codecs)
        if foreign or twice or about.get("storage_transformers"):
            problem = f"it is packed by {', '.join(sorted(foreign or codecs))[:80]}"
            raise DataFileError(path, problem, _HOSTILE, column=place)
        if name == "state" and count > _MOST_POINTS:
            raise DataFileError(path, f"it has {count:.3g} points", _DAMAGED, column=place)
        if not sparse and 8 * count > _MOST_EXPANSION * size:
            problem = (
                f"it would take {8 * count / 2**20:.0f} MiB of a store of {size} bytes"
            )
            raise DataFileError(path, problem, _DAMAGED, column=place)
        if not sparse:
            folder = name.partition("/")[0]
            if folder not in grown:
                grown[folder] = max(map(_grown, files[folder]), default=0.0)
            piece = float(np.prod(pieces))
            _check_pieces(path, place, grown[folder], count, piece)


def _entries(path: Path) -> Iterator[tuple[str, os.DirEntry[str]]]:
    """Yield what a folder holds at any depth, each with the folder that it is in."""
    waiting = [str(path)]
    while waiting:
        folder = waiting.pop()
        try:
            with os.scandir(folder) as found:
                entries = list(found)
        except FileNotFoundError:
            # A sweep that is running has moved it to its place
            continue
        for entry in entries:
            yield folder, entry
            if entry.is_dir(follow_symlinks=False):
                waiting.append(entry.path)


def _walked(path: Path) -> tuple[int, dict[str, list[str]]]:
    """Return the size of a store and the pieces of each of its variables.

    Refuses links, devices and endless depth.
    """
    size, pieces = 0, defaultdict[str, list[str]](list)
    start = len(str(path)) + 1
    try:
        for number, (folder, entry) in enumerate(_entries(path)):
            if number > _MOST_FILES or entry.is_symlink():
                problem = f"{entry.name[:80]} is a link, or one of too many files"
                raise DataFileError(path, problem, _HOSTILE)
            if entry.is_dir(follow_symlinks=False):
                size += _FOLDER
                continue
            try:
                mode = entry.stat(follow_symlinks=False)
            except FileNotFoundError:
                continue
            if not stat.S_ISREG(mode.st_mode):
                problem = f"{entry.name[:80]} is no regular file"
                raise DataFileError(path, problem, _HOSTILE)
            size += mode.st_size
            if entry.name != _ABOUT:
                pieces[folder[start:].partition(os.sep)[0]].append(entry.path)
    except OSError as error:
        raise DataFileError(path, "its folders nest too deeply", _HOSTILE) from error
    return size, pieces


def _pieces(about: dict[str, Any]) -> list[Any]:
    """Return the sides of the pieces that a variable is stored in."""
    return list(about["chunk_grid"]["configuration"]["chunk_shape"])


def _check_pieces(path: Path, place: str, grown: float, count: float, piece: float) -> None:
    """Refuse pieces that are too many, or would grow beyond their size."""
    if not piece > 0 or count > _MOST_PIECES * piece:
        problem = f"its {count:g} values are in pieces of {piece:g}"
        raise DataFileError(path, problem, _DAMAGED, column=place)
    if grown > 16 * piece + _MOST_TEXT:
        problem = f"a piece of it would take {grown / 2**20:.0f} MiB"
        raise DataFileError(path, problem, _HOSTILE, column=place)


def _grown(file: str) -> float:
    """Return the size that a piece says it grows to; inf if it says none.

    Zstandard, RFC 8878, 3.1.1.1: magic number, descriptor, window, dictionary, size of the
    content. Anything else does not grow.
    """
    # Quicker than a stream: stores have thousands of them
    handle = os.open(file, os.O_RDONLY)
    try:
        head = os.read(handle, 18)
    finally:
        os.close(handle)
    if head[:4] != _ZSTD or len(head) < 6:
        return 0.0
    descriptor = head[4]
    single = descriptor >> 5 & 1
    width = (single, 2, 4, 8)[descriptor >> 6]
    start = 6 - single + (0, 1, 2, 4)[descriptor & 3]
    return int.from_bytes(head[start : start + width], "little") if width else math.inf


def _variables(path: Path) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield what a store says of each variable: beside it, and together at its root."""
    for file in path.glob("*/zarr.json"):
        yield file.parent.name, description(path, f"{file.parent.name}/zarr.json")
    root = description(path) if (path / "zarr.json").exists() else {}
    together = root.get("consolidated_metadata") or {}
    held = together.get("metadata", {}) if isinstance(together, dict) else None
    if not isinstance(held, dict) or not all(isinstance(v, dict) for v in held.values()):
        problem = "what its root says of its variables is no table"
        raise DataFileError(path, problem, _DAMAGED)
    for name, about in held.items():
        if about.get("node_type") != "group":
            yield str(name), about


def description(store: Path, place: str = "zarr.json") -> dict[str, Any]:
    """Return what a file of a store says of it or of a variable, a mapping.

    Raises
    ------
    DataFileError
        If it is no such file, or holds anything else.
    """
    file = store / place
    if file.is_symlink() or not file.is_file() or file.stat().st_size > _MOST_METADATA:
        raise DataFileError(store, f"{place} is not there, or no file", _DAMAGED)
    try:
        found = json.loads(file.read_bytes())
    except (ValueError, RecursionError) as error:
        raise DataFileError(store, f"{place} is no JSON", _DAMAGED) from error
    if not isinstance(found, dict):
        raise DataFileError(store, f"{place} describes nothing", _DAMAGED)
    return found

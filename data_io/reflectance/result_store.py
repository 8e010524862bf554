"""Results in Zarr stores: folders of chunks, for what is too large for one file.

A store is written direction by direction and holds a checksum of each variable, for each
direction where it has that dimension.
"""

import json
import stat
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from data_io.reflectance.attributes import CHECKSUMS, digest, encode
from data_io.reflectance.stored import DAMAGED, FAULTS, HOSTILE, MOST_EXPANSION, first_line
from pbrdf.errors import DataFileError
from pbrdf.files import complete_folder
from pbrdf.files.writing import ExistsError
from pbrdf.tracer.memory import SHARE, free_bytes, told

__all__ = ["fill_store", "is_result_store", "read_store", "write_store"]

# Along it stores are written
ALONG = "theta_i"
# Larger chunks are cut further [bytes]
_CHUNK = 64 * 2**20
# What this program writes; others might run anything, or fetch data from elsewhere
_CODECS = {"bytes", "zstd", "vlen-utf8", "crc32c"}
_MOST_FILES, _MOST_METADATA = 200_000, 16 * 2**20
# Counts that parts have each their own of
_SUMMED = ("path_segments", "self_hits", "exact_searches", "medium_mismatches")


def write_store(
    parts: Iterable[xr.Dataset], path: str | Path, *, replace: bool = False
) -> None:
    """Write a result, part by part along theta_i, to a store that appears complete.

    Parameters
    ----------
    parts : iterable of Dataset
        As `pbrdf.simulation.simulate_parts` yields; or one whole result.
    path : str or Path
        The folder, NAME.zarr.
    replace : bool
        Whether a store of a result may be replaced; nothing else ever is.

    Raises
    ------
    ValueError
        If anything else stands there, or zarr is not installed.
    """
    path = Path(path)
    _zarr()
    if path.exists() and not (replace and is_result_store(path)):
        if path.is_dir() and any(path.iterdir()) and not is_result_store(path):
            msg = (
                f"output must be a new store or that of a result, got {path}, which is "
                "neither. Name another."
            )
            raise ValueError(msg)
        if not path.is_dir() or any(path.iterdir()):
            raise ExistsError(path)
    with complete_folder(path, replace=replace) as stage:
        fill_store(parts, stage)


def fill_store(parts: Iterable[xr.Dataset], folder: Path) -> dict[str, Any]:
    """Write the parts of a result into an empty folder; return the attributes of all."""
    zarr = _zarr()
    whole: dict[str, Any] = {}
    checksums: dict[str, list[str]] = {}
    for number, part in enumerate(parts):
        _write_part(part, folder, first=number == 0)
        for name, variable in part.variables.items():
            held = checksums.setdefault(str(name), [])
            if ALONG in variable.dims or number == 0:
                held.extend(_digests(variable))
        whole = _joined(whole, part.attrs) if number else dict(part.attrs)
    with _quiet():
        root = zarr.open_group(folder, mode="r+")
        root.attrs.update(encode(whole) | {CHECKSUMS: json.dumps(checksums)})
        zarr.consolidate_metadata(folder)
    return whole


def is_result_store(path: str | Path) -> bool:
    """Tell whether a folder is the store of a result, not that of a sweep or none."""
    try:
        return CHECKSUMS in _metadata(Path(path) / "zarr.json")["attributes"]
    except (DataFileError, OSError, KeyError, TypeError):
        return False


def read_store(path: str | Path) -> xr.Dataset:
    """Read a result from its store, and compare the checksum of each variable.

    Raises
    ------
    DataFileError
        If it is no such store, damaged, or larger than the memory that is free.
    """
    path = Path(path)
    _zarr()
    if not path.is_dir() or not is_result_store(path):
        problem = "expected the store of a result, got something else"
        raise DataFileError(path, problem, "Give a folder NAME.zarr of this program.")
    _check_folder(path)
    try:
        with _quiet():
            stored = xr.open_zarr(path, chunks=None, consolidated=False, decode_times=False)
            checksums = json.loads(stored.attrs.pop(CHECKSUMS))
            names = {name: list(held) for name, held in checksums.items()}
    except FAULTS as error:
        problem = f"cannot be read: {first_line(error)}"
        place = _unreadable(path)
        raise DataFileError(path, problem, DAMAGED, column=place) from error
    if stored.nbytes > SHARE * free_bytes():
        problem = f"it takes {told(stored.nbytes)}, more than the memory that is free"
        raise DataFileError(path, problem, "Read parts of it by xarray.open_zarr.")
    for name in sorted(names.keys() | set(map(str, stored.variables))):
        _load(path, stored, name, names.get(name))
    return stored


def _unreadable(path: Path) -> str | None:
    """Name the first variable that cannot be read."""
    for file in sorted(path.glob("*/zarr.json")):
        try:
            with _quiet():
                _zarr().open_array(file.parent, mode="r")[...]
        except FAULTS:
            return f"variable {file.parent.name}"
    return None


def _load(path: Path, stored: xr.Dataset, name: str, written: list[str] | None) -> None:
    """Read a variable into memory if it is what was written."""
    place = f"variable {name}"
    if written is None or name not in stored.variables:
        problem = "was not written" if written is None else "was written and is not there"
        raise DataFileError(path, problem, DAMAGED, column=place)
    try:
        with _quiet():
            variable = stored.variables[name].load()
        if variable.dtype.kind in "OT":
            variable = variable.copy(data=variable.to_numpy().astype(str))
        found = _digests(variable)
    except FAULTS as error:
        problem = f"cannot be read: {first_line(error)}"
        raise DataFileError(path, problem, DAMAGED, column=place) from error
    if found != written:
        problem = "the values are not those that were written: its checksum differs"
        raise DataFileError(path, problem, DAMAGED, column=place)


def _write_part(part: xr.Dataset, folder: Path, *, first: bool) -> None:
    encoded = part.copy()
    encoded.attrs = {}
    for name, variable in part.variables.items():
        encoded[name].attrs = encode(variable.attrs)
        encoded[name].encoding = {}
    with _quiet():
        if first:
            encoding = {
                name: {"chunks": _chunks(variable)}
                for name, variable in encoded.variables.items()
                if variable.ndim
            }
            encoded.to_zarr(
                folder, mode="w", zarr_format=3, consolidated=False, encoding=encoding
            )
            return
        shared = [name for name, v in encoded.variables.items() if ALONG not in v.dims]
        encoded.drop_vars(shared).to_zarr(folder, append_dim=ALONG, consolidated=False)


def _chunks(variable: xr.Variable) -> tuple[int, ...]:
    """Cut a variable along theta_i, and further from the left until chunks are small."""
    chunks = {
        str(dim): 1 if dim == ALONG else max(size, 1)
        for dim, size in variable.sizes.items()
    }
    for dim in chunks:
        if variable.dtype.itemsize * np.prod(list(chunks.values())) > _CHUNK:
            chunks[dim] = 1
    return tuple(chunks.values())


def _digests(variable: xr.Variable) -> list[str]:
    """Return the checksum of each direction, or of all where there are none."""
    if ALONG not in variable.dims:
        return [digest(variable)]
    return [
        digest(variable.isel({ALONG: slice(k, k + 1)}))
        for k in range(variable.sizes[ALONG])
    ]


def _joined(whole: dict[str, Any], part: dict[str, Any]) -> dict[str, Any]:
    """Return attributes of directions and of those after them."""
    joined = dict(whole)
    for name, value in part.items():
        if name in _SUMMED:
            joined[name] = whole[name] + value
        elif name == "rel_error":
            joined[name] = max(whole[name], value)
        elif name == "warnings":
            joined[name] = list(dict.fromkeys([*whole[name], *value]))
        elif name.startswith("rays_") and isinstance(value, list):
            joined[name] = [*whole[name], *value]
    return joined


def _check_folder(path: Path) -> None:
    """Refuse a store with links, devices, foreign codecs or shapes beyond its files."""
    size = 0
    for number, entry in enumerate(chain([path], path.rglob("*"))):
        mode = entry.lstat()
        if number > _MOST_FILES or (number and stat.S_ISLNK(mode.st_mode)):
            problem = f"{entry.name[:80]} is a link, or one of too many files"
            raise DataFileError(path, problem, HOSTILE)
        if not (stat.S_ISREG(mode.st_mode) or stat.S_ISDIR(mode.st_mode) or not number):
            raise DataFileError(path, f"{entry.name[:80]} is no regular file", HOSTILE)
        size += mode.st_size
    for file in path.glob("*/zarr.json"):
        about = _metadata(file)
        place = f"variable {file.parent.name}"
        try:
            codecs = {str(one["name"]) for one in about["codecs"]}
            count = float(np.prod([float(side) for side in about["shape"]]))
        except (KeyError, TypeError, ValueError) as error:
            problem = "its shape or its codecs are missing, or no such"
            raise DataFileError(path, problem, DAMAGED, column=place) from error
        if codecs - _CODECS or about.get("storage_transformers"):
            problem = f"it is packed by {', '.join(sorted(codecs - _CODECS))[:80]}"
            raise DataFileError(path, problem, HOSTILE, column=place)
        if 8 * count > MOST_EXPANSION * size:
            problem = f"it would take {told(8 * count)} of a store of {told(size)}"
            raise DataFileError(path, problem, DAMAGED, column=place)


def _metadata(file: Path) -> dict[str, Any]:
    """Return what a zarr.json says, a mapping."""
    if file.is_symlink() or not file.is_file() or file.stat().st_size > _MOST_METADATA:
        raise DataFileError(file, "expected the description of a store", DAMAGED)
    try:
        found = json.loads(file.read_bytes())
    except (ValueError, RecursionError) as error:
        raise DataFileError(file, "is no JSON", DAMAGED) from error
    if not isinstance(found, dict):
        raise DataFileError(file, "is no description of a store", DAMAGED)
    return found


def _zarr() -> Any:
    try:
        import zarr
    except ImportError as error:
        msg = (
            "a result can be stored in .zarr only with the package zarr, which is not "
            'here. Install it: pip install "pbrdf[sweeps]", or name a .nc file.'
        )
        raise ValueError(msg) from error
    return zarr


@contextmanager
def _quiet() -> Iterator[None]:
    """Ignore what zarr and xarray say of kinds that others may not read."""
    with warnings.catch_warnings(action="ignore"):
        yield

"""Results in Zarr stores: folders of chunks, for what is too large for one file.

A store is written direction by direction, and by groups of wavelengths where one direction
is too large; it holds a checksum of each variable, for each direction and each group.
"""

import json
import warnings
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from data_io.reflectance.attributes import (
    CHECKSUMS,
    OF_ATTRS,
    digest_of_attrs,
    digests,
    encode,
)
from pbrdf.errors import DataFileError
from pbrdf.files import complete_folder
from pbrdf.files.hdf5 import DAMAGED, FAULTS, first_line
from pbrdf.files.stores import check_store, description
from pbrdf.files.writing import ExistsError
from pbrdf.memory import SHARE, free_bytes, told

__all__ = ["fill_store", "is_result_store", "read_store", "write_store"]

# Along them stores are written; the checksums of a variable go by the first, then the other
ALONG, WITHIN = "theta_i", "wavelength"
# Stands among the names of variables: the size of a group of wavelengths
_GROUP = "./wavelength"
# Whoever runs this has so much memory; to ask takes a millisecond [bytes]
_SMALL = 64 * 2**20
# Larger chunks are cut further [bytes]
_CHUNK = 64 * 2**20
# A folder for each variable, not one for each index of each piece
_FLAT = {"name": "default", "separator": "."}
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
    found: dict[str, dict[tuple[int, ...], str]] = {}
    group, rows = 0, 0
    for number, part in enumerate(parts):
        first = part.encoding.get("first", {ALONG: rows, WITHIN: 0})
        of_direction = not first[WITHIN]
        _write_part(part, folder, first if number else None)
        if number and not first[ALONG] and not group:
            group = first[WITHIN]
        for name, variable in part.variables.items():
            held = found.setdefault(str(name), {})
            # What has neither dimension is in all parts, and what lacks one in some
            again = ALONG not in variable.dims and first[ALONG] > 0
            again |= WITHIN not in variable.dims and not of_direction
            if not again:
                held.update(_digests(variable, first))
        rows = first[ALONG] + part.sizes.get(ALONG, 0)
        whole = (
            _joined(whole, part.attrs, anew=of_direction) if number else dict(part.attrs)
        )
    checksums = {
        name: [held[place] for place in sorted(held)] for name, held in found.items()
    }
    if group:
        checksums[_GROUP] = [str(group)]
    with _quiet():
        root = zarr.open_group(folder, mode="r+")
        encoded = encode(whole)
        checksums[OF_ATTRS] = [digest_of_attrs(encoded)]
        root.attrs.update(encoded | {CHECKSUMS: json.dumps(checksums)})
        zarr.consolidate_metadata(folder)
    return whole


def is_result_store(path: str | Path) -> bool:
    """Tell whether a folder is the store of a result, not that of a sweep or none."""
    try:
        return CHECKSUMS in description(Path(path))["attributes"]
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
    check_store(path)
    try:
        with _quiet():
            stored = xr.open_zarr(path, chunks=None, consolidated=False, decode_times=False)
            checksums = json.loads(stored.attrs.pop(CHECKSUMS))
            names = {name: list(held) for name, held in checksums.items()}
            group = max(int(names.pop(_GROUP, ["0"])[0]), 0)
            expected = names.pop(OF_ATTRS, [digest_of_attrs(stored.attrs)])[0]
    except FAULTS as error:
        problem = f"cannot be read: {first_line(error)}"
        place = _unreadable(path)
        raise DataFileError(path, problem, DAMAGED, column=place) from error
    if stored.nbytes > _SMALL and stored.nbytes > SHARE * free_bytes():
        problem = f"it takes {told(stored.nbytes)}, more than the memory that is free"
        raise DataFileError(path, problem, "Read parts of it by xarray.open_zarr.")
    if expected != digest_of_attrs(stored.attrs):
        problem = "they are not those that were written: their checksum differs"
        raise DataFileError(path, problem, DAMAGED, column="attributes")
    for name in sorted(names.keys() | set(map(str, stored.variables))):
        _load(path, stored, name, names.get(name), group)
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


def _load(
    path: Path, stored: xr.Dataset, name: str, written: list[str] | None, group: int
) -> None:
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
        found = list(_digests(variable, {}, group, *written[:1]).values())
    except FAULTS as error:
        problem = f"cannot be read: {first_line(error)}"
        raise DataFileError(path, problem, DAMAGED, column=place) from error
    if found != written:
        problem = "the values are not those that were written: its checksum differs"
        raise DataFileError(path, problem, DAMAGED, column=place)


def _write_part(part: xr.Dataset, folder: Path, first: Mapping[str, int] | None) -> None:
    """Write a part at its place; without one, make the store of it."""
    encoded = part.copy()
    encoded.attrs = {}
    for name, variable in part.variables.items():
        encoded[name].attrs = encode(variable.attrs)
        encoded[name].encoding = {}
    with _quiet():
        if first is None:
            encoding = {
                name: {"chunks": _chunks(variable), "chunk_key_encoding": _FLAT}
                for name, variable in encoded.variables.items()
                if variable.ndim
            }
            encoded.to_zarr(
                folder, mode="w", zarr_format=3, consolidated=False, encoding=encoding
            )
            return
        root = _zarr().open_group(folder, mode="r+")
        for name, variable in encoded.variables.items():
            if ALONG in variable.dims or WITHIN in variable.dims:
                _put(root[str(name)], variable, first)


def _put(array: Any, variable: xr.Variable, first: Mapping[str, int]) -> None:
    """Write the values of a part into the array of all, which grows as it must."""
    starts = [first.get(str(dim), 0) for dim in variable.dims]
    ends = [start + size for start, size in zip(starts, variable.shape, strict=True)]
    array.resize(tuple(map(max, zip(array.shape, ends, strict=True))))
    array[tuple(map(slice, starts, ends))] = variable.to_numpy()


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


def _digests(
    variable: xr.Variable, first: Mapping[str, int], group: int = 0, *like: str
) -> dict[tuple[int, ...], str]:
    """Return checksums by place: of each direction, and each group of wavelengths."""
    sides = [(d, variable.sizes[d]) for d in (ALONG, WITHIN) if d in variable.dims]
    steps = {ALONG: 1, WITHIN: group or max(variable.sizes.get(WITHIN, 1), 1)}
    keys, places = [], []
    for place in product(*(range(0, size, steps[dim]) for dim, size in sides)):
        starts = {dim: k for (dim, _), k in zip(sides, place, strict=True)}
        keys.append(tuple(k + first.get(dim, 0) for dim, k in starts.items()))
        places.append(
            tuple(
                slice(starts[dim], starts[dim] + steps[dim])
                if dim in starts
                else slice(None)
                for dim in map(str, variable.dims)
            )
        )
    return dict(zip(keys, digests(variable, places, *like), strict=True))


def _joined(whole: dict[str, Any], part: dict[str, Any], *, anew: bool) -> dict[str, Any]:
    """Return attributes of directions and of those after them.

    `anew` says whether the part begins directions, whose rays are counted once.
    """
    joined = dict(whole)
    for name, value in part.items():
        counted = name in _SUMMED or name.startswith("rays_")
        if counted and not anew:
            continue
        if name in _SUMMED:
            joined[name] = whole[name] + value
        elif name == "rel_error":
            joined[name] = max(whole[name], value)
        elif name == "warnings":
            joined[name] = list(dict.fromkeys([*whole[name], *value]))
        elif name.startswith("rays_") and isinstance(value, list):
            joined[name] = [*whole[name], *value]
    return joined


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

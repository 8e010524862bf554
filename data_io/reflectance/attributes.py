"""Attributes that files can hold, and checksums of variables."""

import hashlib
import json
from collections.abc import Hashable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
import xxhash

__all__ = [
    "CHECKSUMS",
    "OF_ATTRS",
    "decode",
    "digest",
    "digest_of_attrs",
    "digests",
    "encode",
]

# Marks an attribute that netCDF cannot hold as it is: truth values, None, lists, mappings
_JSON = "json:"
_INT64 = 2**63
# Attribute that holds the checksum of each variable
CHECKSUMS = "pbrdf_checksums"
# Stands among the names of variables, of which none can be this
OF_ATTRS = "."
_XXH3 = "xxh3:"


def digest(variable: xr.Variable, like: str = _XXH3) -> str:
    """Return a checksum of dimensions, values and attributes.

    Parameters
    ----------
    variable : xarray.Variable
        Of any shape.
    like : str
        A checksum of the kind wanted: SHA-256, which files of earlier versions have, is
        without a mark.
    """
    return next(digests(variable, [()], like))


def digests(
    variable: xr.Variable, places: Iterable[tuple[slice, ...]], like: str = _XXH3
) -> Iterator[str]:
    """Yield the checksum of each part of a variable, told by its slices."""
    whole: Any = variable.to_numpy()
    text = whole.dtype.kind in "OTU"
    kind = "text" if text else whole.dtype.str
    attrs = _in_order(variable.attrs)
    fast = like.startswith(_XXH3)
    for place in places:
        values = whole[(*place, ...)]
        found = xxhash.xxh3_128() if fast else hashlib.sha256()
        found.update(f"{variable.dims} {values.shape} {kind} {attrs}".encode() + b"\0")
        if text:
            found.update("\0".join(map(str, values.reshape(-1))).encode())
        else:
            _add(found, values)
        yield _XXH3 * fast + found.hexdigest()


def _add(found: Any, values: np.ndarray) -> None:
    """Add the bytes of an array in its order; a large one is not copied."""
    if not values.flags.c_contiguous and values.nbytes > 2**20:
        for part in values:
            _add(found, part)
    else:
        found.update(np.ascontiguousarray(values).reshape(-1).view(np.uint8).data)


def digest_of_attrs(attrs: Mapping[Any, Any]) -> str:
    """Return a checksum of encoded attributes but for the checksums among them."""
    held = {name: value for name, value in attrs.items() if name != CHECKSUMS}
    return hashlib.sha256(str(_in_order(held)).encode()).hexdigest()


def _in_order(attrs: Mapping[Any, Any]) -> list[tuple[str, str]]:
    return sorted((str(key), str(value)) for key, value in attrs.items())


def encode(attrs: dict[Any, Any]) -> dict[Any, Any]:
    """Return attributes that netCDF can hold."""
    return {name: _encode_one(name, value) for name, value in attrs.items()}


def _encode_one(name: Hashable, value: Any) -> str | int | float:
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, str) and not value.startswith(_JSON) and "\x00" not in value:
        # HDF5 has no empty text of its own
        return value or _JSON + '""'
    if isinstance(value, float):
        return value
    if isinstance(value, int) and not isinstance(value, bool) and -_INT64 <= value < _INT64:
        return value
    try:
        return _JSON + json.dumps(value, default=_plain)
    except (TypeError, ValueError) as error:
        msg = (
            f"attribute {name} must be text, numbers, lists or mappings, got "
            f"{type(value).__name__}. Convert it first."
        )
        raise TypeError(msg) from error


def _plain(value: Any) -> Any:
    """Return what JSON can write for what it cannot."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Path):
        return str(value)
    raise TypeError


def decode(attrs: dict[Any, Any]) -> dict[Any, Any]:
    """Return attributes as they were before `encode`; arrays and tuples become lists."""
    decoded = {}
    for name, value in attrs.items():
        if isinstance(value, str) and value.startswith(_JSON):
            decoded[name] = json.loads(value.removeprefix(_JSON))
        elif isinstance(value, np.generic):
            decoded[name] = value.item()
        else:
            decoded[name] = value
    return decoded

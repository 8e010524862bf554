"""Result datasets in netCDF files, complete with their attributes."""

import hashlib
import io
import json
import warnings
from collections.abc import Hashable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import pbrdf.accessor  # noqa: F401  (registers ds.pbrdf)
from data_io.reflectance.stored import FAULTS, check_stored, first_line
from data_io.text.files import read_bytes
from pbrdf.errors import DataFileError
from pbrdf.files import complete_file

# Marks an attribute that netCDF cannot hold as it is: truth values, None, lists, mappings
_JSON = "json:"
_HDF5_MAGIC = b"\x89HDF\r\n\x1a\n"
_INT64 = 2**63
# Attribute that holds the checksum of each variable
_CHECKSUMS = "pbrdf_checksums"


def write_result(dataset: xr.Dataset, path: str | Path) -> None:
    """Write a dataset to a netCDF 4 file, compressed; it appears complete or not at all.

    Attributes of every kind survive: text and numbers as they are, everything else as JSON
    behind the mark ``json:``.

    Parameters
    ----------
    dataset : xarray.Dataset
        As from `simulate`, or any other.
    path : str or Path
        The file.

    Raises
    ------
    TypeError
        If `dataset` is no Dataset, or an attribute cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> dataset = xr.Dataset({"albedo": ("theta_i", [0.1])}, attrs={"seeds": [1, None]})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_result(dataset, Path(folder) / "result.nc")
    ...     read_result(Path(folder) / "result.nc").attrs
    {'seeds': [1, None]}
    """
    if not isinstance(dataset, xr.Dataset):
        msg = f"dataset must be an xarray.Dataset, got {type(dataset).__name__}."
        raise TypeError(msg)
    encoded = dataset.copy()
    encoded.attrs = _encode(dataset.attrs)
    for name, variable in dataset.variables.items():
        encoded[name].attrs = _encode(variable.attrs)
    encoding: dict[Hashable, dict[str, Any]] = {
        name: {"zlib": True, "complevel": 4, "shuffle": True}
        for name, variable in dataset.data_vars.items()
        if variable.ndim and variable.dtype.kind in "fiu"
    }
    encoded.attrs[_CHECKSUMS] = json.dumps(
        {str(name): _digest(variable) for name, variable in encoded.variables.items()}
    )
    # In memory first: HDF5 takes the interpreter with it when the disk is full
    content = encoded.to_netcdf(engine="h5netcdf", encoding=encoding)
    with complete_file(path) as temporary:
        temporary.write_bytes(content)


def _digest(variable: xr.Variable) -> str:
    """Return a checksum of dimensions, values and attributes."""
    values = np.ascontiguousarray(variable.to_numpy())
    text = values.dtype.kind in "OTU"
    held = values.reshape(-1)
    content = "\0".join(map(str, held)).encode() if text else held.tobytes()
    kind = "text" if text else values.dtype.str
    attrs = sorted((str(key), str(value)) for key, value in variable.attrs.items())
    head = f"{variable.dims} {values.shape} {kind} {attrs}"
    return hashlib.sha256(head.encode() + b"\0" + content).hexdigest()


def read_result(path: str | Path) -> xr.Dataset:
    """Read a dataset that `write_result` wrote; all of it is in memory, the file is closed.

    Raises
    ------
    DataFileError
        If the file is missing, empty, truncated or no netCDF 4 file.
    """
    content = read_bytes(path)
    if not content.startswith(_HDF5_MAGIC):
        problem = "expected a netCDF 4 file, the content is something else"
        raise DataFileError(path, problem, "Give a result file (.nc) of this program.")
    check_stored(path, content)
    try:
        # Names of variables decide nothing: wavelength units are no times
        with (
            warnings.catch_warnings(action="ignore"),
            xr.open_dataset(
                io.BytesIO(content), engine="h5netcdf", decode_times=False
            ) as stored,
        ):
            dataset = stored.load()
        _check_digests(path, dataset)
    except DataFileError:
        raise
    except FAULTS as error:
        problem = f"expected a complete netCDF 4 file, got: {first_line(error)}"
        raise DataFileError(path, problem, "The file is truncated or damaged.") from error
    dataset = dataset.assign_coords(
        {
            name: (coord.dims, coord.to_numpy().astype(str), coord.attrs)
            for name, coord in dataset.coords.items()
            if coord.dtype.kind in "OT"
        }
    )
    try:
        dataset.attrs = _decode(dataset.attrs)
        for name in dataset.variables:
            dataset[name].attrs = _decode(dataset[name].attrs)
            dataset[name].encoding = {}
    except FAULTS as error:
        problem = f"an attribute is no JSON: {first_line(error)}"
        raise DataFileError(path, problem, "The file is damaged.") from error
    dataset.encoding = {}
    return dataset


def _check_digests(path: str | Path, dataset: xr.Dataset) -> None:
    """Compare what was read with the checksums that were written beside it.

    Files of earlier versions have none.
    """
    written = json.loads(dataset.attrs.pop(_CHECKSUMS, "{}"))
    cure = "The file is damaged; copy it again or repeat the run."
    for name, variable in dataset.variables.items():
        if written and written.get(str(name)) != _digest(variable):
            problem = "the values are not those that were written: its checksum differs"
            raise DataFileError(path, problem, cure, column=f"variable {name}")
    missing = sorted(set(written) - set(map(str, dataset.variables)))
    if missing:
        problem = "was written and is not there"
        raise DataFileError(path, problem, cure, column=f"variable {missing[0]}")


def _encode(attrs: dict[Any, Any]) -> dict[Any, Any]:
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


def _decode(attrs: dict[Any, Any]) -> dict[Any, Any]:
    """Return attributes as they were before `_encode`; arrays and tuples become lists."""
    decoded = {}
    for name, value in attrs.items():
        if isinstance(value, str) and value.startswith(_JSON):
            decoded[name] = json.loads(value.removeprefix(_JSON))
        elif isinstance(value, np.generic):
            decoded[name] = value.item()
        else:
            decoded[name] = value
    return decoded

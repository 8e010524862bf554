"""Result datasets in netCDF files, complete with their attributes."""

import json
from collections.abc import Hashable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from data_io.text.files import read_bytes
from data_io.text.write import complete_file
from pbrdf.errors import DataFileError

# Marks an attribute that netCDF cannot hold as it is: truth values, None, lists, mappings
_JSON = "json:"
_HDF5_MAGIC = b"\x89HDF\r\n\x1a\n"
_INT64 = 2**63


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
    with complete_file(path) as temporary:
        encoded.to_netcdf(temporary, engine="h5netcdf", encoding=encoding)


def read_result(path: str | Path) -> xr.Dataset:
    """Read a dataset that `write_result` wrote; all of it is in memory, the file is closed.

    Raises
    ------
    DataFileError
        If the file is missing, empty, truncated or no netCDF 4 file.
    """
    if not read_bytes(path).startswith(_HDF5_MAGIC):
        problem = "expected a netCDF 4 file, the content is something else"
        raise DataFileError(path, problem, "Give a result file (.nc) of this program.")
    try:
        # Names of variables decide nothing: wavelength units are no times
        with xr.open_dataset(path, engine="h5netcdf", decode_times=False) as stored:
            dataset = stored.load()
    except (OSError, ValueError, KeyError, RuntimeError) as error:
        problem = f"expected a complete netCDF 4 file, got: {str(error).splitlines()[0]}"
        raise DataFileError(path, problem, "The file is truncated or damaged.") from error
    dataset = dataset.assign_coords(
        {
            name: (coord.dims, coord.to_numpy().astype(str), coord.attrs)
            for name, coord in dataset.coords.items()
            if coord.dtype.kind in "OT"
        }
    )
    dataset.attrs = _decode(dataset.attrs)
    for name in dataset.variables:
        dataset[name].attrs = _decode(dataset[name].attrs)
        dataset[name].encoding = {}
    dataset.encoding = {}
    return dataset


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

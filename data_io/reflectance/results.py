"""Result datasets in netCDF files, complete with their attributes."""

import json
import math
import warnings
from collections.abc import Hashable
from pathlib import Path
from typing import Any

import h5netcdf
import numpy as np
import xarray as xr
from xarray.backends import H5NetCDFStore

import pbrdf.accessor  # noqa: F401  (registers ds.pbrdf)
from data_io.reflectance.attributes import (
    CHECKSUMS,
    OF_ATTRS,
    decode,
    digest,
    digest_of_attrs,
    encode,
)
from data_io.reflectance.result_store import read_store, write_store
from data_io.text.files import read_bytes
from pbrdf.errors import DataFileError
from pbrdf.files import complete_file
from pbrdf.files.hdf5 import FAULTS, first_line, opened

# Pieces of a variable; smaller ones take longer to read [bytes]
_CHUNK = 2**19
_HDF5_MAGIC = b"\x89HDF\r\n\x1a\n"


def write_result(dataset: xr.Dataset, path: str | Path) -> None:
    """Write a dataset to a netCDF 4 file, compressed; it appears complete or not at all.

    A path that ends in .zarr becomes a Zarr store, a folder for results too large for one
    file; only a store of a result is replaced by it.

    Attributes of every kind survive: text and numbers as they are, everything else as JSON
    behind the mark ``json:``.

    Parameters
    ----------
    dataset : xarray.Dataset
        As from `simulate`, or any other.
    path : str or Path
        The file, or the store.

    Raises
    ------
    TypeError
        If `dataset` is no Dataset, or an attribute cannot be written.
    ValueError
        If a store would take the place of anything else, or zarr is not installed.

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
    if Path(path).suffix == ".zarr":
        write_store([dataset], path, replace=True)
        return
    encoded = dataset.copy()
    encoded.attrs = encode(dataset.attrs)
    for name, variable in dataset.variables.items():
        encoded[name].attrs = encode(variable.attrs)
    packed = {"zlib": True, "complevel": 4, "shuffle": True}
    encoding: dict[Hashable, dict[str, Any]] = {
        name: packed | {"chunksizes": _chunks(variable)}
        for name, variable in dataset.data_vars.items()
        if variable.ndim and variable.size and variable.dtype.kind in "fiu"
    }
    checksums = {str(name): digest(one) for name, one in encoded.variables.items()}
    checksums[OF_ATTRS] = digest_of_attrs(encoded.attrs)
    encoded.attrs[CHECKSUMS] = json.dumps(checksums)
    # In memory first: HDF5 takes the interpreter with it when the disk is full
    content = encoded.to_netcdf(engine="h5netcdf", encoding=encoding)
    with complete_file(path) as temporary:
        temporary.write_bytes(content)


def _chunks(variable: xr.DataArray) -> tuple[int, ...]:
    """Cut a variable, the first dimensions first, into pieces that follow its order."""
    sides = list(variable.shape)
    for k, side in enumerate(sides):
        size = variable.dtype.itemsize * math.prod(sides)
        sides[k] = max(min(side, side * _CHUNK // size), 1)
    return tuple(sides)


def read_result(path: str | Path) -> xr.Dataset:
    """Read a dataset that `write_result` wrote; all of it is in memory, the file is closed.

    The checksum of each variable is compared.

    Raises
    ------
    DataFileError
        If the file is missing, empty, truncated, damaged or no netCDF 4 file; likewise of a
        store, .zarr.
    """
    if Path(path).suffix == ".zarr":
        return _plain_again(path, read_store(path))
    if read_bytes(path, len(_HDF5_MAGIC)) != _HDF5_MAGIC:
        problem = "expected a netCDF 4 file, the content is something else"
        raise DataFileError(path, problem, "Give a result file (.nc) of this program.")
    try:
        # Names of variables decide nothing: wavelength units are no times
        with (
            warnings.catch_warnings(action="ignore"),
            opened(path) as file,
            h5netcdf.File(file, "r") as inside,
            xr.open_dataset(H5NetCDFStore(inside), decode_times=False) as stored,
        ):
            dataset = stored.load()
        _check_digests(path, dataset)
    except DataFileError:
        raise
    except FAULTS as error:
        problem = f"expected a complete netCDF 4 file, got: {first_line(error)}"
        raise DataFileError(path, problem, "The file is truncated or damaged.") from error
    return _plain_again(path, dataset)


def _plain_again(path: str | Path, dataset: xr.Dataset) -> xr.Dataset:
    """Return what was read with text and attributes as they were before writing."""
    dataset = dataset.assign_coords(
        {
            name: (coord.dims, coord.to_numpy().astype(str), coord.attrs)
            for name, coord in dataset.coords.items()
            if coord.dtype.kind in "OT"
        }
    )
    try:
        dataset.attrs = decode(dataset.attrs)
        for variable in dataset.variables.values():
            variable.attrs = decode(variable.attrs)
            variable.encoding = {}
    except FAULTS as error:
        problem = f"an attribute is no JSON: {first_line(error)}"
        raise DataFileError(path, problem, "The file is damaged.") from error
    dataset.encoding = {}
    for name in ("brdf_total", "brdf"):
        if name not in dataset:
            continue
        place = f"variable {name}"
        if dataset[name].dtype.kind not in "fiu":
            problem = f"expected numbers, got {dataset[name].dtype}"[:150]
            raise DataFileError(path, problem, "Repeat the run.", column=place)
        if _is_infinite(dataset[name].to_numpy()):
            problem = "it holds inf, which no run gives"
            raise DataFileError(path, problem, "Repeat the run.", column=place)
    return dataset


def _is_infinite(values: np.ndarray) -> bool:
    """Tell whether any value is infinite; a sum that is finite proves that none is."""
    with np.errstate(over="ignore", invalid="ignore"):
        total = values.sum()
    return not np.isfinite(total) and bool(np.isinf(values).any())


def _check_digests(path: str | Path, dataset: xr.Dataset) -> None:
    """Compare what was read with the checksums that were written beside it.

    Files of earlier versions have none.
    """
    written = json.loads(dataset.attrs.pop(CHECKSUMS, "{}"))
    cure = "The file is damaged; copy it again or repeat the run."
    of_attrs = written.pop(OF_ATTRS, None)
    if of_attrs is not None and of_attrs != digest_of_attrs(dataset.attrs):
        problem = "they are not those that were written: their checksum differs"
        raise DataFileError(path, problem, cure, column="attributes")
    for name, variable in dataset.variables.items():
        expected = written.get(str(name), "")
        if written and expected != digest(variable, expected):
            problem = "the values are not those that were written: its checksum differs"
            raise DataFileError(path, problem, cure, column=f"variable {name}")
    missing = sorted(set(written) - set(map(str, dataset.variables)))
    if missing:
        problem = "was written and is not there"
        raise DataFileError(path, problem, cure, column=f"variable {missing[0]}")

"""Polarised measured BSDF files (.pbsdf) in: of this package, of Mitsuba and of KAIST.

The layout is that of `data_io.reflectance.mitsuba`, which writes them, the frames are those
of `data_io.reflectance.half_vector`.
"""

import struct
import warnings
from hashlib import sha256
from pathlib import Path

import numpy as np
import xarray as xr

from data_io.goniometer.scan import CONVENTIONS, ELEMENTS, ConventionWarning
from data_io.reflectance.half_vector import (
    HalfVectorGrid,
    file_frames,
    half_vector_geometry,
    zeniths,
)
from data_io.text.files import read_bytes
from pbrdf.errors import DataFileError

__all__ = ["MAGIC", "read_pbsdf", "tensor_fields"]

MAGIC = b"tensor_file\0"
# Types of fields by their code in the file
_TYPES = {1: "<u1", 2: "<i1", 3: "<u2", 4: "<i2", 5: "<u4", 6: "<i4", 7: "<u8", 8: "<i8",
          9: "<f2", 10: "<f4", 11: "<f8"}  # fmt: skip
_NEEDED = ("phi_d", "theta_d", "theta_h", "wvls", "M")
# Beyond so many rows a table is thinned
_ROWS = 400_000
_HORIZON = np.radians(89.0)
_DAMAGED = "The file is damaged; download or export it again."


def read_pbsdf(path: str | Path) -> xr.Dataset:
    """Read a polarised measured BSDF as a goniometer scan, one row a node and wavelength.

    Nodes below 89 degrees of both zeniths are kept, each direction once. Of a table of more
    than 400 000 such rows every second, third, ... node of each angle is taken.

    Returns
    -------
    Dataset
        As `data_io.read_goniometer` returns it, with all sixteen elements. [1/sr]

    Raises
    ------
    DataFileError
        If the file is truncated, lacks a field, its fields do not fit together, or M holds
        no number.

    Warns
    -----
    ConventionWarning
        If the table is thinned, or rows are left out because an element is nan or inf.
    """
    path = Path(path)
    content = read_bytes(path)
    fields = tensor_fields(path, content)
    missing = [name for name in _NEEDED if name not in fields]
    if missing:
        problem = f"expected the fields {', '.join(_NEEDED)}, lacks {', '.join(missing)}"
        raise DataFileError(
            path, problem, "It is no polarised BSDF of an isotropic surface."
        )
    with np.errstate(invalid="ignore"):
        axes = [np.asarray(fields[name], float).ravel() for name in _NEEDED[:4]]
    table = fields["M"]
    shape = (axes[0].size, axes[1].size, axes[2].size, axes[3].size, 4, 4)
    if table.shape != shape or not all(np.isfinite(axis).all() for axis in axes):
        problem = f"expected M of the shape {shape} of its axes, got {table.shape}"
        raise DataFileError(path, problem, _DAMAGED)
    phi_d, theta_d, theta_h, waves = axes
    if min(axis.size for axis in axes) == 0 or not ((waves > 10) & (waves < 65536)).all():
        problem = f"expected wavelengths in nanometres, got {waves.tolist()[:5]}"
        raise DataFileError(path, problem, _DAMAGED, column="wvls")
    for name, axis, limit in (
        ("phi_d", phi_d, 2 * np.pi), ("theta_d", theta_d, np.pi / 2),
        ("theta_h", theta_h, np.pi / 2),
    ):  # fmt: skip
        low = -limit if name == "phi_d" else 0.0
        if not ((axis >= low - 1e-3) & (axis <= limit + 1e-3)).all():
            problem = f"expected radians in [{low:.4g}, {limit:.4g}], got {axis.max():.4g}"
            raise DataFileError(path, problem, _DAMAGED, column=name)
    step = 1
    while table[::step, ::step, ::step].size / 16 > _ROWS:
        step += 1
    if step > 1:
        msg = (
            f"{path.name}: every {step}. node of each angle is read, of "
            f"{table.size // 16} nodes and wavelengths."
        )
        warnings.warn(msg, ConventionWarning, stacklevel=3)
    grid = HalfVectorGrid(phi_d[::step], theta_d[::step], theta_h[::step])
    with np.errstate(invalid="ignore", over="ignore"):
        mueller = np.asarray(table[::step, ::step, ::step], float)
        dataset = _scan(grid, waves, mueller)
    return _numbers_alone(path, dataset).assign_attrs(
        source=path.name,
        sha256=sha256(content).hexdigest(),
        conventions=CONVENTIONS,
        quantity="brdf",
        format="pbsdf",
        title=path.stem,
    )


def _scan(grid: HalfVectorGrid, waves: np.ndarray, table: np.ndarray) -> xr.Dataset:
    """Return the nodes of a table (phi_d, theta_d, theta_h, ...) in the conventions."""
    geometry = half_vector_geometry(*np.meshgrid(*grid, indexing="ij"))
    theta_i, theta_s, dphi = zeniths(geometry)
    into, out_of = file_frames(geometry)
    # The frames are rotations: turning back is the transposed matrix
    own = np.swapaxes(into, -1, -2)[..., None, :, :] @ table @ out_of[..., None, :, :]
    keep = _distinct(grid) & (theta_i < _HORIZON) & (theta_s < _HORIZON)
    rows = own[keep].reshape(-1, 4, 4)
    repeat = {"repeats": waves.size}
    angle = {"units": "rad"}
    coords = {
        name: ("geometry", np.repeat(values[keep], **repeat), angle)
        for name, values in (("theta_i", theta_i), ("theta_s", theta_s), ("dphi", dphi))
    }
    coords["wavelength"] = (
        "geometry", np.tile(waves / 1e3, int(keep.sum())), {"units": "um"},
    )  # fmt: skip
    data = {
        name: ("geometry", rows[:, int(name[1]), int(name[2])], {"units": "sr-1"})
        for name in ELEMENTS
    }
    return xr.Dataset(data, coords)


def _numbers_alone(path: Path, dataset: xr.Dataset) -> xr.Dataset:
    """Return the rows whose elements are all numbers, and say how many are not."""
    size = dataset.sizes["geometry"]
    if not size:
        problem = "expected nodes above the horizon, found none"
        raise DataFileError(path, problem, _DAMAGED)
    known = np.isfinite(dataset.to_dataarray().values).all(axis=0)
    if not known.any():
        problem = f"expected numbers in M, got none at any of {size} nodes and wavelengths"
        raise DataFileError(path, problem, _DAMAGED, column="M")
    if known.all():
        return dataset
    largest = np.degrees(np.maximum(dataset.theta_i.values, dataset.theta_s.values))
    first, last = (f(largest[~known]) for f in (np.min, np.max))
    msg = (
        f"{path.name}: {size - known.sum()} of {size} rows are left out, where M holds nan "
        f"or inf; the larger zenith there is {first:.3g} to {last:.3g} degrees."
    )
    warnings.warn(msg, ConventionWarning, stacklevel=4)
    return dataset.isel(geometry=np.flatnonzero(known))


def _distinct(grid: HalfVectorGrid) -> np.ndarray:
    """Tell which nodes are directions of their own: phi_d turns nothing at either pole."""
    phi_d, theta_d, theta_h = np.meshgrid(*grid, indexing="ij")
    first = np.arange(grid.phi_d.size)[:, None, None] == 0
    again = np.cos(phi_d - grid.phi_d[0]) > 1 - 1e-9
    return first | ((theta_d > 1e-6) & (theta_h > 1e-6) & ~again)


def tensor_fields(path: Path, content: bytes) -> dict[str, np.ndarray]:
    """Return the arrays of a tensor file, each within the file."""
    if content[: len(MAGIC)] != MAGIC:
        problem = f"expected a tensor file, got {content[:12]!r}"
        raise DataFileError(path, problem, "Pass a .pbsdf file.")
    fields: dict[str, np.ndarray] = {}
    try:
        major, minor, count = struct.unpack_from("<BBI", content, len(MAGIC))
        if (major, minor) != (1, 0) or count > 1000:
            problem = f"expected version 1.0, got {major}.{minor} with {count} fields"
            raise DataFileError(path, problem, _DAMAGED)
        position = len(MAGIC) + 6
        for _ in range(count):
            (length,) = struct.unpack_from("<H", content, position)
            name = content[position + 2 : position + 2 + length].decode()
            position += 2 + length
            ndim, code, offset = struct.unpack_from("<HBQ", content, position)
            shape = struct.unpack_from(f"<{ndim}Q", content, position + 11)
            position += 11 + 8 * ndim
            fields[name] = _array(path, content, name, code, shape, offset)
    except (struct.error, UnicodeDecodeError, KeyError) as error:
        problem = "expected a table of fields, found it damaged"
        raise DataFileError(path, problem, _DAMAGED) from error
    return fields


def _array(
    path: Path,
    content: bytes,
    name: str,
    code: int,
    shape: tuple[int, ...],
    offset: int,
) -> np.ndarray:
    kind = np.dtype(_TYPES[code])
    size = 1
    for length in shape:
        size *= length
    if not 0 < len(shape) < 10 or size == 0:
        problem = f"expected the field {name} to hold numbers, got the shape {shape[:10]}"
        raise DataFileError(path, problem, _DAMAGED)
    if size * kind.itemsize + offset > len(content):
        problem = f"expected the field {name} of shape {shape} in the file, it ends before"
        raise DataFileError(path, problem, "The file is truncated.")
    return np.frombuffer(content, kind, size, offset).reshape(shape)

"""Polarised measured BSDF files (.pbsdf) for the renderer Mitsuba 3.

The file tabulates the Mueller BRDF of an isotropic surface in half-vector angles, see
`data_io.reflectance.half_vector`; V and Q have the senses of this package.
"""

import json
import struct
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from data_io.reflectance.brdf_source import from_dataset, from_model
from data_io.reflectance.half_vector import HalfVectorGrid, adapted_grid, tabulate
from data_io.reflectance.pbsdf import tensor_fields
from data_io.reflectance.table_accuracy import GRAZING, accuracy
from pbrdf.analytic import MicrofacetModel
from pbrdf.errors import AccuracyWarning, real_array, require
from pbrdf.files import complete_file

# Mitsuba interpolates wrongly between other numbers of wavelengths
_WAVELENGTH_COUNTS = (1, 3, 4, 5)
# A surface of unknown wavelength is grey; the file needs one all the same [um]
_GREY_WAVELENGTH = 0.55
# Part of M00 by which most of the bright directions may differ from the source
_WANTED = 0.01
_DTYPE_CODES = {np.dtype(np.uint16): 3, np.dtype(np.float32): 10}


def export_mitsuba(
    source: xr.Dataset | MicrofacetModel,
    path: str | Path,
    *,
    wavelength: npt.ArrayLike | None = None,
    shape: tuple[int, int, int] | None = None,
) -> xr.Dataset:
    """Write a Mueller BRDF as a polarised measured BSDF of Mitsuba 3.

    A model is evaluated at the nodes. A dataset is interpolated linearly in theta_i,
    theta_s and dphi, in a frame that is smooth across the normal; beyond its outermost
    angles the last value stands. Mitsuba interpolates linearly between the nodes: they lie
    the closer the more M00 bends. The file is read back at random directions, and how far
    it is from the source there is returned, and written beside it as JSON, by element and
    brightness.

    Parameters
    ----------
    source : xarray.Dataset or MicrofacetModel
        A result of `simulate` with all four Stokes elements and several incident zeniths,
        summed over bounces here; or an analytical model of an isotropic surface.
    path : str or Path
        The file, usually ``.pbsdf``.
    wavelength : array_like, optional
        One, three, four or five rising wavelengths at which to evaluate a model, stored in
        whole nanometres; for a dataset they come from its coordinate. Without any the file
        holds one, 0.55 um, which Mitsuba uses for all. [um]
    shape : (int, int, int), optional
        Number of nodes in phi_d, theta_d and theta_h, spaced evenly but for theta_h, in
        place of nodes that suit the lobe. A file has 64 bytes a node and wavelength.

    Returns
    -------
    xarray.Dataset
        `error` (brightness, quantile, stokes_out, stokes_in): median, 95 % and worst of
        the difference from the source, in parts of its M00; also in ``<path>.json``.

    Raises
    ------
    TypeError
        If the source is neither.
    ValueError
        If the dataset lacks Stokes elements or incident angles, depends on phi_i, or the
        wavelengths cannot be stored.

    Warns
    -----
    AccuracyWarning
        If the incident zeniths of a dataset leave wide gaps, or the nodes that were chosen
        leave more than 1 % of M00 in 5 % of the bright directions.
    """
    if isinstance(source, MicrofacetModel):
        waves = _model_wavelengths(wavelength)
        brdf, bins = from_model(source, None if wavelength is None else waves), None
    elif isinstance(source, xr.Dataset):
        waves = _dataset_wavelengths(source, wavelength)
        brdf = from_dataset(source)
        bins = source.sizes["theta_s"], source.sizes["dphi"]
    else:
        msg = f"source must be a Dataset or a MicrofacetModel, got {type(source).__name__}."
        raise TypeError(msg)
    _check_wavelengths(waves)
    path = Path(path)
    grid = adapted_grid(brdf, bins) if shape is None else _grid(shape)
    table = tabulate(brdf, grid)
    _write_tensor_file(
        path,
        {
            "phi_d": grid.phi_d.astype(np.float32)[None],
            "theta_d": grid.theta_d.astype(np.float32)[None],
            "theta_h": grid.theta_h.astype(np.float32)[None],
            "wvls": np.rint(waves * 1e3).astype(np.uint16),
            "M": np.ascontiguousarray(np.moveaxis(table, 0, 3), dtype=np.float32),
        },
    )
    found = accuracy(brdf, grid, _read_back(path))
    with complete_file(path.with_name(f"{path.name}.json")) as temporary:
        temporary.write_text(json.dumps(_summary(found), indent=1), encoding="utf-8")
    if shape is None:
        _check_accuracy(found)
    return found


def _summary(found: xr.Dataset) -> dict[str, Any]:
    """Return the accuracy of a file as plain numbers by brightness, element and quantile.

    NaN, which JSON does not know, stands for a class of no directions as null.
    """
    classes: dict[str, Any] = {}
    for name in found.brightness.values:
        here = found.sel(brightness=name)
        elements: dict[str, Any] = {}
        for row, column in np.ndindex(4, 4):
            one = here.error.isel(stokes_out=row, stokes_in=column)
            elements[f"M{row}{column}"] = {
                str(label): None if np.isnan(value) else round(float(value), 6)
                for label, value in zip(one["quantile"].values, one.values, strict=True)
            }
        what = f"M00 {name} of its peak" if name != GRAZING else f"zeniths {name}"
        classes[what] = {"directions": int(here["count"])} | elements
    return {
        "what": "difference of the file, read back between its nodes, from its source, in "
        "parts of M00 there; zeniths beyond 85 degrees are a class of their own",
        "peak_M00_per_sr": found.attrs["peak_M00"],
        "nodes_phi_d_theta_d_theta_h": found.attrs["nodes"],
        "error": classes,
    }


def _check_accuracy(found: xr.Dataset) -> None:
    """Warn where the nodes that were chosen do not reach what is wanted."""
    bright = found.error.isel(brightness=slice(2)).sel(quantile="p95")
    worst = float(bright.isel(stokes_out=0, stokes_in=0).max())
    if worst > _WANTED:
        msg = (
            f"Between its nodes the file differs from its source by {100 * worst:.2g} % of "
            "M00 or more in 5 % of the directions above 1 % of the peak. Give a larger "
            f"shape than {tuple(found.attrs['nodes'])}, or a source with less noise."
        )
        warnings.warn(msg, AccuracyWarning, stacklevel=3)


def _read_back(path: Path) -> Callable[[np.ndarray], np.ndarray]:
    """Return the table of a written file as Mitsuba interpolates it, from its bytes."""
    from scipy.interpolate import RegularGridInterpolator

    fields = tensor_fields(path, path.read_bytes())
    nodes = tuple(
        fields[name][0].astype(np.float64) for name in ("phi_d", "theta_d", "theta_h")
    )
    # Nodes in single precision may end a hair before the angles do
    return RegularGridInterpolator(
        nodes, fields["M"].astype(np.float64), bounds_error=False, fill_value=None
    )


def _grid(shape: tuple[int, int, int]) -> HalfVectorGrid:
    """Return the nodes; both ends of every range are among them."""
    counts = [int(count) for count in shape]
    if len(counts) != 3 or min(counts) < 2:
        msg = f"shape must be three numbers of nodes, at least 2, got {shape}."
        raise ValueError(msg)
    n_phi_d, n_theta_d, n_theta_h = counts
    return HalfVectorGrid(
        phi_d=np.linspace(-np.pi, np.pi, n_phi_d),
        theta_d=np.linspace(0.0, np.pi / 2, n_theta_d),
        theta_h=np.pi / 2 * np.linspace(0.0, 1.0, n_theta_h) ** 2,
    )


def _model_wavelengths(wavelength: npt.ArrayLike | None) -> np.ndarray:
    if wavelength is None:
        return np.array([_GREY_WAVELENGTH])
    return np.atleast_1d(real_array("wavelength", wavelength, "Give micrometres."))


def _dataset_wavelengths(
    dataset: xr.Dataset, wavelength: npt.ArrayLike | None
) -> np.ndarray:
    if wavelength is not None and "wavelength" in dataset.coords:
        msg = "wavelength must be left out, the dataset names its own. Select there."
        raise ValueError(msg)
    if "wavelength" in dataset.coords:
        return np.atleast_1d(dataset["wavelength"].to_numpy())
    return _model_wavelengths(wavelength)


def _check_wavelengths(waves: np.ndarray) -> None:
    """Refuse what the file cannot hold: 16-bit nanometres, few, rising."""
    require(
        "wavelength",
        waves,
        lambda v: (v >= 0.01) & (v <= 65.5),
        "lie in [0.01, 65.5] um",
        "Give micrometres.",
    )
    if waves.size not in _WAVELENGTH_COUNTS:
        msg = (
            f"wavelength must hold 1, 3, 4 or 5 values, got {waves.size}. Mitsuba "
            "interpolates wrongly between other numbers; select some."
        )
        raise ValueError(msg)
    if (np.diff(np.rint(waves * 1e3)) < 1).any():
        msg = f"wavelength must rise by at least 1 nm, got {waves.tolist()} um."
        raise ValueError(msg)


def _write_tensor_file(path: Path, fields: Mapping[str, np.ndarray]) -> None:
    """Write Mitsuba's tensor file: a table of fields, then their data, little-endian."""
    header = b"tensor_file\0" + struct.pack("<BBI", 1, 0, len(fields))
    size = len(header) + sum(
        2 + len(name) + 2 + 1 + 8 + 8 * array.ndim for name, array in fields.items()
    )
    offset = size + -size % 8
    with complete_file(path) as temporary, temporary.open("wb") as stream:
        stream.write(header)
        for name, array in fields.items():
            text = name.encode()
            stream.write(struct.pack("<H", len(text)) + text)
            stream.write(struct.pack("<HBQ", array.ndim, _DTYPE_CODES[array.dtype], offset))
            stream.write(struct.pack(f"<{array.ndim}Q", *array.shape))
            offset += array.nbytes + -array.nbytes % 8
        stream.write(bytes(-size % 8))
        for array in fields.values():
            stream.write(array.astype(array.dtype.newbyteorder("<")).tobytes())
            stream.write(bytes(-array.nbytes % 8))

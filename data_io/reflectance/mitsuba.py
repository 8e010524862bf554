"""Polarised measured BSDF files (.pbsdf) for the renderer Mitsuba 3.

The file tabulates the Mueller BRDF of an isotropic surface in half-vector angles. With L to
the light, E to the viewer, n the normal and h the half vector: theta_h is the angle from n
to h, theta_d the angle from h to L, and phi_d the azimuth of L about h, counted from
t = b x h towards b = n x h. Both beams have their s axis along L x E; V and Q have the
senses of this package.
"""

import struct
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from data_io.goniometer.frames import rotation
from data_io.reflectance.brdf_source import Brdf, from_dataset, from_model
from pbrdf.analytic import MicrofacetModel
from pbrdf.errors import real_array, require
from pbrdf.files import complete_file

# Mitsuba interpolates wrongly between other numbers of wavelengths
_WAVELENGTH_COUNTS = (1, 3, 4, 5)
# A surface of unknown wavelength is grey; the file needs one all the same [um]
_GREY_WAVELENGTH = 0.55
# Cells below the horizon take the value at this zenith, since NaN would spread
_LAST_ZENITH = np.radians(89.5)
_DTYPE_CODES = {np.dtype(np.uint16): 3, np.dtype(np.float32): 10}


class HalfVectorGrid(NamedTuple):
    """Nodes of the table. [rad]"""

    phi_d: np.ndarray
    theta_d: np.ndarray
    theta_h: np.ndarray


class Geometry(NamedTuple):
    """Directions of all nodes and their s axis, (n_phi_d, n_theta_d, n_theta_h, 3)."""

    to_light: np.ndarray
    to_viewer: np.ndarray
    s_axis: np.ndarray


def export_mitsuba(
    source: xr.Dataset | MicrofacetModel,
    path: str | Path,
    *,
    wavelength: npt.ArrayLike | None = None,
    shape: tuple[int, int, int] = (73, 46, 46),
) -> None:
    """Write a Mueller BRDF as a polarised measured BSDF of Mitsuba 3.

    A model is evaluated at the nodes. A dataset is interpolated linearly in theta_i,
    theta_s and dphi, in a frame that is smooth across the normal; beyond its outermost
    angles the last value stands. Mitsuba interpolates linearly between the nodes, which
    limits what it shows of narrow lobes: nodes of theta_h lie the closer the nearer to 0.

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
    shape : (int, int, int)
        Number of nodes in phi_d, theta_d and theta_h. A file has 64 bytes a node and
        wavelength.

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
        If the incident zeniths of a dataset leave wide gaps.
    """
    if isinstance(source, MicrofacetModel):
        waves = _model_wavelengths(wavelength)
        brdf = from_model(source, None if wavelength is None else waves)
    elif isinstance(source, xr.Dataset):
        waves = _dataset_wavelengths(source, wavelength)
        brdf = from_dataset(source)
    else:
        msg = f"source must be a Dataset or a MicrofacetModel, got {type(source).__name__}."
        raise TypeError(msg)
    _check_wavelengths(waves)
    grid = _grid(shape)
    table = _tabulate(brdf, grid)
    _write_tensor_file(
        Path(path),
        {
            "phi_d": grid.phi_d.astype(np.float32)[None],
            "theta_d": grid.theta_d.astype(np.float32)[None],
            "theta_h": grid.theta_h.astype(np.float32)[None],
            "wvls": np.rint(waves * 1e3).astype(np.uint16),
            "M": np.ascontiguousarray(np.moveaxis(table, 0, 3), dtype=np.float32),
        },
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


def half_vector_geometry(grid: HalfVectorGrid) -> Geometry:
    """Return the directions of all nodes, with h in the x, z plane.

    With u the part of L across h, L = cos(theta_d) h + sin(theta_d) u and
    E = cos(theta_d) h - sin(theta_d) u, so that L x E points along u x h, which is defined
    even where L and E coincide.
    """
    phi_d, theta_d, theta_h = np.meshgrid(*grid, indexing="ij")
    zero = np.zeros_like(theta_h)
    h = np.stack([np.sin(theta_h), zero, np.cos(theta_h)], axis=-1)
    t = np.stack([np.cos(theta_h), zero, -np.sin(theta_h)], axis=-1)
    b = np.array([0.0, 1.0, 0.0])
    u = np.cos(phi_d)[..., None] * t + np.sin(phi_d)[..., None] * b
    along, across = np.cos(theta_d)[..., None] * h, np.sin(theta_d)[..., None] * u
    return Geometry(along + across, along - across, np.cross(u, h))


def _tabulate(brdf: Brdf, grid: HalfVectorGrid) -> np.ndarray:
    """Return the Mueller BRDF at all nodes in the frames of the file. [1/sr]

    Shape (wavelength, n_phi_d, n_theta_d, n_theta_h, 4, 4).
    """
    geometry = half_vector_geometry(grid)
    theta_i, theta_s, dphi = zeniths(geometry)
    mueller = brdf(
        np.minimum(theta_i, _LAST_ZENITH), np.minimum(theta_s, _LAST_ZENITH), dphi
    )
    into, out_of = file_frames(geometry)
    return into @ mueller @ np.swapaxes(out_of, -1, -2)


def zeniths(geometry: Geometry) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return theta_i, theta_s (beyond pi/2 below the horizon) and dphi. [rad]"""
    ends = geometry.to_light, geometry.to_viewer
    phi_i, phi_s = (np.arctan2(d[..., 1], d[..., 0]) for d in ends)
    theta_i, theta_s = (np.arctan2(np.hypot(d[..., 0], d[..., 1]), d[..., 2]) for d in ends)
    return theta_i, theta_s, np.mod(phi_s - phi_i, 2 * np.pi)


def file_frames(geometry: Geometry) -> tuple[np.ndarray, np.ndarray]:
    """Return rotations from the meridian frames of both beams into those of the file.

    A file has ``into @ M @ out_of.T`` of the M of the conventions; (..., 4, 4) each, that
    of the scattered beam first.
    """
    to_light, to_viewer, s_axis = geometry
    phi_i, phi_s = (np.arctan2(d[..., 1], d[..., 0]) for d in (to_light, to_viewer))
    # Light arrives along -L: its azimuth of travel is opposite to that of the source
    into = _into_file_frame(to_viewer, phi_s, s_axis)
    return into, _into_file_frame(-to_light, phi_i + np.pi, s_axis)


def _into_file_frame(
    prop: np.ndarray, azimuth: np.ndarray, s_axis: np.ndarray
) -> np.ndarray:
    """Return rotations from the meridian frame of a beam to the frame with this s axis."""
    e_s = np.stack([-np.sin(azimuth), np.cos(azimuth), np.zeros_like(azimuth)], axis=-1)
    e_p = np.cross(prop, e_s)
    return rotation((s_axis * e_s).sum(axis=-1), (s_axis * e_p).sum(axis=-1))


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

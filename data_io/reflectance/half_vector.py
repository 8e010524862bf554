"""Half-vector angles of a BRDF table: directions, frames and nodes.

With L to the light, E to the viewer, n the normal and h the half vector: theta_h is the
angle from n to h, theta_d the angle from h to L, and phi_d the azimuth of L about h,
counted from t = b x h towards b = n x h. Both beams have their s axis along L x E.
"""

from typing import NamedTuple

import numpy as np

from data_io.goniometer.frames import rotation
from data_io.reflectance.brdf_source import Brdf

# Cells below the horizon take the value at this zenith, since NaN would spread
LAST_ZENITH = np.radians(89.5)
# Nodes do not follow what M00 does further down, and accuracy there is a class of its own
_JUDGED = np.radians(85.0)
# Part of M00 that linear interpolation along one axis may miss between two nodes, and the
# part of the peak below which M00 counts as the floor for it
_MISSED, _FLOOR = 0.003, 0.01
# Places along an axis at which the curvature is asked for
_FINE = 1501
# Least and most nodes of phi_d, theta_d, theta_h, and most in all
_LEAST, _MOST, _MOST_NODES = (25, 24, 24), (181, 121, 161), 500_000


class HalfVectorGrid(NamedTuple):
    """Nodes of the table. [rad]"""

    phi_d: np.ndarray
    theta_d: np.ndarray
    theta_h: np.ndarray


class Geometry(NamedTuple):
    """Directions at half-vector angles and their s axis, (..., 3)."""

    to_light: np.ndarray
    to_viewer: np.ndarray
    s_axis: np.ndarray


def half_vector_geometry(
    phi_d: np.ndarray, theta_d: np.ndarray, theta_h: np.ndarray
) -> Geometry:
    """Return the directions at angles that broadcast, with h in the x, z plane.

    With u the part of L across h, L = cos(theta_d) h + sin(theta_d) u and
    E = cos(theta_d) h - sin(theta_d) u, so that L x E points along u x h, which is defined
    even where L and E coincide.
    """
    phi_d, theta_d, theta_h = np.broadcast_arrays(phi_d, theta_d, theta_h)
    zero = np.zeros_like(theta_h)
    h = np.stack([np.sin(theta_h), zero, np.cos(theta_h)], axis=-1)
    t = np.stack([np.cos(theta_h), zero, -np.sin(theta_h)], axis=-1)
    b = np.array([0.0, 1.0, 0.0])
    u = np.cos(phi_d)[..., None] * t + np.sin(phi_d)[..., None] * b
    along, across = np.cos(theta_d)[..., None] * h, np.sin(theta_d)[..., None] * u
    return Geometry(along + across, along - across, np.cross(u, h))


def zeniths(geometry: Geometry) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return theta_i, theta_s (beyond pi/2 below the horizon) and dphi. [rad]"""
    ends = geometry.to_light, geometry.to_viewer
    phi_i, phi_s = (np.arctan2(d[..., 1], d[..., 0]) for d in ends)
    theta_i, theta_s = (np.arctan2(np.hypot(d[..., 0], d[..., 1]), d[..., 2]) for d in ends)
    return theta_i, theta_s, np.mod(phi_s - phi_i, 2 * np.pi)


def half_angles(to_light: np.ndarray, to_viewer: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return phi_d, theta_d and theta_h of directions (..., 3) of an isotropic surface."""
    middle = to_light + to_viewer
    h = middle / np.linalg.norm(middle, axis=-1, keepdims=True)
    theta_h = np.arctan2(np.hypot(h[..., 0], h[..., 1]), h[..., 2])
    theta_d = np.arccos(np.clip(np.sum(h * to_light, axis=-1), -1.0, 1.0))
    # b = n x h and t = b x h', in the plane of h and the normal
    b = np.stack([-h[..., 1], h[..., 0], np.zeros_like(theta_h)], axis=-1)
    b /= np.maximum(np.linalg.norm(b, axis=-1, keepdims=True), 1e-300)
    t = np.cross(b, h)
    phi_d = np.arctan2(np.sum(b * to_light, axis=-1), np.sum(t * to_light, axis=-1))
    return phi_d, theta_d, theta_h


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


def mueller_at(brdf: Brdf, geometry: Geometry) -> np.ndarray:
    """Return the Mueller BRDF in the frames of the half vector. [1/sr]

    Shape (wavelength, ..., 4, 4).
    """
    into, out_of = file_frames(geometry)
    return into @ brdf(*_above_horizon(geometry)) @ np.swapaxes(out_of, -1, -2)


def tabulate(brdf: Brdf, grid: HalfVectorGrid) -> np.ndarray:
    """Return the Mueller BRDF at all nodes in the frames of the half vector. [1/sr]

    Shape (wavelength, n_phi_d, n_theta_d, n_theta_h, 4, 4).
    """
    nodes = np.meshgrid(*grid, indexing="ij")
    return mueller_at(brdf, half_vector_geometry(*nodes))


def _above_horizon(geometry: Geometry) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return theta_i, theta_s and dphi, zeniths below the horizon lifted above it. [rad]"""
    theta_i, theta_s, dphi = zeniths(geometry)
    return np.minimum(theta_i, LAST_ZENITH), np.minimum(theta_s, LAST_ZENITH), dphi


def judged(geometry: Geometry) -> np.ndarray:
    """Tell which directions are far enough above the horizon to be judged."""
    theta_i, theta_s, _ = zeniths(geometry)
    return np.maximum(theta_i, theta_s) < _JUDGED


def _into_file_frame(
    prop: np.ndarray, azimuth: np.ndarray, s_axis: np.ndarray
) -> np.ndarray:
    """Return rotations from the meridian frame of a beam to the frame with this s axis."""
    e_s = np.stack([-np.sin(azimuth), np.cos(azimuth), np.zeros_like(azimuth)], axis=-1)
    e_p = np.cross(prop, e_s)
    return rotation((s_axis * e_s).sum(axis=-1), (s_axis * e_p).sum(axis=-1))


def adapted_grid(brdf: Brdf, bins: tuple[int, int] | None) -> HalfVectorGrid:
    """Return nodes that lie the closer the more M00 bends.

    Linear interpolation over a step s misses s²/8 times the second derivative; the steps
    make that the same part of M00 everywhere. `bins` (zenith, azimuth) is the resolution
    of a table, whose kinks are no bends.
    """

    def m00(phi_d: np.ndarray, theta_d: np.ndarray, theta_h: np.ndarray) -> np.ndarray:
        """M00 with the wavelength last, NaN near and below the horizon."""
        geometry = half_vector_geometry(phi_d, theta_d, theta_h)
        values = np.moveaxis(brdf(*_above_horizon(geometry))[..., 0, 0], 0, -1)
        return np.where(judged(geometry)[..., None], values, np.nan)

    n_theta, n_phi = (_FINE, _FINE) if bins is None else (2 * bins[0], bins[1])
    share = np.linspace(0.0, 1.0, n_theta)
    # Narrow lobes lie near 0; a table has no nodes there that are closer than elsewhere
    theta_h = np.pi / 2 * (share**2 if bins is None else share)
    fine = HalfVectorGrid(np.linspace(-np.pi, np.pi, n_phi), np.pi / 2 * share, theta_h)
    lobe = m00(np.array(np.pi / 2), np.radians([1.0]), theta_h).max(axis=-1)
    peak = float(np.nanmax(lobe))
    # Where the lobe has fallen to parts of its peak
    parts = (0.97, 0.7, 0.4, 0.15, 0.04, 0.012)
    heights = [theta_h[np.flatnonzero(lobe >= part * peak)[-1]] for part in parts]
    # The smallest ones let theta_d go as far as zeniths are judged
    across = np.minimum([*np.radians([0.5, 2.0, 5.0, 10.0]), *heights], np.radians(80.0))
    inner = np.radians([1.0, 15.0, 30.0, 45.0, 60.0, 70.0, 78.0])
    around = np.radians([0.0, 30.0, 60.0, 90.0, 135.0, 180.0])
    samples = (
        m00(fine.phi_d[:, None, None], inner[:, None], across),
        m00(around[:, None], fine.theta_d[:, None, None], across),
        m00(around[:, None], inner, fine.theta_h[:, None, None]),
    )
    densities = [
        _density(x, values.reshape(len(x), -1), peak, least)
        for x, values, least in zip(fine, samples, _LEAST, strict=True)
    ]
    # A table and its mirror image have the same nodes
    densities[0] = np.maximum(densities[0], densities[0][::-1])
    counts = np.array([
        np.trapezoid(density, x) for density, x in zip(densities, fine, strict=True)
    ])  # fmt: skip
    counts = np.minimum(counts, _MOST)
    counts = counts * min(1.0, (_MOST_NODES / counts.prod()) ** (1 / 3))
    return HalfVectorGrid(*map(_nodes, fine, densities, np.ceil(counts).astype(int)))


def _density(x: np.ndarray, values: np.ndarray, peak: float, least: int) -> np.ndarray:
    """Return nodes a radian that M00 (x, others) asks for."""
    from scipy.ndimage import maximum_filter1d

    slope = np.diff(values, axis=0) / np.diff(x)[:, None]
    bend = np.zeros_like(values)
    bend[1:-1] = np.diff(slope, axis=0) / (0.5 * (x[2:] - x[:-2]))[:, None]
    bend[[0, -1]] = bend[[1, -2]]
    relative = np.nan_to_num(np.abs(bend) / np.maximum(values, _FLOOR * peak))
    smooth = maximum_filter1d(relative.max(axis=1), max(3, len(x) // 100))
    return np.sqrt(smooth / (8 * _MISSED)) + least / np.ptp(x)


def _nodes(x: np.ndarray, density: np.ndarray, count: int) -> np.ndarray:
    """Return that many nodes of this relative density, with both ends."""
    steps = 0.5 * (density[1:] + density[:-1]) * np.diff(x)
    passed = np.concatenate([[0.0], np.cumsum(steps)])
    return np.interp(np.linspace(0.0, passed[-1], count), passed, x)

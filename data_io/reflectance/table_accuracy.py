"""How far a table in half-vector angles is from its source, between its nodes."""

from collections.abc import Callable

import numpy as np
import xarray as xr

from data_io.reflectance.brdf_source import Brdf
from data_io.reflectance.half_vector import (
    LAST_ZENITH,
    Geometry,
    HalfVectorGrid,
    half_angles,
    half_vector_geometry,
    judged,
    mueller_at,
    zeniths,
)

# Brightness classes, as parts of the peak of M00, and what is as bright near the horizon
CLASSES = {
    "above 10 %": (0.1, np.inf),
    "1 to 10 %": (0.01, 0.1),
    "0.1 to 1 %": (1e-3, 0.01),
}
GRAZING = "beyond 85 degrees"
# Directions of a class from which quantiles are taken
_FEWEST = 40
QUANTILES = {"median": 0.5, "p95": 0.95, "worst": 1.0}


def accuracy(
    brdf: Brdf,
    grid: HalfVectorGrid,
    table: Callable[[np.ndarray], np.ndarray],
    directions: int = 60_000,
) -> xr.Dataset:
    """Compare a table between its nodes with its source, at random directions.

    Parameters
    ----------
    brdf : callable
        The source.
    grid : HalfVectorGrid
        Nodes of the table; directions are as close as they are.
    table : callable
        Points (N, 3) in phi_d, theta_d, theta_h -> matrices (N, wavelength, 4, 4).
    directions : int
        How many to try.

    Returns
    -------
    xarray.Dataset
        `error` (brightness, quantile, stokes_out, stokes_in), parts of M00 by which an
        element differs, and the `count` of directions in each class of brightness. They
        are drawn in three ways, and the worst of the three counts.
        Directions beyond 85 degrees of zenith, to the light or to the viewer, with more
        than 0.1 % of the peak are a class of their own.
    """
    draws = _draws(grid, directions // 3)
    points, way = np.concatenate(draws), np.repeat(np.arange(3), directions // 3)
    geometry = half_vector_geometry(*points.T)
    theta_i, theta_s, _ = zeniths(geometry)
    seen = np.maximum(theta_i, theta_s) < LAST_ZENITH
    geometry = Geometry(*(one[seen] for one in geometry))
    points, way = points[seen], way[seen]
    expected = np.moveaxis(mueller_at(brdf, geometry), 0, 1)
    m00 = expected[..., 0, 0]
    scale = np.maximum(expected[..., :1, :1], 1e-300)
    error = np.abs(table(points) - expected) / scale
    high_up = np.broadcast_to(judged(geometry)[:, None], m00.shape)
    peak = float(m00[high_up].max())
    # Directions and wavelengths count alike
    ways = np.broadcast_to(way[:, None], m00.shape)
    members = [
        high_up & (m00 >= low * peak) & (m00 < high * peak)
        for low, high in CLASSES.values()
    ]
    members.append(~high_up & (m00 >= CLASSES["0.1 to 1 %"][0] * peak))
    errors = [_quantiles(error[which], ways[which]) for which in members]
    counts = [int(which.sum()) for which in members]
    stokes = list("IQUV")
    return xr.Dataset(
        {
            "error": (
                ("brightness", "quantile", "stokes_out", "stokes_in"), np.array(errors),
                {"units": "1", "long_name": "difference from the source, part of its M00"},
            ),
            "count": ("brightness", counts),
        },
        {"brightness": [*CLASSES, GRAZING], "quantile": list(QUANTILES),
         "stokes_out": stokes, "stokes_in": stokes},
        {"peak_M00": peak, "nodes": [axis.size for axis in grid]},
    )  # fmt: skip


def _draws(grid: HalfVectorGrid, count: int) -> list[np.ndarray]:
    """Draw points (count, 3) in the angles of the table in three ways.

    Evenly over the nodes, so that a narrow lobe is met; evenly over the angles; and over
    all pairs of directions above the horizon, as one looks a table up who knows nothing
    of half vectors.
    """
    rng = np.random.default_rng(0)
    shares = rng.random((2, 3, count))
    nodes = [
        np.interp(share * (axis.size - 1), np.arange(axis.size), axis)
        for axis, share in zip(grid, shares[0], strict=True)
    ]
    angles = [
        axis[0] + share * np.ptp(axis) for axis, share in zip(grid, shares[1], strict=True)
    ]
    pairs = half_angles(*(_upward(*rng.random((2, count))) for _ in range(2)))
    return [np.stack(points, axis=-1) for points in (nodes, angles, pairs)]


def _upward(cosine: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Return directions (..., 3) of these cosines to the normal and turns about it."""
    across, azimuth = np.sqrt(1 - cosine**2), 2 * np.pi * turn
    return np.stack([across * np.cos(azimuth), across * np.sin(azimuth), cosine], axis=-1)


def _quantiles(error: np.ndarray, way: np.ndarray) -> np.ndarray:
    """Return the quantiles (quantiles, 4, 4) of the way of drawing that finds most.

    What is rare in one way may be common in another.
    """
    found = [
        np.quantile(error[way == one], list(QUANTILES.values()), axis=0)
        for one in np.unique(way)
        if (way == one).sum() >= _FEWEST
    ]
    return np.max(found, axis=0) if found else np.full((len(QUANTILES), 4, 4), np.nan)

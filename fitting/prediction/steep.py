"""Facets too steep for an objective: found, taken out, and bridged from their rims.

A smooth facet steeper than the objective's cone sends no light back. The height there is
missing or wrong by whole fringes, and what is left are the flatter facets. Heights that no
visible facet can join are taken out, and islands between them smaller than a spot of light
too: nothing ties their fringe to that of the rest. The thin plate through height and slope
of the rims bridges the holes, so that a flank between a visible top and a visible foot
keeps its mean slope.
"""

import warnings
from dataclasses import dataclass

import numpy as np
from scipy import ndimage, sparse
from scipy.sparse import linalg

from data_io import MendedMap, MendWarning
from data_io.mending.bands import find_bands
from fitting.prediction.instrument import Instrument
from fitting.statistics.mended import mended_once
from pbrdf.surface.heightmap import HeightMap

Array = np.ndarray

# Share of a map that can be bridged
_MOST = 0.5


@dataclass(frozen=True, kw_only=True, eq=False)
class Bridged:
    """A mended map without holes, and where it was bridged.

    Parameters
    ----------
    surface : HeightMap
        [um]
    lost : ndarray of bool, shape (nx, ny)
        Nodes that the instrument did not see.
    """

    surface: HeightMap
    lost: Array


def bridged(surface: HeightMap, instrument: Instrument) -> Bridged:
    """Mend the map of an instrument, and bridge what was too steep for it.

    Raises
    ------
    ValueError
        If more than half of the map is lost.
    """
    first = mended_once(surface)
    digitised = _as_digitised(first)
    bands = None if digitised is first else find_bands(digitised.heights)
    # No surface within the bands is flatter
    lost = _lost(digitised, instrument, 0.0 if bands is None else bands.width)
    if lost.mean() > _MOST:
        msg = (
            f"aperture must let the instrument see half of the map at least: with slopes "
            f"up to {instrument.steepest:.3g} it sees {1 - lost.mean():.0%}. Give the "
            "objective's true aperture, or a map of one with a larger."
        )
        raise ValueError(msg)
    if not lost.any():
        return Bridged(surface=first, lost=lost)
    mended = first if bands is None else _drawn_again(digitised, lost)
    holed = np.where(lost, np.nan, mended.heights)
    whole = _thin_plate(holed, surface.spacing)
    return Bridged(
        surface=HeightMap(whole, surface.spacing, periodic=surface.periodic), lost=lost
    )


def _drawn_again(digitised: HeightMap, lost: Array) -> HeightMap:
    """Take terraces off what was seen; wrong fringes would pass for noise between them."""
    holed = HeightMap(
        np.where(lost, np.nan, digitised.heights), digitised.spacing,
        periodic=digitised.periodic,
    )  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MendWarning)
        return mended_once(holed.filled())


def _as_digitised(surface: HeightMap) -> HeightMap:
    """Return the map without its other faults, but with its bands."""
    if not isinstance(surface, MendedMap):
        return surface
    drawn = any(one.kind == "terraces" and one.mended for one in surface.mends)
    if not drawn:
        return surface
    known = np.isfinite(surface.heights)
    return HeightMap(
        np.where(known, surface.raw.heights, np.nan), surface.spacing,
        periodic=surface.periodic,
    )  # fmt: skip


def _lost(surface: HeightMap, instrument: Instrument, width: float) -> Array:
    """Tell which nodes are missing, at too steep a rise between bands, or cut off."""
    lost = ~np.isfinite(surface.heights)
    for axis, step in enumerate(surface.spacing):
        # The nodes before and after each rise
        heights, nodes = np.moveaxis(surface.heights, axis, 0), np.moveaxis(lost, axis, 0)
        steep = np.abs(np.diff(heights, axis=0)) - width > instrument.steepest * step
        nodes[:-1] |= steep
        nodes[1:] |= steep
    islands, _ = ndimage.label(~lost)
    small = np.bincount(islands.ravel()) * np.prod(surface.spacing) < instrument.spot
    return np.asarray(lost | small[islands])


def _thin_plate(heights: Array, spacing: tuple[float, float]) -> Array:
    """Fill holes with the surface of least mean square Laplacian through the rest."""
    across = [_second_difference(n, d) for n, d in zip(heights.shape, spacing, strict=True)]
    laplacian = sparse.kronsum(across[1], across[0], format="csr")
    hole = np.isnan(heights).ravel()
    unknown = laplacian[:, hole]
    touched = np.unique(unknown.nonzero()[0])
    unknown = unknown[touched]
    pull = -laplacian[touched][:, ~hole] @ heights.ravel()[~hole]
    found = heights.ravel().copy()
    found[hole] = linalg.spsolve((unknown.T @ unknown).tocsc(), unknown.T @ pull)
    return found.reshape(heights.shape)


def _second_difference(count: int, step: float) -> sparse.csr_matrix:
    """Second difference along an axis, free of moments at its ends. [1/um^2]"""
    rows = sparse.diags([1.0, -2.0, 1.0], [-1, 0, 1], (count, count)).tolil()
    rows[0] = rows[-1] = 0
    return rows.tocsr() / step**2

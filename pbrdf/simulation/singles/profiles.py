"""Lines of nodes for looks without a surface, for a direction over a Gaussian surface."""

import math
from functools import lru_cache

import numpy as np

from pbrdf.kernels.sights.looks import Ensemble
from pbrdf.kernels.sights.profiles import (
    CLEAR,
    N_BENT,
    N_ROW,
    Lines,
    Profiles,
    fill_profiles,
)
from pbrdf.surface import GaussianSurface

__all__ = ["NO_PROFILES", "most_bytes", "profiles_of"]

# Nodes lie so many correlation lengths apart, and twice as far from `NEAR` on; further than
# `FAR` none matters enough
STEP, NEAR, FAR = 0.5, 6.0, 20.0
# Nodes of the grid between them at least, and from the facet to the first: no corner of it
LEAST_NODES, FIRST_NODES = 1.5, 2.5
# Azimuths across a column and zeniths across a cell, where these are wide
TURNS, STEPS, MANY = 2, 8, 100


def _ways(first: float, step: float, last: float) -> np.ndarray:
    """Distances of the nodes of a line from the facet, in correlation lengths."""
    near = np.arange(first, min(NEAR, last), step)
    if last <= NEAR:
        return near
    beyond = near[-1] if near.size else first
    return np.concatenate([near, np.arange(beyond + 2.0 * step, last, 2.0 * step)])


def _span(surface: GaussianSurface) -> tuple[float, float, float]:
    """First node of a line, step and furthest node, in correlation lengths."""
    pitch = np.broadcast_to(np.asarray(surface.spacing, dtype=float), 2)
    length = np.broadcast_to(np.asarray(surface.corr_length, dtype=float), 2)
    node = float((pitch / length).max())
    # A line that goes round the period must not come back to its facet
    most = min(float((np.asarray(surface.shape) * pitch / length).min()) - 1.0, FAR)
    return max(STEP, FIRST_NODES * node), max(STEP, LEAST_NODES * node), most


def profiles_of(
    surface: GaussianSurface,
    ensemble: Ensemble,
    along: tuple[np.ndarray, np.ndarray],
    source: tuple[float, float],
    cells: np.ndarray,
    wanted: np.ndarray,
    change: np.ndarray,
    left: float,
) -> Profiles:
    """Lines of the cells (cells, cells, N_CELL) of a direction that are wanted.

    `along` are the autocorrelations of `Mesh`, `source` zenith and azimuth [rad]; `change`
    (cells,) is how the density of looks changes across a column of cells of one dphi, the
    first of which begins at `left` [rad].
    """
    shape = (cells.shape, wanted.shape)
    return _profiles(
        surface, _Hidden((ensemble, along)), source, shape, cells.tobytes(),
        wanted.tobytes(), change.tobytes(), left,
    )  # fmt: skip


class _Hidden:
    """What follows from other arguments of a cached function, and counts as the same."""

    def __init__(self, held: tuple[Ensemble, tuple[np.ndarray, np.ndarray]]) -> None:
        self.held = held

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Hidden)

    def __hash__(self) -> int:
        return 0


# Runs that differ in their seeds or rays share them
@lru_cache(maxsize=8)
def _profiles(
    surface: GaussianSurface,
    known: _Hidden,
    source: tuple[float, float],
    shape: tuple[tuple[int, ...], tuple[int, ...]],
    cells: bytes,
    wanted: bytes,
    change: bytes,
    left: float,
) -> Profiles:
    ensemble, along = known.held
    theta_i, phi_i = source
    of_cells, asked = np.frombuffer(cells).reshape(shape[0]), np.frombuffer(wanted, bool)
    length = np.broadcast_to(np.asarray(surface.corr_length, dtype=float), 2)
    first, step, most = _span(surface)
    rise = math.cos(theta_i) / max(math.sin(theta_i), 1e-12)
    high = CLEAR * surface.ensemble_height_rms / float(length.min())
    ways_i = _ways(first, step, min(high / rise, most))
    ways_s = _ways(first, step, most)
    n_theta, columns = shape[1]
    profiles = _room(len(ways_i), len(ways_i) + len(ways_s), n_theta, columns)
    lines = Lines(
        ways_i, ways_s, float(length[0]),
        float(length[1]), surface.ensemble_height_rms, theta_i, phi_i, left,
        np.frombuffer(change),
    )  # fmt: skip
    fill_profiles(ensemble, lines, *along, of_cells, asked.reshape(shape[1]), profiles)
    return profiles


def _room(sources: int, nodes: int, n_theta: int, columns: int) -> Profiles:
    """Lines of so many nodes, the first of them towards the source, to be filled in."""
    turns = TURNS if columns <= MANY else 1
    steps = STEPS if n_theta <= MANY else 1
    paths = 2 * turns * columns
    return Profiles(
        np.zeros((paths, nodes, 2), dtype=np.int64), np.zeros((paths, nodes, 3)),
        np.zeros((paths, nodes, N_BENT)), np.zeros((paths, nodes, nodes)),
        np.zeros((paths, nodes), dtype=np.int64),
        np.zeros((turns * columns, steps, N_ROW, n_theta)), sources, columns,
    )  # fmt: skip


def most_bytes(surface: GaussianSurface, columns: int) -> float:
    """Memory of the lines of a direction at most, for so many columns of cells. [bytes]"""
    nodes = 2 * _ways(*_span(surface)).size
    return 8.0 * nodes**2 * 2.0 * max(TURNS * MANY, columns)


NO_PROFILES = _room(0, 0, 0, 1)

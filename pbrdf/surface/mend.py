"""Measured maps made fit for tracing: holes filled, edges made to repeat."""

import numpy as np
from scipy import sparse
from scipy.sparse import linalg


def fill_holes(heights: np.ndarray, *, periodic: bool) -> np.ndarray:
    """Fill missing heights (NaN) with the membrane spanned by the rim of each hole.

    Solves Laplace's equation on the missing nodes (each the mean of its four neighbours),
    so that no height exceeds those of the rim. Returns a new array.

    Raises
    ------
    ValueError
        If more than half of the heights are missing.
    """
    missing = np.isnan(heights)
    if not missing.any():
        return heights.copy()
    if missing.mean() > 0.5:
        msg = (
            f"heights must be known at half the nodes at least, got "
            f"{100 * missing.mean():.3g} % missing. Crop the map to where it was measured."
        )
        raise ValueError(msg)
    number = np.full(heights.shape, -1)
    number[missing] = np.arange(missing.sum())
    rows, columns = np.nonzero(missing)
    count = len(rows)
    degree = np.zeros(count)
    known = np.zeros(count)
    links = []
    for down, right in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        i, j = rows + down, columns + right
        if periodic:
            i, j = i % heights.shape[0], j % heights.shape[1]
        inside = (i >= 0) & (i < heights.shape[0]) & (j >= 0) & (j < heights.shape[1])
        here = np.flatnonzero(inside)
        there = number[i[inside], j[inside]]
        degree[here] += 1
        hole = there >= 0
        links.append((here[hole], there[hole]))
        known[here[~hole]] += heights[i[inside], j[inside]][~hole]
    a = np.concatenate([link[0] for link in links])
    b = np.concatenate([link[1] for link in links])
    matrix = sparse.diags(degree) - sparse.csr_matrix(
        (np.ones(len(a)), (a, b)), shape=(count, count)
    )
    filled = heights.copy()
    filled[missing] = linalg.spsolve(matrix.tocsc(), known)
    return filled


def mirror_edges(heights: np.ndarray) -> np.ndarray:
    """Reflect a map at its far edges, so that it repeats without a step.

    The result has (2 nx - 2, 2 ny - 2) nodes; every slope occurs with both signs.
    """
    wide = np.concatenate([heights, heights[-2:0:-1]], axis=0)
    return np.concatenate([wide, wide[:, -2:0:-1]], axis=1)

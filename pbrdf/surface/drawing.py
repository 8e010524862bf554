"""What drawing a random surface takes: the sides of its grid and random numbers."""

from typing import Any

import numpy as np

from pbrdf.errors import check_seed, require

# A period of fewer nodes holds no surface worth the name
LEAST_NODES = 8
# Where no shape is given: powers of two at least, and correlation lengths a period
LEAST_POWER, LENGTHS = 8, 16


def grid_shape(shape: Any) -> tuple[int, int]:
    """Return the numbers of nodes (nx, ny) of a random surface."""
    rule = f"be (nx, ny) with at least {LEAST_NODES} nodes each, whole numbers"
    sides = require(
        "shape", shape,
        lambda v: (v >= LEAST_NODES) & (v == np.floor(v)) & np.isfinite(v),
        rule, "Count the nodes along x and y.",
    )  # fmt: skip
    if sides.shape != (2,):
        msg = f"shape must {rule}, got {shape!r}. Count the nodes along x and y."
        raise ValueError(msg)
    return int(sides[0]), int(sides[1])


def default_shape(cells: np.ndarray) -> tuple[int, int]:
    """Return nodes (nx, ny) for so many cells a correlation length along each axis."""
    nx, ny = (1 << max(int(np.ceil(np.log2(LENGTHS * one))), LEAST_POWER) for one in cells)
    return nx, ny


def generator(
    seed: int | np.random.SeedSequence | np.random.Generator | None,
) -> np.random.Generator:
    """Random numbers from a seed that may be a number, a sequence of seeds or None."""
    if not isinstance(seed, np.random.SeedSequence | np.random.Generator):
        check_seed(seed)
    return np.random.default_rng(seed)

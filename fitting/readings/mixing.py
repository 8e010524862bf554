"""Which Mueller elements of which rays a reading is made of, and with what weights."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fitting.readings.aperture import Rays
from fitting.readings.observations import ELEMENTS, LINEAR, NORMALISED

if TYPE_CHECKING:
    import casadi

__all__ = ["Mixing"]


@dataclass(frozen=True, eq=False)
class Mixing:
    """Linear map from the elements of all rays to readings.

    Parameters
    ----------
    rays : Rays
        The rays, those of one reading in succession.
    shares : mapping of str to ndarray, shape (R, 16)
        For each linear observable what every element of every ray adds to it.
    elements : tuple of int
        The elements that occur, numbered along the rows of the matrix.
    """

    rays: Rays
    shares: dict[str, np.ndarray]
    elements: tuple[int, ...]

    @classmethod
    def of(cls, rays: Rays, observables: Sequence[str]) -> "Mixing":
        """Return the map for these observables."""
        linear = {name for name in observables if name in LINEAR}
        if "DOLP" in observables:
            linear |= {"M00", "M10", "M20"}
        for name in set(observables) & set(NORMALISED):
            linear |= {"M00", NORMALISED[name]}
        shares = {}
        for name in sorted(linear):
            pattern = np.zeros((4, 4))
            for element, coefficient in LINEAR[name].items():
                pattern.flat[ELEMENTS.index(element)] = coefficient
            # Element (i, j) of a ray adds turn_out[a, i] turn_in[j, b] to reading (a, b)
            left = np.einsum("ab,rai->rib", pattern, rays.turn_out)
            share = np.einsum("rib,rjb->rij", left, rays.turn_in)
            shares[name] = rays.weight[:, None] * share.reshape(-1, 16)
        used = sum(np.abs(share).sum(axis=0) for share in shares.values())
        return cls(rays, shares, tuple(np.flatnonzero(used).tolist()))

    def matrix(self, names: np.ndarray, at: np.ndarray) -> "casadi.DM":
        """Return the sparse matrix from stacked ray elements to readings (names, at)."""
        import casadi

        first = np.searchsorted(self.rays.parent, np.arange(self.rays.parent[-1] + 2))
        start, count = first[at], first[at + 1] - first[at]
        reading = np.repeat(np.arange(len(at)), count)
        # Number the rays of each reading: its first one, the next, ...
        ray = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
        ray = ray + start[reading]
        values = np.empty((len(ray), len(self.elements)))
        for name, share in self.shares.items():
            here = names[reading] == name
            values[here] = share[np.ix_(ray[here], self.elements)]
        row, column = np.nonzero(values)
        return casadi.DM.triplet(
            reading[row].tolist(),
            (ray[row] * len(self.elements) + column).tolist(),
            casadi.DM(values[row, column]),
            len(at),
            len(self.rays.parent) * len(self.elements),
        )

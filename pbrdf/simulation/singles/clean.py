"""What single bounces of a clean surface that do not come from rays tell of themselves."""

from typing import Protocol, Self

import numpy as np

from pbrdf.kernels.terrain.heightfield import Terrain
from pbrdf.simulation.plan import Plan, Tally


class Clean(Protocol):
    """Single bounces of the directions of a plan over a clean surface."""

    @property
    def one_of_many(self) -> bool:
        """Whether they are of one direction among several."""
        ...

    @property
    def everything(self) -> bool:
        """Whether no facet hides another, so that no light is left for further bounces."""
        ...

    def certain(self) -> np.ndarray:
        """Say the same of each direction (angles,)."""
        ...

    def serves(self) -> np.ndarray:
        """Say of which directions single bounces do not come from rays (angles,)."""
        ...

    def hidden(self) -> np.ndarray:
        """Return the share of a bin that is hidden, about (angles, n_theta, n_dphi)."""
        ...

    def doubtful(self) -> np.ndarray:
        """Return the mean square of what a look at a bin may tell, about (as `hidden`)."""
        ...

    def looks(self) -> np.ndarray:
        """Count the looks of a sample at a bin (as `hidden`)."""
        ...

    def part(self, first: int, last: int) -> Self:
        """Return those of some directions."""
        ...

    def of_waves(self, first: int, last: int) -> Self:
        """Return those of some wavelengths."""
        ...

    def add(
        self,
        terrain: Terrain | None,
        plan: Plan,
        seed: np.random.SeedSequence,
        tally: Tally,
    ) -> None:
        """Put single bounces in the place of those of the rays of a sample."""
        ...

    def bounce(self, plan: Plan, tally: Tally, angle: int, wave: int) -> np.ndarray:
        """Return those of a sample (n_theta, n_dphi, stokes, stokes), in rays of light."""
        ...

    def explanation(self) -> list[str]:
        """Say what they do without."""
        ...

"""Histograms of heights and slopes beside the Gaussian of their rms."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np

from pbrdf.plots.sheet import COLOURS, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["histograms"]


class Drawn(Protocol):
    """What a histogram must tell to be drawn."""

    @property
    def edges(self) -> np.ndarray:
        """Bin edges."""

    @property
    def density(self) -> np.ndarray:
        """Of the measured values."""

    @property
    def rms(self) -> float:
        """Of the Gaussian."""

    @property
    def quantity(self) -> str:
        """For the axis."""

    @property
    def units(self) -> str:
        """For the axis."""

    def gaussian(self, at: np.ndarray | None = None) -> np.ndarray:
        """Density of the Gaussian of the rms."""


def histograms(several: "Sequence[Drawn]") -> "Figure":
    """Draw densities beside the Gaussian of the rms that was measured."""
    figure, axes = new_figure(1, len(several), (4.0 * len(several), 3.4))
    for axis, histogram in zip(axes.flat, several, strict=True):
        axis.stairs(
            histogram.density, histogram.edges, fill=True, color=COLOURS[5], alpha=0.55,
            label="measured",
        )  # fmt: skip
        x = np.linspace(histogram.edges[0], histogram.edges[-1], 400)
        label = f"Gaussian, rms {histogram.rms:.3g}"
        axis.plot(x, histogram.gaussian(x), color=COLOURS[1], label=label)
        axis.set(xlabel=f"{histogram.quantity} [{histogram.units}]", ylabel="density")
        axis.set_ylim(0.0, 1.3 * max(histogram.density.max(), histogram.gaussian(x).max()))
        axis.legend(frameon=False, fontsize="small", loc="upper left")
    return figure

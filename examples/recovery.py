"""The embedded example as a whole: make it, and judge what was recovered from it."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import micrograph
import numpy as np
import scan

import data_io

TRUTH = {
    "height_rms": micrograph.HEIGHT_RMS,
    "corr_length": micrograph.CORR_LENGTH,
    "slope_rms": float(np.sqrt(2) * micrograph.HEIGHT_RMS / micrograph.CORR_LENGTH),
    "specular_gain": scan.SPECULAR_GAIN,
    "diffuse_albedo": scan.DIFFUSE_ALBEDO,
}
UNITS = {"height_rms": "um", "corr_length": "um"}


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """One recovered number beside the true one.

    Attributes
    ----------
    name, curve : str
        The quantity, and the curve whose fit gave it.
    value, stderr, low, high, true : float
        Recovered value, its standard error and 95 % interval, and the true value.
    """

    name: str
    curve: str
    value: float
    stderr: float
    low: float
    high: float
    true: float

    @property
    def sigma(self) -> float:
        """Deviation in standard errors."""
        return (self.value - self.true) / self.stderr

    @property
    def holds(self) -> bool:
        """Statistics: truth inside the 95 % interval. Gains: within 3 standard errors."""
        if self.curve == "surface":
            return self.low <= self.true <= self.high
        return abs(self.sigma) <= 3.0

    def __str__(self) -> str:
        verdict = "holds" if self.holds else "MISS"
        unit = UNITS.get(self.name, "")
        return (
            f"{self.name:<15} {self.curve:<12} {self.value:8.4f} ± {self.stderr:.4f} "
            f"{unit:<2}  true {self.true:7.4f}  {self.sigma:+5.1f} sigma  {verdict}"
        )


def make_example(folder: Path, seed: int) -> tuple[Path, Path]:
    """Write the micrograph and the scan of one seed; return their paths."""
    edge, table = folder / "edge.png", folder / "scan.csv"
    micrograph.make_micrograph(edge, seed)
    scan.make_scan(table, seed)
    return edge, table


def recovered(folder: Path) -> Iterator[Comparison]:
    """Compare the results of `pbrdf pipeline` with what the example was made with."""
    attrs = data_io.read_result(folder / "result.nc").attrs
    surface = {
        name: attrs["statistics"][name] for name in TRUTH if name in attrs["statistics"]
    }
    groups = {
        "surface": surface,
        "analytical": attrs["analytic_fit"]["parameters"],
        "Monte Carlo": attrs["monte_carlo_fit"]["parameters"],
    }
    for curve, estimates in groups.items():
        for name, estimate in estimates.items():
            numbers = {key: estimate[key] for key in ("value", "stderr", "low", "high")}
            yield Comparison(name=name, curve=curve, true=TRUTH[name], **numbers)

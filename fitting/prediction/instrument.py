"""What a microscope could see of a surface: its aperture, wavelength and pixel."""

from dataclasses import dataclass
from math import asin, hypot, pi, sqrt, tan

import numpy as np

from pbrdf.errors import one_number

# Standard deviation of the Gaussian nearest to an Airy spot, in wavelengths over aperture
_AIRY = 0.21
# Spread of an objective that just resolves two steps: lambda/(2 NA) = 2 steps
_TWO_STEPS = 4 * _AIRY


@dataclass(frozen=True, kw_only=True)
class Instrument:
    """Objective and camera of the interferometer or microscope that measured a map.

    Parameters
    ----------
    aperture : float
        Numerical aperture of the objective, in air. [1]
    wavelength : float
        Mean wavelength of its light. [um]
    pixel : float, optional
        Width of a pixel on the surface; by default the step of the map. [um]

    Examples
    --------
    >>> microscope = Instrument(aperture=0.55, wavelength=0.55)
    >>> round(microscope.steepest, 2), round(microscope.spread(0.2), 2)
    (0.66, 0.22)
    """

    aperture: float
    wavelength: float = 0.55
    pixel: float | None = None

    def __post_init__(self) -> None:
        one_number(
            "aperture", self.aperture, lambda v: (v > 0) & (v < 1), "lie between 0 and 1",
            "It is the sine of the half angle of the objective's cone, in air.",
        )  # fmt: skip
        sizes = {"wavelength": self.wavelength}
        if self.pixel is not None:
            sizes["pixel"] = self.pixel
        for name, size in sizes.items():
            one_number(
                name, size, lambda v: (v > 0) & np.isfinite(v),
                "be positive [um]", "",
            )  # fmt: skip

    @property
    def steepest(self) -> float:
        """Slope beyond which a smooth facet mirrors no light back into the cone. [1]"""
        return tan(asin(self.aperture))

    @property
    def spot(self) -> float:
        """Area of the Airy disc. [um^2]"""
        return pi * (0.61 * self.wavelength / self.aperture) ** 2

    def spread(self, step: float) -> float:
        """Return the standard deviation of its point spread, spot and pixel. [um]"""
        pixel = step if self.pixel is None else self.pixel
        return hypot(_AIRY * self.wavelength / self.aperture, pixel / sqrt(12))


def widest_spread(step: float) -> float:
    """Return the spread of an objective that resolves two steps of a map. [um]"""
    return _TWO_STEPS * step

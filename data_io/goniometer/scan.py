"""Measured geometries and values in the conventions, and what makes them wrong."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from data_io.goniometer.scatter import curve_keys
from pbrdf.errors import DataFileError

ELEMENTS = tuple(f"M{i}{j}" for i in range(4) for j in range(4))
# The same elements divided by M00, as polarimeters and ellipsometers write them
NORMALISED = tuple(name.lower() for name in ELEMENTS[1:])
# Light behind polarisers, as `fitting.readings.observations.LINEAR` defines them
INTENSITIES = ("I_s", "I_p", "f_ss", "f_sp", "f_ps", "f_pp")
RATIOS = (*NORMALISED, "DOLP")
QUANTITIES = (*ELEMENTS, *INTENSITIES, *RATIOS)
STDERR = "_stderr"

CONVENTIONS = (
    "Angles in rad, dphi = phi_s - phi_i, specular at dphi = pi. "
    "Stokes frames of the meridian planes, Q > 0 is s (perpendicular), "
    "V > 0 right-circular for the receiver. "
    "M in 1/sr without the cosine, M[out][in]; m01..m33 are divided by M00. "
    "NaN: not measured."
)


class ConventionWarning(UserWarning):
    """What a file leaves open was taken in the more likely way."""


@dataclass(frozen=True, kw_only=True)
class Scan:
    """Rows of a goniometer file, converted to the conventions but not yet checked.

    Attributes
    ----------
    path : Path
        The file.
    lines : sequence of int
        Line of each row.
    theta_i, theta_s, dphi : ndarray, shape (n,)
        Geometry; degrees, because the checks and their messages speak the file's language.
    values : mapping of str to ndarray, shape (n,)
        Quantities by name (`QUANTITIES`) and their standard errors. [1/sr or 1]
    wavelength : ndarray, shape (n,), optional
        Vacuum wavelength. [um]
    phi_i : ndarray, shape (n,), optional
        Azimuth of the source about the normal of the sample, or how far the sample was
        turned under it. [deg]
    source_half_angle, detector_half_angle : ndarray, shape (n,), optional
        Half-angles of the cones of light. [deg]
    quantity : str
        "brdf", or "relative": all but the ratios have one unknown factor in common; before
        conversion also "reflectance-factor" and "brdf-cos".
    declares_quantity : bool
        The file itself says which.
    angles_declared : bool
        Whoever reads the file says the unit of its angles.
    names : mapping of str to str
        What the file calls the angles, for messages.
    attrs : mapping
        What the dataset keeps beside the numbers.
    """

    path: Path
    lines: Sequence[int]
    theta_i: np.ndarray
    theta_s: np.ndarray
    dphi: np.ndarray
    values: Mapping[str, np.ndarray]
    wavelength: np.ndarray | None = None
    phi_i: np.ndarray | None = None
    source_half_angle: np.ndarray | None = None
    detector_half_angle: np.ndarray | None = None
    quantity: str = "brdf"
    declares_quantity: bool = False
    angles_declared: bool = False
    names: Mapping[str, str] = field(default_factory=dict)
    attrs: Mapping[str, object] = field(default_factory=dict)

    @cached_property
    def curves(self) -> tuple[np.ndarray, np.ndarray]:
        """The curve that each reading lies on, and its place along it (`curve_keys`)."""
        others = (self.phi_i, self.wavelength)
        return curve_keys(self.theta_i, self.theta_s, self.dphi, *others)

    def fault(
        self, rows: np.ndarray, column: str, problem: str, cure: str
    ) -> DataFileError:
        """Return the error for the first of the marked rows."""
        row = int(np.argmax(rows))
        name = self.names.get(column, column)
        return DataFileError(self.path, problem, cure, line=self.lines[row], column=name)

"""Surface profiles z(x): the container."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from data_io.mending.faults import Mend
from pbrdf.errors import real_array, require


@dataclass(frozen=True, eq=False, repr=False, init=False)
class Profile:
    """Heights z over rising positions x, evenly spaced or not.

    Parameters
    ----------
    x : array_like, shape (n,)
        Positions, strictly rising. [um]
    z : array_like, shape (n,)
        Heights. [um] Points whose position or height a mask hides are left out.
    slope : array_like, shape (n,), optional
        Slopes dz/dx that were measured, of which the heights are the integral. [1]

    Raises
    ------
    TypeError
        If the arrays are complex or no numbers.
    ValueError
        If the arrays differ in shape, hold fewer than three points or non-finite values, or
        x does not rise.

    Examples
    --------
    >>> Profile([0.0, 1.0, 2.5], [0.1, 0.0, 0.3])
    Profile(3 points, length 2.5 um, unevenly spaced)
    """

    x: np.ndarray
    z: np.ndarray
    slope: np.ndarray | None

    def __init__(
        self,
        x: npt.ArrayLike,
        z: npt.ArrayLike,
        *,
        slope: npt.ArrayLike | None = None,
    ) -> None:
        cure = "Leave missing points out; a profile may be unevenly spaced."
        pairs = (("x", x), ("z", z))
        hidden = [np.ma.getmaskarray(np.ma.asanyarray(values)) for _, values in pairs]
        if any(mask.any() for mask in hidden) and hidden[0].shape == hidden[1].shape:
            known = ~(hidden[0] | hidden[1])
            pairs = tuple((name, real_array(name, one)[known]) for name, one in pairs)  # type: ignore[assignment]
            slope = None if slope is None else real_array("slope", slope)[known]
        arrays = [
            require(name, values, np.isfinite, "be finite [um]", cure).copy()
            for name, values in pairs
        ]
        if arrays[0].ndim != 1 or arrays[0].shape != arrays[1].shape:
            msg = (
                f"x and z must be one-dimensional and of one length, got shapes "
                f"{arrays[0].shape} and {arrays[1].shape}. Give one height a position."
            )
            raise ValueError(msg)
        if arrays[0].size < 3:
            msg = f"x must have at least 3 points, got {arrays[0].size}. Measure more."
            raise ValueError(msg)
        rising = np.diff(arrays[0]) > 0
        if not rising.all():
            i = int(np.argmin(rising)) + 1
            msg = (
                f"x must rise strictly [um], got {arrays[0][i]:.9g} after "
                f"{arrays[0][i - 1]:.9g} at index {i}. Sort points and merge equal ones."
            )
            raise ValueError(msg)
        slopes = None
        if slope is not None:
            slopes = require("slope", slope, np.isfinite, "be finite [1]", cure).copy()
            if slopes.shape != arrays[0].shape:
                msg = f"slope must have shape {arrays[0].shape} as x, got {slopes.shape}."
                raise ValueError(msg)
            slopes.setflags(write=False)
        object.__setattr__(self, "slope", slopes)
        for name, array in zip(("x", "z"), arrays, strict=True):
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @classmethod
    def from_slope(cls, x: npt.ArrayLike, slope: npt.ArrayLike) -> "Profile":
        """Profile of measured slopes; heights are their integral, by the trapezium rule.

        Examples
        --------
        >>> Profile.from_slope([0.0, 1.0, 3.0], [0.1, 0.3, 0.1]).z.round(3)
        array([0. , 0.2, 0.6])
        """
        position, slopes = np.asarray(x, dtype=float), np.asarray(slope, dtype=float)
        rises = np.diff(position) * (slopes[1:] + slopes[:-1]) / 2
        heights = np.concatenate([[0.0], np.cumsum(rises)])
        return cls(position, heights, slope=slopes)

    @property
    def size(self) -> int:
        """Number of points."""
        return self.x.size

    @property
    def length(self) -> float:
        """Distance from the first to the last point. [um]"""
        return float(self.x[-1] - self.x[0])

    @property
    def spacing(self) -> float:
        """Mean distance of neighbouring points. [um]"""
        return self.length / (self.size - 1)

    @property
    def evenly_spaced(self) -> bool:
        """True if every step agrees with the mean step to 1 %.

        Files print positions with few digits, so exact equality would reject them.
        """
        return bool(np.abs(np.diff(self.x) / self.spacing - 1).max() < 0.01)

    def __repr__(self) -> str:
        kind = "evenly" if self.evenly_spaced else "unevenly"
        return f"Profile({self.size} points, length {self.length:.6g} um, {kind} spaced)"


class MendedProfile(Profile):
    """A profile in which faults were found, with the profile as it was.

    Parameters
    ----------
    x, z, slope
        As of `Profile`, without the points that were left out.
    mends : tuple of Mend
        What was found; places are those of `raw`.
    raw : Profile
        As it was measured.
    """

    mends: tuple[Mend, ...]
    raw: Profile

    def __init__(self, profile: Profile, *, mends: tuple[Mend, ...], raw: Profile) -> None:
        super().__init__(profile.x, profile.z, slope=profile.slope)
        object.__setattr__(self, "mends", mends)
        object.__setattr__(self, "raw", raw)

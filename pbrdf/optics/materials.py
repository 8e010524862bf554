"""What a facet is made of: its complex index and the diffuse base under it."""

from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np
import numpy.typing as npt

from pbrdf.errors import require
from pbrdf.notebook import table
from pbrdf.optics.checks import checked_kappa, checked_n
from pbrdf.optics.dispersion import Dispersion, Table, require_in_range

__all__ = ["Material"]


@dataclass(frozen=True)
class Material:
    """Complex index N = n + i kappa of a homogeneous medium, seen from vacuum.

    Parameters
    ----------
    n : float or Dispersion
        Real part, > 0; `inf` is a perfect mirror. [1]
    kappa : float or Dispersion
        Imaginary part, >= 0, positive in an absorber (fields as exp(-i w t)). [1]
    diffuse_albedo : float or Table
        Albedo in [0, 1] of a Lambertian base under the interface. [1]
    name : str, optional
        For messages and results.
    source : str, optional
        Where the constants come from.
    absorbs_all : bool
        A perfect absorber: whatever it lies in or under, all light that meets it ends. It
        has n = 1 and kappa = 0, so that nothing comes back from it in air either.

    Raises
    ------
    ValueError
        If n <= 0, kappa < 0 (it is never conjugated), the albedo leaves [0, 1], or a
        perfect absorber has an interface.

    Examples
    --------
    >>> Material(1.5, 0.1).index()
    (1.5, 0.1)
    >>> Material.from_table(wavelength=[0.4, 0.8], n=[1.5, 1.4]).index(0.6)
    (1.45, 0.0)
    """

    n: float | Dispersion
    kappa: float | Dispersion = 0.0
    diffuse_albedo: float | Table = 0.0
    name: str | None = None
    source: str | None = None
    absorbs_all: bool = False

    def __post_init__(self) -> None:
        if not callable(self.n):
            object.__setattr__(self, "n", _scalar("n", checked_n(self.n)))
        if not callable(self.kappa):
            object.__setattr__(self, "kappa", _scalar("kappa", checked_kappa(self.kappa)))
        tabulated = isinstance(self.diffuse_albedo, Table)
        given: Any = self.diffuse_albedo
        albedo = require(
            "diffuse_albedo", given.values if tabulated else given,
            lambda v: (v >= 0) & (v <= 1), "lie in [0, 1] [1]",
            "It is a fraction of the light.",
        )  # fmt: skip
        if not tabulated:
            object.__setattr__(self, "diffuse_albedo", _scalar("diffuse_albedo", albedo))
        self._check_words()
        bare = (self.n, self.kappa, self.diffuse_albedo) == (1.0, 0.0, 0.0)
        if self.absorbs_all and not bare:
            msg = (
                f"absorbs_all must stand with n = 1 and kappa = 0, got n {self.n}, kappa "
                f"{self.kappa} and diffuse_albedo {self.diffuse_albedo}. A perfect "
                "absorber has no interface; leave it out, or the constants."
            )
            raise ValueError(msg)

    def _check_words(self) -> None:
        """Refuse what is no truth value or no text."""
        if not isinstance(self.absorbs_all, bool | np.bool_):
            msg = f"absorbs_all must be true or false, got {self.absorbs_all!r}."
            raise TypeError(msg)
        for key, value in (("name", self.name), ("source", self.source)):
            if not isinstance(value, str | None):
                msg = f"{key} must be a text or left out, got {value!r}. Put it in quotes."
                raise TypeError(msg)

    @classmethod
    def mirror(cls) -> "Material":
        """Perfect mirror: r_s = -1, r_p = +1 at every angle."""
        return cls(inf, name="mirror")

    @classmethod
    def black(cls) -> "Material":
        """Perfect absorber: nothing comes back, whatever it lies in or under."""
        return cls(1.0, name="black", absorbs_all=True)

    @classmethod
    def from_table(
        cls,
        *,
        wavelength: npt.ArrayLike,
        n: npt.ArrayLike,
        kappa: npt.ArrayLike = 0.0,
        diffuse_albedo: npt.ArrayLike | Table = 0.0,
        name: str | None = None,
        source: str | None = None,
    ) -> "Material":
        """Material with constants tabulated against rising vacuum wavelengths [um].

        Masked rows are missing, and the table is linear across them.

        Examples
        --------
        >>> Material.from_table(wavelength=[0.4, 0.8], n=[1.5, 1.4]).index(0.9)
        Traceback (most recent call last):
        ...
        ValueError: wavelength must lie in [0.4, 0.8] um, the range of its source, got \
0.9. Optical constants are not extrapolated; wavelengths are in micrometres.
        """
        absorption = kappa if np.ndim(kappa) == 0 else Table.of("kappa", wavelength, kappa)
        albedo: Any = diffuse_albedo
        if not isinstance(albedo, Table) and np.ndim(albedo) > 0:
            albedo = Table.of("diffuse_albedo", wavelength, albedo)
        index: Any = n if np.ndim(n) == 0 else Table.of("n", wavelength, n)
        return cls(index, absorption, albedo, name, source)  # type: ignore[arg-type]

    @property
    def dispersive(self) -> bool:
        """Whether the index depends on the wavelength."""
        return callable(self.n) or callable(self.kappa)

    @property
    def valid_range(self) -> tuple[float, float]:
        """Wavelengths at which the index is known. [um]"""
        constants = (self.n, self.kappa, self.diffuse_albedo)
        ranges = [c.valid_range for c in constants if callable(c)]
        return max((r[0] for r in ranges), default=0.0), min(
            (r[1] for r in ranges), default=inf
        )

    @property
    def has_base(self) -> bool:
        """Whether there is a diffuse base under the interface."""
        albedo = self.diffuse_albedo
        return any(albedo.values) if isinstance(albedo, Table) else albedo > 0.0

    def summary(self) -> str:
        """Return name, index or its range, and albedo of the base, in a line.

        Examples
        --------
        >>> Material(1.5, 0.01, diffuse_albedo=0.2, name="grey paint").summary()
        'grey paint: n 1.5, kappa 0.01, base of albedo 0.2'
        """
        parts = [
            f"{label} {'tabulated' if callable(value) else f'{value:.6g}'}"
            for label, value in (("n", self.n), ("kappa", self.kappa))
        ]
        if self.has_base:
            albedo = self.diffuse_albedo
            known = "tabulated" if callable(albedo) else f"{albedo:.6g}"
            parts.append(f"base of albedo {known}")
        if self.dispersive:
            low, high = self.valid_range
            parts.append(f"known from {low:.4g} to {high:.4g} um")
        text = ", ".join(parts)
        return f"{self.name}: {text}" if self.name else text

    def _repr_html_(self) -> str:
        rows = [("constants", self.summary())]
        rows += [("source", self.source)] if self.source else []
        return table("Material", rows)

    def albedo(self, wavelength: npt.ArrayLike | None = None) -> np.ndarray:
        """Albedo of the base at vacuum wavelengths of any shape [um].

        Raises
        ------
        ValueError
            If it is tabulated and the wavelength is missing or out of its range.
        """
        if callable(self.diffuse_albedo) and wavelength is None:
            low, high = self.diffuse_albedo.valid_range
            msg = (
                "wavelength must be given for a tabulated diffuse_albedo, got None. "
                f"Pass one between {low:g} and {high:g} um."
            )
            raise ValueError(msg)
        return self._at(self.diffuse_albedo, wavelength)

    def index(self, wavelength: float | None = None) -> tuple[float, float]:
        """(n, kappa) at one vacuum wavelength [um].

        Raises
        ------
        ValueError
            If the index is tabulated and the wavelength is missing or out of its range.
        """
        n, kappa = self.indices(wavelength)
        return float(n), float(kappa)

    def indices(
        self, wavelength: npt.ArrayLike | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Both constants at vacuum wavelengths of any shape [um]."""
        if self.dispersive and wavelength is None:
            low, high = self.valid_range
            msg = (
                f"wavelength must be given for {self.name or 'a tabulated material'}, "
                f"got None. Pass one between {low:g} and {high:g} um."
            )
            raise ValueError(msg)
        n = self._at(self.n, wavelength)
        kappa = self._at(self.kappa, wavelength)
        return n, kappa

    def _at(
        self, constant: float | Dispersion, wavelength: npt.ArrayLike | None
    ) -> np.ndarray:
        """Evaluate a dispersion; a number stays as it is."""
        if not callable(constant):
            return np.asarray(constant, dtype=np.float64)
        asked = np.nan if wavelength is None else wavelength
        owner = self.name or "its source"
        return constant(require_in_range(asked, constant.valid_range, owner))


def _scalar(name: str, value: Any) -> float:
    """One float; a list of values needs `Material.from_table`."""
    if np.ndim(value):
        got = f"got shape {np.shape(value)}. Use Material.from_table."
        msg = f"{name} must be one number, {got}"
        raise ValueError(msg)
    return float(value)

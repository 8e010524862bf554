"""A goniometer scan as a flat list of numbers to fit: what, where, how well.

Every observable is a linear combination of Mueller elements seen by an instrument of ideal
polarisers, or a ratio of such combinations: the elements divided by M00 (m10 .. m33), and
the degree of linear polarisation. A ratio knows nothing of absolute brightness.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fitting.readings.geometry import Geometry, geometry_of, joined
from pbrdf.errors import real_array

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "ELEMENTS",
    "LINEAR",
    "RATIOS",
    "Geometry",
    "Mask",
    "Observations",
    "observe",
]

ELEMENTS = tuple(f"M{out}{into}" for out in range(4) for into in range(4))

# f_ab is the BRDF for a source polarised along b behind an analyser along a, I_a that of an
# unpolarised source; each counts the light that leaves the analyser
LINEAR: dict[str, dict[str, float]] = {
    **{element: {element: 1.0} for element in ELEMENTS},
    "I_s": {"M00": 0.5, "M10": 0.5},
    "I_p": {"M00": 0.5, "M10": -0.5},
    "f_ss": {"M00": 0.5, "M01": 0.5, "M10": 0.5, "M11": 0.5},
    "f_sp": {"M00": 0.5, "M01": -0.5, "M10": 0.5, "M11": -0.5},
    "f_ps": {"M00": 0.5, "M01": 0.5, "M10": -0.5, "M11": -0.5},
    "f_pp": {"M00": 0.5, "M01": -0.5, "M10": -0.5, "M11": 0.5},
}

# Normalised elements, and the element that each divides by M00
NORMALISED = {f"m{element[1:]}": element for element in ELEMENTS[1:]}
RATIOS = (*NORMALISED, "DOLP")

Mask = Callable[["xr.Dataset"], "np.ndarray | xr.Dataset"]


@dataclass(frozen=True, eq=False)
class Observations:
    """The m numbers of one or several scans that enter a fit.

    Parameters
    ----------
    geometry : Geometry
        The N directions they were taken at.
    scan : ndarray of int, shape (N,)
        Which scan each direction belongs to.
    labels : tuple of str
        Names of the scans.
    name : ndarray of str, shape (m,)
        The observable.
    at : ndarray of int, shape (m,)
        Index into the geometry.
    value, stderr : ndarray, shape (m,)
        The number and its standard error, nan where the file gives none.
    relative : ndarray of bool, shape (scans,)
        Scans known up to a common factor only.
    """

    geometry: Geometry
    scan: np.ndarray
    labels: tuple[str, ...]
    name: np.ndarray
    at: np.ndarray
    value: np.ndarray
    stderr: np.ndarray
    relative: np.ndarray

    @property
    def names(self) -> tuple[str, ...]:
        """The observables that occur, in order of appearance."""
        return tuple(dict.fromkeys(self.name.tolist()))

    @property
    def is_ratio(self) -> np.ndarray:
        """Which readings are ratios, shape (m,)."""
        return np.isin(self.name, RATIOS)

    @property
    def m00(self) -> np.ndarray:
        """The M00 read at the geometry of each reading, nan where it was not, (m,)."""
        there = np.full(self.geometry.size, np.nan)
        is_m00 = self.name == "M00"
        there[self.at[is_m00]] = self.value[is_m00]
        return there[self.at]

    @property
    def wavelengths(self) -> np.ndarray:
        """The known wavelengths of what is read, rising. [um]"""
        waves = self.geometry.wavelength[self.at].round(9)
        return np.unique(waves[np.isfinite(waves)])

    @property
    def mixes_wavelengths(self) -> bool:
        """True if one scan holds several wavelengths."""
        waves, scan = self.geometry.wavelength[self.at].round(9), self.scan[self.at]
        pairs = np.unique(np.stack([scan, np.nan_to_num(waves, nan=-1.0)]), axis=1)
        return bool(pairs.shape[1] > len(np.unique(scan)))

    @property
    def has_polarisation(self) -> bool:
        """True if anything but M00 was measured."""
        return set(self.names) != {"M00"}


def observe(
    scans: Mapping[str, "xr.Dataset"],
    *,
    use: Sequence[str] | None = None,
    mask: Mask | Iterable[Mask] = (),
) -> Observations:
    """Flatten scans into the numbers to fit.

    Parameters
    ----------
    scans : mapping of str to Dataset
        Goniometer data sets, dimension `geometry`; NaN is not measured.
    use : sequence of str, optional
        Observables to use; default all that the scans hold.
    mask : callable or iterable of callables
        Each returns, for a scan, what to keep: a boolean array over `geometry`, or a
        Dataset of them for single observables.

    Raises
    ------
    TypeError
        If a scan is not a Dataset.
    ValueError
        If nothing is left to fit, or a standard error is not positive.
    """
    masks = (mask,) if callable(mask) else tuple(mask)
    parts = [
        _flatten(label, scan, use, masks, index)
        for index, (label, scan) in enumerate(scans.items())
    ]
    offsets = np.cumsum([0, *(part.geometry.size for part in parts)])
    together = Observations(
        geometry=joined([part.geometry for part in parts]),
        scan=np.concatenate([part.scan for part in parts]),
        labels=tuple(scans),
        name=np.concatenate([part.name for part in parts]),
        at=np.concatenate([part.at + o for part, o in zip(parts, offsets, strict=False)]),
        value=np.concatenate([part.value for part in parts]),
        stderr=np.concatenate([part.stderr for part in parts]),
        relative=np.concatenate([part.relative for part in parts]),
    )
    if not len(together.value):
        any_of = "M00..M33, m10..m33, DOLP, I_s, I_p or f_ss..f_pp"
        wanted = any_of if use is None else ", ".join(use)
        msg = f"measurement must hold numbers in {wanted}, got none. Check names and masks."
        raise ValueError(msg)
    return together


def _flatten(
    label: str,
    scan: "xr.Dataset",
    use: Sequence[str] | None,
    masks: Sequence[Mask],
    index: int,
) -> Observations:
    """Flatten one scan."""
    geometry = geometry_of(label, scan)
    known = [*LINEAR, *RATIOS]
    derived = {}
    names = [name for name in known if name in scan]
    if use is not None:
        unknown = set(use) - set(known)
        if unknown:
            msg = f"use must name observables, got {sorted(unknown)[0]!r}. Known: {known}."
            raise ValueError(msg)
        names = [name for name in use if name in scan]
    else:
        derived = {name: _derived(scan, name) for name in names}
    keep = [mask(scan) for mask in masks]
    columns = []
    for name in names:
        value = real_array(name, scan[name].values)
        good = np.isfinite(value) & ~derived.get(name, np.zeros(value.size, dtype=bool))
        for kept in keep:
            if isinstance(kept, np.ndarray):
                good = good & kept.astype(bool)
            elif name in kept:
                good = good & np.asarray(kept[name].values, dtype=bool)
        columns.append((name, np.flatnonzero(good), value[good], _stderr(scan, name, good)))
    return Observations(
        geometry=geometry,
        scan=np.full(geometry.size, index),
        labels=(label,),
        name=np.array([name for name, at, *_ in columns for _ in at], dtype=str),
        at=np.concatenate([np.zeros(0, dtype=int), *(at for _, at, *_ in columns)]),
        value=np.concatenate([np.zeros(0), *(value for _, _, value, _ in columns)]),
        stderr=np.concatenate([np.zeros(0), *(stderr for *_, stderr in columns)]),
        relative=np.array([_is_relative(label, scan)]),
    )


def _derived(scan: "xr.Dataset", name: str) -> np.ndarray:
    """Tell where a reading follows from others of its row: it must not count again.

    Light behind polarisers comes first, then elements, then ratios.
    """
    found = np.zeros(scan.sizes["geometry"], dtype=bool)
    for others in _follows(name):
        if set(others) <= set(scan.data_vars):
            found |= np.logical_and.reduce([np.isfinite(scan[o].values) for o in others])
    other = {"I_s": "I_p", "I_p": "I_s"}.get(name)
    if other is not None and {"M00", "M10"} <= set(scan.data_vars):
        # Without its counterpart light behind an analyser takes nothing from the elements
        alone = np.isfinite(scan["M00"].values) & np.isfinite(scan["M10"].values)
        if other in scan:
            alone &= ~np.isfinite(scan[other].values)
        found |= alone
    return found


def _follows(name: str) -> Iterator[tuple[str, ...]]:
    """Yield the sets of observables that each give one."""
    if name in LINEAR and not name.startswith("f_"):
        for group in (("I_s", "I_p"), ("f_ss", "f_sp", "f_ps", "f_pp")):
            known = set().union(*(LINEAR[one] for one in group))
            if name not in group and set(LINEAR[name]) <= known:
                yield group
    if name in NORMALISED:
        yield "M00", NORMALISED[name]
    if name == "DOLP":
        yield "M00", "M10"
        yield ("m10",)
    if name in ("m10", "DOLP"):
        yield "I_s", "I_p"


def _is_relative(label: str, scan: "xr.Dataset") -> bool:
    """Tell whether a scan is declared to be known up to a factor."""
    quantity = scan.attrs.get("quantity", "brdf")
    if quantity not in ("brdf", "relative"):
        msg = (
            f"measurement {label} must have the attribute quantity 'brdf' or 'relative', "
            f"got {quantity!r}. Convert other quantities to a BRDF first [1/sr]."
        )
        raise ValueError(msg)
    return bool(quantity == "relative")


def _stderr(scan: "xr.Dataset", name: str, good: np.ndarray) -> np.ndarray:
    """Return the standard errors of the kept values, nan where there is no column."""
    column = f"{name}_stderr"
    if column not in scan:
        return np.full(int(good.sum()), np.nan)
    stderr = real_array(column, scan[column].values)[good]
    wrong = ~(stderr > 0.0) & ~np.isnan(stderr)
    if wrong.any():
        where = np.flatnonzero(good)[wrong][0]
        msg = (
            f"{column} must be > 0, got {stderr[wrong][0]:g} at geometry {where}. "
            "Leave it out to have the noise estimated."
        )
        raise ValueError(msg)
    return stderr

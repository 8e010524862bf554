"""Find the faults of a measured map and mend those that are asked for."""

import warnings
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from data_io.mending.bands import find_bands
from data_io.mending.scan_lines import find_lost_lines, line_offsets
from data_io.mending.sentinels import find_sentinels, find_spikes
from data_io.mending.terraces import deterrace
from pbrdf.surface.heightmap import HeightMap

Array = np.ndarray

KINDS = ("sentinels", "lines", "offsets", "spikes", "terraces")
# To draw the surface under more nodes takes minutes
_MOST_NODES = 4_000_000


class MendWarning(UserWarning):
    """A map had faults; which, how many, and what was done about them."""


@dataclass(frozen=True, eq=False)
class Mend:
    """One kind of fault.

    Parameters
    ----------
    kind : str
        One of `KINDS`.
    count : int
        Points, lines or bands.
    text : str
        What was found and done, in words.
    where : ndarray of bool, shape (nx, ny)
        The points concerned.
    mended : bool
        False if they were left by choice.
    """

    kind: str
    count: int
    text: str
    where: Array
    mended: bool


class MendedMap(HeightMap):
    """A height map whose faults were found, with the map as it was.

    Parameters
    ----------
    heights, spacing, periodic
        As of `HeightMap`.
    mends : tuple of Mend
        What was found.
    raw : HeightMap
        As it was measured.
    uncertainty : ndarray, optional
        Standard deviation that mending leaves to every height, 0 where nothing was done;
        NaN where missing. [um]
    """

    mends: tuple[Mend, ...]
    raw: HeightMap
    uncertainty: Array | None

    def __init__(
        self,
        surface: HeightMap,
        *,
        mends: tuple[Mend, ...],
        raw: HeightMap,
        uncertainty: Array | None = None,
    ) -> None:
        super().__init__(
            surface.heights, surface.spacing, periodic=surface.periodic,
            labels=surface.labels,
        )  # fmt: skip
        object.__setattr__(self, "mends", mends)
        object.__setattr__(self, "raw", raw)
        object.__setattr__(self, "uncertainty", uncertainty)


def mend(
    surface: HeightMap, *, kinds: str | Iterable[str] = "all", name: str = "heights"
) -> HeightMap:
    """Mend the faults of a measured map, and say what they were.

    Parameters
    ----------
    surface : HeightMap
        As measured; NaN where missing. [um]
    kinds : str or sequence of str
        What to mend: ``all``, ``none``, or any of `KINDS`, as one string by commas. What
        is found but not asked for is named and left.

        ==========  ================================================================
        sentinels   values far from the rest, and flat patches with a rim of jumps:
                    missing
        lines       lines that repeat their neighbour, are flat, or of another place:
                    missing
        offsets     independent offsets of the lines: taken off
        spikes      points twelve times further from their neighbours than usual: missing
        terraces    bands of equal heights: the surface under them is drawn. Crowding at
                    levels less than 2 nm apart may be a crystal's, and is left with ``all``
        ==========  ================================================================
    name : str
        Of the map, for the warning.

    Returns
    -------
    HeightMap
        The same map if nothing was found, else a `MendedMap`.

    Raises
    ------
    ValueError
        If a kind is unknown.

    Warns
    -----
    MendWarning
        For each kind that was found.

    Examples
    --------
    >>> z = np.random.default_rng(0).normal(size=(40, 40))
    >>> z[3, 4] = -9999.0
    >>> with warnings.catch_warnings():
    ...     warnings.simplefilter("ignore", MendWarning)
    ...     found = mend(HeightMap(z, 1.0))
    >>> found.mends[0].text
    '1 of 1600 heights is -9999, far from the rest'
    >>> round(found.missing * z.size)
    1
    """
    wanted = wanted_kinds(kinds)
    heights = surface.heights.copy()
    # What is left as it is must not pass for another fault
    clean = heights
    mends: list[Mend] = []
    for kind, find in (
        ("sentinels", _sentinels),
        ("lines", _lines),
        ("offsets", _offsets),
        ("spikes", _spikes),
    ):
        found = find(clean)
        if found is None:
            continue
        text, count, where, after = found
        mends.append(Mend(kind, count, text, where, kind in wanted))
        if kind in wanted:
            heights = heights + (after - clean)
        clean = after
    mended = HeightMap(
        heights, surface.spacing, periodic=surface.periodic, labels=surface.labels
    )
    uncertainty = None
    bands = find_bands(clean)
    if bands is not None:
        small = heights.size <= _MOST_NODES
        text = str(bands)
        done = "terraces" in wanted and small
        if bands.may_be_real and wanted == set(KINDS):
            text, done = f"{text}, which may be the terraces of a crystal", False
        where = np.isfinite(heights)
        mends.append(Mend("terraces", bands.levels.size, text, where, done))
        if done:
            drawn = deterrace(mended, bands=bands)
            uncertainty = np.where(where, drawn.uncertainty, np.nan)
            mended = HeightMap(
                np.where(where, drawn.surface.heights, np.nan), surface.spacing,
                periodic=surface.periodic, labels=surface.labels,
            )  # fmt: skip
    if not mends:
        return surface
    for one in mends:
        warn_of(name, one, stacklevel=3)
    return MendedMap(mended, mends=tuple(mends), raw=surface, uncertainty=uncertainty)


def wanted_kinds(kinds: str | Iterable[str]) -> set[str]:
    """Return which kinds are asked for; an unknown one is refused."""
    words = kinds.split(",") if isinstance(kinds, str) else list(kinds)
    chosen = {word.strip().lower() for word in words if word.strip()}
    if chosen == {"all"}:
        return set(KINDS)
    if chosen == {"none"}:
        return set()
    unknown = chosen - set(KINDS)
    if unknown:
        msg = (
            f"mend must be all, none or some of {', '.join(KINDS)}, "
            f"got {', '.join(sorted(unknown))!r}. Give names by commas."
        )
        raise ValueError(msg)
    return chosen


def warn_of(name: str, one: Mend, *, stacklevel: int) -> None:
    """Warn of one kind of fault, of what was done, and of how to have it otherwise."""
    warnings.warn(_sentence(name, one), MendWarning, stacklevel=stacklevel)


def _sentence(name: str, one: Mend) -> str:
    done = {
        "sentinels": "they are taken as missing",
        "lines": "they are taken as missing",
        "offsets": "they are taken off",
        "spikes": "they are taken as missing",
        "terraces": "the surface under them is drawn",
    }[one.kind]
    if not one.mended:
        done = f"left as they are; mend={one.kind!r} mends {one.kind}"
        return f"{name}: {one.text}; {done}."
    return f"{name}: {one.text}; {done} (mend='none' leaves them)."


_Found = tuple[str, int, Array, Array]


def _sentinels(heights: Array) -> _Found | None:
    where, values = find_sentinels(heights)
    count = int(where.sum())
    if not count:
        return None
    named = ", ".join(f"{value:g}" for value in values)
    verb = "is" if count == 1 else "are"
    text = f"{count} of {heights.size} heights {verb} {named}, far from the rest"
    return text, count, where, np.where(where, np.nan, heights)


def _lines(heights: Array) -> _Found | None:
    where = np.zeros(heights.shape, dtype=bool)
    words = []
    for axis, view, across in (("rows", where, heights), ("columns", where.T, heights.T)):
        lost = find_lost_lines(across)
        if lost.size:
            view[:, lost] = True
            shown = ", ".join(str(j + 1) for j in lost[:6])
            more = f" and {lost.size - 6} more" if lost.size > 6 else ""
            words.append(f"{axis} {shown}{more}")
    if not words:
        return None
    text = f"scan lines are lost: {'; '.join(words)}"
    return text, int(where.sum()), where, np.where(where, np.nan, heights)


def _offsets(heights: Array) -> _Found | None:
    for axis, view in (("rows", heights), ("columns", heights.T)):
        offsets = line_offsets(view)
        if offsets is not None:
            size = float(np.std(offsets))
            after = view - offsets
            text = f"{axis} are offset from each other by {size:.3g} um rms"
            level = after if axis == "rows" else after.T
            return text, offsets.size, np.isfinite(heights), level
    return None


def _spikes(heights: Array) -> _Found | None:
    where = find_spikes(heights, in_bands=find_bands(heights) is not None)
    count = int(where.sum())
    if not count:
        return None
    verb = "jumps" if count == 1 else "jump"
    text = f"{count} of {heights.size} heights {verb} from all their neighbours"
    return text, count, where, np.where(where, np.nan, heights)

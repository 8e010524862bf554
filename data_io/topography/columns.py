"""What the columns of a table are: positions, heights, slopes, numbers of rows, others.

It comes from the names over the columns and their units, or from the caller. Nothing is
taken for a height that its header calls something else.
"""

import re
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from data_io.text.text import COMMENT_MARKS, Line, Rows, find_delimiter
from data_io.text.units import (
    axis_units,
    header_units,
    sole_unit,
    unit_kind,
    unit_size,
    warn_missing_unit,
)
from pbrdf.errors import DataFileError
from pbrdf.files.reading import MOST_CELLS

Columns = str | Sequence[str | int]

# Words of column names, in the languages of instruments, by what they say. Earlier rows
# are the stronger: a "slope position" is a slope, a "height error" of a mirror a height.
_WORDS = {
    "other": "sigma std stdev stderr uncertainty intensity intensität intensity counts "
    "quality valid validity flag mask time temperature phase signal voltage current force "
    "confidence weight curvature laser reflectance",
    "slope": "slope slopes gradient neigung steigung pente pendenza inclination dzdx",
    "height": "height heights hoehe höhe hauteur altezza altura elevation depth tiefe "
    "topography sag",
    "position": "position pos distance dist lateral abscissa length weg strecke coordinate "
    "coord location scan",
    "weak height": "profile profil raw surface figure residual deviation relief data value",
    "index": "index idx no nr num number point pt sample row line i n nummer punkt",
}
_ROLES = {
    "other": "other", "slope": "slope", "height": "z", "position": "x",
    "weak height": "z", "index": "index",
}  # fmt: skip
_BRACKETS = re.compile(r"\[([^\]]*)\]|\(([^)]*)\)|<([^>]*)>|\{([^}]*)\}")
_SPLIT = re.compile(r"(?:^|\s)in\s+(\S+)\s*$|/\s*(\S+)\s*$|[_\s]([^\s_]+)\s*$")
_NO_HEIGHTS = re.compile(
    r"\b(slopes?|gradients?|steigung|neigung|intensity|[uµμnm]rad|arcsec)\b", re.IGNORECASE
)
ASK = "Say which columns hold position and height by columns='1,2'."


@dataclass(frozen=True)
class Column:
    """One column of a table.

    Parameters
    ----------
    place : int
        Its place in the table, from 0.
    name : str
        As the header has it.
    role : str
        ``x``, ``y``, ``z``, ``slope``, ``index``, ``other``; empty if the name says none.
    unit : str or None
        As the name has it.
    """

    place: int
    name: str
    role: str
    unit: str | None

    @property
    def kind(self) -> str:
        """What its unit measures: ``length``, ``angle``, ``other``, or nothing."""
        return unit_kind(self.unit) if self.unit else ""


@dataclass(frozen=True)
class ProfileColumns:
    """Where a profile stands in a table: position (None if evenly spaced) and value."""

    position: Column | None
    value: Column

    @property
    def is_slope(self) -> bool:
        """Whether the values are slopes, by their name or by their unit."""
        return self.value.role == "slope" or self.value.kind == "angle"


def describe(place: int, name: str) -> Column:
    """Take a column's name apart into what it is and its unit.

    Examples
    --------
    >>> describe(1, "Residual slope [urad]")
    Column(place=1, name='Residual slope [urad]', role='slope', unit='urad')
    >>> describe(0, "x_mm").role, describe(0, "x_mm").unit, describe(0, "No.").role
    ('x', 'mm', 'index')
    """
    words, unit = _unit(name.strip())
    return Column(place, name.strip(), _role(words, unit), unit)


def _unit(name: str) -> tuple[str, str | None]:
    """Return a name without its unit, and the unit."""
    for found in _BRACKETS.finditer(name):
        text = next(part for part in found.groups() if part is not None).strip()
        rest = name[: found.start()] + " " + name[found.end() :]
        # Square brackets hold units; others may hold a remark
        if unit_kind(text) or (found[0][0] == "[" and text):
            return rest, text
    bare = _BRACKETS.sub(" ", name).strip()
    tail = _SPLIT.search(bare)
    if tail:
        text = next(part for part in tail.groups() if part is not None)
        if unit_kind(text):
            return bare[: tail.start()], text
    if len(bare) > 1 and unit_kind(bare):
        return "", bare
    return bare, None


def _role(words: str, unit: str | None) -> str:
    """Return what a name without its unit says the column is."""
    if re.fullmatch(r"\s*#\s*", words):
        return "index"
    found = re.findall(r"[^\W\d_]+", words.lower().replace("dz/dx", "dzdx"))
    if not found:
        return ""
    for group in ("other", "slope"):
        if set(found) & set(_WORDS[group].split()):
            return _ROLES[group]
    if found[0] in ("x", "y", "z"):
        return found[0]
    for group in ("height", "position", "weak height", "index"):
        if set(found) & set(_WORDS[group].split()):
            role = _ROLES[group]
            # A "point" in millimetres is a place, and no number of a row
            return "x" if role == "index" and unit and unit_kind(unit) else role
    return ""


def table_width(data: Rows) -> int:
    """Return the number of columns without those that are empty in the first rows."""
    delimiter = find_delimiter(data.first)
    rows = [Line(0, text).cells(delimiter) for text in data.texts[:50]]
    width = len(rows[0])
    while width > 1 and all(len(row) < width or not row[width - 1] for row in rows):
        width -= 1
    return width


def name_columns(header: list[Line], data: Rows) -> list[Column] | None:
    """Return the columns as the header names them, or None if it does not.

    A line of units under a line of names belongs to the names. Names may be separated
    otherwise than the numbers under them.
    """
    width = table_width(data)
    if width > MOST_CELLS:
        # A map; so many columns have no names
        return None
    delimiter = find_delimiter(data.first)
    for i in range(len(header) - 1, max(len(header) - 9, -1), -1):
        names = _names(header[i].text, width, delimiter)
        if names is None:
            continue
        columns = [describe(place, name) for place, name in enumerate(names)]
        if i > 0 and not any(c.role for c in columns) and all(c.unit for c in columns):
            above = _names(header[i - 1].text, width, delimiter)
            if above is not None:
                pairs = zip(above, columns, strict=True)
                return [describe(c.place, f"{name} [{c.unit}]") for name, c in pairs]
        own = not header[i].text.lstrip().startswith(COMMENT_MARKS)
        if any(c.role or c.unit for c in columns) or (own and i == len(header) - 1):
            return columns
    return None


def _names(text: str, width: int, delimiter: str | None) -> list[str] | None:
    """Split a line of the header into as many names as there are columns."""
    text = text.strip().lstrip("".join(COMMENT_MARKS)).strip()
    text = re.sub(r"^columns?\s*:\s*", "", text, flags=re.IGNORECASE)
    if not re.search(r"[^\W\d_]", text):
        return None
    ways = [delimiter, "\t", ";", ","] if delimiter else ["\t", ";", ","]
    for mark in dict.fromkeys([*ways, None]):
        if mark is not None:
            cells = _split_outside(re.escape(mark), text)
        else:
            cells = _split_outside(r"\s{2,}", text)
            if len(cells) != width:
                cells = _words_with_units(text)
        cells = [cell.strip() for cell in cells]
        while len(cells) > width and not cells[-1]:
            cells.pop()
        if len(cells) == width and (width > 1 or _is_name(cells[0])):
            return cells
    return None


def _split_outside(mark: str, text: str) -> list[str]:
    """Split at a mark unless the next bracket after it closes one, in linear time."""
    brackets = [found.start() for found in re.finditer(r"[\[\]()]", text)]
    cells, start = [], 0
    for found in re.finditer(mark, text):
        following = bisect_left(brackets, found.end())
        if following < len(brackets) and text[brackets[following]] in ")]":
            continue
        cells.append(text[start : found.start()])
        start = found.end()
    return [*cells, text[start:]]


def _is_name(text: str) -> bool:
    """Whether a line over a single column is its name, and not a remark or a setting."""
    column = describe(0, text)
    return column.role in ("z", "slope") and not re.search(r"[=:]", text)


def _words_with_units(text: str) -> list[str]:
    """Split at spaces, but leave "z [nm]", "X mm" and "slope in urad" together."""
    words = re.findall(r"(?:[\[(][^\])]*[\])]|[^\s\[(])+", text)
    joined: list[str] = []
    for word in words:
        unit = word.strip("[](),")
        bracketed = word[0] in "[("
        if joined and (bracketed or word in ("in", "/") or unit_kind(unit)):
            joined[-1] += f" {word}"
        else:
            joined.append(word)
    return joined


def profile_columns(
    path: str | Path,
    header: list[Line],
    data: Rows,
    asked: Columns | None,
    *,
    unit_given: bool,
) -> ProfileColumns:
    """Find the columns of a profile by their names and units, or take those asked for.

    Raises
    ------
    DataFileError
        If the names do not say which columns hold the profile, or say that there is none.
    """
    columns = name_columns(header, data)
    width = table_width(data)
    if asked is not None:
        chosen = asked_columns(path, asked, columns, width)
        if len(chosen) > 2:
            problem = f"expected one or two columns for a profile, got {len(chosen)}"
            raise DataFileError(path, problem, ASK)
        value = chosen[-1]
        return ProfileColumns(chosen[0] if len(chosen) == 2 else None, value)
    line = header[-1].number if header else None
    if columns is None:
        said = next((m for h in header if (m := _NO_HEIGHTS.search(h.text))), None)
        if said and not unit_given:
            problem = f"expected columns with names, the header speaks of {said[0]!r} only"
            cure = "Head the columns, or say: columns='1,2' unit=('mm', 'urad')."
            raise DataFileError(path, problem, cure, line=line)
        plain = [Column(i, "", "", None) for i in range(width)]
        if width == 1:
            return ProfileColumns(None, plain[0])
        if width == 2:
            return ProfileColumns(plain[0], plain[1])
        problem = f"expected two columns, x and z, got {width} without names"
        cure = (
            "Head them x and z, or name them by columns=; commas separate columns, "
            "not decimals."
        )
        raise DataFileError(path, problem, cure, line=data.numbers[0])
    return _named(path, columns, line)


def _named(path: str | Path, columns: list[Column], line: int | None) -> ProfileColumns:
    """Choose position and value among columns with names."""
    kept = [c for c in columns if c.role not in ("index", "other")]
    heights = [c for c in kept if c.role == "z"]
    slopes = [c for c in kept if c.role == "slope"]
    sides = {axis: [c for c in kept if c.role == axis] for axis in ("x", "y")}
    if not heights and not slopes and sides["x"] and sides["y"]:
        heights, sides["y"] = sides["y"], []
    positions = sides["x"] or sides["y"]
    nameless = [c for c in kept if not c.role]
    if len(columns) == 2 and not slopes:
        # One name says what the other must be, unless its unit says otherwise
        if not heights and positions and len(nameless) == 1 and nameless[0].unit:
            heights = nameless
        elif heights and not positions and nameless:
            positions = nameless
        elif len(nameless) == 2 and all(c.unit for c in nameless):
            positions, heights = nameless[:1], nameless[1:]
    values = heights or slopes
    for axis, found in (("x", positions), ("z", values)):
        if len(found) > 1:
            named = ", ".join(f"{c.name!r} ({c.place + 1})" for c in found)
            problem = f"expected one column {axis}, found {len(found)}: {named}"
            raise DataFileError(
                path, problem, "Choose by columns=, or remove the others.",
                line=line, column=axis,
            )  # fmt: skip
    if not values:
        named = ", ".join(repr(c.name) for c in columns)
        problem = f"expected a column of heights or slopes, the header names {named}"
        raise DataFileError(path, problem, ASK, line=line)
    chosen = ProfileColumns(positions[0] if positions else None, values[0])
    if chosen.position is None and any(c.role not in ("index", "z") for c in columns):
        named = ", ".join(repr(c.name) for c in columns)
        problem = f"expected a column of positions, the header names {named}"
        raise DataFileError(path, problem, ASK, line=line)
    _check_units(path, chosen, line)
    return chosen


def _check_units(path: str | Path, chosen: ProfileColumns, line: int | None) -> None:
    """Refuse units that contradict what the names say."""
    wanted = {"slope": ("angle", "a unit of angle, such as urad")}
    length = ("length", "a length unit")
    pairs = [(chosen.value, wanted.get(chosen.value.role, length))]
    if chosen.position is not None:
        pairs.insert(0, (chosen.position, length))
    for column, (kind, words) in pairs:
        angles = column is chosen.value and column.role != "z" and column.kind == "angle"
        if column.unit and column.kind != kind and not angles:
            problem = f"expected {words}, got {column.unit!r}"
            cure = "Convert the column and head it with its unit, or choose by columns=."
            raise DataFileError(path, problem, cure, line=line, column=column.name)


def asked_columns(
    path: str | Path, asked: Columns, columns: list[Column] | None, width: int
) -> list[Column]:
    """Return the columns asked for by number, from 1, or by name.

    Raises
    ------
    DataFileError
        If the table has no such column.
    """
    wanted = asked.split(",") if isinstance(asked, str) else list(asked)
    plain = columns or [Column(i, "", "", None) for i in range(width)]
    found = []
    for word in wanted:
        text = str(word).strip()
        named = [c for c in plain if c.name.lower() == text.lower()]
        if not named and text.isdigit() and 1 <= int(text) <= width:
            named = [plain[int(text) - 1]]
        if len(named) != 1:
            known = ", ".join(f"{c.place + 1} {c.name!r}".strip() for c in plain)
            problem = f"expected a column of the table, got {text!r}"
            raise DataFileError(path, problem, f"It has {known}.")
        found.append(named[0])
    return found


def stated_units(path: str | Path, header: list[Line]) -> tuple[str | None, str | None]:
    """Return the length units of x and z that lines of the header name in words."""
    texts = [line.text for line in header]
    by_axis = axis_units(texts)
    if by_axis:
        return by_axis.get("x"), by_axis.get("z", by_axis.get("y"))
    for text in reversed(texts):
        units = header_units(text)
        if len(units) == 2:
            return units[0], units[1]
    common = sole_unit(path, texts)
    return common, common


def column_sizes(
    path: str | Path,
    header: list[Line],
    unit: str | tuple[str, str] | None,
    chosen: ProfileColumns,
) -> tuple[float, float, bool]:
    """Return the size of the units of x [um] and of z [um] or slope [rad], and which.

    Raises
    ------
    DataFileError
        If a unit is missing, or contradicts the one given.
    """
    line = header[-1].number if header else None
    position, value = chosen.position, chosen.value
    named = (position.unit if position else None, value.unit)
    if not any(named):
        named = stated_units(path, header)
    pair = named if unit is None else _given_units(path, unit, named, line)
    is_slope = value.role == "slope" or unit_kind(pair[1] or "") == "angle"
    _check_kinds(path, pair, value, is_slope=is_slope, line=line)
    missing = [name is None for name in pair]
    if position is None:
        missing = missing[1:]
    if any(missing) and not all(missing):
        problem = f"expected a unit for both columns, the header names {pair[0] or pair[1]}"
        cure = "Head the columns, for example x_mm,z_um, or give unit=('mm', 'um')."
        raise DataFileError(path, problem, cure, line=line)
    if all(missing):
        warn_missing_unit(path, stacklevel=6)
    return unit_size(pair[0] or "um"), unit_size(pair[1] or "um"), is_slope


def _given_units(
    path: str | Path,
    unit: str | tuple[str, str],
    named: tuple[str | None, str | None],
    line: int | None,
) -> tuple[str, str]:
    """Return the units that the caller gave, which may not contradict the header."""
    pair = (unit, unit) if isinstance(unit, str) else unit
    for stated, wanted in zip(named, pair, strict=True):
        if unit_size(wanted) and stated and unit_size(stated) != unit_size(wanted):
            words = ", ".join(name or "none" for name in named)
            problem = f"expected the unit given, {unit}, the header says {words}"
            cure = "Leave the argument out or mend the header."
            raise DataFileError(path, problem, cure, line=line)
    return pair


def _check_kinds(
    path: str | Path,
    pair: tuple[str | None, str | None],
    value: Column,
    *,
    is_slope: bool,
    line: int | None,
) -> None:
    """Refuse positions in radians, slopes in micrometres, heights in radians."""
    if unit_kind(pair[0] or "") == "angle":
        problem = f"expected positions in a length unit, got {pair[0]!r}"
        raise DataFileError(path, problem, ASK, line=line)
    angle = unit_kind(pair[1] or "") == "angle"
    if is_slope and not angle:
        problem = f"expected slopes in a unit of angle, got {pair[1] or 'none'}"
        cure = "Head the column, for example slope_urad, or give unit=('mm', 'urad')."
        raise DataFileError(path, problem, cure, line=line, column=value.name)
    if value.role == "z" and angle:
        problem = f"expected heights in a length unit, got {pair[1]!r}"
        raise DataFileError(path, problem, ASK, line=line, column=value.name)

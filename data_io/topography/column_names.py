"""What the header of a table calls its columns: names, roles and units.

Nothing is taken for a height that its header calls something else.
"""

import re
from bisect import bisect_left
from dataclasses import dataclass

from data_io.text.text import COMMENT_MARKS, LONGEST_NAME, Line, Rows, find_delimiter
from data_io.text.units import unit_kind
from pbrdf.files.reading import MOST_CELLS

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

_SETTING = re.compile(
    r"\b(?:step|spacing|pitch|sampling)\b[^,;\t]*?\b\d[\d.]*\s*[a-zµμ]+\b", re.IGNORECASE
)


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


def describe(place: int, name: str) -> Column:
    """Take a column's name apart into what it is and its unit.

    Examples
    --------
    >>> describe(1, "Residual slope [urad]")
    Column(place=1, name='Residual slope [urad]', role='slope', unit='urad')
    >>> describe(0, "x_mm").role, describe(0, "x_mm").unit, describe(0, "No.").role
    ('x', 'mm', 'index')
    """
    if len(name) > LONGEST_NAME:
        return Column(place, name.strip(), "", None)
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
    # A remark with a setting: "height in nm, step 1 um"
    if not re.search(r"[^\W\d_]", text) or _SETTING.search(text):
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

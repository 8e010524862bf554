"""Blocks of columns in a text file of optical constants."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from pbrdf.errors import DataFileError
from pbrdf.optics.published.columns import Column, column_of, unit_of
from pbrdf.optics.published.definitions import (
    is_unit_of_number,
    refuse_attenuation_index,
    refuse_units,
    with_unit,
)
from pbrdf.optics.published.text import Line, cells_of, number, separator_of

__all__ = ["Block", "read_blocks"]

_COMMENT = ("#", "%", ";", "!", "//")
_CURE = (
    "Known: wavelength_nm, wavelength_um, energy_ev or wavenumber_cm-1; n; kappa, k or "
    "extinction; eps1, eps2; diffuse_albedo. Rename what has another name; leave the rest "
    "out, --material-ignore NAME, ignore=['NAME'], or ignore = ['NAME'] in a scene. "
    "Remarks begin with #."
)
# First line of a spreadsheet's export
_SEPARATOR = re.compile(r'"?sep=.?"?', re.IGNORECASE)
# What a column holds that is left out
IGNORED = "ignored"
# Third line of the text format of ellipsometry programs
_KINDS = {"nk": ("n", "kappa"), "e1e2": ("eps1", "eps2"), "eps": ("eps1", "eps2"),
          "n&k": ("n", "kappa"), "e1&e2": ("eps1", "eps2")}  # fmt: skip


@dataclass
class Block:
    """Rows of numbers under one header, and the cells of columns that are left out."""

    columns: list[Column]
    lines: list[int] = field(default_factory=list)
    rows: list[list[float]] = field(default_factory=list)
    left_out: dict[str, list[str]] = field(default_factory=dict)

    def values(self, role: str) -> list[float] | None:
        """Return a column by what it means, or None."""
        for k, column in enumerate(self.columns):
            if column.role == role:
                return [row[k] for row in self.rows]
        return None

    def column(self, role: str) -> Column:
        """Return the column of that meaning."""
        return next(column for column in self.columns if column.role == role)


def read_blocks(path: Path, text: str, ignore: Sequence[str] = ()) -> list[Block]:
    """Read every table of a file: a header with names of columns, and rows under it.

    Columns whose names are in `ignore` are left out.

    Raises
    ------
    DataFileError
        With all unknown columns at once, or the first cell that is no number.
    """
    lines = [Line(k, s.strip()) for k, s in enumerate(text.split("\n"), start=1)]
    # Spreadsheets leave rows of separators
    lines = [line for line in lines if line.text.strip(",;\t ")]
    if lines and _SEPARATOR.fullmatch(lines[0].text):
        lines = lines[1:]
    content = [line for line in lines if not line.text.startswith(_COMMENT)]
    comments = [line for line in lines if line.text.startswith(_COMMENT)]
    if not content:
        problem, cure = "expected a table, got none", "Give wavelength_um,n,kappa."
        raise DataFileError(path, problem, cure)
    ellipsometry = _ellipsometry(content)
    nameless = path.suffix.lower() == ".nk" and _is_row(content[0])
    if ignore and (ellipsometry or nameless):
        problem = f"expected no columns to leave out, got {', '.join(map(repr, ignore))}"
        raise DataFileError(path, problem, "The columns of this format have no names.")
    if ellipsometry:
        columns, rows = ellipsometry
        return [_rows(path, Block(columns), rows)]
    if nameless:
        return [_rows(path, Block(_nk_columns(path, comments)), content)]
    blocks = _headed(path, content, comments, ignore)
    if any(column.role == "kappa" for block in blocks for column in block.columns):
        refuse_attenuation_index(path, comments)
    names = {_bare(column.name) for block in blocks for column in block.columns}
    absent = [name for name in ignore if name not in names]
    if absent:
        problem = f"expected the columns {', '.join(map(repr, absent))}, found none"
        raise DataFileError(path, problem, f"The file has {', '.join(sorted(names))}.")
    return blocks


def _bare(name: str) -> str:
    """Return a name without the unit that a row below it gave."""
    return re.sub(r"\s*\[[^\[\]]*\]$", "", name) or name


def _headed(
    path: Path, content: Sequence[Line], comments: Sequence[Line], ignore: Sequence[str]
) -> list[Block]:
    """Read blocks that begin with the names of their columns."""
    blocks: list[Block] = []
    starts = [k for k, line in enumerate(content) if not _is_row(line)]
    if not starts or starts[0] > 0:
        # The names may stand in the last comment above the rows
        above = [line for line in comments if line.number < content[0].number]
        header = above[-1:] and Line(above[-1].number, above[-1].text.lstrip("#%;!/ \t"))
        if not header or _unknown(header, ignore):
            first = content[0].text[:40]
            problem = f"expected the names of the columns above the numbers, got {first!r}"
            raise DataFileError(path, problem, _CURE, line=content[0].number)
        content = [header, *content]
        starts = [0, *(k + 1 for k in starts)]
    k = 0
    while k < len(content):
        header, units = content[k], None
        following = content[k + 1] if k + 1 < len(content) else None
        if following is not None and not _is_row(following) and _is_units(following):
            units, k = following, k + 1
        end = next((s for s in starts if s > k), len(content))
        columns = _columns(path, header, units, ignore)
        blocks.append(_rows(path, Block(columns), content[k + 1 : end], header))
        k = end
    return blocks


def _is_row(line: Line) -> bool:
    """Tell whether a line holds numbers: its first cell, or most of them."""
    cells = [cell for cell in cells_of(line.text, separator_of(line.text)) if cell]
    numbers = [number(cell) is not None for cell in cells]
    named = cells[:1] and (unit_of(cells[0]) or column_of(cells[0]))
    return any(numbers[:1]) or (2 * sum(numbers) > len(numbers) and not named)


def _is_units(line: Line) -> bool:
    """Tell whether a line names the units of the columns above it."""
    cells = cells_of(line.text, separator_of(line.text))
    units = [bool(unit_of(cell)) or is_unit_of_number(cell) for cell in cells]
    return (any(units) or {*cells} <= {"", "-", "1"}) and all(
        unit or cell == "1" or (number(cell) is None and column_of(cell) is None)
        for cell, unit in zip(cells, units, strict=True)
    )


def _unknown(header: Line, ignore: Sequence[str]) -> list[str]:
    cells = cells_of(header.text, separator_of(header.text))
    return [cell for cell in cells if column_of(cell) is None and _bare(cell) not in ignore]


def _columns(
    path: Path, header: Line, units: Line | None, ignore: Sequence[str]
) -> list[Column]:
    """Return what the columns mean; each is known, and one is the wavelength."""
    cells = cells_of(header.text, separator_of(header.text))
    while len(cells) > 1 and not cells[-1]:
        cells = cells[:-1]
    if units is not None:
        below = cells_of(units.text, separator_of(units.text))
        below += [""] * (len(cells) - len(below))
        refuse_units(
            path, [c if _bare(c) not in ignore else "" for c in cells], units, below
        )
        pairs = zip(cells, below, strict=False)
        cells = [with_unit(name, unit) for name, unit in pairs]
    found = [
        # A first column without a name counts the rows, as in tables of pandas
        Column(cell, IGNORED)
        if {cell, _bare(cell)} & {*ignore} or (not cell and k == 0)
        else column_of(cell)
        for k, cell in enumerate(cells)
    ]
    unknown = [cell for cell, column in zip(cells, found, strict=True) if column is None]
    if unknown:
        problem = f"expected known columns, got {', '.join(map(repr, unknown))}"
        raise DataFileError(path, problem, _CURE, line=header.number)
    columns = [column for column in found if column is not None]
    roles = [column.role for column in columns]
    for role in dict.fromkeys(role for role in roles if role != IGNORED):
        if roles.count(role) > 1:
            names = ", ".join(c.name for c in columns if c.role == role)
            problem = f"expected one column of {role}, got {names}"
            cure = "Keep one of them."
            raise DataFileError(path, problem, cure, line=header.number)
    if "wavelength" not in roles or not set(roles) - {"wavelength", "eps2", IGNORED}:
        names = ", ".join(column.name for column in columns)
        problem = f"expected the columns wavelength_um and n, got {names}"
        cure = "Name them in the first row."
        raise DataFileError(path, problem, cure, line=header.number)
    spectral = columns[roles.index("wavelength")]
    if spectral.unit is None:
        problem = "expected the unit of the wavelengths, got none"
        cure = "Head the column wavelength_nm, wavelength_um, energy_ev or wavenumber_cm-1."
        raise DataFileError(path, problem, cure, line=header.number, column=spectral.name)
    return columns


def _rows(
    path: Path, block: Block, content: Sequence[Line], header: Line | None = None
) -> Block:
    """Fill a block with the numbers of its lines."""
    for line in content:
        separator = separator_of(line.text)
        if header is not None and separator is None and "," in header.text:
            separator = separator_of(header.text)
        cells = cells_of(line.text, separator)
        extra = [cell for cell in cells[len(block.columns) :] if cell]
        if extra:
            problem = (
                f"expected {len(block.columns)} cells as in the header, got {len(cells)}"
            )
            cure = (
                "Name every column; decimals with commas need semicolons between columns."
            )
            raise DataFileError(path, problem, cure, line=line.number)
        row = []
        for k, column in enumerate(block.columns):
            cell = cells[k] if k < len(cells) else ""
            if column.role == IGNORED:
                row.append(float("nan"))
                block.left_out.setdefault(column.name, []).append(cell)
                continue
            value = number(cell)
            if value is None or not _allowed(column.role, value):
                problem = f"expected a finite number >= 0, got {cell!r}"
                cure = _cure_of(cell, value)
                if column.role == "eps1":
                    problem = f"expected a finite number, got {cell!r}"
                raise DataFileError(
                    path, problem, cure, line=line.number, column=column.name
                )
            row.append(value)
        block.rows.append(row)
        block.lines.append(line.number)
    if not block.rows:
        problem = "expected rows of numbers, got none"
        cure = "The file is truncated, or units stand behind its numbers."
        raise DataFileError(path, problem, cure)
    return block


def _cure_of(cell: str, value: float | None) -> str:
    """Return what to do about a cell that is no constant."""
    if value is not None and value < 0.0:
        return (
            "The index is n + i kappa with kappa >= 0 absorbing: of n - i k, and of eps1 - "
            "i eps2, write the second without its sign."
        )
    if re.search(r"\d\s*\*?\s*[ij]\)?$", cell):
        return "Give the real and the imaginary part of a complex number a column each."
    return "Leave rows with a gap out, or give each constant a table of its own."


def _allowed(role: str, value: float) -> bool:
    low = float("-inf") if role == "eps1" else 0.0
    return low <= value < float("inf") and abs(value) < float("inf")


def _ellipsometry(content: Sequence[Line]) -> tuple[list[Column], Sequence[Line]] | None:
    """Return columns and rows of the format of ellipsometry programs, or None.

    A comment, the spectral unit, what the columns are (NK), and rows without names.
    """
    for k in range(min(3, len(content) - 1)):
        unit = unit_of(content[k].text)
        kind = _KINDS.get(re.sub(r"[\s,]+", "", content[k + 1].text.lower()))
        if unit and kind:
            first = Column(content[k].text, "wavelength", unit)
            return [first, *(Column(role, role) for role in kind)], content[k + 2 :]
    return None


def _nk_columns(path: Path, comments: Sequence[Line]) -> list[Column]:
    """Return the columns of an .nk file: wavelength or energy, n, k.

    Its comments name the unit; "A" is one in brackets only, and one behind a number is that
    of a thickness or of a gap.
    """
    text = " ".join(comment.text for comment in comments)
    text = re.sub(r"\d[\d.]*(?:[eE][-+]?\d+)?\s*[^\W\d_]+", " ", text)
    words = re.findall(r"[(\[]\s*([^()\[\]]+?)\s*[)\]]", text)
    words += [word for word in re.split(r"[\s,;:()\[\]]+", text) if len(word) > 1]
    found = {unit for word in words if (unit := unit_of(word))}
    if len(found) != 1:
        got = ", ".join(sorted(found)) or "none"
        problem = f"expected one unit of the first column in a comment, got {got}"
        cure = "Add a line such as '; nm', '; angstrom' or '; eV'."
        raise DataFileError(path, problem, cure)
    return [
        Column("wavelength", "wavelength", found.pop()),
        Column("n", "n"),
        Column("k", "kappa"),
    ]

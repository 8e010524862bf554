"""The project's own goniometer CSV: columns by name, units in the names."""

import difflib
import re
from pathlib import Path

import numpy as np
import xarray as xr

from data_io.goniometer.scan import CONVENTIONS, QUANTITIES, STDERR, Scan
from data_io.text.text import Line, is_comment, is_number
from data_io.text.write import complete_file
from pbrdf.errors import DataFileError

GEOMETRY = ("theta_i_deg", "theta_s_deg", "dphi_deg", "theta_view_deg")
OPTIONAL = ("phi_i_deg", "source_half_angle_deg", "detector_half_angle_deg")
WAVELENGTHS = {"wavelength_um": 1.0, "wavelength_nm": 1e-3}
KNOWN = (
    *GEOMETRY,
    *OPTIONAL,
    *WAVELENGTHS,
    *QUANTITIES,
    *(name + STDERR for name in QUANTITIES),
)
_VALUE_NAMES = set(KNOWN) - set(GEOMETRY) - set(OPTIONAL) - set(WAVELENGTHS)
_QUANTITY = re.compile(r"quantity\s*[:=]\s*(\S+)")

# What `write` notes in the file, and `read` need not keep;
NOTES = (
    "Angles in degrees, dphi = phi_s - phi_i, specular at dphi = 180",
    *CONVENTIONS.split(". ")[1:],
)

_COLUMNS_CURE = (
    "Columns: theta_i_deg; theta_view_deg or theta_s_deg and dphi_deg; M00..M33, DOLP; "
    "m01..m33 (divided by M00), I_s, I_p; <name>_stderr; wavelength_um; phi_i_deg; "
    "source_half_angle_deg, detector_half_angle_deg."
)


def looks_like(header: Line) -> bool:
    """Tell whether a header line names any of the columns."""
    cells = {cell.strip() for mark in ",;\t" for cell in header.text.split(mark)}
    return bool(cells & set(KNOWN)) or bool(set(header.text.split()) & set(KNOWN))


def read(path: Path, lines: list[Line]) -> Scan:
    """Read the rows of a CSV; the header is the first line that is no comment."""
    content = [line for line in lines if line.text.strip() and not is_comment(line)]
    comments = [line.text.strip().lstrip("#% ") for line in lines if is_comment(line)]
    names = _column_names(path, content[0])
    if len(content) < 2:
        problem = "expected rows below the header, found none"
        raise DataFileError(path, problem, "The file is truncated.", line=content[0].number)
    table = _table(path, names, content[1:])
    numbers = [line.number for line in content[1:]]
    columns = {name: table[:, i] for i, name in enumerate(names)}
    for name in (*GEOMETRY, *OPTIONAL, *WAVELENGTHS):
        if name in columns and np.isnan(columns[name]).any():
            row = int(np.argmax(np.isnan(columns[name])))
            problem = "expected a number in every row, got an empty cell or nan"
            cure = "Only measured values may be left empty."
            raise DataFileError(path, problem, cure, line=numbers[row], column=name)
    theta_s, dphi, view_name = _view(path, columns, numbers)
    wavelength = next((name for name in WAVELENGTHS if name in columns), None)
    # The notes that `write` adds need not pile up
    kept = [
        text
        for text in comments
        if text and not _noted(text) and not _QUANTITY.fullmatch(text)
    ]
    return Scan(
        path=path,
        lines=numbers,
        theta_i=columns["theta_i_deg"],
        theta_s=theta_s,
        dphi=dphi,
        values={name: columns[name] for name in names if name in _VALUE_NAMES},
        wavelength=None
        if wavelength is None
        else columns[wavelength] * WAVELENGTHS[wavelength],
        phi_i=columns.get("phi_i_deg"),
        source_half_angle=columns.get("source_half_angle_deg"),
        detector_half_angle=columns.get("detector_half_angle_deg"),
        quantity=_quantity(path, comments),
        names={
            "theta_i": "theta_i_deg",
            "theta_s": view_name,
            "dphi": "dphi_deg",
            "wavelength": wavelength or "",
            **{name.removesuffix("_deg"): name for name in OPTIONAL},
        },
        attrs={
            "format": "csv",
            "title": kept[0] if kept else "",
            "comments": "\n".join(kept),
        },
    )


def _noted(text: str) -> bool:
    """Tell whether a comment is one that `write` adds, now or in earlier versions."""
    return text in NOTES or text.startswith(("Angles in rad, dphi", "M in 1/sr without"))


def _quantity(path: Path, comments: list[str]) -> str:
    """Return what a comment such as "quantity: relative" declares."""
    found = [match[1] for text in comments if (match := _QUANTITY.fullmatch(text))]
    if found and found[0] not in ("brdf", "relative"):
        problem = f"expected 'quantity: brdf' or 'quantity: relative', got {found[0]!r}"
        raise DataFileError(path, problem, "Mend the comment.")
    return found[0] if found else "brdf"


def _column_names(path: Path, header: Line) -> list[str]:
    """Return the column names; each is known, none is missing, repeated or at odds."""
    if "," not in header.text:
        mark = next((m for m in (";", "\t", " ") if m in header.text.strip()), None)
        if mark is not None:
            problem = f"expected columns separated by commas, got {mark!r}"
            cure = "Write commas between columns and points in decimals."
            raise DataFileError(path, problem, cure, line=header.number)
    names = _cells(header)
    for name in names:
        if name not in KNOWN:
            close = difflib.get_close_matches(name, KNOWN, n=1)
            cure = f"Did you mean {close[0]}? " if close else ""
            problem = f"expected a known column, got {name!r}"
            if is_number(name):
                problem = f"expected a header line with column names, got {name!r}"
            raise DataFileError(path, problem, cure + _COLUMNS_CURE, line=header.number)
        if names.count(name) > 1:
            problem = f"expected one column of this name, found {names.count(name)}"
            cure = "Remove the others."
            raise DataFileError(path, problem, cure, line=header.number, column=name)
    _require_columns(path, set(names), header.number)
    return names


def _cells(line: Line) -> list[str]:
    """Return the cells of a line, without the quotes that spreadsheets put round them."""
    return [re.sub(r'^"(.*)"$', r"\1", cell).strip() for cell in line.cells(",")]


def _require_columns(path: Path, names: set[str], line: int) -> None:
    """Refuse a header that lacks a column, or has two that may contradict each other."""
    needed = ["theta_i_deg"]
    # The signed view angle stands for both others, but half a pair stands for nothing
    if "theta_view_deg" not in names or names & {"theta_s_deg", "dphi_deg"}:
        needed += ["theta_s_deg", "dphi_deg"]
    if not names & _VALUE_NAMES:
        needed.append("M00")
    for column in needed:
        if column not in names:
            problem = "expected this column, found none"
            raise DataFileError(path, problem, _COLUMNS_CURE, line=line, column=column)
    if set(WAVELENGTHS) <= names:
        problem, cure = (
            "expected one wavelength column, found wavelength_um too",
            "Remove one.",
        )
        raise DataFileError(path, problem, cure, line=line, column="wavelength_nm")


def _table(path: Path, names: list[str], rows: list[Line]) -> np.ndarray:
    """Return the numbers of all rows, NaN where a cell is empty; shape (rows, columns)."""
    table = np.full((len(rows), len(names)), np.nan)
    for i, line in enumerate(rows):
        cells = _cells(line)
        if len(cells) != len(names):
            problem = f"expected {len(names)} cells as in the header, got {len(cells)}"
            cure = "The row is truncated, has extra cells, or decimals have commas."
            raise DataFileError(path, problem, cure, line=line.number)
        for j, text in enumerate(cells):
            if not text:
                continue
            if not is_number(text):
                problem = f"expected a number, got {text!r}"
                cure = "Leave gaps empty."
                raise DataFileError(path, problem, cure, line=line.number, column=names[j])
            table[i, j] = float(text)
    return table


def _view(
    path: Path, columns: dict[str, np.ndarray], numbers: list[int]
) -> tuple[np.ndarray, np.ndarray, str]:
    """Return theta_s, dphi [deg] and the name of the column they came from.

    The signed view angle is positive on the forward side, where dphi is 180 degrees.
    """
    view = columns.get("theta_view_deg")
    if view is None:
        return columns["theta_s_deg"], columns["dphi_deg"], "theta_s_deg"
    theta_s, dphi = np.abs(view), np.where(view >= 0, 180.0, 0.0)
    if "theta_s_deg" in columns:
        turn = np.mod(columns["dphi_deg"] - dphi + 180.0, 360.0) - 180.0
        # At the normal every azimuth is right
        at_odds = (np.abs(columns["theta_s_deg"] - theta_s) > 1e-3) | (
            (np.abs(turn) > 1e-3) & (theta_s > 1e-3)
        )
        if at_odds.any():
            row = int(np.argmax(at_odds))
            problem = (
                f"expected the direction theta_s_deg = {columns['theta_s_deg'][row]:.6g}, "
                f"dphi_deg = {columns['dphi_deg'][row]:.6g}, got {view[row]:.6g}"
            )
            cure = "Keep theta_view_deg, or theta_s_deg with dphi_deg."
            raise DataFileError(
                path, problem, cure, line=numbers[row], column="theta_view_deg"
            )
        return columns["theta_s_deg"], columns["dphi_deg"], "theta_s_deg"
    return theta_s, dphi, "theta_view_deg"


def write(dataset: xr.Dataset, path: str | Path) -> None:
    """Write a goniometer dataset; see `data_io.write_goniometer`."""
    columns = {
        f"{name}_deg": degrees(dataset[name]) for name in ("theta_i", "theta_s", "dphi")
    }
    shape = columns["dphi_deg"].shape
    for name in OPTIONAL:
        angle = name.removesuffix("_deg")
        if angle in dataset.variables:
            columns[name] = np.broadcast_to(degrees(dataset[angle]), shape)
    if "wavelength" in dataset.coords:
        columns["wavelength_um"] = np.broadcast_to(dataset["wavelength"].to_numpy(), shape)
    columns |= {name: dataset[name].to_numpy() for name in KNOWN if name in dataset}
    comments = [*str(dataset.attrs.get("comments", "")).splitlines(), *NOTES]
    if dataset.attrs.get("quantity", "brdf") != "brdf":
        comments.append(f"quantity: {dataset.attrs['quantity']}")
    with complete_file(path) as temporary, temporary.open("w", encoding="utf-8") as stream:
        stream.writelines(f"# {text}\n" for text in comments)
        stream.write(",".join(columns) + "\n")
        for row in zip(*(values.tolist() for values in columns.values()), strict=True):
            # repr keeps every digit; an empty cell is what was not measured
            stream.write(",".join("" if x != x else repr(x) for x in row) + "\n")


def degrees(angle: xr.DataArray) -> np.ndarray:
    """Return an angle in degrees, without the last digits that radians put there.

    29.999999999999996 becomes 30: both are the same angle in radians, to rounding.

    Examples
    --------
    >>> degrees(xr.DataArray(np.radians([30.0, 41.4]))).tolist()
    [30.0, 41.4]
    """
    radians = angle.to_numpy()
    exact = np.degrees(radians)
    short = np.round(exact, 10)
    same = np.abs(np.radians(short) - radians) <= np.spacing(np.abs(radians))
    return np.where(same, short, exact)

"""Optical constants from CSV tables, the library's own and the user's."""

import csv
from importlib.resources.abc import Traversable
from pathlib import Path

from pbrdf.errors import DataFileError
from pbrdf.optics.materials import Material

__all__ = ["material_from_csv"]

UNITS = {"wavelength_um": 1.0, "wavelength_nm": 1e-3}


def material_from_csv(path: str | Path | Traversable) -> Material:
    r"""Material from a CSV table; the file name is its name.

    Parameters
    ----------
    path : str or Path
        File with the columns wavelength_um (or wavelength_nm), n and, if it absorbs, kappa.
        Lines that start with # are comments; one that starts "# source:" is kept.

    Raises
    ------
    DataFileError
        If a column is missing or a value is no number, negative or out of order; the
        message names line and column.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "paint.csv"
    >>> _ = path.write_text("wavelength_nm,n,kappa\n400,1.6,0.1\n800,1.5,0.2\n")
    >>> material_from_csv(path).index(0.6)
    (1.55, 0.15)
    """
    file = Path(path) if isinstance(path, str) else path
    shown = file if isinstance(file, Path) else Path(file.name)
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        problem = f"cannot be read as text ({type(error).__name__})"
        raise DataFileError(shown, problem, "Pass a CSV file.") from error
    source = next((s[9:].strip() for s in lines if s.startswith("# source:")), None)
    rows = [(k + 1, s) for k, s in enumerate(lines) if s.strip() and not s.startswith("#")]
    if not rows:
        raise DataFileError(
            shown, "expected a table, got none", "Give wavelength_um,n,kappa."
        )
    numbers = [row[0] for row in rows[1:]]
    header, *cells = csv.reader(text for _, text in rows)
    columns = {name.strip(): k for k, name in enumerate(header)}
    unit = next((name for name in UNITS if name in columns), None)
    if unit is None or "n" not in columns:
        problem = f"expected the columns wavelength_um and n, got {', '.join(columns)}"
        raise DataFileError(shown, problem, "Name them in the first row.", line=rows[0][0])
    wanted = [name for name in (unit, "n", "kappa") if name in columns]
    table: dict[str, list[float]] = {name: [] for name in wanted}
    for line, row in zip(numbers, cells, strict=True):
        for name in wanted:
            table[name].append(_number(shown, line, name, row, columns[name]))
    _check_rising(shown, numbers, unit, table[unit])
    try:
        return Material.from_table(
            wavelength=[UNITS[unit] * w for w in table[unit]],
            n=table["n"],
            kappa=table.get("kappa", 0.0),
            name=shown.stem,
            source=source,
        )
    except ValueError as error:
        raise DataFileError(shown, str(error).rstrip("."), "Mend the table.") from error


def _number(path: Path, line: int, name: str, row: list[str], column: int) -> float:
    """One cell as a number, >= 0."""
    text = row[column].strip() if column < len(row) else ""
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 <= value < float("inf"):
        problem = f"expected a finite number >= 0, got {text!r}"
        cure = "The index is n + i kappa with kappa >= 0 absorbing."
        raise DataFileError(path, problem, cure, line=line, column=name)
    return value


def _check_rising(path: Path, lines: list[int], name: str, values: list[float]) -> None:
    """Name the first line whose wavelength does not rise."""
    for k in range(1, len(values)):
        if values[k] <= values[k - 1]:
            problem = (
                f"expected rising wavelengths, got {values[k]:g} after {values[k - 1]:g}"
            )
            cure = "Sort the table and drop repeated rows."
            raise DataFileError(path, problem, cure, line=lines[k], column=name)

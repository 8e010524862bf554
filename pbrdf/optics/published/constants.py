"""A Material from a file of optical constants, whatever published it."""

import re
import warnings
from collections.abc import Sequence
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

import numpy as np

from pbrdf.errors import AccuracyWarning, DataFileError
from pbrdf.optics.dispersion import Dispersion, Table
from pbrdf.optics.materials import Material
from pbrdf.optics.published.database import read_database_entry
from pbrdf.optics.published.definitions import require_one_state
from pbrdf.optics.published.package import PREFIX, read_by_name
from pbrdf.optics.published.tables import IGNORED, Block, read_blocks
from pbrdf.optics.published.text import read_text
from pbrdf.optics.published.transparency import TRANSPARENT, warn_if_absorbing

__all__ = ["read", "read_constant"]

_SOURCE = re.compile(r"^[#%;!/\s]*source:\s*(.+)$", re.MULTILINE)
# Beyond the far infrared: more likely nanometres under the name of micrometres [um]
_LONG = 100.0
# Below it every index is close to 1, as no reading in the visible is. [um], [1]
_X_RAYS, _NEAR_ONE = 0.01, 0.3


def read(
    path: str | Path | Traversable,
    *,
    ignore: Sequence[str] = (),
    kappa: float | None = None,
) -> Material:
    r"""Material from a file of optical constants; the file's name is its name.

    Parameters
    ----------
    path : str or Path
        One of:

        - a table with names of columns, separated by commas, semicolons, tabs or spaces:
          wavelength_nm, wavelength_um, energy_ev, wavenumber_cm-1 (or the unit in brackets
          or in a row below); n; kappa, k or extinction; or eps1, eps2; diffuse_albedo. n
          and k may stand in one table each, as in the export of refractiveindex.info;
        - a YAML file of the refractiveindex.info database, tables and formulas 1 to 9;
        - an .nk file whose comments name the unit;
        - the text format of ellipsometry programs: a comment, a unit, ``NK``, rows;
        - ``refractiveindex:main/Al/Rakic``, an entry of that database by shelf, book and
          page, if the package refractiveindex is installed.

        Lines that start with # are comments; one that starts "# source:" is kept.
    ignore : sequence of str
        Names of columns of a table to leave out, such as a temperature.
    kappa : float, optional
        Of a file that gives n alone. Without it such a medium is transparent; its `source`
        then says "n alone: kappa = 0". [1]

    Returns
    -------
    Material
        Interpolated linearly in the wavelength, never extrapolated.

    Raises
    ------
    DataFileError
        Naming all unknown columns at once, a missing or implausible unit, or the line and
        column of the first value that is no number, negative or given twice; or constants
        that are nowhere known together.

    Warns
    -----
    AccuracyWarning
        If wavelengths beyond 100 um may be nanometres; if neither file nor argument gives
        kappa, and n lies below 1, rises with the wavelength or is as high as where light
        is absorbed, or the file's name is that of a metal.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "paint.csv"
    >>> _ = path.write_text("wavelength_nm,n,k\n400,1.6,0.1\n800,1.5,0.2\n")
    >>> read(path).index(0.6)
    (1.55, 0.15)
    """
    found, name, source = _read(path, ignore)
    if "n" not in found:
        problem = f"expected n, got {', '.join(found)} only"
        raise DataFileError(name, problem, "Give n beside kappa.")
    if kappa is not None and "kappa" in found:
        problem = f"expected kappa of the file or beside it, got both, {kappa:g} beside it"
        raise DataFileError(name, problem, "Leave one out.")
    if kappa is not None:
        found["kappa"] = kappa
    elif "kappa" not in found:
        warn_if_absorbing(Path(name).name, found["n"], stacklevel=3)
        source = f"{source}; {TRANSPARENT}" if source else TRANSPARENT
    albedo: Any = found.get("diffuse_albedo", 0.0)
    extinction = found.get("kappa", 0.0)
    material = Material(found["n"], extinction, albedo, name=_stem(name), source=source)
    low, high = material.valid_range
    if low > high:
        ranges = ", ".join(
            "{} from {:.4g} to {:.4g} um".format(role, *constant.valid_range)
            for role, constant in found.items()
            if callable(constant)
        )
        problem = f"expected constants at common wavelengths, got {ranges}"
        raise DataFileError(name, problem, "Give all of them over one range.")
    return material


def read_constant(
    path: str | Path, role: str, ignore: Sequence[str] = ()
) -> Dispersion | float:
    r"""One constant of a file that `read` takes, which may lack the others.

    Parameters
    ----------
    path : str or Path
        As for `read`.
    role : {"n", "kappa", "diffuse_albedo"}
        Which; diffuse_albedo is a column of a table.
    ignore : sequence of str
        Names of columns to leave out.

    Raises
    ------
    DataFileError
        If the file does not hold it, and as `read` does.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "base.csv"
    >>> _ = path.write_text("wavelength_nm,diffuse_albedo\n400,0.2\n800,0.6\n")
    >>> read_constant(path, "diffuse_albedo")(0.6).round(3)
    np.float64(0.4)
    """
    found, name, _ = _read(path, ignore)
    if role not in found:
        problem = f"expected {role}, got {', '.join(found)} only"
        raise DataFileError(name, problem, f"Name a file that holds {role}.")
    return found[role]


def _read(
    path: str | Path | Traversable, ignore: Sequence[str]
) -> tuple[dict[str, Dispersion | float], str | Path, str | None]:
    """Return all constants of a file by what they are, its name and its source."""
    entry = str(path).startswith(PREFIX) or str(path).lower().endswith((".yml", ".yaml"))
    if ignore and entry:
        problem = f"expected no columns to leave out, got {', '.join(map(repr, ignore))}"
        raise DataFileError(Path(str(path)), problem, "A database entry has none.")
    if str(path).startswith(PREFIX):
        name = str(path).removeprefix(PREFIX)
        index, extinction, origin = read_by_name(name)
        known: dict[str, Dispersion | float] = {"n": index}
        return known | ({"kappa": extinction} if extinction else {}), str(path), origin
    file = Path(path) if isinstance(path, str) else path
    shown = file if isinstance(file, Path) else Path(file.name)
    text = read_text(file, shown)
    constants: dict[str, Dispersion | float] = {}
    if shown.suffix.lower() in (".yml", ".yaml"):
        laws, reference = read_database_entry(shown, text)
        constants.update(laws)
        return constants, shown, reference
    for block in read_blocks(shown, text, ignore):
        for name, table in _constants(shown, block).items():
            if name in constants:
                problem = f"expected one table of {name}, got two"
                raise DataFileError(shown, problem, "Keep one.", line=block.lines[0])
            constants[name] = table
    origin_line = _SOURCE.search(text)
    return constants, shown, origin_line[1].strip() if origin_line else None


def _stem(name: str | Path) -> str:
    return name.stem if isinstance(name, Path) else name.removeprefix(PREFIX)


def _constants(path: Path, block: Block) -> dict[str, Table]:
    """Return n and kappa of a block against rising wavelengths."""
    spectral = block.column("wavelength")
    waves = spectral.to_um(block.values("wavelength") or [])
    _check_plausible(path, block, waves)
    order = np.argsort(waves, kind="stable")
    waves = waves[order]
    _refuse_twice(path, block, waves, order)
    columns = {
        role: np.asarray(values)[order]
        for role in ("n", "kappa", "eps1", "eps2", "diffuse_albedo")
        if (values := block.values(role)) is not None
    }
    left_out = {name: [cells[k] for k in order] for name, cells in block.left_out.items()}
    require_one_state(path, left_out, block.lines, columns)
    if "eps1" in columns:
        if "n" in columns or "kappa" in columns:
            problem = "expected n and kappa or eps1 and eps2, got both"
            raise DataFileError(path, problem, "Keep one pair.")
        # (n + i kappa)^2 = eps1 + i eps2; the principal root absorbs
        index = np.sqrt(columns.pop("eps1") + 1j * columns.pop("eps2", 0.0))
        columns |= {"n": index.real, "kappa": index.imag}
    elif "eps2" in columns:
        problem = "expected eps1 beside eps2, got none"
        raise DataFileError(path, problem, "Give both.")
    for k, value in enumerate(columns.get("diffuse_albedo", ())):
        if value > 1:
            problem = f"expected diffuse_albedo in [0, 1], got {value:g}"
            cure = "It is a fraction; divide percents by 100."
            line = block.lines[int(order[k])]
            raise DataFileError(path, problem, cure, line=line, column="diffuse_albedo")
    for k, value in enumerate(columns.get("n", ())):
        if value <= 0:
            problem = f"expected n > 0, got {value:g}"
            raise DataFileError(
                path, problem, "Mend the row.", line=block.lines[int(order[k])], column="n"
            )
    try:
        return {role: Table.of(role, waves, values) for role, values in columns.items()}
    except ValueError as error:
        raise DataFileError(path, str(error).rstrip("."), "Mend the table.") from error


def _refuse_twice(path: Path, block: Block, waves: np.ndarray, order: np.ndarray) -> None:
    """Refuse a wavelength that stands in two rows."""
    twice = np.flatnonzero(np.diff(waves) <= 0)
    if twice.size:
        row = int(order[twice[0] + 1])
        value = block.values("wavelength")[row]  # type: ignore[index]
        problem = f"expected rising or falling wavelengths, got {value:g} twice"
        cure = "Drop the repeated row."
        if any(column.role == IGNORED for column in block.columns):
            cure = "Keep one value of what is left out, or drop the repeated row."
        raise DataFileError(
            path,
            problem,
            cure,
            line=block.lines[row],
            column=block.column("wavelength").name,
        )


def _check_plausible(path: Path, block: Block, waves: np.ndarray) -> None:
    """Refuse units that the numbers contradict; warn of those that they make unlikely."""
    spectral = block.column("wavelength")
    wrong = ~(np.isfinite(waves) & (waves > 0))
    if wrong.any():
        row = int(np.argmax(wrong))
        given = (block.values("wavelength") or [])[row]
        problem = f"expected a wavelength > 0, got {given:g}"
        raise DataFileError(
            path, problem, "Mend the row.", line=block.lines[row], column=spectral.name
        )
    index = np.asarray(block.values("n") or np.ones(len(waves)))
    rays = (waves < _X_RAYS) & (np.abs(index - 1.0) > _NEAR_ONE)
    if rays.any():
        row = int(np.argmax(rays))
        given = (block.values("wavelength") or [])[row]
        problem = (
            f"expected an index near 1 at {given:g} {spectral.unit} "
            f"({1e3 * waves[row]:.3g} nm, X-rays), got {index[row]:g}"
        )
        other = "nm" if spectral.unit != "nm" else "um"
        cure = f"The unit is not {spectral.unit}: name the right one, for example {other}."
        raise DataFileError(
            path, problem, cure, line=block.lines[row], column=spectral.name
        )
    if waves.min() >= _LONG and spectral.unit == "um":
        low, high = waves.min(), waves.max()
        msg = (
            f"{path.name}: wavelengths of {low:g} to {high:g} um lie beyond the infrared; "
            f"they may be nanometres. Then head the column wavelength_nm."
        )
        warnings.warn(msg, AccuracyWarning, stacklevel=5)

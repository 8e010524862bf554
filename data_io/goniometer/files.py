"""Reading and writing of goniometer files; which format a file has."""

from collections.abc import Callable
from pathlib import Path

import xarray as xr

from data_io.goniometer import fred, nist, own_csv, spacecraft, zemax
from data_io.goniometer.dataset import to_dataset
from data_io.goniometer.scan import QUANTITIES, Scan
from data_io.text.text import Line, is_comment, read_lines
from pbrdf.errors import DataFileError

_READERS: dict[str, Callable[[Path, list[Line]], Scan]] = {
    "csv": own_csv.read,
    "fred": fred.read,
    "zemax": zemax.read,
    "nist": nist.read,
    "spacecraft": spacecraft.read,
}


def read_goniometer(path: str | Path, format: str | None = None) -> xr.Dataset:
    r"""Read a scan of a (polarised) BRDF into the project's conventions.

    Parameters
    ----------
    path : str or Path
        The file.
    format : str, optional
        ``"csv"`` (the project's own), ``"fred"``, ``"zemax"``, ``"nist"`` or
        ``"spacecraft"``; by default told from the content.

    Returns
    -------
    xarray.Dataset
        One dimension `geometry`. Coordinates theta_i, theta_s, dphi [rad] and, where the
        file names them, wavelength [um], phi_i, source_half_angle and detector_half_angle
        [rad]; variables M00..M33 [1/sr], m01..m33 (divided by M00) [1], DOLP [1], I_s, I_p,
        f_ss..f_pp [1/sr] and ``<name>_stderr`` as the file has them. NaN where nothing was
        measured. The attribute `quantity` is "brdf", or "relative" where all but the ratios
        have one unknown factor in common.

    Raises
    ------
    DataFileError
        Naming file, line and column of the first fault, the value and the cure.

    See Also
    --------
    write_goniometer, in_plane, view_angle

    Examples
    --------
    >>> import tempfile
    >>> import numpy as np
    >>> rows = "theta_i_deg,theta_view_deg,M00\n30,-10,0.02\n30,30,0.5\n"
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "scan.csv"
    ...     _ = path.write_text(rows)
    ...     scan = read_goniometer(path)
    >>> np.degrees(scan.dphi.values)
    array([  0., 180.])
    """
    path = Path(path)
    if format is not None and format not in _READERS:
        msg = (
            f"format must be one of {', '.join(_READERS)}, got {format!r}. Or leave it out."
        )
        raise ValueError(msg)
    lines = read_lines(path)
    name = format or _detect(path, lines)
    return to_dataset(_READERS[name](path, lines))


def write_goniometer(dataset: xr.Dataset, path: str | Path) -> None:
    """Write a scan as the project's goniometer CSV.

    Geometry goes into theta_i_deg, theta_s_deg, dphi_deg and, where present, wavelength_um;
    NaN becomes an empty cell. `read_goniometer` returns the same values.

    Parameters
    ----------
    dataset : xarray.Dataset
        As from `read_goniometer`.
    path : str or Path
        The file; it appears complete or not at all.

    Raises
    ------
    ValueError
        If the dataset lacks the dimension, a coordinate, or any known quantity.
    """
    for name in ("theta_i", "theta_s", "dphi"):
        if name not in dataset.coords or dataset[name].dims != ("geometry",):
            msg = (
                f"dataset must have the coordinate {name} along the dimension geometry, "
                f"got {dict(dataset.sizes)}. Select or stack the geometries first."
            )
            raise ValueError(msg)
    if not any(name in dataset for name in QUANTITIES):
        msg = (
            f"dataset must have any of M00..M33, DOLP, got {list(dataset.data_vars)}. "
            "Name the measured elements so."
        )
        raise ValueError(msg)
    if dataset.sizes["geometry"] == 0:
        msg = "dataset must have at least one geometry, got none. Check the selection."
        raise ValueError(msg)
    own_csv.write(dataset, path)


def _detect(path: Path, lines: list[Line]) -> str:
    """Tell the format from the content."""
    comments = [line for line in lines if is_comment(line)]
    content = [line for line in lines if line.text.strip() and not is_comment(line)]
    if not content:
        problem = "expected rows of a scan, found comments only"
        raise DataFileError(path, problem, "The file is truncated.")
    candidates = {
        "zemax": zemax.looks_like(content),
        "fred": fred.looks_like(content[0]),
        "nist": nist.looks_like(content[0]),
        "spacecraft": spacecraft.looks_like(comments),
        "csv": own_csv.looks_like(content[0]) or "," in content[0].text,
    }
    for name, found in candidates.items():
        if found:
            return name
    first = content[0].text.strip()[:40]
    problem = f"expected a goniometer file in a known format, got {first!r}"
    cure = f"Use the project's CSV columns, or give format= ({', '.join(_READERS)})."
    raise DataFileError(path, problem, cure, line=content[0].number)

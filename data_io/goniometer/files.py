"""Reading and writing of goniometer files; which format a file has."""

from collections.abc import Mapping
from itertools import islice
from pathlib import Path

import xarray as xr

from data_io.goniometer.dataset import to_dataset
from data_io.goniometer.declarations import Declared, declared
from data_io.goniometer.formats import astm, fred, nist, spacecraft, zemax
from data_io.goniometer.scan import QUANTITIES
from data_io.goniometer.tables import own_csv
from data_io.goniometer.tables.quantities import as_declared
from data_io.goniometer.tables.writing import write_csv
from data_io.text.text import Line, content_of, read_lines
from pbrdf.errors import DataFileError

# In the order in which they are tried: a table of columns is the last resort
_FORMATS = {
    module.NAME: module for module in (zemax, fred, nist, spacecraft, astm, own_csv)
}
# First words of files that hold a BSDF in a way that is not read
_FOREIGN = {
    "<?xml": "a matrix of window software (XML)",
    "<WindowElement": "a matrix of window software (XML)",
    "Measurement-DataType": "a LightTools file",
    "Filetype": "a LightTools file",
}


def read_goniometer(  # noqa: PLR0913  (each is a convention that files leave open)
    path: str | Path,
    format: str | None = None,
    *,
    columns: Mapping[str, str] | str | Path | None = None,
    azimuth_of_forward: float | None = None,
    angles: str | None = None,
    quantity: str | None = None,
    normalised: bool | None = None,
    source_half_angle: float | None = None,
    detector_half_angle: float | None = None,
) -> xr.Dataset:
    r"""Read a scan of a (polarised) BRDF into the project's conventions.

    Parameters
    ----------
    path : str or Path
        The file.
    format : str, optional
        ``"csv"`` (the project's own, and other tables with names of columns), ``"astm"``,
        ``"fred"``, ``"zemax"``, ``"nist"`` or ``"spacecraft"``; by default told from the
        content. A ``.pbsdf`` of Mitsuba or KAIST is read too.
    columns : mapping of str to str, or path, optional
        What columns mean: ``{"AOI": "theta_i_deg", "note": "ignore"}``; or a TOML file with
        a table ``[columns]`` and the declarations below as keys.
    azimuth_of_forward : float, optional
        0 or pi: the azimuth, relative to the source where the file is, at which the
        specular reflection lies. By default pi, as in the conventions; 0 turns every
        direction to the other side. [rad]
    angles : {"deg", "rad"}, optional
        Unit of all angles of a table, in place of what names say.
    quantity : {"brdf", "reflectance-factor", "brdf-cos", "relative"}, optional
        What was measured: dL/dE [1/sr]; pi times it; times cos(theta_s); or with a factor
        that nobody knows.
    normalised : bool, optional
        True: the elements are divided by M00. False: they are not, whatever they look like.
    source_half_angle, detector_half_angle : float, optional
        Half-angles of the cones of light, where the file has no column of them. [rad]

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
    if format is not None and format not in _FORMATS:
        msg = (
            f"format must be one of {', '.join(_FORMATS)}, got {format!r}. Or leave it out."
        )
        raise ValueError(msg)
    said = declared(
        columns=columns,
        azimuth_of_forward=azimuth_of_forward,
        angles=angles,
        quantity=quantity,
        normalised=normalised,
        source_half_angle=source_half_angle,
        detector_half_angle=detector_half_angle,
    )
    if format is None and _is_tensor(path):
        return _of_renderer(path, said)
    lines = read_lines(path)
    name = format or _detect(path, lines)
    for word in own_csv.TAKES:
        if word not in _FORMATS[name].TAKES and getattr(said, word) not in (None, {}):
            msg = (
                f"{word.replace('_', '-')} does not belong to a {name} file, whose "
                f"conventions are fixed, got {path.name}. Leave it out."
            )
            raise ValueError(msg)
    return to_dataset(as_declared(_FORMATS[name].read(path, lines, said), said))


def _is_tensor(path: Path) -> bool:
    """Tell whether a file is a .pbsdf, by its first bytes."""
    if not path.is_file():
        return False
    with path.open("rb") as stream:
        return stream.read(12) == b"tensor_file\0"


def _of_renderer(path: Path, said: Declared) -> xr.Dataset:
    """Read a .pbsdf, whose conventions are all fixed."""
    from data_io.reflectance.pbsdf import read_pbsdf

    if said != Declared():
        msg = f"a .pbsdf file fixes its conventions, got {said.words()} for {path.name}."
        raise ValueError(msg)
    return read_pbsdf(path)


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
            "dataset must have any of M00..M33, m01..m33, DOLP, I_s, I_p, f_ss..f_pp, got "
            f"{list(dataset.data_vars)}. "
            "Name the measured elements so."
        )
        raise ValueError(msg)
    if dataset.sizes["geometry"] == 0:
        msg = "dataset must have at least one geometry, got none. Check the selection."
        raise ValueError(msg)
    write_csv(dataset, path)


def _detect(path: Path, lines: list[Line]) -> str:
    """Tell the format from the content."""
    content = list(islice(content_of(lines), 20))
    if not content:
        problem = "expected rows of a scan, found comments only"
        raise DataFileError(path, problem, "The file is truncated.")
    first = content[0].text.strip()
    for word, what in _FOREIGN.items():
        if any(line.text.strip().startswith(word) for line in content):
            problem = f"expected a goniometer file in a known format, got {what}"
            cure = f"Export a table; known are {', '.join(_FORMATS)} and .pbsdf."
            raise DataFileError(path, problem, cure, line=content[0].number)
    for name, module in _FORMATS.items():
        if module.looks_like(lines):
            return name
    problem = f"expected a goniometer file in a known format, got {first[:40]!r}"
    cure = f"Give a table with names of columns, or format= ({', '.join(_FORMATS)})."
    raise DataFileError(path, problem, cure, line=content[0].number)

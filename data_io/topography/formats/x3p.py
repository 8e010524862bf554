"""x3p files (ISO 25178-72): a zip folder with main.xml and binary heights, in metres.

Other readers require the XML namespace and main.xml at the top of the archive; files in
circulation often have neither. This reader takes main.xml wherever it lies and matches tag
names without their namespace.
"""

import hashlib
import lzma
import warnings
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from xml.etree import ElementTree
from xml.parsers.expat import ExpatError, ParserCreate

import numpy as np

from data_io.text.files import NotAMapError
from pbrdf.errors import DataFileError
from pbrdf.files import file_size
from pbrdf.surface.heightmap import HeightMap

# What reading an archive raises where it is damaged, encrypted or uses odd methods
_FAULTS = (
    zipfile.BadZipFile,
    zlib.error,
    lzma.LZMAError,
    EOFError,
    NotImplementedError,
    RuntimeError,
    OverflowError,
    LookupError,
    ValueError,
    OSError,
)
MOST_XML = 256 * 2**20
MOST_HEIGHTS = 2**30
# Heights of instruments compress by less than twenty, a map of one height by a thousand
MOST_EXPANSION = 400
_METRE = 1e6  # um
_DTYPES = {"D": "<f8", "F": "<f4", "L": "<i4", "I": "<i2"}


@dataclass(frozen=True)
class X3p:
    """Content of an x3p file.

    Attributes
    ----------
    rows : ndarray, shape (ny, nx)
        Heights in rows of constant y, NaN where invalid. [um]
    steps : (float, float)
        Grid steps dx, dy. [um]
    is_profile : bool
        True for feature type PRF.
    """

    rows: np.ndarray
    steps: tuple[float, float]
    is_profile: bool


class _Document:
    """main.xml, read by tag names without their namespace."""

    def __init__(self, path: Path, content: bytes) -> None:
        self.path = path
        try:
            # Codecs of Python, of which a file may name any, warn
            with warnings.catch_warnings(action="ignore"):
                _refuse_entities(content)
                self.root = ElementTree.fromstring(content)
        except (ElementTree.ParseError, ExpatError, LookupError, ValueError) as error:
            problem = f"expected well-formed XML in main.xml, got: {str(error)[:150]}"
            raise DataFileError(path, problem, "Export the file again.") from error

    def find(self, *tags: str) -> ElementTree.Element | None:
        """Return the element at a path of tag names, or None."""
        element: ElementTree.Element | None = self.root
        for tag in tags:
            if element is None:
                return None
            element = next((e for e in element if e.tag.rpartition("}")[2] == tag), None)
        return element

    def text(self, *tags: str, default: str | None = None) -> str:
        """Return the text at a path of tag names; without default it must be there."""
        element = self.find(*tags)
        text = (element.text or "").strip() if element is not None else ""
        if not text and default is None:
            raise self.fault(tags, "a value, found none")
        return text or str(default)

    def number(self, *tags: str, default: float | None = None) -> float:
        """Return the number at a path of tag names."""
        text = self.text(*tags, default=None if default is None else repr(default))
        try:
            return float(text)
        except ValueError as error:
            raise self.fault(tags, f"a number, got {text!r}") from error

    def fault(self, tags: tuple[str, ...], expected: str) -> DataFileError:
        """Return the error for one element."""
        problem, cure = f"expected {expected}", "Mend or export the file again."
        return DataFileError(self.path, problem, cure, column="main.xml " + "/".join(tags))


def _refuse_entities(content: bytes) -> None:
    """Raise where entities are declared, in any encoding: the known attack on readers."""

    def declared(*_: object) -> None:
        msg = "main.xml declares entities"
        raise ValueError(msg)

    parser = ParserCreate()
    parser.EntityDeclHandler = declared
    parser.Parse(content, True)


def read_x3p(path: str | Path) -> X3p:
    """Read an x3p file of any layout of folders, with or without namespace.

    Raises
    ------
    DataFileError
        If the archive is damaged, a checksum differs, or main.xml lacks what is needed.
    """
    path = Path(path)
    file_size(path)
    try:
        with zipfile.ZipFile(path) as archive:
            return _read_archive(path, archive)
    except DataFileError:
        raise
    except _FAULTS as error:
        text = str(error)[:150] or type(error).__name__
        problem = f"expected an x3p (zip) archive, got: {text}"
        cure = "The file is truncated, encrypted or not x3p."
        raise DataFileError(path, problem, cure) from error


def _member(path: Path, archive: zipfile.ZipFile, name: str, most: int) -> bytes:
    """Return a file of the archive that does not grow beyond reason."""
    info = archive.getinfo(name)
    if (
        info.file_size > most
        or info.file_size > MOST_EXPANSION * info.compress_size + 2**20
    ):
        problem = (
            f"{name[:60]} would grow from {info.compress_size} to {info.file_size} bytes"
        )
        raise DataFileError(path, problem, "The file is damaged or hostile.")
    # Its true length may be another than it says
    with archive.open(info) as stream:
        return stream.read(info.file_size)


def is_x3p(path: Path) -> bool:
    """Tell whether a file is an archive with main.xml, whatever its name."""
    try:
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
    except (zipfile.BadZipFile, OSError):
        return False
    # The archives of other instruments have a main file of that name, and an index
    return any(PurePosixPath(name).name == "main.xml" for name in names) and not any(
        PurePosixPath(name).name == "index.xml" for name in names
    )


def read_x3p_map(path: str | Path) -> HeightMap:
    """Read an areal x3p file. [um]"""
    content = read_x3p(path)
    if min(content.rows.shape) < 2:
        raise NotAMapError(path, content.rows.size)
    return HeightMap(content.rows.T, content.steps)


def _read_archive(path: Path, archive: zipfile.ZipFile) -> X3p:
    # Archives made on Windows may hold backslashes
    names = {
        name.replace("\\", "/"): name
        for name in archive.namelist()
        if not name.startswith("__MACOSX")
    }
    mains = sorted((n for n in names if PurePosixPath(n).name == "main.xml"), key=len)
    if not mains:
        problem = "expected main.xml in the archive, found none"
        raise DataFileError(path, problem, "Only files after ISO 25178-72 can be read.")
    folder = PurePosixPath(mains[0]).parent
    document = _Document(path, _member(path, archive, names[mains[0]], MOST_XML))

    def member(link: str) -> bytes:
        name = str(folder / link.replace("\\", "/").lstrip("/"))
        if name not in names:
            problem = f"expected {name} in the archive, as main.xml says, found none"
            raise DataFileError(path, problem, "Export the file again.")
        return _member(path, archive, names[name], MOST_HEIGHTS)

    shape = ("Record3", "MatrixDimension")
    nx, ny = (int(document.number(*shape, tag)) for tag in ("SizeX", "SizeY"))
    layers = int(document.number(*shape, "SizeZ", default=1.0))
    if nx < 1 or ny < 1 or layers != 1:
        raise document.fault(shape, f"one layer of points, got {nx} x {ny} x {layers}")
    steps = _axis_step(document, "CX"), _axis_step(document, "CY") if ny > 1 else 1.0
    if document.find("Record3", "DataLink") is not None:
        heights = _binary_heights(document, member, nx * ny)
    else:
        heights = _listed_heights(document, nx * ny)
    scale = document.number("Record1", "Axes", "CZ", "Increment", default=1.0)
    offset = document.number("Record1", "Axes", "CZ", "Offset", default=0.0)
    rows = (heights * scale + offset).reshape(ny, nx) * _METRE
    rows = np.where(np.isinf(rows), np.nan, rows)
    feature = document.text("Record1", "FeatureType", default="SUR")
    return X3p(rows, steps, feature == "PRF" or ny == 1)


def _axis_step(document: _Document, axis: str) -> float:
    """Return the grid step of an incremental axis. [um]"""
    tags = ("Record1", "Axes", axis)
    kind = document.text(*tags, "AxisType", default="I")
    if kind != "I":
        raise document.fault(tags, f"an incremental axis (AxisType I), got {kind!r}")
    step = document.number(*tags, "Increment") * _METRE
    if not step > 0 or not np.isfinite(step):
        raise document.fault(tags, f"a positive increment [m], got {step / _METRE}")
    return step


def _binary_heights(
    document: _Document, member: Callable[[str], bytes], size: int
) -> np.ndarray:
    """Return the heights of the linked binary file, NaN where the mask is 0."""
    link = ("Record3", "DataLink")
    content = member(document.text(*link, "PointDataLink"))
    _check_md5(document, content, *link, "MD5ChecksumPointData")
    kind = document.text("Record1", "Axes", "CZ", "DataType", default="D")
    if kind not in _DTYPES:
        tags = ("Record1", "Axes", "CZ", "DataType")
        raise document.fault(tags, f"one of {', '.join(_DTYPES)}, got {kind!r}")
    dtype = np.dtype(_DTYPES[kind])
    if len(content) != size * dtype.itemsize:
        found = f"{len(content)} bytes"
        raise document.fault(link, f"{size} heights of {dtype.itemsize} bytes, got {found}")
    heights = np.frombuffer(content, dtype).astype(np.float64)
    mask = document.find(*link, "ValidPointsLink")
    if mask is not None and (mask.text or "").strip():
        bits = member((mask.text or "").strip())
        _check_md5(document, bits, *link, "MD5ChecksumValidPoints")
        if len(bits) < (size + 7) // 8:
            raise document.fault(link, f"{size} validity bits, got {8 * len(bits)}")
        valid = np.unpackbits(np.frombuffer(bits, np.uint8), count=size, bitorder="little")
        heights = np.where(valid == 1, heights, np.nan)
    return heights


def _listed_heights(document: _Document, size: int) -> np.ndarray:
    """Return the heights written in main.xml itself; an empty Datum is a missing point."""
    tags = ("Record3", "DataList")
    data = document.find(*tags)
    if data is None:
        raise document.fault(tags, "a DataLink or a DataList, found none")
    # Incremental x and y are not listed, or are listed before z
    cells = [(datum.text or "").split(";")[-1].strip() for datum in data]
    try:
        heights = np.array([float(cell) if cell else np.nan for cell in cells])
    except ValueError as error:
        raise document.fault(tags, f"numbers, got: {error}") from error
    if heights.size != size:
        raise document.fault(tags, f"{size} heights, got {heights.size}")
    return heights


def _check_md5(document: _Document, content: bytes, *tags: str) -> None:
    """Compare with the checksum, where main.xml holds one."""
    stated = document.text(*tags, default="-").split()[0].lower()
    if len(stated) == 32:
        found = hashlib.md5(content, usedforsecurity=False).hexdigest()
        if found != stated:
            raise document.fault(tags, f"content with MD5 {stated}, got {found}")

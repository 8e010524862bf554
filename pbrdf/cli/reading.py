"""Read what a user calls a surface: a profile, a map or a micrograph."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from pbrdf.cli.options import Kind

if TYPE_CHECKING:
    import xarray as xr

    from data_io import Profile
    from pbrdf.optics.materials import Material
    from pbrdf.surface.heightmap import HeightMap

__all__ = ["read_material", "read_scan", "read_store", "read_surface"]

_IMAGES = {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp"}
_TEXT = {".csv", ".txt", ".asc", ".dat", ".tsv", ".xyz"}
_NOTHING: Mapping[str, Any] = MappingProxyType({})


def read_surface(
    path: Path,
    *,
    kind: Kind = Kind.auto,
    um_per_pixel: float | None = None,
    spacing: float | None = None,
    unit: str | None = None,
    channel: str | None = None,
    columns: str | None = None,
    block: int | None = None,
    um_per_level: float | None = None,
    mend: str = "all",
    picture: Mapping[str, Any] = _NOTHING,
) -> "Profile | HeightMap":
    """Read a surface file as what it is, or as what the user says it is.

    `picture` holds further arguments of `data_io.read_profile_image` by name, None where
    the user gave none.

    Raises
    ------
    ValueError
        If the file cannot be read, or an option does not belong to its kind.
    """
    import data_io

    guessed = kind is Kind.auto
    if um_per_level is not None and guessed:
        kind = Kind.map
    kind = _kind(path, columns, block) if kind is Kind.auto else kind
    if um_per_level is not None and kind is Kind.map:
        # A pixel of a picture is a step of its map
        spacing, um_per_pixel = spacing or um_per_pixel, None
    given = {name: value for name, value in picture.items() if value is not None}
    unused = {
        "--um-per-pixel": um_per_pixel is not None and kind is not Kind.image,
        "--spacing-um": spacing is not None and kind is Kind.image,
        "--unit": unit is not None and kind is Kind.image,
        "--columns": columns is not None and kind is Kind.image,
        "--block": block is not None and kind is Kind.image,
        "--um-per-level": um_per_level is not None and kind is not Kind.map,
        "--channel": channel is not None and kind is not Kind.map,
    } | {f"--{name.replace('_', '-')}": kind is not Kind.image for name in given}
    for option, wrong in unused.items():
        if wrong:
            msg = f"{option} does not belong to a {kind}, got {path.name}. Leave it out."
            raise ValueError(msg)
    if kind is Kind.image:
        if um_per_pixel is None and "scale_bar_um" not in given:
            msg = (
                f"{path.name} is a picture and has no scale. Give --um-per-pixel, "
                "or the length of its scale bar (pbrdf statistics --scale-bar-um); for a "
                "picture whose levels are heights also --um-per-level."
            )
            raise ValueError(msg)
        return data_io.read_profile_image(path, um_per_pixel, **given)
    if kind is Kind.profile:
        return data_io.read_profile(
            path, unit=_units(unit), columns=columns, spacing=spacing, block=block,
            mend=mend,
        )  # fmt: skip
    try:
        return data_io.read_height_map(
            path, spacing=spacing, unit=unit, channel=channel, columns=columns, block=block,
            um_per_level=um_per_level, mend=mend,
        )  # fmt: skip
    except data_io.NotAMapError:
        if not guessed:
            raise
        return data_io.read_profile(path, unit=_units(unit), mend=mend)


def _units(text: str | None) -> str | tuple[str, str] | None:
    """Return one unit, or those of x and of z or slope."""
    if text is None or "," not in text:
        return text
    words = [word.strip() for word in text.split(",")]
    if len(words) != 2:
        msg = f"--units must be one unit or two, as in mm,nm, got {text!r}."
        raise ValueError(msg)
    return words[0], words[1]


def read_scan(
    path: Path,
    *,
    wavelength: float | None = None,
    declared: Mapping[str, Any] = _NOTHING,
) -> "xr.Dataset":
    """Read a goniometer file, or those of its rows that have a wavelength [um].

    `declared` holds conventions as `data_io.read_goniometer` takes them.

    Raises
    ------
    ValueError
        If the file cannot be read, or has no such rows.
    """
    import numpy as np

    import data_io

    scan = data_io.read_goniometer(path, **declared)
    if wavelength is None:
        return scan
    if "wavelength" not in scan.coords:
        msg = (
            f"--wavelength-um must occur in the scan, {path.name} names none. Leave it out."
        )
        raise ValueError(msg)
    waves = np.broadcast_to(scan.wavelength.values, scan.sizes["geometry"])
    here = np.isclose(waves, wavelength, rtol=1e-6)
    if not here.any():
        known = ", ".join(f"{wave:g}" for wave in np.unique(waves))
        msg = f"--wavelength-um must be one of {known} of {path.name}, got {wavelength:g}."
        raise ValueError(msg)
    return scan.isel(geometry=np.flatnonzero(here))


def read_material(
    n: float | None,
    kappa: float | None,
    file: str | None,
    ignore: Sequence[str] = (),
    *,
    option: str = "--n",
) -> "Material | None":
    """Return the material of --n and --kappa or of --material-file; None without either.

    Raises
    ------
    ValueError
        If both are given, or the file cannot be read.

    Warns
    -----
    AccuracyWarning
        If nothing gives kappa, and the index is not that of a transparent medium.
    """
    from pbrdf import Material, materials
    from pbrdf.optics.published.transparency import warn_if_absorbing

    if file is not None:
        if n is not None:
            msg = f"{option} comes from the --material-file, got both. Drop one."
            raise ValueError(msg)
        return materials.read(file, ignore=ignore, kappa=kappa)
    if ignore:
        msg = "--material-ignore names columns of a --material-file, got none. Drop it."
        raise ValueError(msg)
    if n is None:
        return None
    if kappa is None:
        warn_if_absorbing(f"{option} {n:g}", n)
    return Material(n, kappa or 0.0)


def _kind(path: Path, columns: str | None, block: int | None) -> Kind:
    """Tell the kind from the name, and that of a text file from its columns."""
    suffix = path.suffix.lower()
    if suffix in _IMAGES:
        from data_io.topography.formats.instruments import is_park_tiff

        return Kind.map if is_park_tiff(path) else Kind.image
    if suffix not in _TEXT or suffix == ".xyz":
        return Kind.map
    from data_io import holds_profile

    try:
        profile = holds_profile(path, columns=columns, block=block)
    except ValueError:
        # Instruments write binary files of these names too; the reader says what is wrong
        return Kind.map
    return Kind.profile if profile else Kind.map


def read_store(
    path: Path,
    at: list[str] | None,
    *,
    wavelength: float | None = None,
    theta_i: float | None = None,
    interpolated: bool = True,
    cure: str = "Give --theta-i-deg.",
) -> "xr.Dataset":
    """Interpolate the store of a sweep at NAME=VALUE of each thing that varied.

    Values are in the units of the store's names; those of text are taken as text. Errors
    hold that of interpolation if `interpolated`; `cure` as of `written_places`.

    Raises
    ------
    ValueError
        If a word is no NAME=VALUE, or the store has no such place.
    """
    from pbrdf import from_store
    from pbrdf.cli.places import written_places

    places = written_places(at, cure)
    if "wavelength" in places:
        if wavelength is not None:
            msg = "--wavelength-um must be given once, got it in --at too. Leave one out."
            raise ValueError(msg)
        wavelength = places.pop("wavelength")
    return from_store(path).at(theta_i, wavelength, interpolated=interpolated, **places)

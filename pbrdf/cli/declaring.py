"""Options that say what a goniometer file means, where the file does not."""

import math
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

__all__ = [
    "Accept", "AngleUnit", "Angles", "DetectorCone", "Forward", "Normalised", "Quantity",
    "QuantityOption", "ScanColumns", "SourceCone", "declarations",
]  # fmt: skip


class AngleUnit(StrEnum):
    """Unit of all angles of a table."""

    deg = "deg"
    rad = "rad"


class Quantity(StrEnum):
    """What was measured."""

    brdf = "brdf"
    reflectance_factor = "reflectance-factor"
    brdf_cos = "brdf-cos"
    relative = "relative"


_COLUMNS_HELP = (
    "What columns mean: AOI=theta_i_deg,note=ignore; or a TOML file with [columns]."
)
ScanColumns = Annotated[str | None, typer.Option("--columns", help=_COLUMNS_HELP)]
PipelineScanColumns = Annotated[
    str | None, typer.Option("--scan-columns", help=_COLUMNS_HELP)
]
Forward = Annotated[
    float | None,
    typer.Option(
        "--azimuth-of-forward",
        help="0 or 180: azimuth at which the specular reflection lies [deg].",
        show_default=False,
    ),
]
Angles = Annotated[
    AngleUnit | None, typer.Option("--angles", help="Unit of all angles of the table.")
]
QuantityOption = Annotated[
    Quantity | None,
    typer.Option("--quantity", help="What was measured, if not the BRDF in 1/sr."),
]
Normalised = Annotated[
    bool | None,
    typer.Option(
        "--normalised/--not-normalised", help="Elements are, or are not, divided by M00."
    ),
]
Accept = Annotated[
    str,
    typer.Option(
        help="Errors of physics to go on in spite of, as `pbrdf check` names them, or all."
    ),
]
SourceCone = Annotated[
    float | None,
    typer.Option(
        "--source-half-angle-deg", min=0.0, max=28.0,
        help="Half-angle of the source, in place of the file's; 0 for a point.",
    ),
]  # fmt: skip
DetectorCone = Annotated[
    float | None,
    typer.Option(
        "--detector-half-angle-deg", min=0.0, max=28.0,
        help="Half-angle of the detector, in place of the file's; 0 for a point.",
    ),
]  # fmt: skip


def declarations(
    columns: str | None,
    azimuth_of_forward: float | None,
    angles: AngleUnit | None,
    quantity: Quantity | None,
    normalised: bool | None,
    *,
    source_half_angle: float | None = None,
    detector_half_angle: float | None = None,
    option: str = "--columns",
) -> dict[str, Any]:
    """Return the arguments of `data_io.read_goniometer`; half-angles come in degrees.

    Raises
    ------
    ValueError
        If a column's meaning lacks its sign =, or the azimuth is neither 0 nor 180.
    """
    if azimuth_of_forward not in (None, 0.0, 180.0):
        msg = f"--azimuth-of-forward must be 0 or 180, got {azimuth_of_forward:g}."
        raise ValueError(msg)
    return {
        "columns": _columns(columns, option),
        "azimuth_of_forward": _radians(azimuth_of_forward),
        "angles": None if angles is None else angles.value,
        "quantity": None if quantity is None else quantity.value,
        "normalised": normalised,
        "source_half_angle": _radians(source_half_angle),
        "detector_half_angle": _radians(detector_half_angle),
    }


def _radians(angle: float | None) -> float | None:
    return None if angle is None else math.radians(angle)


def _columns(text: str | None, option: str) -> dict[str, str] | Path | None:
    if text is None:
        return None
    if "=" not in text:
        path = Path(text)
        if path.suffix == ".toml":
            return path
        msg = f"{option} must be NAME=MEANING pairs or a .toml file, got {text!r}."
        raise ValueError(msg)
    found = {}
    for pair in text.split(","):
        name, _, meaning = pair.rpartition("=")
        if not name.strip() or not meaning.strip():
            msg = (
                f"{option} must be NAME=MEANING pairs by commas, got {pair!r} in {text!r}."
            )
            raise ValueError(msg)
        found[name.strip()] = meaning.strip()
    return found

"""Options that several commands share, each written once."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

__all__ = [
    "Azimuth",
    "Azimuths",
    "Block",
    "Blocked",
    "Bundles",
    "Channel",
    "ColumnsOption",
    "Fold",
    "Force",
    "FormOption",
    "Free",
    "Index",
    "Kappa",
    "Kind",
    "KindOption",
    "MaterialFile",
    "MaterialIgnore",
    "MendOption",
    "OptionalIndex",
    "Output",
    "PlannedRays",
    "PlannedRealizations",
    "Rays",
    "Realizations",
    "Scan",
    "Seed",
    "Shadowing",
    "SlopeLaw",
    "SourceHalfAngle",
    "Spacing",
    "Surface",
    "UmPerLevel",
    "UmPerPixel",
    "Unit",
    "Wavelength",
    "Wavelengths",
    "Workers",
]


class Kind(StrEnum):
    """What a surface file holds."""

    auto = "auto"
    profile = "profile"
    map = "map"
    image = "image"


class Stokes(StrEnum):
    """Which Stokes elements to compute."""

    full = "full"
    linear = "linear"
    unpolarized = "unpolarized"


Surface = Annotated[
    Path,
    typer.Argument(
        help="Profile (x, z), height map, or micrograph of an edge.", show_default=False
    ),
]
Scan = Annotated[
    Path,
    typer.Argument(help="Goniometer file; the format is recognised.", show_default=False),
]
KindOption = Annotated[
    Kind,
    typer.Option("--kind", help="What the surface file holds, if not as its name says."),
]
UmPerPixel = Annotated[
    float | None,
    typer.Option(min=1e-6, max=1e4, help="Scale of a micrograph [um per pixel]."),
]
Spacing = Annotated[
    float | None,
    typer.Option(
        "--spacing-um",
        min=1e-6,
        max=1e6,
        help="Grid step of a map, or distance of points, where the file names none.",
    ),
]
Unit = Annotated[
    str | None,
    typer.Option(
        "--unit",
        "--units",
        help="Unit of a file that names none: nm, um, mm, m; of a profile also that of x "
        "and z, mm,nm, or of x and slope, mm,urad.",
    ),
]
ColumnsOption = Annotated[
    str | None,
    typer.Option(
        "--columns",
        help="Columns of a table by number from 1, or name: position and height (2,3), or "
        "x, y and z (1,2,4).",
    ),
]
UmPerLevel = Annotated[
    float | None,
    typer.Option(
        min=1e-9, max=1e6, help="Height of a grey level, of a picture of heights [um]."
    ),
]
MendOption = Annotated[
    str,
    typer.Option(
        "--mend",
        help="Faults of a map to mend: all, none, or some of sentinels, lines, offsets, "
        "spikes, terraces.",
    ),
]
Block = Annotated[
    int | None,
    typer.Option("--block", min=1, help="Which of several blocks of data in a file."),
]
Channel = Annotated[
    str | None,
    typer.Option(help="Channel of an instrument's file, by number or name."),
]
Aperture = Annotated[
    float | None,
    typer.Option(
        "--na",
        min=0.01,
        max=0.99,
        help="Numerical aperture of the objective that measured the map.",
    ),
]
InstrumentWavelength = Annotated[
    float,
    typer.Option(
        "--instrument-wavelength-um",
        min=0.01,
        max=1e3,
        help="Mean wavelength of that objective's light.",
    ),
]
Pixel = Annotated[
    float | None,
    typer.Option(
        "--pixel-um",
        min=1e-6,
        max=1e3,
        help="Pixel of that instrument on the surface; if not given, the map's step.",
    ),
]
FormOption = Annotated[
    str,
    typer.Option(
        "--form", help="Form to remove first: none, mean, tilt, curvature, a degree."
    ),
]
Blocked = Annotated[
    float,
    typer.Option(
        "--blocked-deg",
        min=0.0,
        max=45.0,
        help="Leave out readings this near to retro-reflection.",
    ),
]
Index = Annotated[
    float, typer.Option("--n", min=0.01, max=1e6, help="Real part of the refractive index.")
]
OptionalIndex = Annotated[
    float | None,
    typer.Option("--n", min=0.01, max=1e6, help="Real part of the refractive index."),
]
Kappa = Annotated[
    float | None,
    typer.Option(
        min=0.0,
        max=1e3,
        help="Imaginary part, n + i kappa; positive absorbs. 0 unless a file has it.",
        show_default=False,
    ),
]
MaterialFile = Annotated[
    str | None,
    typer.Option(
        "--material-file",
        help="Optical constants in place of --n and --kappa: CSV, YAML, .nk, or "
        "refractiveindex:shelf/book/page.",
    ),
]
MaterialIgnore = Annotated[
    str,
    typer.Option(
        "--material-ignore",
        help="Columns of that file to leave out, separated by commas.",
    ),
]
Wavelength = Annotated[
    float | None,
    typer.Option(
        "--wavelength-um", min=0.01, max=1e3, help="Use only rows of this wavelength."
    ),
]
At = Annotated[
    list[str] | None,
    typer.Option(
        help="NAME=VALUE of what a sweep varied, once for each name, in the store's units."
    ),
]
Free = Annotated[
    str,
    typer.Option(
        help="Parameters to fit, separated by commas: specular_gain, n, kappa, ..."
    ),
]
Shadowing = Annotated[
    str,
    typer.Option(
        help="Shadowing rule of the analytical model; an unknown name lists all that exist."
    ),
]
SlopeLaw = Annotated[
    str | None,
    typer.Option(
        "--slope-distribution",
        help="Slope distribution of the analytical model, by default gaussian; an unknown "
        "name lists all that exist.",
    ),
]
Rays = Annotated[
    int,
    typer.Option(
        "--n-rays", min=1000, max=10**9, help="Rays an incidence and realisation."
    ),
]
Realizations = Annotated[
    int, typer.Option(min=1, max=100_000, help="Independent random surfaces.")
]
PlannedRays = Annotated[
    int | None,
    typer.Option(
        "--n-rays", min=1000, max=10**9,
        help="Rays an incidence and realisation: 100000, or planned for a target error.",
    ),
]  # fmt: skip
PlannedRealizations = Annotated[
    int | None,
    typer.Option(
        "--realizations", min=1, max=100_000,
        help="Independent random surfaces: 16, or planned for a target error.",
    ),
]  # fmt: skip
Bundles = Annotated[
    int,
    typer.Option(
        "--n-rays", min=1000, max=10**9,
        help="Rays a geometry and realisation: fewer than simulate's, for each looks for "
        "one source, not for every direction.",
    ),
]  # fmt: skip
Seed = Annotated[int, typer.Option(min=0, help="Makes the run reproducible, bit for bit.")]
Workers = Annotated[
    int | None, typer.Option(min=1, max=1024, help="Threads; all cores if not given.")
]
Incidences = Annotated[
    str, typer.Option("--theta-i-deg", help="Zenith angles of the source, by commas.")
]
Azimuths = Annotated[
    str,
    typer.Option(
        "--phi-i-deg",
        help="Azimuths of the source by commas, or uniform for the average. One azimuth "
        "shows the surface as it lies; observe and sweep average if not told otherwise, as "
        "most scans of an unaligned sample do.",
    ),
]
Azimuth = Annotated[
    str,
    typer.Option(
        "--phi-i-deg",
        help="Azimuth of the source, or uniform for the average, which is what a scan "
        "compares with unless the sample was aligned.",
    ),
]
SourceHalfAngle = Annotated[
    float,
    typer.Option(
        "--source-half-angle-deg", min=0.0, max=28.0, help="Half-angle of the source."
    ),
]
Fold = Annotated[
    bool,
    typer.Option(
        "--fold", help="Average with the mirror image, for isotropic random scenes."
    ),
]
Wavelengths = Annotated[
    str | None,
    typer.Option("--wavelength-um", help="Wavelengths, for a material given as a table."),
]
Target = Annotated[
    float | None,
    typer.Option("--target-rel-error", min=1e-6, max=0.999, help="Go on to this error."),
]
Bounces = Annotated[
    int | None,
    typer.Option(
        "--max-bounces",
        min=1,
        max=10_000,
        help="Follow paths no further; what is left counts as truncated.",
    ),
]
ThetaBins = Annotated[int, typer.Option("--n-theta", min=1, max=2000, help="Zenith bins.")]
DphiBins = Annotated[int, typer.Option("--n-dphi", min=2, max=4000, help="Azimuth bins.")]
StokesOption = Annotated[
    Stokes, typer.Option("--stokes", help="Stokes elements to compute.")
]
Output = Annotated[
    Path | None,
    typer.Option("--output", "-o", help="Where to write; nothing is overwritten."),
]
AsJson = Annotated[
    Path | None,
    typer.Option("--json", help="Write all numbers here; - is standard output."),
]
Force = Annotated[
    bool, typer.Option("--force", help="Replace the output of an earlier run.")
]

"""`pbrdf plot`: a scan, or a simulated hemisphere, as a figure."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pbrdf.cli import declaring, options

if TYPE_CHECKING:
    import xarray as xr

HEMISPHERE = ("theta_i", "theta_s", "dphi", "stokes_out", "stokes_in")


def command(
    source: Annotated[
        Path,
        typer.Argument(help="Result (.nc) or goniometer file.", show_default=False),
    ],
    output: options.Output = None,
    force: options.Force = False,
    theta_i: Annotated[
        float,
        typer.Option(
            "--theta-i-deg", min=0.0, max=90.0, help="Incidence of a result to draw."
        ),
    ] = 30.0,
    wavelength: options.Wavelength = None,
    columns: declaring.ScanColumns = None,
    azimuth_of_forward: declaring.Forward = None,
    angles: declaring.Angles = None,
    quantity: declaring.QuantityOption = None,
    normalised: declaring.Normalised = None,
    at: Annotated[
        list[str] | None,
        typer.Option(
            help="NAME=VALUE where a result has more dimensions, as phi_i_deg=90 or what "
            "a sweep varied; the nearest is drawn."
        ),
    ] = None,
) -> None:
    """Draw M00, M10 and polarisation: a scan in plane, a result over the hemisphere.

    Example: pbrdf plot result.nc --theta-i-deg 60 -o result.png
    """
    import numpy as np

    import data_io
    from fitting.report.figures import hemisphere_figure, scan_figure
    from pbrdf.cli.reading import read_scan
    from pbrdf.cli.staging import staged_file

    target = output or source.with_suffix(".png")
    with staged_file(target, force=force) as stage:
        if source.suffix == ".nc":
            result = data_io.read_result(source)
            if "brdf_total" not in result:
                msg = (
                    f"{source.name} must hold brdf_total, got {list(result.data_vars)[:5]}."
                )
                raise ValueError(msg)
            places = dict(_place(text) for text in at or ())
            if wavelength is not None and "wavelength" in result.dims:
                places["wavelength"] = wavelength
            figure = hemisphere_figure(_cut(result, places), float(np.deg2rad(theta_i)))
        else:
            declared = declaring.declarations(
                columns, azimuth_of_forward, angles, quantity, normalised
            )
            scan = data_io.in_plane(
                read_scan(source, wavelength=wavelength, declared=declared)
            )
            if not scan.sizes["geometry"]:
                msg = f"{source.name} must have rows in the plane of incidence, got none."
                raise ValueError(msg)
            figure = scan_figure(scan)
        figure.savefig(stage, dpi=140)
    typer.echo(f"Figure: {target}")


def _place(text: str) -> tuple[str, float]:
    """Return dimension and value of NAME=VALUE; azimuths become radians."""
    name, _, value = text.partition("=")
    numbers = options.numbers(value, f"--at {name}")
    if len(numbers) != 1:
        msg = f"--at must be NAME=VALUE, got {text!r}."
        raise ValueError(msg)
    number = numbers[0]
    return ("phi_i", math.radians(number)) if name == "phi_i_deg" else (name, number)


def _cut(result: "xr.Dataset", places: Mapping[str, float]) -> "xr.Dataset":
    """Cut a result at these places, which must leave one hemisphere an incidence."""
    further = [str(name) for name in result.brdf_total.dims if name not in HEMISPHERE]
    if set(further) != set(places):
        named = ["phi_i_deg" if name == "phi_i" else name for name in further]
        msg = (
            "--at must be given once for each further dimension of the result, "
            f"{', '.join(named) or 'here none'}, got {', '.join(places) or 'none'}."
        )
        raise ValueError(msg)
    return result.sel(places, method="nearest")

"""`pbrdf plot`: a scan, or a simulated hemisphere, as a figure."""

import math
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pbrdf.cli import declaring, option_text, options

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


class Scale(StrEnum):
    """Of the colours of Mueller elements."""

    auto = "auto"
    linear = "linear"
    log = "log"
    symlog = "symlog"


def command(
    source: Annotated[
        Path,
        typer.Argument(
            help="Result (.nc, .zarr), store of a sweep (.zarr), scene (.toml) or "
            "goniometer file.",
            show_default=False,
        ),
    ],
    output: options.Output = None,
    force: options.Force = False,
    theta_i: Annotated[
        float | None,
        typer.Option(
            "--theta-i-deg",
            min=0.0,
            max=90.0,
            help="Incidence of a result to draw, one "
            "that was computed; the first without it.",
        ),
    ] = None,
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
            "a sweep varied: one that was computed, of a store any between."
        ),
    ] = None,
    elements: Annotated[
        str, typer.Option(help="By commas: M00 ... M33, DOLP, AOLP.")
    ] = "M00,M10,M20,DOLP",
    scale: Annotated[Scale, typer.Option(help="Of the colours of M00 ... M33.")] = (
        Scale.auto
    ),
    width_mm: Annotated[
        float, typer.Option(min=60.0, max=1000.0, help="Printed width, 85 or 170 [mm].")
    ] = 170.0,
    errors: Annotated[
        bool, typer.Option("--errors", help="Add panels of the standard errors.")
    ] = False,
    plane: Annotated[
        bool, typer.Option("--in-plane", help="Draw the cut in the plane of incidence.")
    ] = False,
    minus: Annotated[
        str | None,
        typer.Option(help="Of a dew result: add the other states minus this one, as dry."),
    ] = None,
    seed: options.Seed = 0,
) -> None:
    """Draw a scan in plane, a result over the hemisphere, or a scene in space.

    Example: pbrdf plot result.nc --theta-i-deg 60 -o result.png
    """
    import data_io
    from pbrdf.cli.places import places_in, written_places
    from pbrdf.cli.reading import read_scan
    from pbrdf.cli.staging import staged_file
    from pbrdf.plots import hemisphere, plane_cuts, scan_figure

    target = option_text.picture(output or source.with_suffix(".png"))
    with staged_file(target, force=force) as stage:
        if source.suffix == ".nc" or data_io.is_result_store(source):
            result = data_io.read_result(source)
            places = places_in(
                result, theta_i, wavelength, written_places(at), one=not plane
            )
            names = option_text.names(elements)
            if plane:
                figure = plane_cuts(
                    result, names, scale=scale.value, width_mm=width_mm, places=places
                )
            else:
                figure = hemisphere(
                    result, names, errors=errors, minus=minus, scale=scale.value,
                    width_mm=width_mm, places=places,
                )  # fmt: skip
        elif source.suffix == ".zarr":
            figure = _of_store(
                source, at, theta_i, wavelength, option_text.names(elements), plane=plane,
                scale=scale.value, width_mm=width_mm,
            )  # fmt: skip
        elif source.suffix == ".toml":
            from pbrdf import load_scene
            from pbrdf.plots.bodies import scene_picture

            figure = scene_picture(load_scene(source), width_mm=width_mm, seed=seed)
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
            figure = scan_figure(scan, width_mm=width_mm, label=_origin(scan))
        figure.savefig(stage, dpi=200)
    typer.echo(f"Figure: {target}")


def _origin(scan: "xr.Dataset") -> str:
    """Return what the rows of a table are, by its comments."""
    from pbrdf.cli.showing.export import MODEL, SIMULATION

    lines = str(scan.attrs.get("comments", "")).splitlines()
    kinds = {MODEL: "model", SIMULATION: "simulated"}
    return next((word for line, word in kinds.items() if line in lines), "measured")


def _of_store(
    source: Path,
    at: list[str] | None,
    theta_i: float | None,
    wavelength: float | None,
    elements: tuple[str, ...],
    *,
    plane: bool,
    **look: Any,
) -> "Figure":
    """Draw a store at one value of each thing that varied."""
    from pbrdf.cli.reading import read_store
    from pbrdf.plots import hemisphere, plane_cuts

    incidence = None if theta_i is None else math.radians(theta_i)
    # A band shows the error of interpolation; as a mask it would hide what noise does not
    here = read_store(
        source, at, wavelength=wavelength, theta_i=incidence, interpolated=plane
    )
    if plane:
        return plane_cuts(here, elements, **look)
    first = {
        name: here[name].values[0]
        for name in ("theta_i", "wavelength")
        if name in here.dims
    }
    return hemisphere(here, elements, fold=False, places=first, **look)

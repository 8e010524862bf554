"""`pbrdf export`: results and models in the formats of other programs."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pbrdf.cli import options

if TYPE_CHECKING:
    import xarray as xr


def command(
    source: Annotated[
        Path, typer.Argument(help="Result (.nc) or model (.toml).", show_default=False)
    ],
    output: Annotated[
        Path,
        typer.Option(
            "--output",
            "-o",
            help=".pbsdf: polarised measured BSDF of Mitsuba 3. .csv: goniometer table.",
        ),
    ],
    force: options.Force = False,
    wavelength: options.Wavelength = None,
) -> None:
    """Write a simulated or fitted BRDF for a renderer, or as a table.

    Example: pbrdf export model.toml -o vinyl.pbsdf
    """
    import data_io
    from pbrdf.cli.staging import staged_file

    writers = {".pbsdf": "Mitsuba", ".csv": "table"}
    if output.suffix not in writers:
        msg = f"--output must end in {' or '.join(writers)}, got {output.name!r}."
        raise ValueError(msg)
    if source.suffix not in (".nc", ".toml"):
        msg = f"source must be a result (.nc) or a model (.toml), got {source.name!r}."
        raise ValueError(msg)
    if output.suffix == ".csv" and source.suffix == ".toml":
        msg = f"a table needs the geometries of a result (.nc), got {source.name!r}."
        raise ValueError(msg)
    with staged_file(output, force=force) as stage:
        if source.suffix == ".toml":
            model = data_io.read_model(source)
            data_io.export_mitsuba(model, stage, wavelength=wavelength)
        elif output.suffix == ".csv":
            data_io.write_goniometer(as_rows(data_io.read_result(source)), stage)
        else:
            data_io.export_mitsuba(data_io.read_result(source), stage)
    typer.echo(f"Written: {output}")


def as_rows(result: "xr.Dataset") -> "xr.Dataset":
    """Return a simulated hemisphere as goniometer rows, all bounces, with its errors."""
    import numpy as np
    import xarray as xr

    axes = [
        name for name in ("wavelength", "theta_i", "theta_s", "dphi") if name in result.dims
    ]
    labels = {name: number for number, name in enumerate("IQUV")}
    total = result.brdf_total.stack(geometry=axes).reset_index("geometry")
    error = result.brdf_total_stderr.stack(geometry=axes).reset_index("geometry")
    rows = {}
    for out in total.stokes_out.values:
        for into in total.stokes_in.values:
            element = f"M{labels[out]}{labels[into]}"
            here = {"stokes_out": out, "stokes_in": into}
            rows[element] = ("geometry", total.sel(here).values)
            # An empty bin has no spread, which is not the same as no error
            spread = error.sel(here).values
            rows[f"{element}_stderr"] = ("geometry", np.where(spread > 0.0, spread, np.nan))
    coords = {name: ("geometry", np.asarray(total[name])) for name in axes}
    return xr.Dataset(rows, coords)

"""`pbrdf statistics`: how rough a measured surface is, and how well that is known."""

import json
from pathlib import Path
from typing import Annotated

import typer

from pbrdf.cli import options
from pbrdf.cli.options import Kind


def statistics(
    surface: options.Surface,
    kind: options.KindOption = Kind.auto,
    um_per_pixel: options.UmPerPixel = None,
    spacing: options.Spacing = None,
    unit: options.Unit = None,
    form: options.FormOption = "tilt",
    figure: Annotated[
        Path | None,
        typer.Option(help="Draw the height and slope histograms here (png, pdf)."),
    ] = None,
    as_json: Annotated[
        Path | None, typer.Option("--json", help="Write all numbers here.")
    ] = None,
    force: options.Force = False,
) -> None:
    """Print height, correlation length, slope and noise, each with its uncertainty.

    Example: pbrdf statistics edge.png --um-per-pixel 0.5
    """
    from pbrdf.cli.reading import read_surface
    from pbrdf.cli.staging import staged_file

    heights = read_surface(
        surface, kind=kind, um_per_pixel=um_per_pixel, spacing=spacing, unit=unit
    )

    from fitting import surface_statistics

    found = surface_statistics(heights, form=options.form(form))
    if as_json is not None:
        with staged_file(as_json, force=force) as stage:
            stage.write_text(json.dumps(found.to_dict(), indent=2) + "\n", encoding="utf-8")
    if figure is not None:
        from fitting.figures import histogram_figure

        with staged_file(figure, force=force) as stage:
            histograms = [found.height_histogram(), found.slope_histogram()]
            histogram_figure(histograms).savefig(stage, dpi=140)
    typer.echo(str(found))

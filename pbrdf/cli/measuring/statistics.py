"""`pbrdf statistics`: how rough a measured surface is, and how well that is known."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from pbrdf.cli import option_text, options
from pbrdf.cli.options import Kind


class Phase(StrEnum):
    """Which side of an edge is the sample."""

    dark = "dark"
    bright = "bright"


class Direction(StrEnum):
    """How an edge runs."""

    horizontal = "horizontal"
    vertical = "vertical"


def command(
    surface: options.Surface,
    kind: options.KindOption = Kind.auto,
    um_per_pixel: options.UmPerPixel = None,
    spacing: options.Spacing = None,
    unit: options.Unit = None,
    channel: options.Channel = None,
    columns: options.ColumnsOption = None,
    block: options.Block = None,
    um_per_level: options.UmPerLevel = None,
    mend: options.MendOption = "all",
    form: options.FormOption = "tilt",
    figure: Annotated[
        Path | None,
        typer.Option(
            help="Draw surface, mended parts, autocorrelation, spectrum, slopes (png, pdf)."
        ),
    ] = None,
    as_json: options.AsJson = None,
    scale_bar_um: Annotated[
        float | None,
        typer.Option(min=1e-4, max=1e5, help="Length written at a micrograph's scale bar."),
    ] = None,
    edge: Annotated[
        int | None,
        typer.Option(
            min=0, help="Which edge of a micrograph, from top or left; else longest."
        ),
    ] = None,
    material: Annotated[
        Phase | None, typer.Option(help="Which side of a micrograph's edge is the sample.")
    ] = None,
    direction: Annotated[
        Direction | None, typer.Option(help="How the edge runs in a micrograph.")
    ] = None,
    overlay: Annotated[
        Path | None,
        typer.Option(help="Draw the edge into the micrograph here (png), to check by eye."),
    ] = None,
    slopes: Annotated[
        Path | None,
        typer.Option(help="Write the slope distribution with its errors here (csv)."),
    ] = None,
    cutoff: Annotated[
        float,
        typer.Option(
            "--cutoff-um",
            min=0.0,
            max=1e9,
            help="Shortest wavelength that counts for --slopes; 0: as measured.",
        ),
    ] = 0.0,
    force: options.Force = False,
) -> None:
    """Print height, correlation length, slope and noise, each with its uncertainty.

    Examples: pbrdf statistics edge.png --um-per-pixel 0.5

    pbrdf statistics sem.jpg --scale-bar-um 120 --edge 3 --overlay check.png
    """
    from pbrdf.cli.reading import read_surface
    from pbrdf.cli.staging import answer, staged_file

    picture = {
        "scale_bar_um": scale_bar_um,
        "edge": edge,
        "material": material,
        "direction": direction,
    }
    if figure is not None:
        option_text.picture(figure, "--figure")
    heights = read_surface(
        surface, kind=kind, um_per_pixel=um_per_pixel, spacing=spacing, unit=unit,
        channel=channel, columns=columns, block=block, um_per_level=um_per_level,
        mend=mend, picture=picture,
    )  # fmt: skip
    if overlay is not None:
        _draw_overlay(overlay, surface, heights, force=force)

    from fitting import surface_statistics

    found = surface_statistics(heights, form=option_text.form(form))
    answer(str(found), found.to_dict(), as_json, force=force)
    if figure is not None:
        from fitting.report.surface import surface_figure

        with staged_file(figure, force=force) as stage:
            surface_figure(heights, found).savefig(stage, dpi=140)
    if slopes is not None:
        from fitting import slope_distribution

        with staged_file(slopes, force=force) as stage:
            slope_distribution(heights, cutoff=cutoff).to_frame().to_csv(stage, index=False)


def _draw_overlay(overlay: Path, surface: Path, heights: Any, *, force: bool) -> None:
    """Write the micrograph with its edge drawn in."""
    from data_io import write_profile_overlay
    from data_io.micrograph.read import EdgeProfile
    from pbrdf.cli.staging import staged_file

    if not isinstance(heights, EdgeProfile):
        msg = f"--overlay needs a micrograph, got {surface.name}. Leave it out."
        raise ValueError(msg)
    with staged_file(overlay, force=force) as stage:
        write_profile_overlay(stage, surface, [heights])

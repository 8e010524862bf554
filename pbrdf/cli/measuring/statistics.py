"""`pbrdf statistics`: how rough a measured surface is, and how well that is known."""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pbrdf.cli import option_text, options
from pbrdf.cli.unused import refuse_unused

if TYPE_CHECKING:
    from pbrdf import MeshSurface

# Options that have no meaning for a mesh
_OF_HEIGHTS = (
    "um_per_pixel", "spacing", "channel", "columns", "block", "um_per_level", "mend",
    "form", "figure", "scale_bar_um", "edge", "material", "direction", "overlay", "cutoff",
)  # fmt: skip


class Kind(StrEnum):
    """What a file holds of which statistics are asked for."""

    auto = "auto"
    profile = "profile"
    map = "map"
    image = "image"
    mesh = "mesh"


class Phase(StrEnum):
    """Which side of an edge is the sample."""

    dark = "dark"
    bright = "bright"


class Direction(StrEnum):
    """How an edge runs."""

    horizontal = "horizontal"
    vertical = "vertical"


def command(
    context: typer.Context,
    surface: Annotated[
        Path,
        typer.Argument(
            help="Profile (x, z), height map, triangle mesh or scene with one, or "
            "micrograph of an edge.",
            show_default=False,
        ),
    ],
    kind: Annotated[
        Kind,
        typer.Option(
            help="What the file holds, if not as its name says; a mesh file is a map "
            "without it."
        ),
    ] = Kind.auto,
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
        typer.Option(
            help="Write the slope distribution with its errors here (csv); of a mesh the "
            "share of its area by tilt."
        ),
    ] = None,
    period: Annotated[
        str | None,
        typer.Option(
            "--period-um", help="Periods of a --kind mesh along x and y: 40,40 [um]."
        ),
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

    With --kind mesh, overhangs included: area ratio, share of overhangs and walls, slopes.

    Examples: pbrdf statistics edge.png --um-per-pixel 0.5

    pbrdf statistics sem.jpg --scale-bar-um 120 --edge 3 --overlay check.png
    """
    from pbrdf.cli.reading import read_surface
    from pbrdf.cli.staging import answer, staged_file

    if kind is Kind.mesh or surface.suffix.lower() == ".toml":
        refuse_unused(context, _OF_HEIGHTS, "for the statistics of a mesh")
        _of_mesh(_mesh(context, surface, unit, period), slopes, as_json, force=force)
        return
    refuse_unused(context, ["period"], "without --kind mesh")
    picture = {
        "scale_bar_um": scale_bar_um,
        "edge": edge,
        "material": material,
        "direction": direction,
    }
    if figure is not None:
        option_text.picture(figure, "--figure")
    heights = read_surface(
        surface, kind=options.Kind(kind), um_per_pixel=um_per_pixel, spacing=spacing,
        unit=unit, channel=channel, columns=columns, block=block,
        um_per_level=um_per_level, mend=mend, picture=picture,
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


def _mesh(
    context: typer.Context, path: Path, unit: str | None, period: str | None
) -> "MeshSurface":
    """Read a mesh, from its own file or as the surface of a scene."""
    from pbrdf import MeshSurface, load_scene

    if path.suffix.lower() == ".toml":
        refuse_unused(context, ["unit", "period"], "beside a scene file, which has its own")
        surface = load_scene(path).surface
        if not isinstance(surface, MeshSurface):
            msg = (
                f"{path.name} must be a scene with a mesh, got one with a "
                f"{type(surface).__name__}. Name the file of its heights instead."
            )
            raise ValueError(msg)
        return surface
    lengths = None
    if period is not None:
        numbers = option_text.numbers(period, "--period-um")
        if len(numbers) != 2:
            msg = f"--period-um must be two lengths, as in 40,40, got {period!r}."
            raise ValueError(msg)
        lengths = numbers[0], numbers[1]
    return MeshSurface(path, lengths, unit=unit)


def _of_mesh(
    mesh: "MeshSurface", slopes: Path | None, as_json: Path | None, *, force: bool
) -> None:
    """Print the statistics of a mesh."""
    from fitting import surface_statistics
    from pbrdf.cli.staging import answer, staged_file

    found = surface_statistics(mesh)
    answer(str(found), found.to_dict(), as_json, force=force)
    if slopes is not None:
        with staged_file(slopes, force=force) as stage:
            found.tilts().to_csv(stage, index=False)


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

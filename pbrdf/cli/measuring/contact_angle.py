"""`pbrdf contact-angle`: contact angles of a drop from its photograph."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pbrdf.cli import options

if TYPE_CHECKING:
    from fitting.drops.silhouette import ContactAngle


def command(
    photo: Annotated[
        Path,
        typer.Argument(help="Picture of the drop, from the side.", show_default=False),
    ],
    baseline: Annotated[
        str | None,
        typer.Option(
            help="Row and column of two points where the substrate begins: r,c,r,c."
        ),
    ] = None,
    crop: Annotated[
        str | None,
        typer.Option(
            help="Part of the picture to use: first row, last, first column, last."
        ),
    ] = None,
    which: Annotated[
        int | None,
        typer.Option(min=1, help="Which of several drops, from the left; else widest."),
    ] = None,
    overlay: Annotated[
        Path | None,
        typer.Option(help="Draw outline and baseline into the picture here (png)."),
    ] = None,
    as_json: options.AsJson = None,
    force: options.Force = False,
) -> None:
    """Print both contact angles, through the liquid, each with its uncertainty.

    Examples: pbrdf contact-angle drop.png --overlay check.png

    pbrdf contact-angle drop.png --baseline 300,80,302,560 --json -
    """
    from fitting import contact_angle
    from pbrdf.cli.staging import answer, staged_file

    points = _four("--baseline", baseline, "row and column of two points")
    part = _four("--crop", crop, "first and last row, first and last column")
    if points is not None and points[1] == points[3]:
        msg = f"--baseline must join two columns, got {baseline}. Name points far apart."
        raise ValueError(msg)
    found = contact_angle(
        photo,
        baseline=None if points is None else [points[:2], points[2:]],
        crop=None if part is None else tuple(round(edge) for edge in part),  # type: ignore[arg-type]
        which=which,
    )
    if overlay is not None:
        from fitting.drops.overlay import write_drop_overlay

        with staged_file(overlay, force=force) as stage:
            write_drop_overlay(stage, photo, found)
    answer(_lines(found), found.to_dict(), as_json, force=force)
    for remark in found.warnings:
        typer.echo(f"warning: {remark}.".replace("which=", "--which"), err=True)


def _four(option: str, text: str | None, meaning: str) -> list[float] | None:
    """Return the four numbers of an option."""
    if text is None:
        return None
    try:
        values = [float(word) for word in text.split(",")]
    except ValueError:
        values = []
    if len(values) != 4:
        msg = f"{option} must be four numbers by commas, {meaning}, got {text!r}."
        raise ValueError(msg)
    return values


def _lines(found: "ContactAngle") -> str:
    """Return the result for a reader."""
    sides: list[tuple[str, Any]] = [("left", found.left), ("right", found.right)]
    rows = [f"{name:6}{estimate} degrees" for name, estimate in sides]
    (top, left), (bottom, right) = found.baseline
    beyond = max(side.high - side.value - 1.96 * side.stderr for _, side in sides)
    allowed = (
        f"Upper ends allow for {beyond:.1f} degrees by it (0 with --baseline)."
        if beyond >= 0.05
        else "Here the contact is seen, or given, and the intervals leave it out."
    )
    return "\n".join(
        [
            *rows,
            f"base  {found.base_width:.1f} pixels wide, drop {found.height:.1f} high; from "
            f"row {top:.1f}, column {left:.1f} to row {bottom:.1f}, column {right:.1f}",
            "A foot hidden by the substrate's front edge is not seen in a silhouette: each "
            f"pixel of it adds {max(found.per_pixel, key=abs):+.2f} degrees. {allowed}",
        ]
    )

"""`pbrdf report`: a result as one page to explore, which needs no other file."""

from pathlib import Path
from typing import Annotated

import typer

from pbrdf.cli import options


def command(
    source: Annotated[
        Path,
        typer.Argument(
            help="Result or sweep (.nc, .zarr), or a folder that holds one.",
            show_default=False,
        ),
    ],
    output: options.Output = None,
    force: options.Force = False,
) -> None:
    """Write a page with summary, hemisphere, fits, glossary and origin of a result.

    Example: pbrdf report result.nc -o report.html
    """
    import data_io
    from fitting.report.explorer import page_of
    from pbrdf.cli.staging import staged_file
    from pbrdf.stored import is_sweep_store, read_sweep

    swept = is_sweep_store(source)
    one = swept or not source.is_dir() or data_io.is_result_store(source)
    file = source if one else _result_in(source)
    with staged_file(output or file.with_suffix(".html"), force=force) as stage:
        result = read_sweep(file) if swept else data_io.read_result(file)
        page = page_of(result, file.name)
        stage.write_text(page, encoding="utf-8")
    typer.echo(f"Report: {output or file.with_suffix('.html')}")


def _result_in(folder: Path) -> Path:
    """Return the one result of a folder."""
    found = sorted(folder.glob("*.nc"))
    if len(found) == 1:
        return found[0]
    listed = ", ".join(file.name for file in found) or "none"
    msg = f"{folder.name} must hold one result (.nc), got {listed}. Name the file."
    raise ValueError(msg)

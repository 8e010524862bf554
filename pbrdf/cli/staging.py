"""Output that appears whole or not at all, and never in place of a stranger's files."""

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import typer

from pbrdf.cli.typed import check_apart
from pbrdf.files import complete_file, complete_folder

__all__ = [
    "alone", "answer", "staged_file", "staged_folder", "staged_store", "write_numbers",
]  # fmt: skip

# What tells a result folder of this program from any other folder
MARK = "model.toml"


@contextmanager
def staged_folder(target: Path, *, force: bool = False) -> Iterator[Path]:
    """Yield a new empty folder that takes the place of `target` when the block succeeds.

    Parameters
    ----------
    target : Path
        Where the results shall be. Its parent must exist.
    force : bool
        Replace the results of an earlier run. Any other folder is never replaced.

    Raises
    ------
    ValueError
        If `target` exists and may not be replaced; before any work is done where it can be
        known by then.
    """
    check_apart(target)
    _check_ours(target)
    with complete_folder(target, replace=force) as stage:
        yield stage


@contextmanager
def staged_file(target: Path, *, force: bool = False) -> Iterator[Path]:
    """Yield a path beside `target` whose file takes its place when the block succeeds.

    Raises
    ------
    ValueError
        If `target` is a folder, or exists and `force` is not given.
    """
    check_apart(target)
    with complete_file(target, replace=force) as stage:
        yield stage


@contextmanager
def staged_store(target: Path, *, force: bool = False) -> Iterator[Path]:
    """Yield a new empty folder that becomes the store `target` when the block succeeds.

    Raises
    ------
    ValueError
        If `target` exists and `force` is not given, or it is no store of a result.
    """
    from data_io import is_result_store

    check_apart(target)
    strange = target.is_dir() and any(target.iterdir()) and not is_result_store(target)
    if strange or (target.exists() and not target.is_dir()):
        msg = (
            f"output must be a new store or that of a result, got {target}, which is "
            "neither. Name another."
        )
        raise ValueError(msg)
    with complete_folder(target, replace=force) as stage:
        yield stage


def _check_ours(target: Path) -> None:
    if not target.exists() or (target.is_dir() and not any(target.iterdir())):
        return
    if not target.is_dir() or not (target / MARK).is_file():
        msg = (
            f"output must be a new folder or an earlier result, got {target}, "
            "which is neither. Name another."
        )
        raise ValueError(msg)


def answer(
    words: str, numbers: Mapping[str, Any], as_json: Path | None, *, force: bool
) -> None:
    """Print an answer in words, its numbers going where --json says.

    On standard output the numbers stand alone.
    """
    if not alone(as_json):
        typer.echo(words)
    if as_json is not None:
        write_numbers(numbers, as_json, force=force)


def alone(as_json: Path | None) -> bool:
    """Whether standard output is for numbers."""
    return str(as_json) == "-"


def write_numbers(numbers: Mapping[str, Any], target: Path, *, force: bool) -> None:
    """Write JSON to a file, or to standard output for -."""
    text = json.dumps(numbers, indent=2)
    if alone(target):
        typer.echo(text)
        return
    with staged_file(target, force=force) as stage:
        stage.write_text(f"{text}\n", encoding="utf-8")

"""Output that appears whole or not at all, and never in place of a stranger's files."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pbrdf.files import complete_file, complete_folder

__all__ = ["staged_file", "staged_folder", "staged_store"]

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

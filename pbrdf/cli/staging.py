"""Output that appears whole or not at all."""

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

__all__ = ["staged_file", "staged_folder"]

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
        If `target` exists and may not be replaced. Raised before any work is done.
    """
    _check_parent(target)
    _check_free(target, force=force)
    stage = Path(tempfile.mkdtemp(prefix=f".{target.name}-", dir=target.parent))
    try:
        stage.chmod(0o755)
        yield stage
        _replace_folder(stage, target)
    finally:
        shutil.rmtree(stage, ignore_errors=True)


@contextmanager
def staged_file(target: Path, *, force: bool = False) -> Iterator[Path]:
    """Yield a path beside `target` whose file takes its place when the block succeeds.

    Raises
    ------
    ValueError
        If `target` is a folder, or exists and `force` is not given.
    """
    _check_parent(target)
    if target.is_dir():
        msg = f"output must be a file, got the folder {target}. Name a file in it."
        raise ValueError(msg)
    if target.exists() and not force:
        msg = f"output must be new, got {target}, which exists. Use --force to replace it."
        raise ValueError(msg)
    with tempfile.TemporaryDirectory(
        prefix=f".{target.stem}-", dir=target.parent
    ) as folder:
        # The suffix stays: writers choose their format by it
        stage = Path(folder) / target.name
        yield stage
        stage.replace(target)


def _check_parent(target: Path) -> None:
    if not target.parent.is_dir():
        msg = (
            f"output must lie in a folder that exists, got {target}. Make the folder first."
        )
        raise ValueError(msg)


def _check_free(target: Path, *, force: bool) -> None:
    if not target.exists() or (target.is_dir() and not any(target.iterdir())):
        return
    if not target.is_dir() or not (target / MARK).is_file():
        msg = (
            f"output must be a new folder or an earlier result, got {target}, "
            "which is neither. Name another."
        )
        raise ValueError(msg)
    if not force:
        msg = f"output must be new, got {target}, which exists. Use --force to replace it."
        raise ValueError(msg)


def _replace_folder(stage: Path, target: Path) -> None:
    if not target.exists():
        stage.rename(target)
        return
    # Two renames: at no moment does the target hold half of the old and half of the new
    old = Path(tempfile.mkdtemp(prefix=f".{target.name}-old-", dir=target.parent))
    target.rename(old / target.name)
    stage.rename(target)
    shutil.rmtree(old)

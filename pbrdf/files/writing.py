"""One way to write: built beside its target, synced, then put in place in one step.

What is being written has an unguessable name that tells which process on which machine
writes it, so that a later run can clear away what a killed one has left.
"""

import ctypes
import errno
import os
import re
import shutil
import socket
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

__all__ = ["FULL", "ExistsError", "complete_file", "complete_folder"]

# No space left, over quota, file too large for the limits of the process
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
# Ends the name of what has been moved aside
_OLD = "-old"
_PART = re.compile(r"^\..*\.part-(?P<host>[\w-]+)-(?P<pid>\d+)-")


class ExistsError(ValueError):
    """The target exists and may not be replaced: another run may have won."""

    def __init__(self, target: Path) -> None:
        super().__init__(
            f"output must be new, got {target}, which exists. Use --force to replace it."
        )


@contextmanager
def complete_file(path: str | Path, *, replace: bool = True) -> Iterator[Path]:
    """Give a temporary path in the same folder; it becomes `path` if the body succeeds.

    A reader never sees half a file, a failure leaves an older file as it was, and of two
    processes that may not replace anything exactly one gets the name.

    Parameters
    ----------
    path : str or Path
        The target. Its folder must exist.
    replace : bool
        Whether an existing file may be replaced.

    Raises
    ------
    ValueError
        If the folder does not exist, or the target exists and `replace` is False.
    """
    path = Path(path)
    _check_folder(path)
    if path.is_dir():
        msg = f"output must be a file, got the folder {path}. Name a file in it."
        raise ValueError(msg)
    if not replace and path.exists():
        raise ExistsError(path)
    _clear_leftovers(path.parent)
    # The suffix stays: writers choose their format by it
    try:
        handle, name = tempfile.mkstemp(
            prefix=_prefix(path), suffix=path.suffix, dir=path.parent
        )
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error
    os.close(handle)
    stage = Path(name)
    try:
        yield stage
        stage.chmod(0o666 & ~_umask())
        _sync(stage)
        if replace:
            stage.replace(path)
        else:
            _take_name(stage, path)
        _sync(path.parent)
    except OSError as error:
        raise _named(error, path) from error
    finally:
        stage.unlink(missing_ok=True)


@contextmanager
def complete_folder(target: Path, *, replace: bool = False) -> Iterator[Path]:
    """Give a new empty folder that becomes `target` if the body succeeds.

    Raises
    ------
    ValueError
        If the parent does not exist, or the target holds anything and `replace` is False.
    """
    _check_folder(target)
    _clear_leftovers(target.parent)
    if not replace and target.exists() and not _empty_folder(target):
        raise ExistsError(target)
    try:
        stage = Path(tempfile.mkdtemp(prefix=_prefix(target), dir=target.parent))
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(target)) from error
    try:
        yield stage
        stage.chmod(0o777 & ~_umask())
        for file in stage.rglob("*"):
            _sync(file)
        _sync(stage)
        _put_folder(stage, target, replace=replace)
        _sync(target.parent)
    except OSError as error:
        _clear(stage)
        raise _named(error, target) from error
    except BaseException:
        _clear(stage)
        raise


def _clear(stage: Path) -> None:
    """Remove a folder that other threads of this process may still be writing to."""
    gone = 0
    for _ in range(100):
        shutil.rmtree(stage, ignore_errors=True)
        gone = 0 if stage.exists() else gone + 1
        if gone > 8:
            return
        time.sleep(0.02)


def _named(error: OSError, target: Path) -> OSError:
    """Return the error of a full disk with the name of what should have been written."""
    if error.errno in FULL:
        return OSError(error.errno, error.strerror, str(target))
    return error


def _put_folder(stage: Path, target: Path, *, replace: bool) -> None:
    try:
        # Takes the place of an empty folder, of none that holds anything
        stage.rename(target)
    except OSError:
        if not replace:
            raise ExistsError(target) from None
        if _exchanged(stage, target):
            _remove(stage)
            return
        # Two renames: at no moment does the target hold half of the old and of the new
        old = Path(tempfile.mkdtemp(prefix=_prefix(target), suffix=_OLD, dir=target.parent))
        target.rename(old / target.name)
        stage.rename(target)
        shutil.rmtree(old)


def _exchanged(one: Path, other: Path) -> bool:
    """Give two files or folders each other's name in one step; False if none can."""
    if sys.platform != "linux":
        return False
    # Python has no name for it; 2 is RENAME_EXCHANGE of renameat2(2)
    rename = getattr(ctypes.CDLL(None), "renameat2", None)
    here = -100
    return rename is not None and not rename(here, bytes(one), here, bytes(other), 2)


def _remove(entry: Path) -> None:
    if entry.is_dir() and not entry.is_symlink():
        shutil.rmtree(entry)
    else:
        entry.unlink()


def _take_name(stage: Path, path: Path) -> None:
    """Give the file its name unless another file has it."""
    try:
        os.link(stage, path)
    except FileExistsError:
        raise ExistsError(path) from None
    except OSError:
        # No hard links here: an empty file made by nobody else holds the place
        try:
            os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY))
        except FileExistsError:
            raise ExistsError(path) from None
        stage.replace(path)


def _prefix(path: Path) -> str:
    return f".{path.stem[:30]}.part-{_host()}-{os.getpid()}-"


def _host() -> str:
    return re.sub(r"[^\w]", "-", socket.gethostname())[:40] or "host"


def _clear_leftovers(folder: Path) -> None:
    """Remove what processes of this machine that no longer run have left half written."""
    host = _host()
    with suppress(OSError):
        for entry in folder.iterdir():
            found = _PART.match(entry.name)
            if not found or found["host"] != host or _runs(int(found["pid"])):
                continue
            with suppress(OSError):
                if entry.name.endswith(_OLD) and entry.is_dir():
                    _put_back(entry)
                _remove(entry)


def _put_back(old: Path) -> None:
    """Put back a folder whose process ended before another took its place."""
    for held in old.iterdir():
        target = old.parent / held.name
        if not target.exists():
            held.rename(target)


def _runs(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


def _check_folder(path: Path) -> None:
    if not path.parent.is_dir():
        msg = f"output must lie in a folder that exists, got {path}. Make the folder first."
        raise ValueError(msg)


def _empty_folder(target: Path) -> bool:
    return target.is_dir() and not any(target.iterdir())


def _umask() -> int:
    # Python can ask for it only by setting it
    umask = os.umask(0)
    os.umask(umask)
    return umask


def _sync(path: Path) -> None:
    """Ask the disk to keep it; some file systems cannot be asked of folders."""
    if path.is_dir() and os.name == "nt":
        return
    with suppress(PermissionError):
        handle = os.open(path, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)

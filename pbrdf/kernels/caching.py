"""Where compiled kernels are kept, and who compiles them.

Numba does not notice an edited callee in another file, so the folder is named after a hash
of every kernel source and of the Numba version: editing any kernel starts a fresh one.
Inside it a kernel is found by its module and the content of its file, not by path and
time: every checkout and installation of the same sources shares what one has compiled.

Of several processes that want one kernel, one compiles it and the others wait. Numba's
index of what it keeps is read and written back without a lock, and two that write at once
can leave code under another's key.
"""

import hashlib
import os
import tempfile
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba
from filelock import FileLock
from numba.core.compiler_lock import global_compiler_lock

__all__ = ["ByContent", "cache_folder", "keeping", "kernel_sources"]

_ROOT = Path(__file__).parent


def kernel_sources() -> list[Path]:
    """Every source file that the hash of the cache covers: the whole tree of kernels."""
    return sorted(_ROOT.rglob("*.py"))


def cache_folder() -> Path:
    """Folder of the compiled kernels: PBRDF_CACHE_DIR or ~/.cache/pbrdf, then the hash."""
    digest = hashlib.sha256(numba.__version__.encode())
    for source in kernel_sources():
        digest.update(source.relative_to(_ROOT).as_posix().encode() + source.read_bytes())
    chosen = os.environ.get("PBRDF_CACHE_DIR")
    base = Path(chosen) if chosen else Path.home() / ".cache" / "pbrdf"
    return base / f"kernels-{digest.hexdigest()[:16]}"


def _usable(folder: Path) -> bool:
    """Whether compiled kernels can be kept in this folder.

    Where it cannot be written, Numba would keep them beside the sources, under a key that
    knows nothing of edited callees, and return old answers.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError as error:
        warnings.warn(
            f"Compiled kernels cannot be kept in {folder} ({error.strerror or error}): "
            "they are compiled anew in each process. Set PBRDF_CACHE_DIR to a folder that "
            "can be written.",
            RuntimeWarning,
            stacklevel=2,
        )
        return False


_FOLDER = cache_folder()
_KEPT = _usable(_FOLDER)


@cache
def _place_and_stamp(py_file: str) -> tuple[str, str]:
    """Folder name of a module's kernels, and the digest of what its file holds."""
    source = Path(py_file).resolve()
    stamp = hashlib.sha256(source.read_bytes()).hexdigest()
    if source.is_relative_to(_ROOT):
        place = source.relative_to(_ROOT).with_suffix("").as_posix()
    else:
        # A kernel of a study or a test: the folder's hash does not cover its file
        place = "elsewhere-" + hashlib.sha256(str(source).encode()).hexdigest()[:16]
    return place.replace("/", "."), stamp


class ByContent:
    """Tell Numba where a function is kept: by its module and what its file holds.

    The protocol of Numba's cache locators (NUMBA_CACHE_LOCATOR_CLASSES).
    """

    def __init__(self, py_func: Callable[..., Any], py_file: str) -> None:
        self._line = py_func.__code__.co_firstlineno
        self._place, self._stamp = _place_and_stamp(py_file)

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], py_file: str) -> "ByContent":
        """Any function of a file can be kept."""
        return cls(py_func, py_file)

    def get_cache_path(self) -> str:
        """Return the folder of the function's module."""
        return str(_FOLDER / self._place)

    def ensure_cache_path(self) -> None:
        """Make that folder."""
        Path(self.get_cache_path()).mkdir(parents=True, exist_ok=True)

    def get_source_stamp(self) -> str:
        """Return what an entry must have been made from."""
        return self._stamp

    def get_disambiguator(self) -> str:
        """Tell functions of one name in one file apart."""
        return str(self._line)


def keeping(compiled: Callable[[bool], Any]) -> Any:
    """Make a compiled function, told whether to keep it, and let one process compile it.

    Numba reads where to keep it when a function is decorated, and only there.
    """
    if not _KEPT:
        return compiled(False)
    config: Any = numba.config
    previous = config.CACHE_LOCATOR_CLASSES
    config.CACHE_LOCATOR_CLASSES = f"{__name__}.{ByContent.__name__}"
    try:
        kernel = compiled(True)
    finally:
        config.CACHE_LOCATOR_CLASSES = previous
    # Not there with NUMBA_DISABLE_JIT, nor in callbacks, which are compiled already
    if isinstance(kernel, numba.core.dispatcher.Dispatcher):
        _let_one_process_compile(kernel)
    return kernel


@cache
def _lock(file: Path, _process: int) -> FileLock:
    """Lock of a file for a process: one that a fork inherited is not its own."""
    return FileLock(file)


def _let_one_process_compile(kernel: Any) -> None:
    """Hold a lock of the kernel's own while it is looked up, compiled and kept.

    Numba's lock between threads comes first, as it does in every thread. A kernel waits
    only for those that it calls, and no two call each other, so no two wait for each other.
    """
    function = kernel.py_func
    place, _ = _place_and_stamp(function.__code__.co_filename)
    file = _FOLDER / f"{place}.{function.__qualname__}.lock"
    compile_ = kernel.compile

    def alone(signature: Any) -> Any:
        with global_compiler_lock, _lock(file, os.getpid()).acquire(poll_interval=0.01):
            return compile_(signature)

    kernel.compile = alone

"""All compiled code of the package: numbers in, numbers out.

Kernels know no strings, files, units or frames other than those of the conventions page.
`jit` compiles them and keeps the result on disk. Numba does not notice an edited callee in
another file, so the cache folder is named after a hash of every kernel source and of the
Numba version: editing any kernel starts a fresh cache. Of several processes that want one
kernel, one compiles it and the others wait: Numba's index of what it keeps is read and
written back without a lock, and two that write at once can leave code under another's key.
"""

import hashlib
import os
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from filelock import FileLock
from numba.core.compiler_lock import global_compiler_lock

__all__ = ["cache_folder", "compiled_callback", "jit", "kernel_sources"]


def kernel_sources() -> list[Path]:
    """Every source file that the hash of the cache covers: the whole tree of kernels."""
    return sorted(Path(__file__).parent.rglob("*.py"))


def cache_folder() -> Path:
    """Folder of the compiled kernels: PBRDF_CACHE_DIR or ~/.cache/pbrdf, then the hash."""
    digest = hashlib.sha256(numba.__version__.encode())
    root = Path(__file__).parent
    for source in kernel_sources():
        digest.update(source.relative_to(root).as_posix().encode() + source.read_bytes())
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


def jit(
    function: Callable[..., Any] | None = None, *, allocates: bool = True, **options: Any
) -> Any:
    """Compile a kernel without the interpreter lock and cache it under `cache_folder`.

    With allocates=False the kernel makes no arrays and counts no references to those it
    is given: taking an array out of a named tuple inside a hot loop costs two atomic
    operations otherwise, which made half the time of a path.
    """
    if function is None:
        return lambda kernel: jit(kernel, allocates=allocates, **options)
    settings: Any = {"nogil": True, "cache": _KEPT, "error_model": "numpy"} | options
    if not allocates:
        settings["_nrt"] = False
    kernel = _keeping(lambda: numba.njit(**settings)(function))
    if _KEPT and hasattr(kernel, "compile"):  # not with NUMBA_DISABLE_JIT
        _let_one_process_compile(kernel)
    return kernel


def compiled_callback(function: Callable[..., Any], signature: Any) -> Any:
    """Compile a function for a C library to call, at the attribute `address`."""
    return _keeping(
        lambda: numba.cfunc(signature, cache=_KEPT, error_model="numpy")(function)
    )


def _keeping(compiled: Callable[[], Any]) -> Any:
    """Let Numba keep what it compiles in the folder of the kernels.

    It reads the name of the folder when a function is decorated, and only there.
    """
    config: Any = numba.config
    previous = config.CACHE_DIR
    config.CACHE_DIR = str(_FOLDER)
    try:
        return compiled()
    finally:
        config.CACHE_DIR = previous


def _let_one_process_compile(kernel: Any) -> None:
    """Hold a lock of the kernel's own while it is looked up, compiled and kept.

    Numba's lock between threads comes first, as it does in every thread. A kernel waits
    only for those that it calls, and no two call each other, so no two wait for each other.
    """
    function = kernel.py_func
    name = f"{function.__module__}.{function.__qualname__}.lock"
    lock = FileLock(_FOLDER / name, is_singleton=True)
    compile_ = kernel.compile

    def alone(signature: Any) -> Any:
        with global_compiler_lock, lock.acquire(poll_interval=0.01):
            return compile_(signature)

    kernel.compile = alone

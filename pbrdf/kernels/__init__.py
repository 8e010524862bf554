"""All compiled code of the package: numbers in, numbers out.

Kernels know no strings, files, units or frames other than those of the conventions page.
`jit` compiles them and keeps the result on disk. Numba does not notice an edited callee in
another file, so the cache folder is named after a hash of every kernel source and of the
Numba version: editing any kernel starts a fresh cache.
"""

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba

__all__ = ["cache_folder", "jit"]


def cache_folder() -> Path:
    """Folder of the compiled kernels: PBRDF_CACHE_DIR or ~/.cache/pbrdf, then the hash."""
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.name.encode() + source.read_bytes())
    root = os.environ.get("PBRDF_CACHE_DIR")
    base = Path(root) if root else Path.home() / ".cache" / "pbrdf"
    return base / f"kernels-{digest.hexdigest()[:16]}"


_FOLDER = str(cache_folder())


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
    settings: Any = {"nogil": True, "cache": True, "error_model": "numpy"} | options
    if not allocates:
        settings["_nrt"] = False
    # Numba reads its cache folder when a function is decorated, and only there
    config: Any = numba.config
    previous = config.CACHE_DIR
    config.CACHE_DIR = _FOLDER
    try:
        return numba.njit(**settings)(function)
    finally:
        config.CACHE_DIR = previous

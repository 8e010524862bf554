"""All compiled code of the package: numbers in, numbers out.

Kernels know no strings, files, units or frames other than those of the conventions page.
`jit` compiles them and keeps the result on disk, see `pbrdf.kernels.caching`.
"""

from collections.abc import Callable
from typing import Any

import numba

from pbrdf.kernels.caching import cache_folder, keeping, kernel_sources

__all__ = ["cache_folder", "compiled_callback", "jit", "kernel_sources"]


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
    settings: Any = {"nogil": True, "error_model": "numpy"} | options
    if not allocates:
        settings["_nrt"] = False
    return keeping(lambda keep: numba.njit(cache=keep, **settings)(function))


def compiled_callback(function: Callable[..., Any], signature: Any) -> Any:
    """Compile a function for a C library to call, at the attribute `address`."""
    return keeping(
        lambda keep: numba.cfunc(signature, cache=keep, error_model="numpy")(function)
    )

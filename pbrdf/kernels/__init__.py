"""All compiled code of the package: numbers in, numbers out.

Kernels know no strings, files, units or frames other than those of the conventions page.
`jit` compiles them and keeps the result on disk, see `pbrdf.kernels.caching`. Those with
`forceinline` or `part` are parts of other kernels and get no entry from Python, see
`pbrdf.kernels.parts`; `from_python` makes one. A constant argument is taken for any number
of its type, so that no kernel is compiled once for every constant.
"""

from collections.abc import Callable
from functools import cache
from typing import Any

import numba
from numba.core.dispatcher import Dispatcher
from numba.core.types import unliteral

from pbrdf.kernels.caching import cache_folder, keeping, kernel_sources
from pbrdf.kernels.parts import PartCompiler

__all__ = ["cache_folder", "compiled_callback", "from_python", "jit", "kernel_sources"]


def jit(
    function: Callable[..., Any] | None = None,
    *,
    allocates: bool = True,
    part: bool = False,
    **options: Any,
) -> Any:
    """Compile a kernel without the interpreter lock and cache it under `cache_folder`.

    With allocates=False the kernel makes no arrays and counts no references to those it
    is given: taking an array out of a named tuple inside a hot loop costs two atomic
    operations otherwise, which made half the time of a path. With part=True (or
    forceinline) only other kernels can call it.
    """
    if function is None:
        return lambda kernel: jit(kernel, allocates=allocates, part=part, **options)
    settings: Any = {"nogil": True, "error_model": "numpy"} | options
    # C functions are made by `compiled_callback`
    settings["no_cfunc_wrapper"] = True
    if not allocates:
        settings["_nrt"] = False
    part = part or settings.get("forceinline", False)
    if part:
        settings |= {"no_cpython_wrapper": True, "pipeline_class": PartCompiler}
    kernel = keeping(lambda keep: numba.njit(cache=keep, **settings)(function))
    # A plain function where NUMBA_DISABLE_JIT is set
    if isinstance(kernel, Dispatcher):
        _forget_constants(kernel)
        if part:
            _close_to_python(kernel)
    return kernel


def _forget_constants(kernel: Any) -> None:
    """Take a constant for any number of its type: Numba would compile for each of them."""
    compile_ = kernel.compile
    kernel.compile = lambda signature: compile_(tuple(map(unliteral, signature)))


def _close_to_python(kernel: Any) -> None:
    """Refuse calls from Python of a kernel that has no entry: Numba would jump to 0."""

    def refuse(*_: Any, **__: Any) -> None:
        msg = (
            f"{kernel.py_func.__qualname__} is compiled into other kernels only. To call "
            "it from Python, make an entry with pbrdf.kernels.from_python."
        )
        raise TypeError(msg)

    def add_overload(result: Any) -> None:
        kernel.overloads[tuple(result.signature.args)] = result

    # Numba asks for these whenever no compiled entry fits the arguments
    kernel._compile_for_args = refuse
    kernel.add_overload = add_overload


@cache
def from_python(kernel: Any) -> Any:
    """Return a part of other kernels as one that Python can call, not kept on disk."""
    function = getattr(kernel, "py_func", kernel)
    return numba.njit(nogil=True, error_model="numpy")(function)


def compiled_callback(function: Callable[..., Any], signature: Any) -> Any:
    """Compile a function for a C library to call, at the attribute `address`."""
    return keeping(
        lambda keep: numba.cfunc(signature, cache=keep, error_model="numpy")(function)
    )

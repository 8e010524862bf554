"""What a fit found, and how well the data know it."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fitting.result.fit_result import FitResult

__all__ = ["FitResult"]

_HOME = {"FitResult": "fitting.result.fit_result"}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        msg = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(msg)
    return getattr(import_module(_HOME[name]), name)

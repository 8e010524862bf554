"""Readings of a goniometer, traced from the detector's end."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pbrdf.observation.run import observe

__all__ = ["observe"]

_HOME = {"observe": "pbrdf.observation.run"}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        msg = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(msg)
    return getattr(import_module(_HOME[name]), name)

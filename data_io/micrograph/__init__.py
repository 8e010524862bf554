"""Micrographs: the edge of a surface, located to a fraction of a pixel."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from data_io.micrograph.read import read_profile_image

__all__ = ["read_profile_image"]

_HOME = {"read_profile_image": "data_io.micrograph.read"}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        msg = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(msg)
    return getattr(import_module(_HOME[name]), name)

"""Scenes: a surface, its material and what lies on it; in memory and in files."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pbrdf.scene.read import load_scene
    from pbrdf.scene.scene import Scene

__all__ = ["Scene", "load_scene"]

_HOME = {"Scene": "pbrdf.scene.scene", "load_scene": "pbrdf.scene.read"}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        msg = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(msg)
    return getattr(import_module(_HOME[name]), name)

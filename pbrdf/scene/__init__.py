"""Scenes: a surface, its material and what lies on it; in memory and in files."""

from typing import TYPE_CHECKING

from pbrdf._lazy import loader

if TYPE_CHECKING:
    from pbrdf.scene.read import load_scene
    from pbrdf.scene.scene import Scene

__all__ = ["Scene", "load_scene"]

_HOME = {"Scene": "pbrdf.scene.scene", "load_scene": "pbrdf.scene.read"}

__getattr__ = loader(__name__, _HOME)

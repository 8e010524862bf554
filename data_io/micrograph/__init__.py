"""Micrographs: the edge of a surface, located to a fraction of a pixel."""

from typing import TYPE_CHECKING

from pbrdf._lazy import loader

if TYPE_CHECKING:
    from data_io.micrograph.read import read_profile_image

__all__ = ["read_profile_image"]

_HOME = {"read_profile_image": "data_io.micrograph.read"}

__getattr__ = loader(__name__, _HOME)

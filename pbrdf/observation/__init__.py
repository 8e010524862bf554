"""Readings of a goniometer, traced from the detector's end."""

from typing import TYPE_CHECKING

from pbrdf._lazy import loader

if TYPE_CHECKING:
    from pbrdf.observation.run import observe

__all__ = ["observe"]

_HOME = {"observe": "pbrdf.observation.run"}

__getattr__ = loader(__name__, _HOME)

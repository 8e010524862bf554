"""Optical constants from the files in which they are published."""

from pbrdf.optics.published.constants import read

__all__ = ["read"]

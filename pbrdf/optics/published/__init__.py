"""Optical constants from the files in which they are published."""

from pbrdf.optics.published.constants import read, read_constant

__all__ = ["read", "read_constant"]

"""Optical constants from the files in which they are published."""

from pbrdf.optics.published.read import read

__all__ = ["read"]

"""Polarised reflectance of real rough surfaces."""

__version__ = "0.1.0"

"""Kernels that add paths up in bins and judge their noise."""

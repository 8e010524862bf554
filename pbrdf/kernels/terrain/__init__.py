"""Kernels that find where a ray meets a height field."""

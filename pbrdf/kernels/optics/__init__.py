"""Kernels of what an interface does to light."""

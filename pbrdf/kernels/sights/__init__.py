"""Kernels for facets of given slopes on a random surface: light, and what hides it."""

"""Kernels of transparent bodies on a surface: shapes, hits, beams and events."""

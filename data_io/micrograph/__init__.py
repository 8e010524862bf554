"""Micrographs: the edge of a surface, located to a fraction of a pixel."""

"""Faults of measured maps: what is found, counted, named, and mended by a stated rule."""

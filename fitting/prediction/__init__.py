"""Reflectance of a coating from its own height map, with nothing fitted to a scan."""

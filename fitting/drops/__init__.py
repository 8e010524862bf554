"""Contact angles from the silhouettes of drops."""

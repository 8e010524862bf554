"""The store of a sweep as a BRDF: interpolated, with the error of that."""

from pbrdf.stored.source import StoredBRDF, from_store

__all__ = ["StoredBRDF", "from_store"]

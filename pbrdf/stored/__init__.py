"""The store of a sweep: as a BRDF, interpolated with the error of that, and as a result."""

from pbrdf.stored.opening import from_store
from pbrdf.stored.source import StoredBRDF
from pbrdf.stored.whole import is_sweep_store, read_sweep

__all__ = ["StoredBRDF", "from_store", "is_sweep_store", "read_sweep"]

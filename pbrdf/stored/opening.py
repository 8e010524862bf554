"""Open the store of a sweep as a BRDF, whatever its design."""

from pathlib import Path

from pbrdf.stored.contents import open_contents
from pbrdf.stored.source import StoredBRDF

__all__ = ["from_store"]


def from_store(path: str | Path) -> StoredBRDF:
    """Open the store of a sweep as a BRDF.

    Parameters
    ----------
    path : str or Path
        Folder of the store, NAME.zarr. Points are read when they are asked for.

    Raises
    ------
    ValueError
        If it is no store of a sweep with all Stokes elements, or its points are a list or
        a sample of anything but numbers, or too few.
    FileNotFoundError
        If there is none.
    """
    return StoredBRDF(open_contents(path))

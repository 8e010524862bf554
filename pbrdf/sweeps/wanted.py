"""Packages that only sweeps need, loaded on first use."""

from importlib import import_module
from typing import Any

__all__ = ["needed"]


def needed(name: str) -> Any:
    """Import a package of the extra `sweeps`.

    Raises
    ------
    ValueError
        If it is not installed.
    """
    try:
        return import_module(name)
    except ImportError as error:
        msg = f"a sweep must have the package {name}, which is not here. "
        raise ValueError(msg + 'Install it: pip install "pbrdf[sweeps]".') from error

"""Simulations part by part, for results that do not fit into memory."""

import inspect
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy.typing as npt
import xarray as xr

from pbrdf.scene.scene import Scene
from pbrdf.simulation.memory import OF_SIZE, asked_size, directions_at_once
from pbrdf.simulation.run import prepared, simulate, traced
from pbrdf.tracer import arguments

__all__ = ["simulate_parts"]


def simulate_parts(
    scene: Scene, theta_i: npt.ArrayLike, *, at_once: int | None = None, **options: Any
) -> Iterator[xr.Dataset]:
    """Simulate some directions after others: for results that do not fit into memory.

    Put together along theta_i they are what `simulate` gives, bit for bit; attributes are
    those of each part. Realisations are drawn anew for each part.

    Parameters
    ----------
    scene, theta_i
        As of `simulate`.
    at_once : int, optional
        Directions of a part; as many as fit into the free memory by default.
    **options
        What `simulate` takes but target_rel_error, which is reached by all directions
        together.

    Yields
    ------
    xarray.Dataset

    Raises
    ------
    TypeError, ValueError
        As `simulate`, or if not even one direction fits.

    Examples
    --------
    >>> from pbrdf import HeightMap, Material
    >>> scene = Scene(HeightMap.flat(size=(1.0, 1.0)), Material(1.5))
    >>> parts = simulate_parts(scene, [0.0, 0.3, 0.6], at_once=2, n_rays=320)
    >>> [part.sizes["theta_i"] for part in parts]
    [2, 1]
    """
    bound = inspect.signature(simulate).bind(scene, theta_i, **options)
    bound.apply_defaults()
    given = bound.arguments
    if given["target_rel_error"] is not None:
        msg = (
            f"target_rel_error must be left out here, got {given['target_rel_error']}: it "
            "is reached by all directions together. Give n_rays and realizations."
        )
        raise ValueError(msg)
    size = asked_size(theta_i, **{name: given[name] for name in OF_SIZE})
    if at_once is None:
        at_once = directions_at_once(
            scene, size, n_rays=given["n_rays"], realizations=given["realizations"],
            workers=given["workers"], looks=given["variance_reduction"],
        )  # fmt: skip
    at_once = arguments.count("at_once", at_once, 1)
    ready = prepared(whole=False, **given)
    starts = range(0, size.angles, at_once)
    for number, first in enumerate(starts):
        part = ready.part(first, min(first + at_once, size.angles))
        told = _told(given["progress"], number, len(starts))
        yield traced(replace(part, run=replace(part.run, progress=told)))


def _told(
    progress: Callable[[int, int], None] | None, number: int, parts: int
) -> Callable[[int, int], None] | None:
    """Count the samples of one of several parts on from those before it."""
    if progress is None:
        return None
    return lambda done, total: progress(number * total + done, parts * total)

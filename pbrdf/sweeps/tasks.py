"""A group of points: computed, and written into the store."""

import os
import time
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from pbrdf.errors import AccuracyWarning
from pbrdf.scene.scene import Scene
from pbrdf.simulation.parts import simulate_together
from pbrdf.simulation.run import simulate
from pbrdf.sweeps.description import Sweep
from pbrdf.sweeps.layout import DONE, FAILED, STATE, Layout, read_point
from pbrdf.sweeps.store import Mark, Store

__all__ = ["compute", "finish", "simulated"]

# What a machine fails for, not a point: out of memory, of disk, of connections
OF_MACHINE = (MemoryError, OSError)


def finish(sweep: Sweep, store: Store, group: int, threads: int, home: int) -> Mark:
    """Compute what a group lacks and write it; what is finished is not computed again.

    `threads` is the share of the cores, `home` the process that asked: in another one
    nobody listens to warnings, which the marks hold.
    """
    if os.getpid() != home:
        warnings.filterwarnings("ignore", category=AccuracyWarning)
    block, mark = compute(sweep, store.layout, group, threads, store.finished(group))
    return store.write(group, block, mark)


def compute(
    sweep: Sweep,
    layout: Layout,
    group: int,
    threads: int,
    block: dict[str, np.ndarray] | None = None,
) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
    """Compute the points of a group that are not done in `block`, if one is given.

    Returns
    -------
    dict, dict
        Results by variable, and what the mark says of them. A point that fails for its own
        reason is marked so; the others go on.

    Raises
    ------
    MemoryError, OSError
        If the machine fails.
    """
    started = time.perf_counter()
    block = layout.block(group) if block is None else block
    errors: dict[str, str] = {}
    warned: Counter[str] = Counter()
    left = [(at, place) for at, place in layout.points(group) if block[STATE][at] != DONE]
    for members in sweep.alike(place for _, place in left):
        places = [left[k][1] for k in members]
        for k, result in zip(members, simulated(sweep, places, threads), strict=True):
            at, place = left[k]
            try:
                if isinstance(result, Exception):
                    raise result
                numbers = read_point(result, sweep, layout)
            except OF_MACHINE:
                raise
            except Exception as error:
                text = " ".join(f"{type(error).__name__}: {error}".split())
                errors[_named(sweep, place)] = text
                block[STATE][at] = FAILED
                continue
            for name, value in numbers.items():
                block[name][at] = value
            block[STATE][at] = DONE
            warned.update(set(result.attrs["warnings"]))
    mark = {
        "errors": errors,
        "warnings": dict(warned),
        "seconds": time.perf_counter() - started,
    }
    return block, mark


def simulated(
    sweep: Sweep, places: Sequence[Mapping[str, int]], threads: int, **instead: Any
) -> Iterator[xr.Dataset | Exception]:
    """Simulate points that one trace serves; what fails for its own reason gives why.

    `instead` takes the place of arguments of `simulate`.
    """
    if len(places) > 1:
        try:
            found = _at_once([sweep.at(place) for place in places], threads, instead)
        except OF_MACHINE:
            raise
        except Exception:
            # One of them cannot be, or not with the others: it is seen below which
            found = []
        yield from found
        if found:
            return
    for place in places:
        try:
            scene, given = sweep.at(place)
            result = simulate(scene, **given | instead, workers=threads)
        except OF_MACHINE:
            raise
        except Exception as error:
            yield error
        else:
            yield result


def _at_once(
    runs: Sequence[tuple[Scene, dict[str, Any]]], threads: int, instead: dict[str, Any]
) -> list[xr.Dataset]:
    lights = [(scene.substrate, given.pop("wavelength", None)) for scene, given in runs]
    scene, given = runs[0]
    return simulate_together(
        scene.surface, **given | instead, lights=lights, workers=threads
    )


def _named(sweep: Sweep, place: dict[str, int]) -> str:
    """Write the values of a point."""
    values = sweep.design.values(place)
    return ", ".join(f"{axis.name}={values[axis.path]}" for axis in sweep.design.axes)

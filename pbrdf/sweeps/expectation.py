"""What a sweep will take, from its layout and a pilot run."""

import time
import warnings
from collections.abc import Iterator
from dataclasses import dataclass

from pbrdf.errors import AccuracyWarning
from pbrdf.sweeps.description import Sweep
from pbrdf.sweeps.layout import Layout
from pbrdf.sweeps.tasks import simulated
from pbrdf.tracer.arguments import worker_count

__all__ = ["Forecast", "forecast"]

# The pilot draws this part of the realisations, at least the least number
_PART, _LEAST = 8, 2


@dataclass(frozen=True, kw_only=True)
class Forecast:
    """Numbers of a sweep before it runs.

    Attributes
    ----------
    points, groups : int
        Simulations, and groups of them that are computed and written together.
    store_bytes : int
        Size of the results, uncompressed.
    task_bytes : int
        Memory that the results of a task take, whatever the number of tasks.
    seconds : float
        Expected work on one core, from the first and the last point and those that share
        their traces. [s]
    cores : int
        Cores at hand.
    """

    points: int
    groups: int
    store_bytes: int
    task_bytes: int
    seconds: float
    cores: int

    def sentences(self) -> Iterator[str]:
        """Yield the numbers in words."""
        busy = min(self.cores, self.groups)
        yield f"{self.points} simulations in {self.groups} groups."
        yield (
            f"Results: {self.store_bytes / 1e6:.3g} MB before compression, "
            f"{self.task_bytes / 1e6:.3g} MB in memory for each group at work."
        )
        yield (
            f"Expected: {_duration(self.seconds)} of work, "
            f"{_duration(self.seconds / busy)} "
            f"on {busy} {'cores' if busy > 1 else 'core'}, from a pilot run of the first "
            "and the last point."
        )


def forecast(sweep: Sweep, *, workers: int | None = None) -> Forecast:
    """Tell what a sweep will take; nothing is written.

    A part of the realisations of the first and of the last point is computed and timed;
    towards a target error both are computed in full.
    """
    layout = Layout.of(sweep)
    each = [
        _timed(sweep, [point for _, point in layout.points(group)], end)
        for group, end in ((0, 0), (layout.n_groups - 1, -1))
    ]
    return Forecast(
        points=layout.n_points,
        groups=layout.n_groups,
        store_bytes=layout.point_bytes * layout.n_points,
        task_bytes=layout.group_bytes,
        seconds=sum(each) / len(each) * layout.n_points,
        cores=worker_count(workers),
    )


def _timed(sweep: Sweep, points: list[dict[str, int]], end: int) -> float:
    """Return the time of the first or last point of a group on one core. [s]

    It is the part of it in that of all that share its trace.
    """
    places = [points[k] for k in sweep.alike(points)[end]]
    _, given = sweep.at(places[end])
    drawn = int(given.get("realizations", 0))
    instead = {}
    if "target_rel_error" not in given:
        instead["realizations"] = min(drawn, max(_LEAST, drawn // _PART))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AccuracyWarning)
        started = time.perf_counter()
        results = list(simulated(sweep, places, 1, **instead))
        took = (time.perf_counter() - started) / len(places)
    result = results[end]
    if isinstance(result, Exception):
        raise result
    if not instead or result.attrs["stderr_excludes_surface"]:
        return took
    return took * drawn / instead["realizations"]


def _duration(seconds: float) -> str:
    for unit, size in (("days", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 2 * size:
            return f"{seconds / size:.2g} {unit}"
    return f"{seconds:.2g} s"

"""Run a sweep: what is missing in its store, here or by workers of Dask."""

import os
import warnings
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from pbrdf.errors import AccuracyWarning
from pbrdf.files.writing import FULL
from pbrdf.sweeps.description import Sweep
from pbrdf.sweeps.memory import check_sweep
from pbrdf.sweeps.report import RETRIES, Report
from pbrdf.sweeps.store import Store, complete, open_store
from pbrdf.sweeps.tasks import OF_MACHINE, finish
from pbrdf.tracer.arguments import worker_count

__all__ = ["run_sweep"]

Progress = Callable[[int, int], None]


def run_sweep(
    sweep: Sweep,
    path: str | Path,
    *,
    client: Any = None,
    workers: int | None = None,
    part: tuple[int, int] | None = None,
    replace: bool = False,
    progress: Progress | None = None,
) -> Report:
    """Compute what is missing of a sweep into its Zarr store.

    The numbers are the same bit for bit whoever computes them and however often the run was
    killed; what is finished is not computed again, what is damaged or failed is.

    Parameters
    ----------
    sweep : Sweep
        From `load_sweep` or `sweep_of`.
    path : str or Path
        Folder of the store; made if there is none.
    client : distributed.Client, optional
        Whose workers compute; they must see `path` and the files of the scene. Without one,
        workers of Dask in this process.
    workers : int, optional
        Cores to use in this process; all by default. 1 computes without Dask.
    part : (int, int), optional
        Compute part i of n only, i from 1, for job arrays without a scheduler. All parts
        may run at once.
    replace : bool
        Begin anew, also in place of the store of another sweep; not with part.
    progress : callable, optional
        Called with (groups done, groups in all).

    Returns
    -------
    Report

    Raises
    ------
    ValueError
        If there is anything else under `path`, or an argument is out of its range.
    OSError
        If the disk is full.
    """
    _check_part(part, replace=replace)
    cores = worker_count(workers)
    store = open_store(path, sweep, replace=replace, shared=part is not None)
    mine = range(store.layout.n_groups)
    if part is not None:
        mine = mine[part[0] - 1 :: part[1]]
    report = Report()
    left = []
    for group in mine:
        block = store.finished(group)
        if block is None or not complete(block):
            left.append(group)
    report.kept = len(mine) - len(left)

    def told(done: int) -> None:
        if progress is not None:
            progress(report.kept + done, len(mine))

    with warnings.catch_warnings():
        # Said once, from the marks
        warnings.simplefilter("ignore", AccuracyWarning)
        alone = cores == 1 or len(left) <= 1 or part is not None
        check_sweep(
            sweep, store.layout, 1 if alone else min(cores, len(left)), cores, client
        )
        if client is None and alone:
            _serial(sweep, store, left, cores, report, told)
        elif left:
            from pbrdf.sweeps.workers import by_client, in_process

            if client is not None:
                by_client(client, sweep, store, left, report, told)
            else:
                with in_process(min(cores, len(left))) as own:
                    by_client(own, sweep, store, left, report, told, cores=cores)
    store.tell_warnings()
    return report


def _check_part(part: tuple[int, int] | None, *, replace: bool) -> None:
    if part is None:
        return
    if not 1 <= part[0] <= part[1]:
        msg = f"part must be i of n with i from 1 to n, got {part[0]}/{part[1]}."
        raise ValueError(msg)
    if replace:
        msg = (
            "replace must be False with part, it would delete what the other parts have "
            "computed. Delete the store before the first of them."
        )
        raise ValueError(msg)


def _serial(
    sweep: Sweep,
    store: Store,
    groups: Iterable[int],
    threads: int,
    report: Report,
    told: Callable[[int], None],
) -> None:
    """Compute groups one after the other."""
    for done, group in enumerate(groups, start=1):
        for attempt in range(RETRIES + 1):
            try:
                report.add(finish(sweep, store, group, threads, os.getpid()))
                break
            except OF_MACHINE as error:
                if isinstance(error, OSError) and error.errno in FULL:
                    raise
                if attempt == RETRIES:
                    report.errors[f"group {group}"] = f"{type(error).__name__}: {error}"
        told(done)

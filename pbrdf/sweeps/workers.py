"""Groups of a sweep as tasks of Dask."""

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from itertools import islice
from typing import Any

from pbrdf.files.writing import FULL
from pbrdf.sweeps.description import Sweep
from pbrdf.sweeps.report import RETRIES, Report
from pbrdf.sweeps.store import Store
from pbrdf.sweeps.tasks import finish
from pbrdf.sweeps.wanted import needed

__all__ = ["by_client", "connected", "in_process"]

# Tasks known to the scheduler at a time, for each thread: memory stays the same
AHEAD = 4


@contextmanager
def in_process(threads: int) -> Iterator[Any]:
    """Give a client whose one worker is this process, with so many threads."""
    distributed = needed("distributed")
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=threads, processes=False,
            dashboard_address=None, memory_limit=0,
        ) as cluster,
        distributed.Client(cluster) as client,
    ):  # fmt: skip
        yield client


@contextmanager
def connected(address: str) -> Iterator[Any]:
    """Give a client of the scheduler at an address.

    Raises
    ------
    ValueError
        If none answers.
    """
    distributed = needed("distributed")
    try:
        client = distributed.Client(address, timeout="20s")
    except (OSError, ValueError) as error:
        msg = f"scheduler must answer at its address, got {address!r}: {error}."
        raise ValueError(msg) from error
    with client:
        yield client


GONE = "the scheduler is gone. What is finished is in the store; the same command goes on."


def by_client(
    client: Any,
    sweep: Sweep,
    store: Store,
    groups: Sequence[int],
    report: Report,
    told: Callable[[int], None],
    *,
    cores: int | None = None,
) -> None:
    """Let the workers of a client compute groups; `cores` if they are in this process.

    Raises
    ------
    OSError
        If the disk is full, or the scheduler is gone.
    """
    distributed = needed("distributed")
    client.wait_for_workers(1)
    threads = sum(client.nthreads().values())
    share = max(1, (cores or threads) // min(threads, len(groups)))
    waiting = iter(groups)
    attempts = dict.fromkeys(groups, 0)
    of: dict[Any, int] = {}

    def give(group: int) -> Any:
        attempts[group] += 1
        future = client.submit(finish, sweep, store, group, share, os.getpid(), pure=False)
        of[future] = group
        return future

    flow = distributed.as_completed(map(give, islice(waiting, AHEAD * threads)))
    done = 0
    for future in flow:
        group = of.pop(future)
        if future.cancelled() or client.status != "running":
            raise ConnectionError(GONE)
        error = future.exception() if future.status == "error" else None
        if future.status == "finished":
            try:
                report.add(future.result())
            except (OSError, distributed.CancelledError) as fault:
                # The task ended well: its answer was lost on the way
                raise ConnectionError(GONE) from fault
        elif isinstance(error, OSError) and error.errno in FULL:
            client.cancel(list(of))
            raise error
        elif attempts[group] <= RETRIES:
            flow.add(give(group))
            continue
        else:
            report.errors[f"group {group}"] = f"{type(error).__name__}: {error}"
        done += 1
        told(done)
        following = next(waiting, None)
        if following is not None:
            flow.add(give(following))

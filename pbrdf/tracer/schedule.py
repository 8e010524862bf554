"""Samples computed by threads and taken in their order, until there are enough."""

from collections import deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from typing import Any, TypeVar

import numpy as np

T = TypeVar("T")
# Where a run towards a target error gives up
MOST_SAMPLES = 4096


def gather(
    draw: Callable[[np.random.SeedSequence], T],
    root: np.random.SeedSequence,
    add: Callable[[T, Callable[..., Iterable[Any]]], None],
    rel_error: Callable[[], float],
    *,
    samples: int,
    target: float | None,
    workers: int,
    progress: Callable[[int, int], None] | None,
) -> int:
    """Draw samples and add them; with a target until the relative error falls to it.

    `add` gets a sample and the `map` of the threads, for work of its own.
    Returns their number: `samples`, or from so many on the first that meets the target.
    `progress` hears how many are done and how many there will be: towards a target as many
    as the error so far asks for, which falls with the square root of their number.
    The order of samples, and so the result, is the same for any number of workers.
    """
    limit = samples if target is None else max(samples, MOST_SAMPLES)
    with (
        ThreadPoolExecutor(workers) as pool,
        closing(in_order(draw, root, limit, pool, 2 * workers)) as drawn,
    ):
        for done, sample in enumerate(drawn, start=1):
            add(sample, pool.map)
            # One sample alone has no error
            ready = target is not None and done >= max(samples, 2)
            error = rel_error() if ready else np.inf
            if progress is not None:
                progress(done, _expected(done, error, target, samples, limit))
            if target is not None and error <= target:
                return done
    return limit


def _expected(
    done: int, error: float, target: float | None, samples: int, limit: int
) -> int:
    """Estimate how many samples there will be, as far as the error so far tells."""
    if target is None or not np.isfinite(error):
        return max(samples, done)
    return max(done, min(limit, int(np.ceil(done * (error / target) ** 2))))


def in_order(
    draw: Callable[[np.random.SeedSequence], T],
    root: np.random.SeedSequence,
    samples: int,
    pool: ThreadPoolExecutor,
    ahead: int,
) -> Generator[T, None, None]:
    """Draw samples from spawned seeds by threads, some ahead, in their order."""
    pending: deque[Future[T]] = deque()
    submitted = 0
    try:
        while submitted < samples or pending:
            while submitted < samples and len(pending) < ahead:
                pending.append(pool.submit(draw, root.spawn(1)[0]))
                submitted += 1
            yield pending.popleft().result()
    finally:
        for future in pending:
            future.cancel()

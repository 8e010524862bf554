"""Samples computed by threads, handed on in their order."""

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

import numpy as np

T = TypeVar("T")


def in_order(
    draw: Callable[[np.random.SeedSequence], T],
    root: np.random.SeedSequence,
    samples: int,
    workers: int,
) -> Iterator[T]:
    """Draw samples from spawned seeds by threads, a few ahead, in their order."""
    with ThreadPoolExecutor(workers) as pool:
        pending: deque[Future[T]] = deque()
        submitted = 0
        try:
            while submitted < samples or pending:
                while submitted < samples and len(pending) < 2 * workers:
                    pending.append(pool.submit(draw, root.spawn(1)[0]))
                    submitted += 1
                yield pending.popleft().result()
        finally:
            for future in pending:
                future.cancel()

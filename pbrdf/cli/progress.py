"""Progress bars; the library below knows only a callback."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

__all__ = ["progress_bar"]


@contextmanager
def progress_bar(label: str) -> Iterator[Callable[[int, int], None]]:
    """Yield a callback `(done, total)` that draws a bar, if stderr is a terminal."""
    from tqdm import tqdm

    bar = tqdm(desc=label, leave=False, disable=not sys.stderr.isatty(), file=sys.stderr)

    def update(done: int, total: int) -> None:
        bar.total = total
        bar.update(done - bar.n)

    try:
        yield update
    finally:
        bar.close()

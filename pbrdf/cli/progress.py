"""Progress, for terminals and for logs; the library below knows only callbacks."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import Enum
from functools import cache
from types import TracebackType
from typing import Any, Self

import typer

__all__ = ["StageBars", "Talk", "progress_bar", "talk"]

# A log gets a line this often [s]
EVERY = 15.0


class Talk(Enum):
    """How much a command says on stderr."""

    QUIET = 0
    NORMAL = 1
    VERBOSE = 2


_level = [Talk.NORMAL]


def talk(level: Talk | None = None) -> Talk:
    """Set how much commands say, if given; return how much they say."""
    if level is not None:
        _level[0] = level
    return _level[0]


class StageBars:
    """Progress of each stage of a longer work on stderr.

    A bar on a terminal; elsewhere a line now and then, so that a log shows that work goes
    on. Nothing with --quiet.
    """

    def __init__(self) -> None:
        self._bar: Any = None
        self._stage = ""
        self._told = time.monotonic()

    def __enter__(self) -> Self:
        _announce_compilation()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._close()

    def update(self, stage: str, done: int, total: int) -> None:
        """Show that `done` of `total` steps of a stage are behind us."""
        if talk() is Talk.QUIET:
            return
        if not sys.stderr.isatty():
            self._line(stage, done, total)
            return
        from tqdm import tqdm

        if stage != self._stage:
            self._close()
            self._stage = stage
            self._bar = tqdm(desc=stage, leave=False)
        self._bar.total = max(total, self._bar.total or 0)
        self._bar.update(max(done, self._bar.n) - self._bar.n)

    def _line(self, stage: str, done: int, total: int) -> None:
        now = time.monotonic()
        if now - self._told >= EVERY or (talk() is Talk.VERBOSE and stage != self._stage):
            typer.echo(f"{stage}: {done} of {total}", err=True)
            self._told = now
        self._stage = stage

    def _close(self) -> None:
        if self._bar is not None:
            self._bar.close()
            self._bar = None


@contextmanager
def progress_bar(label: str) -> Iterator[Callable[[int, int], None]]:
    """Yield a callback `(done, total)` that shows the progress."""
    with StageBars() as bars:
        yield lambda done, total: bars.update(label, done, total)


@cache
def _announce_compilation() -> None:
    """Say once that kernels are compiled, where no earlier run has kept them."""
    from numba.core import event

    class Notice(event.Listener):
        said = False

        def on_start(self, _: Any) -> None:
            if not self.said and talk() is not Talk.QUIET:
                typer.echo(
                    "note: compiling what this needs; it takes up to a minute, once.",
                    err=True,
                )
            type(self).said = True

        def on_end(self, _: Any) -> None:
            pass

    event.register("numba:compile", Notice())

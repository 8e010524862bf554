"""What was typed after `pbrdf`, for the record of a result."""

from collections.abc import Callable, Iterable, Sequence
from functools import wraps
from pathlib import Path
from typing import Any

__all__ = ["check_apart", "remember", "remembering_paths", "words_typed"]

# Where the result went and how much was said has no part in its numbers
_ALONE = {"--force", "--quiet", "-q", "--verbose", "-v"}
_WITH_VALUE = {"--output", "-o", "--workers"}

# Parameters that say where something goes; init has one for both
_OUTPUTS = {"output", "as_json", "figure", "overlay", "slopes"}
_TO, _FROM = "to", "from"

_words: list[str] = []
_paths: dict[str, list[Path]] = {_TO: [], _FROM: []}


def remember(arguments: Sequence[str]) -> None:
    """Keep what was typed."""
    _words[:] = arguments


def words_typed(arguments: Sequence[str] | None = None) -> list[str]:
    """Return the words of the command that makes the numbers of this run again.

    Examples
    --------
    >>> words_typed(["-q", "fit", "my scan.csv", "-o", "there", "--n=1.5", "--force"])
    ['pbrdf', 'fit', 'my scan.csv', '--n=1.5']
    """
    kept, skip = ["pbrdf"], False
    for word in _words if arguments is None else arguments:
        if skip or word in _ALONE:
            skip = False
            continue
        skip = word in _WITH_VALUE
        if not skip and word.partition("=")[0] not in _WITH_VALUE:
            kept.append(word)
    return kept


def remembering_paths(command: Callable[..., Any]) -> Callable[..., Any]:
    """Return a command that keeps the paths it is given, and checks those it writes to."""

    @wraps(command)
    def run(**given: Any) -> Any:
        for name, value in given.items():
            held = value if isinstance(value, Iterable) else [value]
            paths = [one for one in held if isinstance(one, Path) and str(one) != "-"]
            _paths[_TO if name in _OUTPUTS or "file" in given else _FROM] += paths
        try:
            for path in _paths[_TO]:
                check_apart(path)
            return command(**given)
        finally:
            _paths[_TO], _paths[_FROM] = [], []

    return run


def check_apart(target: Path) -> None:
    """Refuse an output that would take an input or another output with it.

    Raises
    ------
    ValueError
        If it is what the command reads, or a folder that holds it, or two outputs have one
        name, or it lies within a store.
    """
    where = target.resolve()
    for path in _paths[_FROM]:
        if where in (path.resolve(), *path.resolve().parents):
            msg = f"output must not replace what is read, {path}: {target}. Name another."
            raise ValueError(msg)
    if sum(path.resolve() == where for path in _paths[_TO]) > 1:
        msg = f"output must have a name of its own, got {target} twice. Name another."
        raise ValueError(msg)
    for folder in where.parents:
        if (folder / "zarr.json").is_file():
            msg = f"output must not lie within a store, got {target}. Name another place."
            raise ValueError(msg)

"""Values of a scene file by their path in it, as `contaminants[0].contact_angle_deg`."""

from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from itertools import pairwise
from typing import Any

from pbrdf.scene.keys import known_keys

__all__ = ["Path", "changed", "resolve", "written"]

Path = tuple[str | int, ...]

# Two keys of one table that say the same: giving one takes the other away
_INSTEAD = {"slope_rms": "height_rms_um", "height_rms_um": "slope_rms"}


def written(path: Path) -> str:
    """Write a path as people do.

    Examples
    --------
    >>> written(("contaminants", 0, "material", "n"))
    'contaminants[0].material.n'
    """
    return "".join(f"[{s}]" if isinstance(s, int) else f".{s}" for s in path)[1:]


def resolve(name: str, document: Mapping[str, Any], run_keys: tuple[str, ...]) -> Path:
    """Return the path of a value, given in full or by its last key alone.

    A last key alone means the place nearest to the top; where several are as near, that of
    the run, else the one that stands in the file.

    Parameters
    ----------
    name : str
        Such as `contaminants[0].coverage`, or `coverage`.
    document : mapping
        The scene file, and under `simulate` the arguments of the run.
    run_keys : tuple of str
        Keys that `simulate` may hold.

    Raises
    ------
    ValueError
        If the scene has no such value, or several; the message names those near.
    """
    known = dict(_places(document, run_keys))
    by_name = {written(path): path for path in known}
    if name in by_name:
        return by_name[name]
    matches = [path for path in known if path[-1] == name]
    top = min((len(path) for path in matches), default=0)
    matches = [path for path in matches if len(path) == top]
    if len(matches) > 1:
        run = [path for path in matches if path[0] == "simulate"]
        matches = run or [path for path in matches if known[path]] or matches
    if len(matches) == 1:
        return matches[0]
    if matches:
        listed = ", ".join(map(written, matches))
        msg = (
            f"{name} must name one value of the scene, got {listed}. Write the whole path."
        )
        raise ValueError(msg)
    if name.rpartition(".")[2] == "type":
        msg = f"{name} cannot vary: keys depend on it. Make a sweep of each type."
        raise ValueError(msg)
    near = get_close_matches(name, [*by_name, *{str(p[-1]) for p in known}], 4, 0.5)
    if not near:
        near = [place for place, path in by_name.items() if known[path]]
    msg = (
        f"{name!r} must be the path of a value of the scene or of [simulate], which have "
        f"none such. Near or there: {', '.join(near)}."
    )
    raise ValueError(msg)


def changed(document: Mapping[str, Any], values: Mapping[Path, Any]) -> dict[str, Any]:
    """Return the document with these values; the given one stays as it is."""
    out = dict(document)
    for path, value in values.items():
        here: Any = out
        for step, following in pairwise(path):
            empty: Any = [] if isinstance(following, int) else {}
            below = here[step] if isinstance(step, int) else here.get(step, empty)
            here[step] = list(below) if isinstance(below, list) else dict(below)
            here = here[step]
        here[path[-1]] = value
        if path[0] == "surface" and path[-1] in _INSTEAD:
            here.pop(_INSTEAD[str(path[-1])], None)
    return out


def _places(
    document: Mapping[str, Any], run_keys: tuple[str, ...]
) -> Iterator[tuple[Path, bool]]:
    """Yield every place where a value may stand, and whether one does."""
    for key in run_keys:
        yield ("simulate", key), key in document.get("simulate", {})
    for table, keys in known_keys(document):
        here: Any = document
        for step in table:
            here = here[step]
        for key in sorted(keys):
            yield (*table, key), key in here
            value = here.get(key)
            if isinstance(value, list) and all(isinstance(v, int | float) for v in value):
                for number in range(min(len(value), 8)):
                    yield (*table, key, number), True

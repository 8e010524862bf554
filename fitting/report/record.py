"""What a result needs to be had again: inputs and their hashes, options, version."""

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from pbrdf import __version__

__all__ = ["record_of"]


def record_of(
    inputs: Mapping[str, str | Path | Iterable[Path] | None],
    *,
    command: str,
    options: Mapping[str, Any],
    typed: Sequence[str] = (),
) -> dict[str, Any]:
    """Return names and SHA-256 of the inputs, the command, its options and the version.

    Parameters
    ----------
    inputs : mapping of str to Path or several of them
        Files, or an entry of a database, by what they are: surface, scan, scene,
        material; None where there is none.
    command : str
        Name of the command.
    options : mapping of str to value
        Its options by the names that Python has for them; None, for those left out, is
        dropped.
    typed : sequence of str, optional
        The words of the command that makes the result again.
    """
    files = []
    for role, paths in inputs.items():
        for path in (paths,) if isinstance(paths, str | Path) else paths or ():
            file = Path(path)
            # An entry of a database has a name and no bytes of its own
            if not file.is_file():
                files.append({"role": role, "name": str(path)})
                continue
            digest = hashlib.sha256(file.read_bytes()).hexdigest()
            files.append({"role": role, "name": file.name, "sha256": digest})
    return {
        "program": f"pbrdf {__version__}",
        "command": command,
        "inputs": files,
        "options": {name: _plain(v) for name, v in options.items() if v is not None},
        **({"typed": list(typed)} if typed else {}),
    }


def _plain(value: Any) -> Any:
    """Return a value as JSON and TOML can hold it."""
    if isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    return str(value)

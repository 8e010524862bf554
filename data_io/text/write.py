"""Files out: complete or not at all."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def complete_file(path: str | Path) -> Iterator[Path]:
    """Give a temporary path in the same folder; rename it to `path` if the body succeeds.

    A reader never sees half a file, and a failure leaves an older file as it was.
    """
    path = Path(path)
    if not path.parent.is_dir():
        msg = f"path must lie in an existing folder, got {path}. Make the folder first."
        raise ValueError(msg)
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        # mkstemp makes files private; a result has the permissions of any new file
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)

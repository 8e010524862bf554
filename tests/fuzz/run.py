"""Damage good files of every format and see that readers refuse them by name.

    python tests/fuzz/run.py --count 10000 [--seed 1] [--reader result model]

Each reader gets `count` damaged copies of files made here: bytes flipped, cut, repeated,
moved; in every other copy of a text file lines and cells lost, repeated, exchanged, numbers
with another sign, size or mark. A reader may raise
DataFileError, or return what stands in the file: scans and
optical constants are held against the numbers of their lines. Anything else, a warning of a
library, more than 5 s of the processor, more than 1 GiB, a message of over 320 signs or one
without the name of the file is a fault. Of formats with checksums nothing may be returned
that differs from what was written.
Prints a line a reader; exit code 1 if there are faults.
"""

import argparse
import re
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
import warnings
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from pbrdf.errors import DataFileError
from tests.fuzz import good_files, more_files
from tests.fuzz.kept import check
from tests.fuzz.more_files import CHECKED, Content

READERS: Any = good_files.READERS | more_files.READERS
SECONDS = 5.0
# After which a library that never comes back ends the run [s]
HANGS = 60
MEMORY = 2**30
# Signs of a message
LONGEST = 320
WORDS = [
    *(
        b"nan",
        b"inf",
        b"1e400",
        b"-0",
        b"9" * 400,
        b"",
        b"\0",
        b"\xff\xfe",
        b",",
        b";",
        b"\t",
    ),
    *(b"\n", b"[", b"{", b'"', b"#", b"<!ENTITY a 'b'>", b"= 1", b"true"),
]


def damaged(good: bytes, rng: np.random.Generator) -> bytes:
    """Return the file with one fault or a few."""
    content = bytearray(good)
    for _ in range(rng.geometric(0.6)):
        size = len(content)
        start, stop = sorted(rng.integers(0, size + 1, 2).tolist()) if size else (0, 0)
        stop = min(stop, start + 1 + int(rng.exponential(20)))
        kind = rng.integers(7)
        if kind == 0 and size:
            content[rng.integers(size)] ^= 1 << int(rng.integers(8))
        elif kind == 1:
            del content[start:stop]
        elif kind == 2:
            content[start:start] = content[start:stop] * int(rng.integers(1, 40))
        elif kind == 3:
            del content[start:]
        elif kind == 4:
            content[start:stop] = rng.bytes(stop - start)
        elif kind == 5:
            content[start:start] = WORDS[rng.integers(len(WORDS))]
        else:
            piece = bytes(content[start:stop])
            del content[start:stop]
            place = rng.integers(len(content) + 1)
            content[place:place] = piece
    return bytes(content)


def disordered(good: bytes, rng: np.random.Generator) -> bytes:
    """Return a text whose lines and cells are whole but not where or what they were."""
    code = "utf-16" if good[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8"
    lines = [re.split(r"([,;\s]+)", line) for line in good.decode(code).splitlines()]
    for _ in range(rng.geometric(0.6)):
        row, other = rng.integers(len(lines), size=2)
        cell, there = 2 * rng.integers((len(lines[row]) + 1) // 2, size=2)
        kind = rng.integers(9)
        if kind == 0 and len(lines) > 2:
            del lines[row]
        elif kind == 1:
            lines.insert(other, list(lines[row]))
        elif kind == 2:
            lines[row], lines[other] = lines[other], lines[row]
        elif kind == 3:
            del lines[row][cell : cell + 2]
            lines[row] = lines[row] or [""]
        elif kind == 4:
            lines[row][cell], lines[row][there] = lines[row][there], lines[row][cell]
        elif kind == 5:
            lines[row][cell] = f"-{lines[row][cell]}"
        elif kind == 6:
            lines[row][cell] += f"e{rng.integers(-9, 9)}"
        elif kind == 7:
            lines[row][cell] = lines[row][cell].replace(".", ",")
        else:
            lines[row][cell] = lines[row][cell][: rng.integers(8)]
    return "\n".join("".join(line) for line in lines).encode(code)


def spoilt(good: Content, rng: np.random.Generator) -> Content:
    """Return a damaged file, or a folder one file of which is damaged, lost or another."""
    if isinstance(good, bytes):
        return damaged(good, rng)
    names = sorted(good)
    name, other = (names[k] for k in rng.integers(len(names), size=2))
    kind = rng.integers(10)
    if kind == 0:
        return {key: held for key, held in good.items() if key != name}
    return good | {name: good[other] if kind == 1 else damaged(good[name], rng)}


def put(content: Content, path: Path) -> None:
    """Write a file, or a folder of files, in place of what is there."""
    if isinstance(content, bytes):
        path.write_bytes(content)
        return
    shutil.rmtree(path, ignore_errors=True)
    for name, held in content.items():
        (path / name).parent.mkdir(parents=True, exist_ok=True)
        (path / name).write_bytes(held)


def attempt(read: Callable[[Path], Any], path: Path) -> tuple[str, Any]:
    """Return "accepted" and what was read, "refused" and the message, or what is wrong."""
    start = time.process_time()
    found = None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            # Those of the project are meant for users
            warnings.filterwarnings("ignore", category=UserWarning)
            found = read(path)
        said = check(found, path) or "accepted"
    except DataFileError as error:
        said, found = "refused", str(error)
        if len(found) > LONGEST or "\n" in found:
            said = f"a message of {len(found)} signs: {found[:80]} ... {found[-60:]}"
        elif not any(one.name in found for one in path.parent.iterdir()):
            said = f"a message without the file: {found}"
    except Exception as error:  # what must not get out is the question
        place = traceback.extract_tb(error.__traceback__)[-1]
        said = (
            f"{type(error).__name__} at {Path(place.filename).name}:{place.lineno}: {error}"
        )
    if time.process_time() - start > SECONDS:
        said = f"took {time.process_time() - start:.1f} s"
    return " ".join(said.split())[:200], found


def run(name: str, count: int, seed: int) -> tuple[dict[str, int], dict[str, Content]]:
    """Return how often each verdict came, and an example of each fault."""
    make, suffix, read = READERS[name]
    good, rng = make(), np.random.default_rng([seed, len(name)])
    is_text = isinstance(good, bytes) and (b"\0" not in good or good[:2] == b"\xff\xfe")
    tally: dict[str, int] = {}
    faults: dict[str, Content] = {}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"file{suffix}"
        put(good, path)
        said, original = attempt(read, path)
        if said != "accepted":
            msg = f"the good file of {name} must be accepted, got {said}: {original}"
            raise AssertionError(msg)
        for number in range(count):
            change: Any = disordered if number % 2 and is_text else spoilt
            content = change(good, rng)
            put(content, path)
            signal.alarm(HANGS)
            said, found = attempt(read, path)
            signal.alarm(0)
            if said == "accepted" and name in CHECKED and not found.identical(original):
                said = "another value without a word"
            tally[said] = tally.get(said, 0) + 1
            if said not in ("accepted", "refused"):
                faults.setdefault(said, content)
    return tally, faults


def limit_memory() -> None:
    """Give the process what it has now and 1 GiB more."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    size = pages * resource.getpagesize() + MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (size, size))


def main() -> int:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--reader", choices=READERS, nargs="+", default=list(READERS))
    parser.add_argument("--keep", type=Path, help="folder for an example of each fault")
    given = parser.parse_args()
    worst = 0
    for number, name in enumerate(given.reader):
        if number == 1 and sys.platform == "linux":
            limit_memory()
        tally, faults = run(name, given.count, given.seed)
        good = {key: tally.get(key, 0) for key in ("accepted", "refused")}
        bad = given.count - sum(good.values())
        print(
            f"{name:<17} {good['accepted']:>6} accepted {good['refused']:>6} refused "
            f"{bad:>4} faults"
        )
        for said, content in faults.items():
            print(f"    {tally[said]} x {said}")
            if given.keep:
                given.keep.mkdir(parents=True, exist_ok=True)
                put(content, given.keep / f"{name}-{zlib.crc32(said.encode()):x}")
        worst += bad
    return int(worst > 0)


if __name__ == "__main__":
    sys.exit(main())

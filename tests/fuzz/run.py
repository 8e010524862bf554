"""Damage good files of every format and see that readers refuse them by name.

    python tests/fuzz/run.py --count 10000 [--seed 1] [--reader result model]

Each reader gets `count` damaged copies of files made here: bytes flipped, cut, repeated,
moved; in every other copy of a text file lines and cells lost, repeated, exchanged, numbers
with another sign, size or mark. A reader may raise DataFileError (ValueError and
TypeError with the name of the file count too), or return what stands in the file: scans and
optical constants are held against the numbers of their lines. Anything else, a warning of a
library, more than 5 s of the processor or more than 1 GiB is a fault.
Prints a line a reader; exit code 1 if there are faults.
"""

import argparse
import re
import resource
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from pbrdf.errors import DataFileError
from tests.fuzz.good_files import READERS
from tests.fuzz.kept import check

SECONDS = 5.0
MEMORY = 2**30
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


def verdict(read: Callable[[Path], Any], path: Path) -> str:
    """Say "accepted", "refused", or what is wrong."""
    start = time.process_time()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            # Those of the project are meant for users
            warnings.filterwarnings("ignore", category=UserWarning)
            found = read(path)
        said = check(found, path) or "accepted"
    except DataFileError as error:
        said = (
            "refused" if len(str(error)) < 700 else f"a message of {len(str(error))} signs"
        )
    except Exception as error:  # what must not get out is the question
        place = traceback.extract_tb(error.__traceback__)[-1]
        said = (
            f"{type(error).__name__} at {Path(place.filename).name}:{place.lineno}: {error}"
        )
    if time.process_time() - start > SECONDS:
        said = f"took {time.process_time() - start:.1f} s"
    return " ".join(said.split())[:200]


def run(name: str, count: int, seed: int) -> tuple[dict[str, int], dict[str, bytes]]:
    """Return how often each verdict came, and an example of each fault."""
    make, suffix, read = READERS[name]
    good, rng = make(), np.random.default_rng([seed, len(name)])
    is_text = b"\0" not in good or good[:2] == b"\xff\xfe"
    tally: dict[str, int] = {}
    faults: dict[str, bytes] = {}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"file{suffix}"
        path.write_bytes(good)
        if verdict(read, path) != "accepted":
            msg = f"the good file of {name} must be accepted, got {verdict(read, path)}"
            raise AssertionError(msg)
        for number in range(count):
            change = disordered if number % 2 and is_text else damaged
            content = change(good, rng)
            path.write_bytes(content)
            said = verdict(read, path)
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
                (given.keep / f"{name}-{abs(hash(said)) % 10**8}").write_bytes(content)
        worst += bad
    return int(worst > 0)


if __name__ == "__main__":
    sys.exit(main())

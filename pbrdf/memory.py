"""Memory that a run will take, foretold before it begins, and memory that is free.

Sizes are counted from the arrays that a run makes; they are upper ends, since threads need
not hold all samples that they may at one time.
"""

import math
import os
from dataclasses import dataclass
from pathlib import Path

from pbrdf.conventions import BOUNCES

__all__ = [
    "NODE",
    "PROGRAM",
    "SHARE",
    "Size",
    "check_room",
    "check_surface",
    "free_bytes",
    "stored",
    "told",
]

# Of the memory that is free, a run may take this part
SHARE = 0.8
# A node of a surface that is drawn or traced, and compiled code with small things [bytes]
NODE, PROGRAM = 20, 30e6


@dataclass(frozen=True, kw_only=True)
class Size:
    """What a run computes, in numbers.

    Attributes
    ----------
    angles, azimuths, waves : int
        Directions of the source, and wavelengths.
    bins : int
        Detector bins, or 1 where each direction is read by one detector.
    n_stokes : int
        Stokes elements.
    """

    angles: int
    azimuths: int
    waves: int
    bins: int
    n_stokes: int

    @property
    def unit(self) -> int:
        """One matrix for each direction, wavelength and bin. [bytes]"""
        lights = self.angles * self.azimuths * self.waves
        return 8 * lights * self.bins * self.n_stokes**2

    @property
    def result(self) -> int:
        """BRDF by bounces and of all, with their errors. [bytes]"""
        return 2 * (len(BOUNCES) + 1) * self.unit

    def words(self) -> str:
        """Say what makes it so large."""
        azimuths = f" x {self.azimuths} phi_i" if self.azimuths > 1 else ""
        waves = f" x {self.waves} wavelengths" if self.waves > 1 else ""
        bins = f" x {self.bins} bins" if self.bins > 1 else ""
        return (
            f"{self.angles} directions{azimuths}{waves}{bins} x {self.n_stokes**2} elements"
        )


def stored(size: Size) -> float:
    """Return the most that a result takes while it is written to a netCDF file. [bytes]"""
    # Beside the result the file, made in memory and compressed by little
    return 2.3 * size.result + PROGRAM


def free_bytes() -> float:
    """Return the memory that this process may still take. [bytes]

    The least of what the machine has, what the control groups of the process leave, as in
    containers and job queues, and its own limit of addresses.
    """
    import psutil

    rooms = [float(psutil.virtual_memory().available)]
    try:
        groups = Path("/proc/self/cgroup").read_text()
    except OSError:
        groups = ""
    rooms.append(group_room(groups, Path("/sys/fs/cgroup")))
    if os.name == "posix":
        import resource

        limit = resource.getrlimit(resource.RLIMIT_AS)[0]
        if limit != resource.RLIM_INFINITY:
            rooms.append(float(limit - psutil.Process().memory_info().vms))
    return max(min(rooms), 0.0)


def group_room(groups: str, mount: Path) -> float:
    """Return what control groups of Linux leave. [bytes]

    `groups` is what /proc/self/cgroup says, `mount` where their folders are. A group is
    bound by those above it, too.
    """
    room = math.inf
    for line in groups.splitlines():
        _, _, rest = line.partition(":")
        controllers, _, path = rest.partition(":")
        if controllers and "memory" not in controllers.split(","):
            continue
        top = mount / "memory" if controllers else mount
        names = (
            ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file")
            if controllers
            else ("memory.max", "memory.current", "inactive_file")
        )
        folder = top / path.strip("/")
        while folder.is_relative_to(top):
            room = min(room, _left(folder, *names))
            folder = folder.parent
    return room


def _left(folder: Path, limit: str, usage: str, cache: str) -> float:
    """Return what one group leaves; what it holds of files can be given up."""
    try:
        most = float((folder / limit).read_text())
        used = float((folder / usage).read_text())
        entries = dict(
            line.split() for line in (folder / "memory.stat").read_text().splitlines()
        )
        return most - used + float(entries.get(cache, 0.0))
    except (OSError, ValueError):
        # No limit, which reads "max", or no such group
        return math.inf


def told(count: float) -> str:
    """Return a number of bytes in words.

    Examples
    --------
    >>> told(62.2e9)
    '62.2 GB'
    """
    return f"{count / 1e9:.3g} GB" if count >= 1e9 else f"{count / 1e6:.0f} MB"


def check_room(need: float, what: str, cure: str, room: float | None = None) -> None:
    """Refuse what takes more than `SHARE` of the free memory.

    Parameters
    ----------
    need : float
        What it takes. [bytes]
    what : str
        What it is, with the numbers that make it so large.
    cure : str
        What to change; one sentence.
    room : float, optional
        The free memory, where that was asked for already. [bytes]

    Raises
    ------
    ValueError
        If it takes more.
    """
    room = free_bytes() if room is None else room
    if need > SHARE * room:
        msg = (
            f"the run must take at most {SHARE:.0%} of the free memory, {told(room)}; it "
            f"would take {told(need)}: {what}. {cure}"
        )
        raise ValueError(msg)


def check_surface(surface: object, room: float | None = None) -> None:
    """Refuse a surface of which not even one sample fits into the memory that is free.

    `room` as of `check_room`.

    Raises
    ------
    ValueError
        If it takes more.
    """
    shape = getattr(surface, "shape", ())
    if shape:
        nodes = f"{' x '.join(map(str, shape))} nodes of the surface"
        cure = "Take a surface of a smaller shape."
        check_room(NODE * math.prod(shape), nodes, cure, room)

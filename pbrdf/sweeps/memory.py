"""Memory that a sweep will take, foretold before it begins."""

from typing import Any

from pbrdf.memory import check_room
from pbrdf.simulation.memory import CURE, Effort, asked_size, at_work
from pbrdf.sweeps.description import Sweep
from pbrdf.sweeps.layout import Layout

__all__ = ["check_sweep"]


def check_sweep(
    sweep: Sweep, layout: Layout, at_once: int, cores: int, client: Any = None
) -> None:
    """Refuse a sweep that does not fit into the memory that is free.

    Parameters
    ----------
    sweep, layout : Sweep, Layout
        Its first point stands for all.
    at_once : int
        Groups computed at the same time; 0 if all results are held in memory.
    cores : int
        Threads that they share.
    client : distributed.Client, optional
        Whose workers compute, with memory of their own.

    Raises
    ------
    ValueError
        With what it would take, and what to change.
    """
    if client is not None:
        return
    scene, given = sweep.at(dict.fromkeys(layout.sizes, 0))
    size = asked_size(
        given["theta_i"], given.get("phi_i", 0.0), given.get("wavelength"),
        given.get("n_theta", 45), given.get("n_dphi", 90), given.get("stokes", "full"),
    )  # fmt: skip
    shared = {"workers": max(1, cores // max(at_once, 1)), "variance_reduction": True}
    point = at_work(scene, size, Effort.of(given | shared))
    # What a group holds stands a second time where it is written
    group = 2.0 * layout.group_bytes
    if at_once:
        need, words = at_once * (point + group), f"{at_once} groups at once"
        cure = f"{CURE}, or fewer workers=."
    else:
        need = layout.n_points * layout.point_bytes * 2.3 + point + group
        words, cure = f"{layout.n_points} points held", f"{CURE}, or use -o name.zarr."
    check_room(need, f"{words}, each {size.words()}", cure)

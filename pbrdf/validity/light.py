"""Light that a result lacks: lost by a fault, cut off, or gone sideways."""

from collections.abc import Mapping

import numpy as np

from pbrdf.errors import percent

# Share of the rays that rounding may lose: some in ten million
MOST_LOST = 1e-6
# Share of the light that may be missing without a word
MOST_MISSING = 1e-3

CURES = {
    "truncated": "was still on its way after {bounces} bounces and is in no bin. Raise "
    "max_bounces, or look for heights that are no surface: a spike, a pit, a wrong unit",
    "leaked": "was lost by a fault of the tracing: the result lacks it, do not use it. "
    "Check the heights for steps out of proportion",
    "left_sideways": "left the finite map sideways. Take a larger map or mesh, "
    "HeightMap.mirrored(), a period of the mesh, or a steeper source",
    "side_exits": "left the finite map sideways and is not counted. Take a larger map or "
    "mesh, HeightMap.mirrored(), a period of the mesh, or a steeper source",
}


def lost_ray_warnings(lost: int, rays: int) -> list[str]:
    """Say that more rays were lost by a fault of the tracing than rounding explains.

    Parameters
    ----------
    lost : int
        Rays that fell through the surface or met a boundary from the wrong side.
    rays : int
        Rays traced in all.

    Examples
    --------
    >>> lost_ray_warnings(3, 10_000_000)
    []
    >>> print(*lost_ray_warnings(2000, 16_000))
    2000 of 16000 rays were lost by a fault of the tracing: the result lacks their light, \
do not use it.
    """
    # A lone ray of a short run tells nothing
    if lost <= max(3.0, MOST_LOST * rays):
        return []
    return [
        f"{lost} of {rays} rays were lost by a fault of the tracing: the "
        "result lacks their light, do not use it."
    ]


def lost_light_warnings(
    shares: Mapping[str, np.ndarray], theta_i: np.ndarray | None, max_bounces: int
) -> list[str]:
    """Say where more than a thousandth of the light is missing, and what to change.

    Parameters
    ----------
    shares : mapping of str to ndarray, shape (angles, ...)
        Shares of the incident light by the names of `CURES`.
    theta_i : ndarray, shape (angles,), or None
        Zenith angles of the source [rad]; None for a share over all directions.
    max_bounces : int
        Where paths were cut.

    Examples
    --------
    >>> share = {"truncated": np.array([0.0, 0.0123])}
    >>> print(*lost_light_warnings(share, np.array([0.1, 0.5]), 64))
    1.2 % of the light at theta_i 28.65 deg was still on its way after 64 bounces and is \
in no bin. Raise max_bounces, or look for heights that are no surface: a spike, a pit, a \
wrong unit.
    """
    notes = []
    for name, values in shares.items():
        directions = 1 if theta_i is None else len(theta_i)
        by_angle = np.asarray(values).reshape(directions, -1).max(axis=1)
        worst = int(np.argmax(by_angle))
        if by_angle[worst] > MOST_MISSING:
            place = ""
            if theta_i is not None:
                place = f"at theta_i {np.rad2deg(theta_i[worst]):.4g} deg "
            cure = CURES[name].format(bounces=max_bounces)
            notes.append(f"{percent(by_angle[worst])} of the light {place}{cure}.")
    return notes

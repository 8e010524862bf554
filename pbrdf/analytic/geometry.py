"""Checked and broadcast geometries, as the kernels take them."""

from math import pi

import numpy as np
import numpy.typing as npt

from pbrdf.errors import require

__all__ = ["checked_zenith", "flat_geometry"]


def checked_zenith(name: str, theta: npt.ArrayLike) -> np.ndarray:
    """Zenith angles as an array, all within [0, pi/2]."""
    if _within(theta, 0.0, pi / 2):
        return np.asarray(theta)
    return require(
        name, theta, lambda v: (v >= 0) & (v <= pi / 2), "lie in [0, 1.571] rad",
        "Angles are radians; use np.deg2rad.",
    )  # fmt: skip


def checked_azimuth(name: str, phi: npt.ArrayLike) -> np.ndarray:
    """Azimuths as an array: finite, and small enough not to be degrees by mistake."""
    if _within(phi, -4 * pi, 4 * pi):
        return np.asarray(phi)
    return require(
        name, phi, lambda v: np.abs(v) <= 4 * pi, "lie in [-12.57, 12.57] rad",
        "Angles are radians; use np.deg2rad.",
    )  # fmt: skip


def _within(angle: npt.ArrayLike, low: float, high: float) -> bool:
    """Whether a float64 array lies in a range: two passes, where `require` takes six.

    False also if a NaN hides in it or it has a mask; `require` then names the place.
    """
    if type(angle) is not np.ndarray or angle.dtype != np.float64 or not angle.size:
        return False
    return bool(angle.min() >= low and angle.max() <= high)


def flat_geometry(
    theta_i: npt.ArrayLike,
    theta_s: npt.ArrayLike,
    dphi: npt.ArrayLike,
    phi_i: npt.ArrayLike,
    *others: np.ndarray,
) -> tuple[tuple[int, ...], list[np.ndarray]]:
    """Check four angles, broadcast them with the other arrays and flatten them all.

    Returns
    -------
    shape : tuple of int
        The broadcast shape.
    columns : list of ndarray
        Contiguous float64, read-only; of one element where phi_i or another array is a
        single number.
    """
    angles = [
        checked_zenith("theta_i", theta_i),
        checked_zenith("theta_s", theta_s),
        checked_azimuth("dphi", dphi),
    ]
    spare = [checked_azimuth("phi_i", phi_i), *others]
    try:
        shape = np.broadcast_shapes(*(a.shape for a in [*angles, *spare]))
    except ValueError:
        shapes = ", ".join(str(a.shape) for a in [*angles, *spare])
        msg = f"theta_i, theta_s, dphi, phi_i must broadcast together, got shapes {shapes}."
        raise ValueError(msg) from None
    columns = [_flat(a, shape) for a in angles]
    columns += [a.reshape(1) if a.size == 1 else _flat(a, shape) for a in spare]
    return shape, [read_only(column) for column in columns]


def read_only(array: np.ndarray) -> np.ndarray:
    """Return a view that nobody writes through.

    Kernels are compiled once for arrays that may be written to and once more for others:
    what they only read comes to them in one kind, however it was broadcast.
    """
    view = array.view()
    view.flags.writeable = False
    return view


def _flat(array: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Broadcast and flatten, copying only where needed."""
    return np.ascontiguousarray(np.broadcast_to(array, shape).reshape(-1))

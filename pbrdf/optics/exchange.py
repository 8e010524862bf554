"""Mueller matrices and angles in the sign conventions of other programs and papers.

Nothing is reinterpreted silently: the user names the convention the numbers come in.
"""

from dataclasses import dataclass
from math import pi

import numpy as np
import numpy.typing as npt

from pbrdf.errors import real_array
from pbrdf.kernels.microfacet.facet import fill_rotations

__all__ = ["CONVENTIONS", "Convention", "convert_brdf"]


@dataclass(frozen=True, kw_only=True)
class Convention:
    """How Stokes vectors, frames and the azimuth of a source differ from this package's.

    Parameters
    ----------
    flips : (int, int, int)
        Signs of Q, U and V in units of ours.
    scattering_plane : bool
        True if both beams are described in the frame of the plane through source and
        detector, e_s = dir_i x dir_s; False for the meridian frames.
    azimuth_offset : float
        Their azimuth at our dphi = 0. [rad]
    source : str
        Where the convention is stated.
    """

    flips: tuple[int, int, int] = (1, 1, 1)
    scattering_plane: bool = False
    azimuth_offset: float = 0.0
    source: str = ""


CONVENTIONS = {
    "pbrdf": Convention(source="the conventions page of this package"),
    "scatmech": Convention(
        flips=(1, 1, -1),
        azimuth_offset=pi,
        source="NIST SCATMECH: azimuth 0 is forward, V of the opposite sense",
    ),
    "mitsuba": Convention(
        scattering_plane=True,
        source="Mitsuba 3 measured polarised BSDF: x = normalize(to light x to viewer)",
    ),
    "paper": Convention(
        flips=(-1, 1, -1),
        source="Gartley et al. as printed: Q = I_p - I_s, index n - i kappa",
    ),
}


def convert_brdf(
    mueller: npt.ArrayLike,
    theta_i: npt.ArrayLike,
    theta_s: npt.ArrayLike,
    dphi: npt.ArrayLike,
    *,
    source: str = "pbrdf",
    target: str = "pbrdf",
) -> tuple[np.ndarray, np.ndarray]:
    """Mueller matrices and azimuths of one convention in those of another.

    Parameters
    ----------
    mueller : array_like, shape (..., 4, 4)
        BRDF without the cosine, as given in `source`. [1/sr]
    theta_i, theta_s, dphi : array_like, shape (...)
        Geometry, dphi as counted in `source`. [rad]
    source, target : str
        Keys of `CONVENTIONS`.

    Returns
    -------
    mueller : ndarray, shape (..., 4, 4)
    dphi : ndarray, shape (...)
        Azimuth as counted in `target`, in [-pi, pi). [rad]

    Raises
    ------
    ValueError
        If a convention is unknown or the shapes do not broadcast.

    Notes
    -----
    The paper's matrix (10) also lacks a factor 1/2, which is an error, not a convention,
    and is not applied here. In exact retro-reflection the scattering plane is undefined;
    the meridian frame of the source stands in for it.

    Examples
    --------
    >>> metal = np.diag([1.0, 1.0, -0.8, -0.8])
    >>> metal[2, 3], metal[3, 2] = -0.6, 0.6
    >>> turned, dphi = convert_brdf(metal, 0.5, 0.5, np.pi, target="scatmech")
    >>> turned[3, 2], float(dphi)
    (np.float64(-0.6), 0.0)
    """
    given, wanted = _convention("source", source), _convention("target", target)
    matrix = real_array("mueller", mueller)
    theta_i, theta_s = real_array("theta_i", theta_i), real_array("theta_s", theta_s)
    ours = real_array("dphi", dphi) - given.azimuth_offset
    matrix = _flipped(matrix, given.flips)
    if given.scattering_plane != wanted.scattering_plane:
        into_plane = wanted.scattering_plane
        matrix = _turned(matrix, theta_i, theta_s, ours, into_plane)
    theirs = np.mod(ours + wanted.azimuth_offset + pi, 2 * pi) - pi
    return _flipped(matrix, wanted.flips), theirs


def _convention(argument: str, name: str) -> Convention:
    """Look a convention up, or name the known ones."""
    if name not in CONVENTIONS:
        msg = f"{argument} must be one of {', '.join(CONVENTIONS)}, got {name!r}."
        raise ValueError(msg)
    return CONVENTIONS[name]


def _flipped(matrix: np.ndarray, flips: tuple[int, int, int]) -> np.ndarray:
    """P M P with P = diag(1, flips)."""
    signs = np.array([1, *flips])
    return matrix * np.outer(signs, signs)


def _turned(
    matrix: np.ndarray,
    theta_i: npt.ArrayLike,
    theta_s: npt.ArrayLike,
    dphi: npt.ArrayLike,
    into_plane: bool,
) -> np.ndarray:
    """Change both beams between meridian and scattering-plane frames."""
    shape = np.broadcast_shapes(
        matrix.shape[:-2], *(np.shape(a) for a in (theta_i, theta_s, dphi))
    )
    columns = [
        np.ascontiguousarray(
            np.broadcast_to(np.asarray(a, dtype=np.float64), shape).ravel()
        )
        for a in (theta_i, theta_s, dphi)
    ]
    turn_i = np.empty((columns[0].size, 4, 4))
    turn_s = np.empty_like(turn_i)
    fill_rotations(*columns, turn_i, turn_s)
    flat = np.broadcast_to(matrix, (*shape, 4, 4)).reshape(-1, 4, 4)
    if into_plane:
        turned = turn_s @ flat @ turn_i.transpose(0, 2, 1)
    else:
        turned = turn_s.transpose(0, 2, 1) @ flat @ turn_i
    return turned.reshape(*shape, 4, 4)

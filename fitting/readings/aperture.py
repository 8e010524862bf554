"""Finite source and detector: a reading is an average over two cones, not a point.

The average is taken with the seven-point rule on a disc, exact to degree five [1]_,
weighted with the cosines that irradiance and collected flux carry. The instrument's
polarisers stay with the axis of each cone while the meridian frames turn across it, near
the zenith by any angle; the rotation between the two is part of the average.

References
----------
.. [1] M. Abramowitz, I. Stegun, Handbook of Mathematical Functions, 1964, 25.4.61.
"""

from dataclasses import dataclass

import numpy as np

from fitting.readings.observations import Geometry
from pbrdf.conventions import direction, meridian_frame
from pbrdf.errors import one_number

__all__ = ["Aperture", "Rays", "rays_through"]


@dataclass(frozen=True, kw_only=True)
class Aperture:
    """Half-angles of the cones of light.

    Parameters
    ----------
    source, detector : float
        Half-angle of the incident and of the collected cone, 0 for a point. [rad]

    Raises
    ------
    ValueError
        If a half-angle is negative or no cone of light.
    """

    source: float = 0.0
    detector: float = 0.0

    def __post_init__(self) -> None:
        for name, value in (("source", self.source), ("detector", self.detector)):
            one_number(
                f"{name} half-angle", value, lambda v: (v >= 0.0) & (v < 0.5),
                "lie in [0, 0.5) rad", "Angles are radians; use np.deg2rad.",
            )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Rays:
    """Directions whose weighted sum is a reading; K for each of N readings.

    Parameters
    ----------
    geometry : Geometry
        The N K directions.
    parent : ndarray of int, shape (N K,)
        Reading each belongs to.
    weight : ndarray, shape (N K,)
        Sums to 1 over each reading.
    turn_in, turn_out : ndarray, shape (N K, 4, 4)
        Stokes rotations: instrument to meridian frame of the source, and meridian frame to
        instrument at the detector. The reading is the sum of weight turn_out M turn_in.
    """

    geometry: Geometry
    parent: np.ndarray
    weight: np.ndarray
    turn_in: np.ndarray
    turn_out: np.ndarray


def rays_through(geometry: Geometry, aperture: Aperture | None) -> Rays:
    """Return the directions to evaluate for readings taken through an aperture.

    Examples
    --------
    >>> one = Geometry(*(np.array([v]) for v in (0.5, 0.3, 3.0, 0.0, np.nan)))
    >>> rays_through(one, Aperture(detector=0.02)).weight.round(3)
    array([0.25 , 0.126, 0.126, 0.125, 0.124, 0.124, 0.125])
    """
    unity = np.broadcast_to(np.eye(4), (geometry.size, 4, 4))
    if aperture is None or (aperture.source == 0.0 and aperture.detector == 0.0):
        index = np.arange(geometry.size)
        return Rays(geometry, index, np.ones(geometry.size), unity, unity)

    phi_s = geometry.phi_i + geometry.dphi
    source = _cone(geometry.theta_i, geometry.phi_i, aperture.source, sense=-1.0)
    detector = _cone(geometry.theta_s, phi_s, aperture.detector, sense=1.0)
    k_i, k_s = source[0].shape[1], detector[0].shape[1]
    pairs = (geometry.size, k_i, k_s)

    def of_source(values: np.ndarray) -> np.ndarray:
        spread = np.broadcast_to(values[:, :, None], (*pairs, *values.shape[2:]))
        return spread.reshape(-1, *values.shape[2:])

    def of_detector(values: np.ndarray) -> np.ndarray:
        spread = np.broadcast_to(values[:, None, :], (*pairs, *values.shape[2:]))
        return spread.reshape(-1, *values.shape[2:])

    parent = np.repeat(np.arange(geometry.size), k_i * k_s)
    weight = of_source(source[2]) * of_detector(detector[2])
    weight = weight / np.bincount(parent, weight)[parent]
    phi_i = of_source(source[1])
    return Rays(
        geometry=Geometry(
            theta_i=of_source(source[0]),
            theta_s=of_detector(detector[0]),
            dphi=of_detector(detector[1]) - phi_i,
            phi_i=phi_i,
            wavelength=geometry.wavelength[parent],
        ),
        parent=parent,
        weight=weight,
        turn_in=of_source(source[3]),
        # Back from the meridian frame: the transpose of the rotation into it
        turn_out=of_detector(detector[3]).transpose(0, 2, 1),
    )


def _cone(
    theta: np.ndarray, phi: np.ndarray, half_angle: float, *, sense: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return theta, phi, weight (N, K) and rotation into the meridian frame (N, K, 4, 4).

    `sense` is +1 where light leaves along the direction, -1 where it arrives.
    """
    radius = np.array([0.0, *[np.sqrt(2.0 / 3.0)] * 6]) * np.tan(half_angle)
    share = np.array([0.25, *[0.125] * 6])
    if half_angle == 0.0:
        radius, share = radius[:1], np.ones(1)
    around = np.arange(len(radius)) * (np.pi / 3.0)

    axis = direction(theta, phi)
    e_s, e_p = meridian_frame(sense * axis, phi if sense > 0.0 else phi + np.pi)
    across = np.cos(around)[:, None] * e_s[:, None] + np.sin(around)[:, None] * e_p[:, None]
    leaves = axis[:, None] + radius[:, None] * across
    leaves = leaves / np.linalg.norm(leaves, axis=-1, keepdims=True)

    # What has sunk below the horizon carries no light
    up = np.maximum(leaves[..., 2], 0.0)
    zenith = np.arctan2(np.hypot(leaves[..., 0], leaves[..., 1]), np.maximum(up, 1e-12))
    azimuth = np.arctan2(leaves[..., 1], leaves[..., 0])
    azimuth = np.where(radius > 0.0, azimuth, phi[:, None])

    # The polariser's axis, carried along with the least rotation
    carried = e_s[:, None] - np.sum(e_s[:, None] * leaves, -1, keepdims=True) * leaves
    carried = carried / np.linalg.norm(carried, axis=-1, keepdims=True)
    carried_p = np.cross(sense * leaves, carried)
    own_azimuth = azimuth if sense > 0.0 else azimuth + np.pi
    own_s, _ = meridian_frame(sense * leaves, own_azimuth)
    cosine, sine = np.sum(own_s * carried, -1), np.sum(own_s * carried_p, -1)
    turn = np.zeros((*cosine.shape, 4, 4))
    turn[..., 0, 0] = turn[..., 3, 3] = 1.0
    turn[..., 1, 1] = turn[..., 2, 2] = cosine**2 - sine**2
    turn[..., 1, 2] = 2.0 * sine * cosine
    turn[..., 2, 1] = -2.0 * sine * cosine
    return zenith, azimuth, share * up, turn

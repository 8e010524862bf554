"""Finite source and detector: a reading is an average over two cones, not a point.

Within small cones the facet that mirrors a pair of directions depends on the sum of their
two displacements alone, if these are taken along and across the facet's plane of incidence:
both directions make the same angle with its normal. So the average over four numbers is
one over the sum, where a narrow lobe needs a fine rule, and over what is left, where a
coarse one does. Displacements are in equal-area coordinates, 2 sin(angle / 2).

Weights carry the cosines of irradiance and collected flux. The instrument's polarisers stay
with the axis of each cone while the meridian frames turn across it, near the zenith by any
angle; the rotation between the two is part of the average.
"""

from dataclasses import dataclass

import numpy as np

from fitting.readings.cone_rule import FINEST, RULES, pairs
from fitting.readings.observations import Geometry
from pbrdf.conventions import direction, meridian_frame
from pbrdf.errors import one_number

__all__ = ["FINEST", "Aperture", "Cones", "Rays", "cones_of", "rays_through", "spacing"]


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
class Cones:
    """Cones of light of N readings, and how finely each is averaged.

    Parameters
    ----------
    source, detector : ndarray, shape (N,)
        Half-angles. [rad]
    level : ndarray of int, shape (N,)
        Rule of each average, 0 to `FINEST`.
    """

    source: np.ndarray
    detector: np.ndarray
    level: np.ndarray

    def at(self, index: np.ndarray, level: np.ndarray | None = None) -> "Cones":
        """Return those of some readings, at other levels if given."""
        chosen = self.level[index] if level is None else level
        return Cones(self.source[index], self.detector[index], chosen)


@dataclass(frozen=True, eq=False)
class Rays:
    """Directions whose weighted sum is a reading; K for each of N readings.

    Parameters
    ----------
    geometry : Geometry
        The directions of all readings, those of one in succession.
    parent : ndarray of int, shape (R,)
        Reading each belongs to.
    weight : ndarray, shape (R,)
        Sums to 1 over each reading.
    turn_in, turn_out : ndarray, shape (R, 4, 4)
        Stokes rotations: instrument to meridian frame of the source, and meridian frame to
        instrument at the detector. The reading is the sum of weight turn_out M turn_in.
    """

    geometry: Geometry
    parent: np.ndarray
    weight: np.ndarray
    turn_in: np.ndarray
    turn_out: np.ndarray


def cones_of(geometry: Geometry, aperture: Aperture | None) -> Cones | None:
    """Return the cones of light, None if all are points.

    Parameters
    ----------
    geometry : Geometry
        Half-angles of the scans, where they name any.
    aperture : Aperture, optional
        In place of those of the scans.

    Raises
    ------
    ValueError
        If a half-angle of a scan is no cone of light.
    """
    found = []
    for end in ("source", "detector"):
        if aperture is not None:
            found.append(np.full(geometry.size, getattr(aperture, end)))
            continue
        column = getattr(geometry, f"{end}_half_angle")
        angles = np.zeros(geometry.size) if column is None else np.nan_to_num(column)
        wrong = ~((angles >= 0.0) & (angles < 0.5))
        if wrong.any():
            msg = (
                f"{end}_half_angle must lie in [0, 0.5) rad, got {angles[wrong][0]:g} at "
                f"geometry {np.flatnonzero(wrong)[0]}. Angles are radians; use np.deg2rad."
            )
            raise ValueError(msg)
        found.append(angles)
    if not any(angles.any() for angles in found):
        return None
    return Cones(found[0], found[1], np.zeros(geometry.size, dtype=int))


def spacing(cones: Cones) -> np.ndarray:
    """Return the largest step between the sums of displacements, shape (N,). [rad]"""
    rings, around, _ = np.array(RULES)[cones.level].T
    reach = cones.source + cones.detector
    return np.maximum(reach / rings, 2.0 * np.pi * reach / around)


def rays_through(geometry: Geometry, cones: Cones | None) -> Rays:
    """Return the directions to evaluate for readings taken through cones of light.

    Examples
    --------
    >>> one = Geometry(*(np.array([v]) for v in (0.5, 0.3, 3.0, 0.0, np.nan)))
    >>> rays = rays_through(one, cones_of(one, Aperture(detector=0.02)))
    >>> len(rays.weight), float(rays.weight.sum().round(12))
    (12, 1.0)
    """
    if cones is None:
        unity = np.broadcast_to(np.eye(4), (geometry.size, 4, 4))
        index = np.arange(geometry.size)
        return Rays(geometry, index, np.ones(geometry.size), unity, unity)

    parents, shifts_i, shifts_s, shares = [], [], [], []
    keys = np.stack([cones.source, cones.detector, cones.level], axis=1)
    for key in np.unique(keys, axis=0):
        members = np.flatnonzero((keys == key).all(axis=1))
        at_source, at_detector, share = pairs(float(key[0]), float(key[1]), int(key[2]))
        parents.append(np.repeat(members, len(share)))
        shifts_i.append(np.tile(at_source, (len(members), 1)))
        shifts_s.append(np.tile(at_detector, (len(members), 1)))
        shares.append(np.tile(share, len(members)))
    order = np.argsort(np.concatenate(parents), kind="stable")
    parent, share = np.concatenate(parents)[order], np.concatenate(shares)[order]
    shift_i, shift_s = np.concatenate(shifts_i)[order], np.concatenate(shifts_s)[order]

    phi_s = geometry.phi_i + geometry.dphi
    axis_i = direction(geometry.theta_i, geometry.phi_i)
    axis_s = direction(geometry.theta_s, phi_s)
    across = _across(axis_i, axis_s, geometry.phi_i)[parent]
    source = _cone(axis_i[parent], geometry.phi_i[parent], across, shift_i, sense=-1.0)
    detector = _cone(axis_s[parent], phi_s[parent], across, shift_s, sense=1.0)
    weight = share * source[2] * detector[2]
    return Rays(
        geometry=Geometry(
            theta_i=source[0],
            theta_s=detector[0],
            dphi=detector[1] - source[1],
            phi_i=source[1],
            wavelength=geometry.wavelength[parent],
            axis_theta_i=geometry.theta_i[parent],
            axis_phi_i=geometry.phi_i[parent],
            axis_theta_s=geometry.theta_s[parent],
            axis_dphi=geometry.dphi[parent],
        ),
        parent=parent,
        weight=weight / np.bincount(parent, weight)[parent],
        turn_in=source[3],
        # Back from the meridian frame: the transpose of the rotation into it
        turn_out=detector[3].transpose(0, 2, 1),
    )


def _across(axis_i: np.ndarray, axis_s: np.ndarray, phi_i: np.ndarray) -> np.ndarray:
    """Return the unit normal of the facet's plane of incidence, shape (N, 3)."""
    normal = np.cross(axis_i, axis_s)
    length = np.linalg.norm(normal, axis=-1, keepdims=True)
    # Light that goes straight back has no such plane; any serves
    level = np.stack([-np.sin(phi_i), np.cos(phi_i), np.zeros_like(phi_i)], axis=-1)
    return np.where(length > 1e-7, normal / np.maximum(length, 1e-300), level)


def _cone(
    axis: np.ndarray,
    phi: np.ndarray,
    across: np.ndarray,
    shift: np.ndarray,
    *,
    sense: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return theta, phi, cosine (R,) and rotation into the meridian frame (R, 4, 4).

    `shift` (R, 2) is the displacement along `across` and in the plane across the axis.
    `sense` is +1 where light leaves along the direction, -1 where it arrives.
    """
    square = np.sum(shift**2, axis=-1, keepdims=True)
    aside = shift[:, :1] * across + shift[:, 1:] * np.cross(across, axis)
    leaves = axis * (1.0 - 0.5 * square) + aside * np.sqrt(1.0 - 0.25 * square)

    # What has sunk below the horizon carries no light
    up = np.maximum(leaves[:, 2], 0.0)
    zenith = np.arctan2(np.hypot(leaves[:, 0], leaves[:, 1]), np.maximum(up, 1e-12))
    azimuth = np.arctan2(leaves[:, 1], leaves[:, 0])
    azimuth = np.where(square[:, 0] > 0.0, azimuth, phi)

    # The polariser's axis, carried along with the least rotation
    behind = 0.0 if sense > 0.0 else np.pi
    e_s, _ = meridian_frame(sense * axis, phi + behind)
    carried = e_s - np.sum(e_s * leaves, -1, keepdims=True) * leaves
    carried = carried / np.linalg.norm(carried, axis=-1, keepdims=True)
    carried_p = np.cross(sense * leaves, carried)
    own_s, _ = meridian_frame(sense * leaves, azimuth + behind)
    cosine, sine = np.sum(own_s * carried, -1), np.sum(own_s * carried_p, -1)
    turn = np.zeros((len(cosine), 4, 4))
    turn[:, 0, 0] = turn[:, 3, 3] = 1.0
    turn[:, 1, 1] = turn[:, 2, 2] = cosine**2 - sine**2
    turn[:, 1, 2] = 2.0 * sine * cosine
    turn[:, 2, 1] = -2.0 * sine * cosine
    return zenith, azimuth, up, turn

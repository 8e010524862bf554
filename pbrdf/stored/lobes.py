"""Between incidences and bins: read where the same facets shine, in the frame of the facet.

A lobe moves with the incidence. Directions of neighbouring incidences that have the same
half vector are put together, and matrices in the frame of the plane through source, facet
normal and detector, where they change slowly.
"""

from dataclasses import dataclass

import numpy as np

from pbrdf.conventions import direction
from pbrdf.stored.schemes import Scheme, combined

__all__ = ["Lobes"]

_FLAT = 1e-9


@dataclass(frozen=True, kw_only=True)
class Lobes:
    """The hemispheres of several incidences.

    Attributes
    ----------
    theta_i, theta_s, dphi : ndarray
        Incidences and centres of the bins. [rad]
    value, stderr : ndarray, shape (theta_i, theta_s, dphi, 4, 4)
        In meridian frames. [1/sr]
    scheme : Scheme
        Between incidences.
    """

    theta_i: np.ndarray
    theta_s: np.ndarray
    dphi: np.ndarray
    value: np.ndarray
    stderr: np.ndarray
    scheme: Scheme

    def __post_init__(self) -> None:
        grid = np.meshgrid(self.theta_i, self.theta_s, self.dphi, indexing="ij")
        into, out = turns(*grid)
        local = np.swapaxes(out, -1, -2) @ self.value @ into
        object.__setattr__(self, "_local", local)
        spread = turned(np.swapaxes(out, -1, -2), self.stderr, into)
        object.__setattr__(self, "_spread", spread)

    def brdf(
        self,
        theta_i: np.ndarray,
        theta_s: np.ndarray,
        dphi: np.ndarray,
        without: int | None = None,
        apart: bool = False,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return matrices and standard errors at directions of one shape (n,).

        `without` leaves one incidence out, to see what it is worth; `apart` as of
        `combined`.
        """
        held = np.arange(len(self.theta_i))
        held = held if without is None else np.delete(held, without)
        facet = half_vector(theta_i, theta_s, dphi)
        if len(held) == 1:
            value, stderr = self._mirrored(held[np.zeros(theta_i.size, int)], facet)
        else:
            index, weight = self.scheme.weights(self.theta_i[held], theta_i)
            read = [self._mirrored(held[column], facet) for column in index.T]
            value, stderr = combined(
                weight,
                np.stack([one for one, _ in read], axis=1),
                np.stack([one for _, one in read], axis=1),
                log=self.scheme.log,
                apart=apart,
            )
        both = (np.cos(theta_i) + np.cos(theta_s))[:, None, None]
        value, stderr = value / both, stderr / both
        into, out = turns(theta_i, theta_s, dphi)
        back = np.swapaxes(into, -1, -2)
        return out @ value @ back, turned(out, stderr, back)

    def _mirrored(
        self, node: np.ndarray, facet: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Read incidences where facets of these normals shine.

        Values are times cos theta_i + cos theta_s: light of rough surfaces at grazing
        angles goes with its inverse.
        """
        source = direction(self.theta_i[node], 0.0)
        out = 2.0 * (facet * source).sum(-1, keepdims=True) * facet - source
        # Light that would go below the horizon stands for what just clears it
        theta_s = np.arctan2(np.hypot(out[:, 0], out[:, 1]), out[:, 2])
        theta_s = np.minimum(theta_s, np.pi / 2)
        azimuth = np.arctan2(out[:, 1], out[:, 0])
        value, stderr = self._between(node, theta_s, azimuth)
        both = (np.cos(self.theta_i[node]) + np.cos(theta_s))[:, None, None]
        return both * value, both * stderr

    def place(self, theta_s: np.ndarray, dphi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return directions in bins: 0 at the first centre, one more at the next."""
        step, turn = self.theta_s[1] - self.theta_s[0], 2 * np.pi / self.dphi.size
        row = np.minimum((theta_s - self.theta_s[0]) / step, self.theta_s.size - 1.0)
        return row, np.mod(dphi, 2 * np.pi) / turn

    def _between(
        self, node: np.ndarray, theta_s: np.ndarray, dphi: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Interpolate between the centres of four bins."""
        row, column = self.place(theta_s, dphi)
        low, left = np.floor(row).astype(int), np.floor(column).astype(int)
        up, right = row - low, column - left
        value, stderr, weight = [], [], []
        for ring, part in ((low, 1.0 - up), (low + 1, up)):
            # Below the first ring comes the same ring, half a turn on
            across = ring < 0
            for side, share in ((left, 1.0 - right), (left + 1, right)):
                at = (side + across * (self.dphi.size // 2)) % self.dphi.size
                on = np.clip(np.where(across, 0, ring), 0, self.theta_s.size - 1)
                value.append(self._local[node, on, at])  # type: ignore[attr-defined]
                stderr.append(self._spread[node, on, at])  # type: ignore[attr-defined]
                weight.append(part * share)
        return combined(
            np.stack(weight, -1), np.stack(value, 1), np.stack(stderr, 1), log=True,
            apart=True,
        )  # fmt: skip


def half_vector(theta_i: np.ndarray, theta_s: np.ndarray, dphi: np.ndarray) -> np.ndarray:
    """Return the normals of the facets that mirror source to detector, shape (..., 3)."""
    both = direction(theta_i, 0.0) + direction(theta_s, dphi)
    length = np.linalg.norm(both, axis=-1, keepdims=True)
    return np.where(length > _FLAT, both / np.maximum(length, _FLAT), [1.0, 0.0, 0.0])


def turns(
    theta_i: np.ndarray, theta_s: np.ndarray, dphi: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return Mueller rotations from the facet's frame into the meridian frames.

    Shapes (..., 4, 4) of the incident and of the scattered beam; at retro-reflection,
    where no plane is given, that of incidence.
    """
    zero = np.zeros(np.broadcast_shapes(*map(np.shape, (theta_i, theta_s, dphi))))
    source, sensor = direction(theta_i + zero, zero), direction(theta_s + zero, dphi + zero)
    across = np.cross(sensor, source)
    length = np.linalg.norm(across, axis=-1, keepdims=True)
    incidence = np.broadcast_to([0.0, -1.0, 0.0], across.shape)
    across = np.where(length > _FLAT, across / np.maximum(length, _FLAT), incidence)
    found = []
    # Azimuths of the beams themselves: the incident one travels against its direction
    for prop, azimuth in ((-source, np.pi + zero), (sensor, dphi + zero)):
        e_s = np.stack([-np.sin(azimuth), np.cos(azimuth), zero], axis=-1)
        e_p = np.cross(prop, e_s)
        found.append(_rotation((across * e_s).sum(-1), (across * e_p).sum(-1)))
    return found[0], found[1]


def turned(left: np.ndarray, stderr: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the error of left @ value @ right, of elements that err each by itself."""
    return np.asarray(np.sqrt(left**2 @ stderr**2 @ right**2))


def _rotation(cosine: np.ndarray, sine: np.ndarray) -> np.ndarray:
    """Mueller matrix from the frame whose e_s' has this cosine and sine with e_s, e_p."""
    cos2, sin2 = cosine**2 - sine**2, 2 * sine * cosine
    matrix = np.zeros((*cosine.shape, 4, 4))
    matrix[..., 0, 0] = matrix[..., 3, 3] = 1.0
    matrix[..., 1, 1] = matrix[..., 2, 2] = cos2
    matrix[..., 1, 2], matrix[..., 2, 1] = -sin2, sin2
    return matrix

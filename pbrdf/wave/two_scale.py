"""Fine structure, seen by waves, on coarse facets, seen by rays."""

import warnings
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from pbrdf.analytic.geometry import flat_geometry
from pbrdf.errors import AccuracyWarning, one_number
from pbrdf.wave.directional import smith
from pbrdf.wave.energy import hemisphere
from pbrdf.wave.model import WaveModel, checked_wavelength

__all__ = ["TwoScaleModel"]

Array = np.ndarray

# Slopes reach so many standard deviations, at this step or at this part of the lobe of the
# fine structure, whichever is finer
REACH, STEP, PART = 4.5, 0.9, 0.6
MOST_NODES = 60
# Matrices at a time
CHUNK = 200_000
# Angles at which the mean field is tabulated
ZENITHS = np.r_[np.linspace(0.0, 1.55, 125), np.linspace(1.5505, 0.5 * np.pi, 20)]


@dataclass(frozen=True)
class TwoScaleModel:
    """Facets of Gaussian slopes, each of them a finely rough surface.

    A facet mirrors the mean field of its fine structure and scatters the rest about its
    own normal. What the fine structure takes from the one is in the other.

    Parameters
    ----------
    fine : WaveModel
        The fine structure, isotropic.
    slope_rms : float
        Rms slope of the facets PER AXIS. Their heights are well above the wavelength, or
        there would be a beam. [1]

    Raises
    ------
    ValueError
        If the slope leaves (0, 1], or the fine structure has directions.

    Examples
    --------
    >>> from pbrdf import Material
    >>> fine = WaveModel(Material(1.5), height_rms=0.03, corr_length=0.5)
    >>> paint = TwoScaleModel(fine, slope_rms=0.1)
    >>> shares = paint.shares(0.5, 0.6)
    >>> bool(shares["scattered"] > 0.1 * shares["mirrored"])
    True
    """

    fine: WaveModel
    slope_rms: float

    def __post_init__(self) -> None:
        one_number(
            "slope_rms", self.slope_rms, lambda v: (v > 0) & (v <= 1), "lie in (0, 1]",
            "It is the rms slope per axis.",
        )  # fmt: skip
        if self.fine.directional is not None:
            msg = "fine must be isotropic, got heights that differ by direction."
            raise ValueError(msg)

    def brdf(
        self,
        theta_i: npt.ArrayLike,
        theta_s: npt.ArrayLike,
        dphi: npt.ArrayLike,
        wavelength: npt.ArrayLike,
    ) -> Array:
        """Mueller BRDF of single scattering, (..., 4, 4) [1/sr]; asked as `WaveModel`."""
        mirrored, scattered = self.parts(theta_i, theta_s, dphi, wavelength)
        return mirrored + scattered

    def parts(
        self,
        theta_i: npt.ArrayLike,
        theta_s: npt.ArrayLike,
        dphi: npt.ArrayLike,
        wavelength: npt.ArrayLike,
    ) -> tuple[Array, Array]:
        """Light that facets mirror, and light that their fine structure scatters.

        Returns
        -------
        mirrored, scattered : ndarray, shape (..., 4, 4)
            Their sum is `brdf`. [1/sr]
        """
        waves = checked_wavelength(wavelength)
        shape, columns = flat_geometry(theta_i, theta_s, dphi, 0.0, waves)
        del columns[3]
        size = int(np.prod(shape))
        geometry = [np.broadcast_to(c, size) for c in columns]
        mirrored, scattered = np.zeros((2, size, 4, 4))
        for wave in np.unique(geometry[3]):
            rows = np.flatnonzero(geometry[3] == wave)
            views = Views(*(c[rows] for c in geometry[:3]))
            mirrored[rows] = self._mirrored(views, float(wave))
            scattered[rows] = self._scattered(views, float(wave))
        angles = geometry[0], geometry[1], geometry[2]
        hidden = smith(*angles, self.slope_rms, self.slope_rms)[:, None, None]
        both = (hidden * part for part in (mirrored, scattered))
        one, other = (part.reshape(*shape, 4, 4) for part in both)
        return one, other

    def error_estimate(
        self,
        theta_i: npt.ArrayLike,
        theta_s: npt.ArrayLike,
        dphi: npt.ArrayLike,
        wavelength: npt.ArrayLike,
    ) -> Array:
        """Relative standard error of M00: that of the fine structure's part."""
        directions = theta_i, theta_s, dphi, wavelength
        mirrored, scattered = (p[..., 0, 0] for p in self.parts(*directions))
        share = scattered / np.maximum(mirrored + scattered, 1e-300)
        return share * self.fine.error_estimate(*directions)

    def shares(self, theta_i: float, wavelength: float) -> dict[str, float]:
        """Book unpolarised incident light: what becomes of it, as shares of its power.

        Returns
        -------
        dict
            `mirrored` by facets, `scattered` by their fine structure, and the `rest`, which
            goes below or on to a second facet. [1]
        """
        both: list[Array] = []

        def light(theta_s: Array, dphi: Array) -> Array:
            if not both:
                parts = self.parts(theta_i, theta_s, dphi, wavelength)
                both.extend(part[..., 0, 0] for part in parts)
            return both.pop(0)

        # The directions of both are the same
        width = min(2 * self.slope_rms, 0.4)
        found = {
            name: hemisphere(theta_i, width, light) for name in ("mirrored", "scattered")
        }
        return found | {"rest": 1.0 - found["mirrored"] - found["scattered"]}

    def _mirrored(self, views: "Views", wavelength: float) -> Array:
        """Mean field of the facet that mirrors one direction into the other."""
        normal = views.to_source + views.to_sensor
        normal = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
        tilt = normal[:, 2]
        square = (1.0 - tilt**2) / tilt**2
        density = np.exp(-0.5 * square / self.slope_rms**2)
        density = density / (2 * np.pi * self.slope_rms**2 * tilt**4)
        half = np.arccos(np.clip((normal * views.to_source).sum(-1), 0.0, 1.0))
        matrix = views.turned(self._beam(half, wavelength), normal)
        scale = density / (4 * views.to_source[:, 2] * views.to_sensor[:, 2])
        return scale[:, None, None] * matrix

    def _beam(self, theta: Array, wavelength: float) -> Array:
        """Mueller matrices of the mean field of the fine structure, interpolated."""
        if wavelength not in self._beams:
            with warnings.catch_warnings():
                # It is in doubt near grazing, where few facets are met
                warnings.simplefilter("ignore", AccuracyWarning)
                self._beams[wavelength] = self.fine.coherent(ZENITHS, wavelength)
        table = self._beams[wavelength].reshape(-1, 16)
        found = np.stack([np.interp(theta, ZENITHS, column) for column in table.T], -1)
        return found.reshape(-1, 4, 4)

    @cached_property
    def _beams(self) -> dict[float, Array]:
        return {}

    def _scattered(self, views: "Views", wavelength: float) -> Array:
        """Mean over the facets of what their fine structure scatters."""
        lobe = wavelength / (2 * np.pi * self.fine.surface.heights.corr_length)
        step = min(STEP, PART * lobe / self.slope_rms)
        # Even, so that no facet is level: its frame would have no direction
        count = 2 * int(min(np.ceil(REACH / step), MOST_NODES))
        step = 2 * REACH / count
        line = (np.arange(count) - 0.5 * (count - 1)) * step
        weight = np.exp(-0.5 * line**2) * step / np.sqrt(2 * np.pi)
        slopes = np.stack(np.meshgrid(line, line, indexing="ij"), -1).reshape(-1, 2)
        weights = np.outer(weight, weight).ravel()
        kept = weights > 1e-7 * weights.max()
        slopes, weights = slopes[kept] * self.slope_rms, weights[kept] / weights[kept].sum()
        out = np.zeros((views.size, 4, 4))
        for k in range(0, weights.size, max(CHUNK // views.size, 1)):
            part = slice(k, k + max(CHUNK // views.size, 1))
            out += self._of_facets(views, slopes[part], weights[part], wavelength)
        return out

    def _of_facets(
        self, views: "Views", slopes: Array, weights: Array, wavelength: float
    ) -> Array:
        """Sum over facets of given slopes, (N, 4, 4)."""
        every = views.repeated(weights.size)
        long = np.hypot(1.0, np.hypot(*slopes.T))
        along, across = (np.repeat(-one / long, views.size) for one in slopes.T)
        cos, sin = every.middle.T
        normal = np.stack(
            [cos * along - sin * across, sin * along + cos * across,
             np.repeat(1.0 / long, views.size)], -1,
        )  # fmt: skip
        cos_i, cos_s = ((normal * d).sum(-1) for d in (every.to_source, every.to_sensor))
        seen = np.flatnonzero((cos_i > 1e-6) & (cos_s > 1e-6))
        normal, every = normal[seen], every.only(seen)
        cos_i, cos_s = cos_i[seen], cos_s[seen]
        turn = (every.to_source * every.to_sensor).sum(-1) - cos_i * cos_s
        side = (np.cross(every.to_source, every.to_sensor) * normal).sum(-1)
        matrix = self.fine.brdf(
            np.arccos(np.minimum(cos_i, 1.0)), np.arccos(np.minimum(cos_s, 1.0)),
            np.arctan2(side, turn), wavelength,
        )  # fmt: skip
        scale = (weights * long)[seen // views.size] * cos_i * cos_s
        scale = scale / (every.to_source[:, 2] * every.to_sensor[:, 2])
        out = np.zeros((views.size, 4, 4))
        turned = scale[:, None, None] * every.turned(matrix, normal)
        np.add.at(out, seen % views.size, turned)
        return out


class Views:
    """Directions to source and detector, (N, 3), with the frames of the conventions."""

    def __init__(self, theta_i: Array, theta_s: Array, dphi: Array) -> None:
        cos_i, cos_s = (np.maximum(np.cos(t), 1e-9) for t in (theta_i, theta_s))
        zero = np.zeros(theta_i.size)
        self.to_source = np.stack([np.sin(theta_i), zero, cos_i], -1)
        sin_s = np.sin(theta_s)
        self.to_sensor = np.stack([sin_s * np.cos(dphi), sin_s * np.sin(dphi), cos_s], -1)
        # e_s = z x k of the light that comes, and of that which goes
        self.s_in = np.stack([zero, zero - 1.0, zero], -1)
        self.s_out = np.stack([-np.sin(dphi), np.cos(dphi), zero], -1)
        # Axis of the slopes, the same for both ways of the light
        middle = (self.to_source + self.to_sensor)[:, :2]
        length = np.linalg.norm(middle, axis=1, keepdims=True)
        level = np.stack([-np.sin(0.5 * dphi), np.cos(0.5 * dphi)], -1)
        self.middle = np.where(length > 1e-9, middle / np.maximum(length, 1e-300), level)

    @property
    def size(self) -> int:
        """Number of views."""
        return int(self.to_source.shape[0])

    def only(self, rows: Array) -> "Views":
        """Return some of the views."""
        out = object.__new__(Views)
        for name, value in vars(self).items():
            setattr(out, name, value[rows])
        return out

    def repeated(self, times: int) -> "Views":
        """Return all views several times over."""
        return self.only(np.tile(np.arange(self.size), times))

    def turned(self, matrix: Array, normal: Array) -> Array:
        """Mueller matrices in the frames of facets, in those of the mean surface."""
        into = _turn(-self.to_source, self.s_in, normal)
        away = _turn(self.to_sensor, self.s_out, normal)
        found: Array = away.swapaxes(1, 2) @ matrix @ into
        return found


def _turn(direction: Array, e_s: Array, normal: Array) -> Array:
    """Rotation of Stokes vectors from a frame to that of the facet, (N, 4, 4)."""
    local = np.cross(normal, direction)
    size = np.linalg.norm(local, axis=-1, keepdims=True)
    local = np.where(size > 1e-12, local / np.maximum(size, 1e-300), e_s)
    cos = (local * e_s).sum(-1)
    sin = (local * np.cross(direction, e_s)).sum(-1)
    out = np.zeros((cos.size, 4, 4))
    out[:, 0, 0] = out[:, 3, 3] = 1.0
    out[:, 1, 1] = out[:, 2, 2] = cos**2 - sin**2
    out[:, 1, 2], out[:, 2, 1] = 2 * cos * sin, -2 * cos * sin
    return out

"""What a map and optical constants predict: a Mueller BRDF and the interval of M00."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from fitting.prediction.facets import Facets
from pbrdf import MicrofacetModel, WaveModel
from pbrdf.analytic.bounces import second_bounce

Array = np.ndarray

# Points an axis of the second bounce: 2 % of a small term
_NODES = 24
# Slope of the second bounce where most of a map, or one of its axes, is flat
_LEAST = 1e-3


@dataclass(frozen=True, kw_only=True, eq=False)
class Draw:
    """One member of the predictive distribution.

    Parameters
    ----------
    model : MicrofacetModel or WaveModel
        Over its own slopes or heights, and index.
    gain : ndarray, shape (k,)
        Factors of the facet model's own error. [1]
    base : ndarray, shape (k,)
        Lambertian albedo of what the map does not show. [1]
    """

    model: MicrofacetModel | WaveModel
    gain: Array
    base: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class Prediction:
    """Reflectance predicted from a map, nothing fitted.

    Parameters
    ----------
    model : MicrofacetModel or WaveModel
        Facets, or waves of a smooth map, at the most likely value of everything.
    wavelength : float
        In vacuum. [um]
    facets : Facets
        Slopes of the map as light sees them.
    draws : tuple of Draw
        The predictive distribution.
    notes : tuple of str
        What was assumed, in words.
    """

    model: MicrofacetModel | WaveModel
    wavelength: float
    facets: Facets
    draws: tuple[Draw, ...]
    notes: tuple[str, ...]

    def brdf(
        self, theta_i: npt.ArrayLike, theta_s: npt.ArrayLike, dphi: npt.ArrayLike,
        wavelength: float | None = None, *, phi_i: npt.ArrayLike = 0.0,
    ) -> Array:  # fmt: skip
        """Mueller BRDF of one and two bounces; arguments broadcast.

        Of a smooth map the incoherent part of one; its specular beam is `coherent`.

        Parameters
        ----------
        theta_i, theta_s, dphi : array_like
            As in `MicrofacetModel.brdf`. [rad]
        wavelength : float, optional
            Its own, where it is read as any model. [um]
        phi_i : array_like
            Azimuth of the source from the x axis of the map. [rad]

        Returns
        -------
        ndarray, shape (..., 4, 4)
            [1/sr]
        """
        self._check(wavelength)
        angles = (theta_i, theta_s, dphi)
        once = self.model.brdf(*angles, self.wavelength, phi_i=phi_i)
        return once + self._twice(angles, phi_i)

    def interval(
        self, theta_i: npt.ArrayLike, theta_s: npt.ArrayLike, dphi: npt.ArrayLike,
        *, phi_i: npt.ArrayLike = 0.0, level: float = 0.95,
    ) -> tuple[Array, Array]:  # fmt: skip
        """Interval that holds a reading of M00 with a chance of `level`. [1/sr]"""
        if not 0 < level < 1:
            msg = f"level must lie between 0 and 1, got {level:g}. 0.95 is usual."
            raise ValueError(msg)
        angles = (theta_i, theta_s, dphi)
        twice = self._twice(angles, phi_i)[..., 0, 0]
        values = []
        for draw in self.draws:
            once = draw.model.brdf(*angles, self.wavelength, phi_i=phi_i)[..., 0, 0]
            whole = (once + twice)[..., None] * draw.gain + draw.base / np.pi
            values.append(whole)
        ends = [(1 - level) / 2, (1 + level) / 2]
        low, high = np.quantile(np.concatenate(values, axis=-1), ends, axis=-1)
        # Draws have a diffuse part that the prediction itself leaves out
        own = self.brdf(*angles, phi_i=phi_i)[..., 0, 0]
        return np.minimum(low, own), np.maximum(high, own)

    def coherent(
        self, theta_i: npt.ArrayLike, wavelength: float | None = None,
        *, phi_i: npt.ArrayLike = 0.0,
    ) -> Array:  # fmt: skip
        """Mueller matrix of the specular beam, (..., 4, 4) [1]; 0 of a map of facets.

        Arguments as of `brdf`.
        """
        self._check(wavelength)
        if isinstance(self.model, WaveModel):
            return self.model.coherent(theta_i, self.wavelength, phi_i=phi_i)
        return np.zeros((*np.broadcast_shapes(np.shape(theta_i), np.shape(phi_i)), 4, 4))

    def _check(self, wavelength: float | None) -> None:
        if wavelength is not None and wavelength != self.wavelength:
            msg = (
                f"wavelength must be that of the prediction, {self.wavelength:g} um, got "
                f"{wavelength:g}. Predict anew: patches depend on it."
            )
            raise ValueError(msg)

    def _twice(self, angles: tuple[npt.ArrayLike, ...], phi_i: npt.ArrayLike) -> Array:
        theta_i, theta_s, dphi = angles
        if isinstance(self.model, WaveModel):
            return np.zeros((*np.broadcast_shapes(*map(np.shape, (*angles, phi_i))), 4, 4))
        return second_bounce(
            self._gaussian, theta_i, theta_s, dphi, self.wavelength,
            phi_i=phi_i, nodes=_NODES,
        )  # fmt: skip

    @cached_property
    def _gaussian(self) -> MicrofacetModel:
        """Gaussian slopes of the median of the patches, for the second bounce only.

        Light that went from a patch to another has left the first: neither cliffs, which
        pair with nothing nearby, nor what lies within a patch send it there.
        """
        # A Gaussian of unit slopes has its median at 1.18,
        scale = np.median(self.facets.radius) / np.sqrt(2 * np.log(2))
        widths, _ = self.facets.principal
        slope: float | tuple[float, float] = max(float(scale * widths[0]), _LEAST)
        if widths[0] != widths[1]:
            slope = (
                max(float(scale * np.std(self.facets.slope_x)), _LEAST),
                max(float(scale * np.std(self.facets.slope_y)), _LEAST),
            )
        return MicrofacetModel(self.model.material, slope_rms=slope)

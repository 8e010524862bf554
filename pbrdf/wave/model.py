"""Polarised reflectance of a surface whose roughness is no larger than the wavelength."""

from dataclasses import dataclass, fields
from functools import cached_property, partial
from typing import Any

import numpy as np
import numpy.typing as npt

from pbrdf.analytic.geometry import checked_azimuth, checked_zenith, flat_geometry
from pbrdf.errors import require
from pbrdf.optics import library
from pbrdf.optics.materials import Material
from pbrdf.wave.accuracy import relative_error
from pbrdf.wave.directional import Directional, GaussianAxes, directional_heights
from pbrdf.wave.energy import Energy, account, hemisphere
from pbrdf.wave.local_curvature import profile_curvature
from pbrdf.wave.methods import method_of
from pbrdf.wave.scattering import Scattering
from pbrdf.wave.specular import mueller_of
from pbrdf.wave.statistics import Statistics
from pbrdf.wave.surfaces import heights_of

__all__ = ["WaveModel"]

Array = np.ndarray

# Zenith beyond which both ways of the light are averaged [rad], and the signs of the Stokes
# parameters when source and detector change places
NEAR_GRAZING = 0.5 * np.pi - 2e-3
EXCHANGE = np.array([1.0, 1.0, -1.0, 1.0])


@dataclass(frozen=True, eq=False, init=False)
class WaveModel:
    """Scattering and mean reflection of a Gaussian-height surface by wave optics.

    Parameters
    ----------
    material : Material or str
        What is below the surface, or the name of a material of the library.
    height_rms, corr_length : float
        Rms height and 1/e length of the autocorrelation; (l_x, l_y) of a Gaussian one that
        differs along the axes, for every method but "local-curvature". [um]
    autocorrelation : str, callable or (lag, correlation)
        "gaussian", "exponential", "k-correlation" (with `exponent`), a function of the lag
        [um] that is 1 at zero, or a table; corr_length then follows from it.
    psd : (frequency, density), optional
        Measured two-sided spectral density over frequencies without 2 pi [1/um];
        height_rms and corr_length follow from it. `brdf` and `coherent` read it as that of
        the isotropic surface, whose integral over the plane of frequencies is height_rms^2
        [um^4]; (f_x, f_y, density) is that over the plane of frequencies, for
        "first-order". `profile_scattering` and `profile_coherent` read it as that of the
        profile [um^3].
    method : str
        A key of `pbrdf.wave.METHODS`.
    exponent : float, optional
        Of "k-correlation": the density of profiles falls by this power. [1]

    Raises
    ------
    ValueError
        If a value leaves its range or a name is unknown.

    Notes
    -----
    Single scattering. Where the rms slope exceeds 0.45 a call warns: double bounces are
    missing.

    References
    ----------
    .. [1] S. O. Rice, Commun. Pure Appl. Math. 4, 351 (1951).
    .. [2] P. Beckmann, A. Spizzichino, The Scattering of Electromagnetic Waves from Rough
       Surfaces, 1963.
    .. [3] T. M. Elfouhaily, C.-A. Guerin, Waves in Random Media 14, R1 (2004).

    Examples
    --------
    A polished glass scatters little, and its specular beam keeps almost all of 4 %:

    >>> polished = WaveModel(Material(1.5), height_rms=0.005, corr_length=2.0)
    >>> float(polished.coherent(0.0, 0.633)[0, 0].round(4))
    0.0396
    >>> float(polished.brdf(0.0, 0.2, 0.0, 0.633)[0, 0].round(5))
    0.00025
    """

    material: Material
    height_rms: float | None
    corr_length: float | None
    autocorrelation: Any
    psd: Any
    method: str
    exponent: float | None

    def __init__(
        self,
        material: Material | str,
        *,
        height_rms: float | None = None,
        corr_length: float | None = None,
        autocorrelation: Any = "gaussian",
        psd: Any = None,
        method: str = "auto",
        exponent: float | None = None,
    ) -> None:
        set_field = object.__setattr__
        known = isinstance(material, Material)
        set_field(self, "material", material if known else library.get(str(material)))
        set_field(self, "height_rms", height_rms)
        set_field(self, "corr_length", corr_length)
        set_field(self, "autocorrelation", autocorrelation)
        set_field(self, "psd", psd)
        set_field(self, "method", method)
        set_field(self, "exponent", exponent)
        # A fault shows here, not at the first call. A density may be that of a profile,
        # which only the methods of profiles read
        method_of(method)
        if self.directional is not None:
            self._check_directional(self.directional)
        elif psd is None:
            _ = self.surface
        elif height_rms is not None:
            self._check_height()

    def _check_height(self) -> None:
        """Refuse a density that has height_rms neither of a surface nor of a profile."""
        try:
            _ = self.surface
        except ValueError as fault:
            try:
                _ = self.profile
            except ValueError:
                raise fault from None

    @cached_property
    def directional(self) -> Directional | None:
        """Heights that differ from direction to direction, None of an isotropic surface."""
        return directional_heights(
            self.height_rms, self.corr_length, self.psd, self.autocorrelation
        )

    def _check_directional(self, heights: Directional) -> None:
        """Refuse a form that needs more than the spectrum."""
        if self.method not in heights.methods:
            msg = (
                f"method must be one of {', '.join(heights.methods)} where heights differ "
                f"from direction to direction, got {self.method!r}: the others need slopes "
                "and curvatures of an isotropic surface."
            )
            raise ValueError(msg)

    def _isotropic(self, what: str) -> None:
        """Refuse what is known of isotropic surfaces only."""
        if self.directional is not None:
            msg = f"{what} must be asked of an isotropic surface, got unequal directions."
            raise ValueError(msg)

    @cached_property
    def surface(self) -> Scattering:
        """The heights as those of an isotropic surface."""
        return Scattering(self.directional or self._heights(2), self.method, 2)

    @cached_property
    def profile(self) -> Scattering:
        """The heights as those of a profile."""
        self._isotropic("a profile")
        heights = self.surface.heights if self.psd is None else self._heights(1)
        return Scattering(heights, self.method, 1)

    def _heights(self, dimensions: int) -> Statistics:
        """Statistics of the heights along one axis or two."""
        return heights_of(
            self.autocorrelation, self.psd, self.height_rms, self.corr_length,
            self.exponent, dimensions,
        )  # fmt: skip

    def brdf(
        self,
        theta_i: npt.ArrayLike,
        theta_s: npt.ArrayLike,
        dphi: npt.ArrayLike,
        wavelength: npt.ArrayLike,
        *,
        phi_i: npt.ArrayLike = 0.0,
    ) -> Array:
        """Mueller BRDF of the incoherent part, without the specular beam.

        Parameters
        ----------
        theta_i, theta_s : array_like
            Zeniths of the directions to source and detector, in [0, pi/2]. [rad]
        dphi : array_like
            phi_s - phi_i; specular at pi. [rad]
        wavelength : array_like
            Vacuum wavelength. [um]
        phi_i : array_like
            Azimuth of the source, where heights differ from direction to direction. [rad]

        Returns
        -------
        ndarray, shape (..., 4, 4)
            In the frames of the conventions page. [1/sr]

        Raises
        ------
        ValueError
            If an angle leaves its range (degrees?), or a wavelength the material's.
        """
        shape, columns, azimuth = self._columns(theta_i, theta_s, dphi, wavelength, phi_i)
        found = self.surface.matrices(columns, phi_i=azimuth)
        low = np.flatnonzero(np.maximum(columns[0], columns[1]) > NEAR_GRAZING)
        if low.size:
            found[low] = self._reciprocal(
                found[low],
                [c[low] for c in columns],
                np.broadcast_to(azimuth, len(found))[low],
            )
        return found.reshape(*shape, 4, 4)

    def _reciprocal(self, there: Array, columns: list[Array], phi_i: Array) -> Array:
        """Mean of both ways of light that leaves or comes along the surface.

        On the last degree to the horizon few digits are left in the normal parts of waves;
        what is lost must not tell source from detector.
        """
        theta_i, theta_s, dphi, *light = columns
        back = self.surface.matrices([theta_s, theta_i, -dphi, *light], phi_i=phi_i + dphi)
        exchanged = back.reshape(-1, 4, 4).swapaxes(1, 2) * np.outer(EXCHANGE, EXCHANGE)
        return 0.5 * (there + exchanged.reshape(-1, 16))

    def coherent(
        self,
        theta_i: npt.ArrayLike,
        wavelength: npt.ArrayLike,
        *,
        phi_i: npt.ArrayLike = 0.0,
    ) -> Array:
        """Mueller matrix of the mean field: the specular beam, as wide as the incident one.

        Parameters
        ----------
        theta_i : array_like
            Incidence. [rad]
        wavelength : array_like
            Vacuum wavelength. [um]
        phi_i : array_like
            Azimuth of the source, where heights differ from direction to direction. [rad]

        Returns
        -------
        ndarray, shape (..., 4, 4)
            [..., 0, 0] is the reflectance of unpolarised light. [1]
        """
        return mueller_of(self._mean_jones(self.surface, theta_i, wavelength, phi_i))

    def profile_scattering(
        self,
        theta_i: npt.ArrayLike,
        theta_view: npt.ArrayLike,
        wavelength: npt.ArrayLike,
        *,
        interference: bool = False,
    ) -> Array:
        """Incoherent scattering in plane by a surface that varies along x only.

        Parameters
        ----------
        theta_i : array_like
            Incidence in the x-z plane, in [0, pi/2]. [rad]
        theta_view : array_like
            Signed zenith of the detector, positive on the forward side. [rad]
        wavelength : array_like
            Vacuum wavelength. [um]
        interference : bool
            Add Re and Im of <F_s F_p*>.

        Returns
        -------
        ndarray, shape (..., 2) or (..., 4)
            Power scattered per radian over incident power, for s (field along y) and p;
            then Re and Im of the interference. [1/rad]
        """
        view = require(
            "theta_view", theta_view, lambda v: np.abs(v) <= np.pi / 2,
            "lie in [-1.571, 1.571] rad", "Angles are radians; use np.deg2rad.",
        )  # fmt: skip
        dphi = np.where(view >= 0, np.pi, 0.0)
        shape, columns, _ = self._columns(theta_i, np.abs(view), dphi, wavelength)
        four = self._in_plane(columns)
        return four[:, : 4 if interference else 2].reshape(*shape, -1)

    def error_estimate(
        self,
        theta_i: npt.ArrayLike,
        theta_s: npt.ArrayLike,
        dphi: npt.ArrayLike,
        wavelength: npt.ArrayLike,
        *,
        phi_i: npt.ArrayLike = 0.0,
    ) -> Array:
        """Relative standard error of M00 of `brdf`, judged on rigorous solutions.

        68 % of their directions lie within it, 95 % within twice its value. They are of
        profiles up to 0.8 wavelengths high, in plane. Arguments as in `brdf`.
        Of heights with two lengths the larger error of the isotropic surfaces of either.

        Returns
        -------
        ndarray, shape (...)
            Error over value; 0.26 is 1 dB. [1]
        """
        directions = theta_i, theta_s, dphi, wavelength
        if isinstance(self.directional, GaussianAxes):
            sides = [
                self.with_parameters(corr_length=length).error_estimate(*directions)
                for length in self.directional.lengths
            ]
            shape = np.broadcast_shapes(sides[0].shape, np.shape(phi_i))
            return np.broadcast_to(np.maximum(*sides), shape)
        self._isotropic("an error")
        shape, columns, _ = self._columns(*directions, phi_i)
        heights = self.surface.heights
        found, best, orders, plane = (
            Scattering(heights, name, 2).matrices(columns)[:, 0] for name in self._compared
        )
        slope = self.surface.slopes(columns[3])
        fine = self.surface.fineness(columns[3])
        zenith = np.maximum(columns[0], columns[1])
        error = relative_error(found, best, orders, plane, slope, fine, zenith)
        return error.reshape(shape)

    def profile_error(
        self, theta_i: npt.ArrayLike, theta_view: npt.ArrayLike, wavelength: npt.ArrayLike
    ) -> Array:
        """Relative standard errors of s and p of `profile_scattering`, (..., 2)."""
        found, best, orders, plane = (
            self.with_method(name).profile_scattering(theta_i, theta_view, wavelength)
            for name in self._compared
        )
        waves = np.broadcast_to(checked_wavelength(wavelength), found.shape[:-1])
        slope, fine = (
            measure(waves.ravel()).reshape(*waves.shape, 1)
            for measure in (self.profile.slopes, self.profile.fineness)
        )
        zenith = np.maximum(*np.broadcast_arrays(theta_i, np.abs(theta_view), waves)[:2])
        return relative_error(found, best, orders, plane, slope, fine, zenith[..., None])

    @property
    def _compared(self) -> tuple[str, str, str, str]:
        """Names of the forms that an estimate of the error compares."""
        return self.method, "auto", "order-weighted", "kirchhoff"

    def with_parameters(self, **changes: Any) -> "WaveModel":
        """Return the model with some arguments replaced."""
        return WaveModel(**{**self.given, **changes})

    def with_method(self, method: str) -> "WaveModel":
        """Return the same surface by another form."""
        return self.with_parameters(method=method)

    @property
    def given(self) -> dict[str, Any]:
        """The arguments that make this model."""
        return {one.name: getattr(self, one.name) for one in fields(self)}

    def energy(
        self, theta_i: npt.ArrayLike, wavelength: npt.ArrayLike, *, phi_i: float = 0.0
    ) -> Energy:
        """Account for unpolarised incident light, as shares of its power.

        Parameters
        ----------
        theta_i : array_like
            Incidence. [rad]
        wavelength : array_like
            Vacuum wavelength. [um]
        phi_i : float
            Azimuth of the source, where heights differ from direction to direction. [rad]
        """
        theta, waves = checked_zenith("theta_i", theta_i), checked_wavelength(wavelength)
        theta, waves = np.broadcast_arrays(theta, waves)
        coherent = self.coherent(theta, waves, phi_i=phi_i)[..., 0, 0]
        incoherent = np.empty(theta.shape)
        heights = self.surface.heights
        for at in np.ndindex(theta.shape):
            angle, wave = float(theta[at]), float(waves[at])
            slope = float(self.surface.slopes(np.array([wave]))[0])
            width = max(min(2.0 * slope, 0.4), 0.15 * wave / heights.corr_length)
            light = partial(self._lightness, angle, wave, phi_i)
            incoherent[at] = hemisphere(angle, width, light)
        return account(coherent, incoherent, np.isinf(self.material.indices(waves)[0]))

    def _lightness(
        self, theta_i: float, wavelength: float, phi_i: float, theta_s: Array, dphi: Array
    ) -> Array:
        """M00 of `brdf`, the mean of both sides, as `hemisphere` asks for it."""
        if self.directional is None:
            return self.brdf(theta_i, theta_s, dphi, wavelength)[..., 0, 0]
        sides = np.stack([dphi, -dphi])
        found = self.brdf(theta_i, theta_s, sides[:, None], wavelength, phi_i=phi_i)
        return found[..., 0, 0].mean(axis=0)

    def _in_plane(self, columns: list[Array]) -> Array:
        """Scattering of s and p by the profile and their interference, (N, 4).

        Spectra of several scales need the curvature form in full; the phase between s and p
        is then still that of "auto", which has the mean field's.
        """
        heights = self.profile.heights
        if self.method == "local-curvature":
            return profile_curvature(columns, heights)
        rows = self.profile.matrices(columns)
        total, split, real, imag = rows[:, [0, 1, 10, 14]].T
        four = np.stack([total + split, total - split, real, imag], axis=-1)
        if self.method != "auto" or heights.law is not None:
            return four
        powers = profile_curvature(columns, heights)[:, :2]
        shown = np.sqrt(np.maximum(four[:, 0] * four[:, 1], 1e-300))
        scale = np.sqrt(powers[:, 0] * powers[:, 1]) / shown
        return np.concatenate([powers, scale[:, None] * four[:, 2:]], axis=1)

    def profile_coherent(self, theta_i: npt.ArrayLike, wavelength: npt.ArrayLike) -> Array:
        """Specular reflectance of the mean field of a surface that varies along x only.

        Returns
        -------
        ndarray, shape (..., 2)
            For s (field along y) and p. [1]
        """
        found = self._mean_jones(self.profile, theta_i, wavelength, 0.0)
        return np.abs(np.diagonal(found, axis1=-2, axis2=-1)) ** 2

    def _mean_jones(
        self, scattering: Scattering, theta_i: npt.ArrayLike, wavelength: npt.ArrayLike,
        phi_i: npt.ArrayLike,
    ) -> Array:  # fmt: skip
        """Jones matrices of the mean field, shape (..., 2, 2)."""
        theta, waves = checked_zenith("theta_i", theta_i), checked_wavelength(wavelength)
        n, kappa = self.material.indices(waves)
        turn = checked_azimuth("phi_i", phi_i)
        return scattering.mean_jones(theta, waves, n, kappa, turn)

    def _columns(
        self,
        theta_i: npt.ArrayLike,
        theta_s: npt.ArrayLike,
        dphi: npt.ArrayLike,
        wavelength: npt.ArrayLike,
        phi_i: npt.ArrayLike = 0.0,
    ) -> tuple[tuple[int, ...], list[Array], Array]:
        """Broadcast shape; zeniths, dphi, wavelength, n, kappa as flat columns; phi_i."""
        waves = checked_wavelength(wavelength)
        n, kappa = self.material.indices(waves)
        shape, columns = flat_geometry(theta_i, theta_s, dphi, phi_i, waves, n, kappa)
        size = columns[0].size
        flat = [np.ascontiguousarray(np.broadcast_to(c, size)) for c in columns]
        azimuth = flat.pop(3)
        return shape, flat, azimuth


def checked_wavelength(wavelength: npt.ArrayLike) -> Array:
    """Wavelengths as an array, all positive."""
    return require(
        "wavelength", wavelength, lambda v: (v > 0) & np.isfinite(v), "be positive [um]",
        "Wavelengths are vacuum wavelengths in micrometres.",
    )  # fmt: skip

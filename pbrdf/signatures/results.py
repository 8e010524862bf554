"""Results of a simulation as sources of signatures: checked, and one direction picked."""

import warnings

import numpy as np
import xarray as xr

from pbrdf.conventions import LOSSES
from pbrdf.errors import AccuracyWarning
from pbrdf.signatures.result_surface import ResultSurface, SunlitResult
from pbrdf.signatures.sun import Sun

__all__ = ["Result"]

# Lost light above this share of the incident light is warned of
MOST_LOST = 1e-3


class Result:
    """A dataset of `simulate` whose directions can be looked from.

    Raises
    ------
    ValueError
        If it is no such dataset, lacks Stokes elements, or depends on phi_i.
    """

    def __init__(self, dataset: xr.Dataset) -> None:
        needed = {"brdf", "brdf_stderr", "albedo_stderr", "projected_solid_angle"}
        if "brdf_total_stderr" in dataset:
            # A surface out of a store has the sum over bounces alone
            needed -= {"brdf", "brdf_stderr"}
        missing = sorted(needed - set(map(str, dataset.data_vars)))
        if missing or "theta_i" not in dataset.coords:
            msg = (
                "source must be a result of simulate, it lacks "
                f"{missing[0] if missing else 'theta_i'}. Give the dataset as simulated."
            )
            raise ValueError(msg)
        if dataset.sizes.get("stokes_out") != 4 or dataset.sizes.get("stokes_in") != 4:
            held = [dataset.sizes.get(name, 0) for name in ("stokes_out", "stokes_in")]
            msg = (
                f"source must have 4 x 4 Stokes elements, got {held[0]} x {held[1]}. "
                'Simulate with stokes="full".'
            )
            raise ValueError(msg)
        if "phi_i" in dataset.dims:
            msg = (
                "source must not depend on phi_i, got "
                f"{dataset.sizes['phi_i']} azimuths. Select one, .isel(phi_i=0), or "
                'simulate with phi_i="uniform".'
            )
            raise ValueError(msg)
        known = ("theta_i", "wavelength", "phi_i", "bounces")
        swept = [d for d in map(str, dataset.albedo_stderr.dims) if d not in known]
        if swept:
            msg = (
                f"source must be one surface, it varies along {', '.join(swept)}. Pick one "
                f"in Python, pbrdf.signature(read_result(path).sel({swept[0]}=...), ...), "
                "or simulate it alone."
            )
            raise ValueError(msg)
        if dataset.attrs.get("without_beam", False):
            msg = (
                "source must hold its specular beam, which waves leave and which is not "
                "interpolated in a store. Take computed values of all that varies, or "
                "simulate this surface."
            )
            raise ValueError(msg)
        if "brdf_total" not in dataset:
            # Of bounces that err independently; results of today hold the sum itself
            square = (dataset.brdf_stderr**2).sum("bounces")
            dataset = dataset.assign(
                brdf_total=dataset.brdf.sum("bounces"), brdf_total_stderr=np.sqrt(square)
            )
        self.dataset = (
            dataset if "theta_i" in dataset.dims else dataset.expand_dims("theta_i")
        )
        self.spectral = "wavelength" in dataset.dims
        self.waves: np.ndarray | None = None
        if "wavelength" in dataset.coords:
            self.waves = dataset.wavelength.to_numpy()

    def surface(
        self, wave: float | None, theta: float, phi: float, sun_only: Sun | None
    ) -> ResultSurface | SunlitResult:
        """Return the surface as seen from (theta, phi) [rad] at a wavelength [um].

        Raises
        ------
        ValueError
            If neither the sensor's zenith nor, for sunlight alone, the sun's was simulated.
        """
        here = self._at(wave)
        zeniths = here.theta_i.to_numpy()
        found = np.flatnonzero(np.abs(zeniths - theta) < 1e-6)
        if found.size:
            chosen = here.isel(theta_i=int(found[0]))
            self._check_azimuth(phi, "sensor")
            self._check_losses(chosen)
            _check_finite(chosen)
            return ResultSurface(chosen, phi)
        degrees = ", ".join(f"{value:.4g}" for value in np.rad2deg(zeniths))
        if sun_only is not None:
            found = np.flatnonzero(np.abs(zeniths - sun_only.theta) < 1e-6)
            if found.size:
                self._check_azimuth(sun_only.phi, "sun")
                chosen = here.isel(theta_i=int(found[0]))
                _check_finite(chosen)
                return SunlitResult(chosen, theta, phi)
        msg = (
            f"theta_s must be an incident zenith of the result, {degrees} degrees, got "
            f"{np.rad2deg(theta):.4g}. Simulate incidence at the zeniths of the "
            "sensor; for sunlight alone, that of the sun will do."
        )
        raise ValueError(msg)

    def _at(self, wave: float | None) -> xr.Dataset:
        if self.waves is None or wave is None:
            return self.dataset
        known = np.atleast_1d(self.waves)
        found = np.flatnonzero(np.isclose(known, wave, rtol=1e-6, atol=0.0))
        if not found.size:
            names = ", ".join(f"{value:g}" for value in known)
            msg = (
                f"wavelength must be one of the result's, {names} um, got {wave:g}. "
                "Simulate it."
            )
            raise ValueError(msg)
        return (
            self.dataset.isel(wavelength=int(found[0])) if self.spectral else self.dataset
        )

    def _check_azimuth(self, phi: float, whose: str) -> None:
        """Warn of a result of one azimuth that is used at another."""
        traced = self.dataset.attrs.get("phi_i", "uniform")
        if isinstance(traced, str):
            return
        traced = float(
            np.ravel(traced)[0]
            if "phi_i" not in self.dataset.coords
            else self.dataset.phi_i
        )
        if abs(np.exp(1j * traced) - np.exp(1j * phi)) > 1e-6:
            msg = (
                f"the result was traced at the azimuth {np.rad2deg(traced):g} deg and is "
                f"used with the {whose} at {np.rad2deg(phi):.4g} deg, right for isotropic "
                'surfaces only. Simulate with phi_i="uniform" or that azimuth.'
            )
            warnings.warn(msg, AccuracyWarning, stacklevel=4)

    @staticmethod
    def _check_losses(chosen: xr.Dataset) -> None:
        lost = float(sum(chosen[name] for name in LOSSES if name in chosen))
        # Of a surface between those of a store
        lost = max(lost, float(chosen.attrs.get("most_lost", 0.0)))
        if lost > MOST_LOST:
            msg = (
                f"{100 * lost:.2g} % of the light was lost in the simulation and counts as "
                "emitted. Raise max_bounces or mend the scene."
            )
            warnings.warn(msg, AccuracyWarning, stacklevel=4)


def _check_finite(chosen: xr.Dataset) -> None:
    """Refuse gaps in a result, and tell of errors that are not known."""
    bins = chosen.brdf_total.transpose("theta_s", "dphi", ...).to_numpy()
    gaps = np.argwhere(~np.isfinite(bins).all((-2, -1)))
    if len(gaps):
        zenith, azimuth = chosen.theta_s[gaps[0][0]], chosen.dphi[gaps[0][1]]
        msg = (
            f"source must be finite, {len(gaps)} of {bins.shape[0] * bins.shape[1]} bins "
            f"of brdf_total are not, the first at theta_s {np.rad2deg(float(zenith)):.4g}, "
            f"dphi {np.rad2deg(float(azimuth)):.4g} degrees of the incidence "
            f"{np.rad2deg(float(chosen.theta_i)):.4g}. Simulate them, or fill them."
        )
        raise ValueError(msg)
    unknown = int(np.isnan(chosen.brdf_total_stderr.to_numpy()).sum())
    if unknown:
        msg = (
            f"{unknown} standard errors of the result are nan: that of the signature is "
            "not known. Simulate with more realisations."
        )
        warnings.warn(msg, AccuracyWarning, stacklevel=4)

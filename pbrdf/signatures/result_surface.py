"""A simulated surface, looked at from one of its incident directions by reciprocity."""

from math import pi

import numpy as np
import xarray as xr

from pbrdf.signatures.function_surface import (
    BLACK,
    EXCHANGED,
    Light,
    Value,
    mirrored_sun,
)
from pbrdf.signatures.sun import Sun

__all__ = ["ResultSurface", "SunlitResult"]


class ResultSurface:
    """One incident direction of a result as what a sensor there sees.

    Light that goes from the sensor to a bin of the hemisphere goes the other way too:
    the matrix from the bin to the sensor is P M^T P, P = diag(1, 1, -1, 1). So one traced
    direction answers for the whole sky, and what it loses is what the surface emits.

    Parameters
    ----------
    dataset : xarray.Dataset
        brdf_total, brdf_total_stderr (theta_s, dphi, stokes_out, stokes_in), albedo_stderr
        (bounces) and projected_solid_angle of one incidence and wavelength; coherent
        (stokes_out, stokes_in) where waves leave a specular beam.
    phi : float
        Azimuth of the sensor. [rad]
    """

    statistical = True

    def __init__(self, dataset: xr.Dataset, phi: float) -> None:
        order = ("theta_s", "dphi", "stokes_out", "stokes_in")
        self.zeniths = dataset.theta_s.to_numpy()
        self.azimuths = dataset.dphi.to_numpy()
        self.weight = dataset.projected_solid_angle.transpose("theta_s", "dphi").to_numpy()
        both = np.outer(EXCHANGED, EXCHANGED)
        back = ("theta_s", "dphi", "stokes_in", "stokes_out")
        self.matrices = dataset.brdf_total.transpose(*back).to_numpy() * both
        self.stderr = dataset.brdf_total_stderr.transpose(*back).to_numpy()
        self.theta, self.phi = float(dataset.theta_i), phi
        self.beam = both * _beam(dataset).T
        single = dataset.brdf_total_stderr.transpose(*order).to_numpy()[..., 0, 0]
        apart = np.sqrt(((single * self.weight) ** 2).sum())
        together = np.sqrt((dataset.albedo_stderr.to_numpy() ** 2).sum())
        # Bins of one surface err together: by as much as the albedo shows, never by less
        # than independent ones
        self.inflation = max(1.0, float(together / apart)) if apart > 0 else 1.0

    def facing(self, sun: Sun, irradiance: float) -> Value:
        """Stokes radiance of sunlight off the surface; the sun is narrower than a bin."""
        at = sun.theta, sun.phi - self.phi
        scale = irradiance * np.cos(sun.theta)
        columns = self.matrices[..., 0], self.stderr[..., 0]
        value, error = _between_bins(self.zeniths, self.azimuths, at, columns)
        beam = mirrored_sun(self.beam, (self.theta, self.phi), sun, irradiance)
        return scale * value + beam, scale * error

    def gather(self, light: Light) -> Value:
        """Stokes radiance that the surface makes of the light of the whole sky."""
        sky = self._mean(light)
        value = np.einsum("abij,abj,ab->i", self.matrices, sky, self.weight)
        square = np.einsum("abij,abj,ab->i", self.stderr**2, sky**2, self.weight**2)
        mirrored = light(np.array([self.theta]), np.array([self.phi + pi]))[0]
        return value + self.beam @ mirrored, self.inflation * np.sqrt(square)

    def emissivity(self) -> Value:
        """Stokes vector emitted to the sensor over the radiance of a black body."""
        reflected, error = self.gather(
            lambda theta, _: np.broadcast_to(BLACK, (*theta.shape, 4))
        )
        return BLACK - reflected, error

    def _mean(self, light: Light) -> np.ndarray:
        """Mean of the light over each bin, by four points."""
        step, turn = (pi / 4) / self.zeniths.size, pi / self.azimuths.size
        total, weights = 0.0, 0.0
        for up in (-1, 1):
            for side in (-1, 1):
                theta = self.zeniths + up * step / np.sqrt(3)
                phi = self.phi + self.azimuths + side * turn / np.sqrt(3)
                weight = (np.sin(theta) * np.cos(theta))[:, None, None]
                grid = np.broadcast_arrays(theta[:, None], phi[None, :])
                total = total + weight * light(*grid)
                weights = weights + weight
        return np.asarray(total / weights)


class SunlitResult:
    """The incident direction of a result as the sun; no other light can be answered for.

    Parameters
    ----------
    dataset : xarray.Dataset
        As of `ResultSurface`; its incidence is the zenith of the sun.
    theta, phi : float
        Direction to the sensor. [rad]
    """

    statistical = True

    def __init__(self, dataset: xr.Dataset, theta: float, phi: float) -> None:
        self.dataset, self.theta, self.phi = dataset, theta, phi

    def facing(self, sun: Sun, irradiance: float) -> Value:
        """Stokes radiance of sunlight off the surface, between the centres of bins."""
        order = ("theta_s", "dphi", "stokes_out")
        one = self.dataset.isel(stokes_in=0)
        columns = (
            one.brdf_total.transpose(*order).to_numpy(),
            one.brdf_total_stderr.transpose(*order).to_numpy(),
        )
        value, error = _between_bins(
            one.theta_s.to_numpy(), one.dphi.to_numpy(),
            (self.theta, self.phi - sun.phi), columns,
        )  # fmt: skip
        scale = irradiance * np.cos(sun.theta)
        beam = mirrored_sun(_beam(self.dataset), (self.theta, self.phi), sun, irradiance)
        return scale * value + beam, scale * error


def _beam(dataset: xr.Dataset) -> np.ndarray:
    """Mueller reflectance of the specular beam; rays have none."""
    if "coherent" not in dataset:
        return np.zeros((4, 4))
    return dataset.coherent.transpose("stokes_out", "stokes_in").to_numpy()


def _between_bins(
    zeniths: np.ndarray,
    azimuths: np.ndarray,
    at: tuple[float, float],
    columns: tuple[np.ndarray, np.ndarray],
) -> Value:
    """Interpolate values and their errors linearly; neighbouring bins may err together."""
    value, error = np.zeros(4), np.zeros(4)
    for row, part in _neighbours(zeniths, at[0], closed=False):
        for column, share in _neighbours(azimuths, np.mod(at[1], 2 * pi), closed=True):
            value += part * share * columns[0][row, column]
            error += part * share * columns[1][row, column]
    return value, error


def _neighbours(centres: np.ndarray, at: float, *, closed: bool) -> list[tuple[int, float]]:
    """Return the two bins about a value and their shares, by linear interpolation."""
    if centres.size == 1:
        return [(0, 1.0)]
    step = centres[1] - centres[0]
    place = (at - centres[0]) / step
    if not closed:
        place = min(max(place, 0.0), centres.size - 1.0)
    low = min(int(np.floor(place)), centres.size - 1)
    high = (low + 1) % centres.size if closed else min(low + 1, centres.size - 1)
    part = place - low
    return [(low, 1.0 - part), (high, part)]

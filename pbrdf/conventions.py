"""The conventions page in code: directions, frames, the one table of result variables."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from pbrdf.errors import real_array

STOKES = ("I", "Q", "U", "V")
BOUNCES = ("1", "2", "3+")
# Variables of a result that hold light of which nobody knows where it went
LOSSES = ("truncated", "leaked", "left_sideways")


class Variable(NamedTuple):
    """What a result variable is: its units, its name in words and its dimensions."""

    units: str
    long_name: str
    dims: tuple[str, ...]

    @property
    def about(self) -> dict[str, str]:
        """Its attributes in a dataset."""
        return {"units": self.units, "long_name": self.long_name}


_LIGHT = ("theta_i", "phi_i", "wavelength")
_BOUNCES = ("bounces", *_LIGHT)
_BINS = ("theta_s", "dphi")
_MUELLER = (*_BINS, "stokes_out", "stokes_in")

RESULT_VARIABLES: dict[str, Variable] = {
    "brdf": Variable(
        "sr-1", "Mueller BRDF by number of bounces", (*_BOUNCES, *_MUELLER)
    ),
    "brdf_stderr": Variable(
        "sr-1", "standard error of brdf", (*_BOUNCES, *_MUELLER)
    ),
    "brdf_total": Variable(
        "sr-1", "Mueller BRDF of all bounces", (*_LIGHT, *_MUELLER)
    ),
    "brdf_total_stderr": Variable(
        "sr-1", "standard error of brdf_total", (*_LIGHT, *_MUELLER)
    ),
    "albedo": Variable(
        "1", "directional-hemispherical reflectance by number of bounces",
        _BOUNCES,
    ),
    "albedo_stderr": Variable(
        "1", "standard error of albedo", _BOUNCES
    ),
    "coherent": Variable(
        "1", "Mueller reflectance of the mean field, a beam apart from brdf",
        (*_LIGHT, *_MUELLER[-2:]),
    ),
    "projected_solid_angle": Variable("sr", "integral of cos(theta_s) over the bin", _BINS),
    "absorbed": Variable("1", "share of the light absorbed", _LIGHT),
    "transmitted": Variable("1", "share of the light transmitted", _LIGHT),
    "truncated": Variable(
        "1", "share of the light still travelling at the bounce limit", _LIGHT
    ),
    "leaked": Variable("1", "share of the light lost by a fault", _LIGHT),
    "left_sideways": Variable(
        "1", "share of the light that a diffuse base sent off a finite map",
        _LIGHT,
    ),
    "side_exits": Variable(
        "1", "share of the rays that left a finite map sideways, not counted",
        ("theta_i", "phi_i"),
    ),
    "coherent_share": Variable(
        "1", "share of the light that stays in a coherent specular beam",
        ("theta_i", "wavelength"),
    ),
    "curvature_number": Variable(
        "1", "k R cos(theta_i)^3, R the typical radius of curvature: inverse of the error "
        "of the tangent plane", ("theta_i", "wavelength"),
    ),
    "corr_length_in_waves": Variable(
        "1", "correlation length of the surface over the wavelength", ("wavelength",)
    ),
    "cell_in_waves": Variable("1", "grid step over the wavelength", ("wavelength",)),
    "size_parameter": Variable(
        "1", "least size parameter 2 pi R / wavelength of drops and spheres",
        ("wavelength",),
    ),
    "film_field": Variable(
        "1", "field that comes back through a film and interferes", ("wavelength",)
    ),
    "theta_i": Variable("rad", "zenith angle of the source", ("theta_i",)),
    "phi_i": Variable("rad", "azimuth of the source", ("phi_i",)),
    "theta_s": Variable("rad", "zenith of the detector, bin centre", ("theta_s",)),
    "dphi": Variable("rad", "azimuth from source to detector, bin centre", ("dphi",)),
    "wavelength": Variable("um", "vacuum wavelength", ("wavelength",)),
    "bounces": Variable("1", "number of bounces", ("bounces",)),
    "stokes_out": Variable("1", "Stokes element of the scattered light", ("stokes_out",)),
    "stokes_in": Variable("1", "Stokes element of the incident light", ("stokes_in",)),
}  # fmt: skip


def direction(theta: npt.ArrayLike, phi: npt.ArrayLike) -> np.ndarray:
    """Return the unit vector that leaves the surface at (theta, phi), shape (..., 3).

    Examples
    --------
    >>> direction(np.pi / 2, 0.0).round(12) + 0.0
    array([1., 0., 0.])
    """
    theta, phi = np.broadcast_arrays(real_array("theta", theta), real_array("phi", phi))
    sin_theta = np.sin(theta)
    return np.stack(
        [sin_theta * np.cos(phi), sin_theta * np.sin(phi), np.cos(theta)], axis=-1
    )


def meridian_frame(
    prop: npt.ArrayLike, phi: npt.ArrayLike = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Frame (e_s, e_p) of a beam along the unit vector `prop`, shapes (..., 3).

    e_s = z x k / |z x k| and e_p = k x e_s. For k along the z axis `phi` is the azimuth of
    the propagation vector whose limit is taken.

    Examples
    --------
    >>> e_s, e_p = meridian_frame([1.0, 0.0, 0.0])
    >>> e_s + 0.0, e_p + 0.0
    (array([0., 1., 0.]), array([0., 0., 1.]))
    """
    k, phi = real_array("prop", prop), real_array("phi", phi)
    azimuth = np.where(
        np.hypot(k[..., 0], k[..., 1]) == 0.0, phi, np.arctan2(k[..., 1], k[..., 0])
    )
    e_s = np.stack([-np.sin(azimuth), np.cos(azimuth), np.zeros_like(azimuth)], axis=-1)
    return e_s, np.cross(k, e_s)


def detector_bins(n_theta: int, n_dphi: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Bin centres theta_s and dphi [rad] and ∫cosθ dΩ (n_theta, n_dphi) of the bins [sr].

    Zenith bins are equal in angle over [0, π/2]; azimuth bins are equal over the circle and
    centred on 0 and π.

    Examples
    --------
    >>> theta_s, dphi, weight = detector_bins(45, 90)
    >>> bool(np.isclose(weight.sum(), np.pi))
    True
    """
    edges = np.linspace(0.0, np.pi / 2, n_theta + 1)
    theta_s = 0.5 * (edges[1:] + edges[:-1])
    dphi = np.arange(n_dphi) * (2 * np.pi / n_dphi)
    # ∫ cos sin dθ = sin(θ2 - θ1) sin(θ2 + θ1) / 2, which does not cancel
    ring = 0.5 * np.sin(np.diff(edges)) * np.sin(edges[1:] + edges[:-1])
    weight = np.broadcast_to(ring[:, None] * (2 * np.pi / n_dphi), (n_theta, n_dphi))
    return theta_s, dphi, weight.copy()

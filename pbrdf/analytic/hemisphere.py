"""What a model sends into the whole hemisphere, and what it keeps: DHR and emissivity."""

from collections.abc import Callable
from dataclasses import dataclass
from math import pi

import numpy as np

from pbrdf.analytic.geometry import checked_zenith
from pbrdf.analytic.microfacet import MicrofacetModel
from pbrdf.optics.materials import Material

Integrand = Callable[[np.ndarray, float], np.ndarray]

__all__ = ["HemisphericalReflectance", "emissivity", "reflectance"]


@dataclass(frozen=True)
class HemisphericalReflectance:
    """Integral of the Mueller BRDF over the projected hemisphere, with its error.

    Parameters
    ----------
    mueller : ndarray, shape (4, 4)
        Row 0 is the reflected power for each incident Stokes element; the other rows add
        light in the meridian frames of its own directions. [1]
    error : ndarray, shape (4, 4)
        Estimate of the quadrature's absolute error. [1]
    """

    mueller: np.ndarray
    error: np.ndarray

    @property
    def value(self) -> float:
        """Directional-hemispherical reflectance of unpolarised light. [1]"""
        return float(self.mueller[0, 0])


def reflectance(
    model: MicrofacetModel,
    theta_i: float,
    wavelength: float | None = None,
    *,
    phi_i: float = 0.0,
    rel_error: float = 1e-8,
) -> HemisphericalReflectance:
    """Directional-hemispherical reflectance by adaptive Gauss-Kronrod quadrature.

    Parameters
    ----------
    model : MicrofacetModel
    theta_i, phi_i : float
        Direction of the source. [rad]
    wavelength : float, optional
        Vacuum wavelength. [um]
    rel_error : float
        Error to reach, in units of the largest element; the reached one is in the result.

    Raises
    ------
    ValueError
        If theta_i leaves [0, pi/2).

    Examples
    --------
    A Lambertian term reflects its albedo:

    >>> from pbrdf import Material
    >>> white = MicrofacetModel(Material(1.5), 0.2, specular_gain=0.0, diffuse_albedo=0.3)
    >>> round(reflectance(white, 0.4).value, 10)
    0.3
    """
    from scipy.integrate import cubature

    zenith = float(checked_zenith("theta_i", theta_i))
    n, kappa = model.material.index(wavelength)
    base = float(model.material.albedo(wavelength))
    at = model.with_parameters(material=Material(n, kappa, diffuse_albedo=base))
    # Cubes of the variables crowd the nodes about the specular direction
    span = np.array([-zenith, pi / 2 - zenith])

    def integrand(points: np.ndarray, side: float) -> np.ndarray:
        x, y = points[:, 0], points[:, 1]
        theta_s = np.clip(zenith + side * x**3, 0.0, pi / 2)
        dphi = pi + pi * y**3
        weight = abs(side) * 3 * x**2 * pi * 3 * y**2
        weight = weight * np.sin(theta_s) * np.cos(theta_s)
        matrices = at.brdf(zenith, theta_s, dphi, phi_i=phi_i)
        return matrices.reshape(-1, 16) * weight[:, None]

    total, error = np.zeros(16), np.zeros(16)
    for side in span[np.abs(span) > 0]:
        for half in ((-1.0, 0.0), (0.0, 1.0)):
            part = cubature(
                integrand,
                [0.0, half[0]],
                [1.0, half[1]],
                rule="gk15",
                rtol=0.0,
                atol=rel_error * _scale(integrand, side, half),
                args=(side,),
                max_subdivisions=2000,
            )
            total, error = total + part.estimate, error + np.abs(part.error)
    return HemisphericalReflectance(total.reshape(4, 4), error.reshape(4, 4))


def emissivity(
    model: MicrofacetModel,
    theta: float,
    wavelength: float | None = None,
    *,
    phi: float = 0.0,
    rel_error: float = 1e-8,
) -> np.ndarray:
    """Stokes vector emitted towards (theta, phi), in units of the black body's radiance.

    Kirchhoff's law with reciprocity: the light seen is what would be absorbed of light sent
    back along the way, e = (1, 0, 0, 0) - P R[0], R[0] the first row of the hemispherical
    reflectance and P = diag(1, 1, -1, 1) the exchange of directions.

    Parameters
    ----------
    theta, phi : float
        Direction of the detector. [rad]

    Returns
    -------
    ndarray, shape (4,)
        I is the unpolarised emissivity; Q < 0 (along e_p) is usual. [1]

    Notes
    -----
    What the model neither reflects nor absorbs, light of further bounces above all, is
    counted as emitted: use a model whose shadowing closes the energy budget.

    Examples
    --------
    >>> from pbrdf import Material
    >>> emissivity(MicrofacetModel(Material.black(), 0.2), 1.0)
    array([1., 0., 0., 0.])
    """
    row = reflectance(model, theta, wavelength, phi_i=phi, rel_error=rel_error).mueller[0]
    return np.array([1.0, 0.0, 0.0, 0.0]) - row * [1, 1, -1, 1]


def _scale(integrand: Integrand, side: float, half: tuple[float, float]) -> float:
    """Rough size of the largest integral, from a fixed rule."""
    node, weight = np.polynomial.legendre.leggauss(48)
    x = 0.5 + 0.5 * node
    y = half[0] + x
    points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    both = 0.25 * np.outer(weight, weight).ravel()
    return float(max(np.abs((integrand(points, side) * both[:, None]).sum(0)).max(), 1e-6))

"""The best slope density that a scan allows: free, isotropic, non-negative."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from pbrdf import Material, MicrofacetModel
from pbrdf.analytic.slope_table import SlopeTable

Array = np.ndarray

# Slopes at which the density is free, hat functions between them
_SLOPES = np.concatenate([np.arange(0.0, 1.0, 0.05), np.arange(1.0, 2.01, 0.2)])
_GRID = np.linspace(-2.2, 2.2, 221)
# Shadowing depends on the density; it settles at once
_ROUNDS = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class ScanDensity:
    """What no isotropic facet model with a Lambertian term can do better.

    Parameters
    ----------
    error : float
        Rms of (model - measured)/measured. [1]
    gain, diffuse_albedo : float
        Of facets and Lambertian term. [1]
    slopes, density : ndarray, shape (n,)
        Density per slope area at |slope|, scaled to 1; linear between. [1]
    """

    error: float
    gain: float
    diffuse_albedo: float
    slopes: Array
    density: Array

    def quantile(self, shares: Array) -> Array:
        """|slope| below which given shares of the facets lie. [1]"""
        radius = np.linspace(0, self.slopes[-1], 2001)
        ring = np.interp(radius, self.slopes, self.density) * radius
        return np.interp(shares, np.cumsum(ring) / ring.sum(), radius)


def free_density(
    theta_i: Array, theta_s: Array, dphi: Array, measured: Array, material: Material
) -> ScanDensity:
    """Fit a slope density to readings of M00, all of one wavelength, all > 0.

    Relative residuals, non-negative least squares: for given shadowing the optimum is
    exact; shadowing follows the density in a few rounds.
    """
    cos_i, cos_s = np.cos(theta_i), np.cos(theta_s)
    cos_2beta = cos_i * cos_s + np.sin(theta_i) * np.sin(theta_s) * np.cos(dphi)
    cos_tilt = (cos_i + cos_s) / np.sqrt(2 + 2 * cos_2beta)
    slope = np.sqrt(np.maximum(cos_tilt**-2 - 1, 0))
    hats = np.stack(
        [np.interp(slope, _SLOPES, row, right=0.0) for row in np.eye(_SLOPES.size)], -1
    )
    radius = np.hypot(_GRID[:, None], _GRID)
    table = SlopeTable(_GRID, _GRID, np.exp(-(radius**2) / 0.125) + 1e-6)
    inside = slope < _GRID[-1]
    for _ in range(_ROUNDS):
        model = MicrofacetModel(material, slope_distribution=table)
        curve = model.brdf(theta_i, theta_s, dphi)[..., 0, 0]
        at = table.density_at(slope, np.zeros_like(slope))
        unit = np.where(inside, curve / np.where(inside, at, 1.0), 0.0)
        columns = np.column_stack([hats * unit[:, None], np.full(slope.shape, 1 / np.pi)])
        found, left = nnls(columns / measured[:, None], np.ones(measured.size))
        density = np.interp(radius, _SLOPES, found[:-1], right=0.0)
        gain = float(density.sum() * (_GRID[1] - _GRID[0]) ** 2)
        if gain == 0:
            break
        # A floor keeps the next round's division defined
        table = SlopeTable(_GRID, _GRID, density / gain + 1e-6)
    return ScanDensity(
        error=float(left / np.sqrt(measured.size)), gain=gain,
        diffuse_albedo=float(found[-1]), slopes=_SLOPES,
        density=found[:-1] / (gain or 1.0),
    )  # fmt: skip

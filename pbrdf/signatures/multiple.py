"""Light scattered again and again by clean air over Lambertian ground.

Air scatters as dipoles do: what it sends out depends on the light that arrives by nothing
but its coherency tensor, the sum of E E* over all directions. Under the sun that is four
functions of the depth t, here (a, b, c, d) = (xx + yy, zz, xz, xx - yy), z up and x towards
the sun's azimuth, and the equation of transfer becomes

    s(t) = s_sun(t) + s_ground(t) + integral over t' of K(|t - t'|) s(t'),

with K made of exponential integrals. It is Chandrasekhar's problem without its X and Y
functions, and holds for all directions at once. Fields are linearly polarised throughout.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import exp, pi, sqrt

import numpy as np
from numpy.polynomial import legendre
from scipy.special import expn

__all__ = ["Air", "scatter"]

# Legendre polynomials of the source function; fewer of them tell the error
ORDERS, FEWER = 24, 16
# Gauss points on each side of the kernel's singularity
POINTS = 32
# Panels, each half as long as the one above it, and points in each, of paths to the ground
PANELS, EACH = 10, 8
# Cosines of zeniths and azimuths from the sun at which the error is taken
PROBES = ((1.0, 0.0), (0.7, 1.0), (0.4, 2.5), (0.15, 0.3), (0.05, 1.6), (0.01, 3.0))


@dataclass(frozen=True, eq=False)
class Air:
    """Air of one optical depth under a sun of irradiance 1, facing it, over ground.

    Attributes
    ----------
    depth, cos_sun, dipole : float
        Vertical optical depth; cosine of the sun's zenith; part of the scattering that is
        that of dipoles, the rest being isotropic and unpolarised. [1]
    sun : ndarray, shape (4,)
        Coherency of the sunlight above the air. [1]
    source : ndarray, shape (orders, 4)
        Coherency of all other light, in Legendre polynomials of 2 x - 1 with the depth
        t = depth x^3 (10 - 15 x + 6 x^2). [1]
    ground : float
        Radiance of the ground. [1/sr]
    diffuse : float
        Irradiance of the sky on the ground, horizontal. [1]
    error : float
        Largest change of I, Q, U with fewer polynomials, in parts of I.
    """

    depth: float
    cos_sun: float
    dipole: float
    sun: np.ndarray
    source: np.ndarray
    ground: float = 0.0
    diffuse: float = 0.0
    error: float = 0.0

    def at(self, x: np.ndarray) -> np.ndarray:
        """Coherency (..., 4) of the light that is not the sun's own at depths t(x)."""
        found: np.ndarray = _basis(x, len(self.source)) @ self.source
        return found

    def seen(self, cos_theta: np.ndarray) -> np.ndarray:
        """Coherency (..., 4) summed along the ways to a point of the ground.

        Sum of s(t) exp(-(depth - t)/cos_theta) dt/cos_theta. Light that was scattered once
        is exact, the rest by quadrature, graded towards the ground.
        """
        mu = np.maximum(cos_theta, 1e-12)
        height, weight, source = self._paths
        share = np.exp(-height / mu[..., None]) * (weight / mu[..., None])
        return once(self.depth, mu, self.cos_sun)[..., None] * self.sun + share @ source

    @property
    def _paths(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Optical heights of points above the ground, their weights, coherency there."""
        x, weight = _paths()
        return self.depth * _depth(x), weight * self.depth, self.at(1.0 - x)


def once(depth: float, mu: np.ndarray, mu_sun: float) -> np.ndarray:
    """Sunlight scattered once on the ways to the ground, for a source of 1.

    Chandrasekhar, section 16: mu_sun (e^-t/mu_sun - e^-t/mu)/(mu_sun - mu), here as
    (t/mu) e^(-t/larger) (1 - e^-x)/x with x = t |1/mu - 1/mu_sun|, which neither cancels
    where both are equal nor overflows.
    """
    mu = np.maximum(mu, 1e-12)
    mu_sun = max(mu_sun, 1e-12)
    x = depth * np.abs(mu_sun - mu) / (mu * mu_sun)
    small = x < 1e-9
    safe = np.where(small, 1.0, x)
    quotient = np.where(small, 1.0 - 0.5 * x, -np.expm1(-safe) / safe)
    return depth / mu * np.exp(-depth / np.maximum(mu, mu_sun)) * quotient


@lru_cache(maxsize=256)
def scatter(depth: float, cos_sun: float, dipole: float, albedo: float) -> Air:
    """Solve for the light between the sun and the ground.

    Parameters
    ----------
    depth, cos_sun, dipole : float
        As of `Air`; nothing is absorbed in the air. [1]
    albedo : float
        Of the Lambertian ground, which depolarises. [1]
    """
    coarse, fine = (
        _solve(depth, cos_sun, dipole, albedo, orders) for orders in (FEWER, ORDERS)
    )
    light = [np.stack([_stokes(air, *probe) for probe in PROBES]) for air in (coarse, fine)]
    change = np.abs(light[0] - light[1]) / light[1][:, :1] if depth else np.zeros(1)
    return Air(**{**vars(fine), "error": float(change.max())})


def _solve(depth: float, cos_sun: float, dipole: float, albedo: float, orders: int) -> Air:
    """Collocate the equation of transfer at Gauss points of x."""
    x, _ = _gauss(orders)
    nodes, weights = _both_sides(x)
    # Distances of different points only; 1e-300 stands where they round to one
    apart = np.maximum(depth * np.abs(_depth(x)[:, None] - _depth(nodes)), 1e-300)
    kernel = _kernel(apart, dipole) * (depth * weights)[..., None, None]
    matrix = np.einsum("iqab,iqj->iajb", kernel, _basis(nodes, orders))
    own = np.einsum("ij,ab->iajb", _basis(x, orders), np.eye(4))
    sin_sun = sqrt(max(1.0 - cos_sun**2, 0.0))
    # A transverse field of no direction, (1 - n n)/2
    sun = 0.5 * np.array(
        [1.0 + cos_sun**2, sin_sun**2, -sin_sun * cos_sun, -(sin_sun**2)]
    )  # fmt: skip
    dimmed = np.exp(-depth * _depth(nodes) / max(cos_sun, 1e-12))
    from_sun = np.einsum("iqab,iq,b->ia", kernel, dimmed, sun)
    # Unpolarised light of radiance 1 from below
    above = depth * _depth(1.0 - x)
    e2, e4 = expn(2, above), expn(4, above)
    from_ground = pi * np.stack([e2 + e4, e2 - e4, 0 * above, 0 * above], axis=-1)
    size = 4 * orders
    sides = np.stack([from_sun.ravel(), from_ground.ravel()], axis=-1)
    solved = np.linalg.solve((own - matrix).reshape(size, size), sides)
    air = Air(depth, cos_sun, dipole, sun, solved[:, 0].reshape(orders, 4))
    lit = Air(depth, cos_sun, dipole, 0 * sun, solved[:, 1].reshape(orders, 4))
    sky, back = _irradiance(air), _irradiance(lit)
    direct = cos_sun * exp(-depth / max(cos_sun, 1e-12))
    # What the ground sends up comes back in part, again and again
    ground = albedo / pi * (direct + sky) / (1.0 - albedo / pi * back)
    source = air.source + ground * lit.source
    return Air(depth, cos_sun, dipole, sun, source, ground, sky + ground * back)


def _kernel(apart: np.ndarray, dipole: float) -> np.ndarray:
    """Coherency (..., 4, 4) at an optical distance from a layer per coherency in it.

    Dipoles send P s P, P = 1 - k k, along k; its mean over the azimuth is a polynomial of
    the cosine, and each power of that an exponential integral.
    """
    e1, e3, e5 = (expn(order, apart) for order in (1, 3, 5))
    rayleigh, even = 0.75 * dipole, 0.25 * (1.0 - dipole)
    kernel = np.zeros((*apart.shape, 4, 4))
    kernel[..., 0, 0] = rayleigh * (e1 + e5) / 2 + even * (e1 + e3)
    kernel[..., 0, 1] = rayleigh * (e3 - e5) + even * (e1 + e3)
    kernel[..., 1, 0] = rayleigh * (e3 - e5) / 2 + even * (e1 - e3)
    kernel[..., 1, 1] = rayleigh * (e1 - 2 * e3 + e5) + even * (e1 - e3)
    kernel[..., 2, 2] = rayleigh * (e1 + e3 - 2 * e5) / 2
    kernel[..., 3, 3] = rayleigh * (e1 + 2 * e3 + e5) / 4
    return kernel


def _irradiance(air: Air) -> float:
    """Irradiance on the ground of all that the air scatters, sunlight once included."""
    height, weight, source = air._paths
    dimmed = np.exp(-(air.depth - height) / max(air.cos_sun, 1e-12))
    source = source + dimmed[:, None] * air.sun
    e2, e4 = expn(2, height), expn(4, height)
    rayleigh, even = 0.75 * air.dipole, 0.5 * (1.0 - air.dipole)
    flat = rayleigh * (e2 + e4) / 2 + even * e2
    upright = rayleigh * (e2 - e4) + even * e2
    return float(weight @ (flat * source[:, 0] + upright * source[:, 1]))


def _stokes(air: Air, cos_theta: float, azimuth: float) -> np.ndarray:
    """I, Q, U at the ground from one direction, its azimuth counted from the sun."""
    sin_theta = sqrt(1.0 - cos_theta**2)
    cos, sin = np.cos(azimuth), np.sin(azimuth)
    across = np.array([-sin, cos, 0.0])
    up = np.array([-cos_theta * cos, -cos_theta * sin, sin_theta])
    ss, pp, sp = field(air, np.array(cos_theta), across, up)
    return np.array([ss + pp, ss - pp, 2 * sp])


def field(
    air: Air, cos_theta: np.ndarray, e_s: np.ndarray, e_p: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Coherency ss, pp, sp of the sky's light along unit vectors. [1/sr]

    The vectors (..., 3) are perpendicular to the ray, x towards the sun's azimuth.
    """
    a, b, c, d = np.moveaxis(air.seen(cos_theta), -1, 0)

    def along(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        ux, uy, uz = np.moveaxis(u, -1, 0)
        vx, vy, vz = np.moveaxis(v, -1, 0)
        flat = (a + d) / 2 * ux * vx + (a - d) / 2 * uy * vy
        return np.asarray(flat + b * uz * vz + c * (ux * vz + uz * vx))

    rayleigh = 3.0 * air.dipole / (8.0 * pi)
    even = (1.0 - air.dipole) / (8.0 * pi) * (a + b)
    return (
        rayleigh * along(e_s, e_s) + even,
        rayleigh * along(e_p, e_p) + even,
        rayleigh * along(e_s, e_p),
    )


def _depth(x: np.ndarray) -> np.ndarray:
    """Share of the optical depth above x: flat at both ends, where sources bend."""
    return x**3 * (10.0 - 15.0 * x + 6.0 * x * x)


def _slope(x: np.ndarray) -> np.ndarray:
    return 30.0 * (x * (1.0 - x)) ** 2


def _basis(x: np.ndarray, orders: int) -> np.ndarray:
    return legendre.legvander(2.0 * x - 1.0, orders - 1)


def _gauss(points: int) -> tuple[np.ndarray, np.ndarray]:
    node, weight = legendre.leggauss(points)
    return 0.5 + 0.5 * node, 0.5 * weight


def _both_sides(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Quadrature of [0, 1] for each x, crowded on both sides of it as a cube."""
    y, weight = _gauss(POINTS)
    below, above = x[:, None], 1.0 - x[:, None]
    nodes = np.concatenate([below * (1.0 - y**3), below + above * y**3], axis=1)
    jacobian = 3.0 * y * y * weight
    weights = np.concatenate([below * jacobian, above * jacobian], axis=1)
    return nodes, weights * _slope(nodes)


@lru_cache(maxsize=1)
def _paths() -> tuple[np.ndarray, np.ndarray]:
    """Points of [0, 1] above the ground, finer by halves towards it, and weights."""
    edges = np.append(0.0, 0.5 ** np.arange(PANELS)[::-1])
    y, weight = _gauss(EACH)
    width = np.diff(edges)[:, None]
    x = (edges[:-1, None] + width * y).ravel()
    return x, (width * weight).ravel() * _slope(x)

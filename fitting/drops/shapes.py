"""Curves fitted to a drop's contour: Young-Laplace, and a smooth arc near the contact."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy import optimize, stats
from scipy.spatial import cKDTree

# Bond numbers at which profiles are computed; between them distances are interpolated
GRID = 0.01
# Largest Bond number that is tried
MAX_BOND = 20.0


@dataclass(frozen=True, kw_only=True)
class ShapeFit:
    """A curve fitted to one side of a drop.

    Parameters
    ----------
    angle : float
        Contact angle at the baseline. [rad]
    stderr : float
        Standard error from the scatter of the contour alone. [rad]
    centre : float
        Middle of the interval, where a limit of the Bond number makes it one-sided. [rad]
    rms : float
        Root mean square distance of the contour from the curve. [pixels]
    contact : float
        Where the curve meets the baseline, along it. [pixels]
    slope_by_height : float
        Change of the angle for a baseline one pixel higher. [rad / pixel]
    bond_number : float
        Gravity over surface tension, (density g / tension) apex radius^2; NaN if not
        fitted.
    parameters : ndarray
        Of the curve, to start another fit from.
    """

    angle: float
    stderr: float
    centre: float
    rms: float
    contact: float
    slope_by_height: float
    bond_number: float
    parameters: np.ndarray


@lru_cache(maxsize=256)
def laplace_profile(bond_number: float) -> np.ndarray:
    """Return (x, depth, slope angle) of an axisymmetric sessile drop of apex radius 1.

    From the apex to where the surface is vertical downwards again (angle π), by the
    Bashforth-Adams equation dφ/ds = 2 + B z - sin φ / x in arc length s, with fourth-order
    Runge-Kutta steps.

    References
    ----------
    .. [1] F. Bashforth, J. C. Adams, An attempt to test the theories of capillary action,
       Cambridge, 1883.
    """
    step = 0.01

    def slope(state: np.ndarray) -> np.ndarray:
        x, z, angle = state
        # At the apex both principal curvatures are 1
        around = np.sin(angle) / x if x > 1e-9 else 1.0
        return np.array([np.cos(angle), np.sin(angle), 2 + bond_number * z - around])

    states = [np.zeros(3)]
    while states[-1][2] < np.pi and len(states) < 900:
        y = states[-1]
        k1 = slope(y)
        k2 = slope(y + step / 2 * k1)
        k3 = slope(y + step / 2 * k2)
        k4 = slope(y + step * k3)
        following = y + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        if following[0] <= 0:
            break
        states.append(following)
    return np.array(states)


def _distance(points: np.ndarray, curve: np.ndarray) -> np.ndarray:
    """Signed distance of points from a densely sampled curve, along its local normal."""
    nearest = cKDTree(curve).query(points)[1].clip(1, len(curve) - 2)
    tangent = curve[nearest + 1] - curve[nearest - 1]
    tangent /= np.hypot(*tangent.T)[:, None]
    offset = points - curve[nearest]
    # To second order the curve bends away from its tangent
    along = (offset * tangent).sum(axis=1)
    step = np.hypot(*(curve[nearest + 1] - curve[nearest - 1]).T) / 2
    bend = curve[nearest + 1] - 2 * curve[nearest] + curve[nearest - 1]
    normal = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
    curvature = (bend * normal).sum(axis=1) / step**2
    return (offset * normal).sum(axis=1) - curvature * along**2 / 2


def fit_laplace(points: np.ndarray, start: np.ndarray | None = None) -> ShapeFit:
    """Fit axis, apex height, apex radius and Bond number to points (outward x, height).

    Parameters
    ----------
    points : ndarray, shape (n, 2)
        Of the right side, or of both.
    start : ndarray, optional
        Parameters of an earlier fit.
    """

    def curve(p: np.ndarray) -> np.ndarray:
        x, z, _ = laplace_profile(p[3]).T
        half = np.stack([x, -z], axis=1)
        whole = np.concatenate([(half * [-1, 1])[:0:-1], half])
        return np.array([p[0], p[1]]) + p[2] * whole

    def residual(p: np.ndarray) -> np.ndarray:
        # Between tabulated Bond numbers the distance is interpolated, so it stays smooth
        low, share = _grid_place(p[3])
        above = round(low + GRID, 9)
        below = _distance(points, curve(np.array([*p[:3], low])))
        return below + share * (_distance(points, curve(np.array([*p[:3], above]))) - below)

    if start is None:
        centre, radius = _circle(points)
        start = np.array([centre[0], centre[1] + radius, radius, 0.1])
    scale = np.array([start[2], start[2], start[2], 1.0])
    low = np.array([-np.inf, 0.5, 2.0, 0.0])
    high = np.array([np.inf, np.inf, np.inf, MAX_BOND])
    # Steps are relative: numbers near zero are moved away from it
    shift = np.array([start[2], start[2], 0.0, 1.0])
    found = optimize.least_squares(
        lambda q: residual(q - shift),
        np.clip(start, low + 1e-6, high - 1e-6) + shift,
        x_scale=scale,
        bounds=(low + shift, high + shift),
        loss="soft_l1",
        f_scale=0.5,
        max_nfev=60,
        diff_step=1e-4,
    )
    p = found.x - shift
    rest = residual(p)
    covariance, variance = _covariance(found.jac, rest)
    free = p - covariance @ found.grad / variance
    middle, covariance = _within_bond_numbers(free, covariance)
    at = _laplace_at
    # Near 180 degrees a hundredth of a Bond number is degrees
    steps = np.array([1e-3, 0.02, 1e-4 * p[2], GRID / 4])
    gradient = np.array(
        [
            (at(p + d * np.eye(4)[i])[0] - at(p - d * np.eye(4)[i] * (i != 3))[0])
            / (d * (1 + (i != 3)))
            for i, d in enumerate(steps)
        ]
    )
    angle, contact = at(p)
    return ShapeFit(
        angle=angle,
        stderr=float(np.sqrt(max(gradient @ covariance @ gradient, 0))),
        centre=at(middle)[0],
        rms=float(np.sqrt(np.mean(rest**2))),
        contact=contact,
        slope_by_height=at(p, 0.5)[0] - at(p, -0.5)[0],
        bond_number=float(p[3]),
        parameters=p,
    )


def _laplace_at(parameters: np.ndarray, height: float = 0.0) -> tuple[float, float]:
    """Return angle and outward place of a drop at a height above its base."""
    depth = (parameters[1] - height) / parameters[2]
    low, share = _grid_place(parameters[3])
    ends = [
        [np.interp(depth, z, column) for column in (angle, x)]
        for x, z, angle in (laplace_profile(b).T for b in (low, round(low + GRID, 9)))
    ]
    angle, x = (1 - share) * np.array(ends[0]) + share * np.array(ends[1])
    return float(angle), float(parameters[0] + parameters[2] * x)


def _within_bond_numbers(
    free: np.ndarray, covariance: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Mean and covariance of the parameters if all Bond numbers tried are equally likely.

    `free` is the best fit without limits, to first order. A sphere has a Bond number at a
    limit, and a flat drop hardly shows its own: the errors of the fit at an end of the
    range lead out of it, and say nothing of the way in.
    """
    spread = float(np.sqrt(covariance[3, 3]))
    limits = (np.array([0.0, MAX_BOND]) - free[3]) / spread
    mean, variance = stats.truncnorm.stats(*limits, moments="mv")
    along = covariance[3] / spread
    return free + along * mean, covariance + (variance - 1) * np.outer(along, along)


def _grid_place(bond_number: float) -> tuple[float, float]:
    """Return the tabulated Bond number below one, and the share of the way to the next."""
    cell = np.floor(max(bond_number, 0.0) / GRID + 1e-9)
    # Rounded, so that each is computed once
    return round(float(cell * GRID), 9), float(max(bond_number, 0.0) / GRID - cell)


def fit_arc(points: np.ndarray) -> ShapeFit:
    """Fit a curve whose tangent angle is quadratic in the arc length.

    Needs no physics: it follows a pinned or uneven drop, but rests on the few points near
    the contact. Points are (outward x, height) in order from the contact upwards.
    """
    step = np.hypot(*np.diff(points, axis=0).T)
    arc = np.concatenate([[0.0], np.cumsum(step)])
    s = np.linspace(-0.6 * arc[-1], 1.2 * arc[-1], 400)
    zero = int(np.searchsorted(s, 0.0))

    def curve(p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        angle = p[2] + p[3] * s / arc[-1] + p[4] * (s / arc[-1]) ** 2
        ds = s[1] - s[0]
        # θ = 0 points inwards (-x), π/2 upwards
        xy = np.stack([-np.cos(angle), np.sin(angle)], axis=1) * ds
        path = np.cumsum(xy, axis=0) - xy / 2
        return path - path[zero] + p[:2], angle

    def residual(p: np.ndarray) -> np.ndarray:
        return _distance(points, curve(p)[0])

    rise = np.unwrap(np.arctan2(np.gradient(points[:, 1]), -np.gradient(points[:, 0])))
    rise = rise - 2 * np.pi * np.round((np.median(rise) - np.pi / 2) / (2 * np.pi))
    linear = np.polyfit(arc / arc[-1], rise, 1)
    start = np.array([*points[0], linear[1], linear[0], 0.0])
    found = optimize.least_squares(
        residual,
        start,
        loss="soft_l1",
        f_scale=0.5,
        max_nfev=60,
        x_scale=np.array([1.0, 1.0, 0.1, 0.1, 0.1]),
    )

    def at(p: np.ndarray, height: float = 0.0) -> tuple[float, float]:
        path, angle = curve(p)
        below = np.flatnonzero(path[: zero + 1, 1] <= height)
        i = int(below[-1]) if below.size else 0
        rise = path[i + 1, 1] - path[i, 1]
        share = np.clip((height - path[i, 1]) / rise, 0, 1) if rise else 0.0
        x = path[i, 0] + share * (path[i + 1, 0] - path[i, 0])
        return float(angle[i] + share * (angle[i + 1] - angle[i])), float(x)

    rest = residual(found.x)
    covariance, _ = _covariance(found.jac, rest)
    gradient = np.array(
        [(at(found.x + d)[0] - at(found.x - d)[0]) / 0.02 for d in 0.01 * np.eye(5)]
    )
    angle, contact = at(found.x)
    return ShapeFit(
        angle=angle,
        stderr=float(np.sqrt(max(gradient @ covariance @ gradient, 0))),
        centre=angle,
        rms=float(np.sqrt(np.mean(rest**2))),
        contact=contact,
        slope_by_height=at(found.x, 0.5)[0] - at(found.x, -0.5)[0],
        bond_number=float("nan"),
        parameters=found.x,
    )


def _covariance(jacobian: np.ndarray, residual: np.ndarray) -> tuple[np.ndarray, float]:
    """Covariance of the parameters, for residuals that are correlated along the contour.

    With it comes the variance that each point would have if all were independent.
    """
    centred = residual - residual.mean()
    spectrum = np.abs(np.fft.rfft(centred, 2 * centred.size)) ** 2
    correlation = np.fft.irfft(spectrum)[: centred.size // 4]
    correlation = correlation / max(correlation[0], 1e-300)
    negative = np.flatnonzero(correlation <= 0)
    reach = int(negative[0]) if negative.size else correlation.size
    inflation = 1 + 2 * correlation[1:reach].sum()
    inflation = max(float(inflation), 1.0)
    # Each parameter takes the scatter of one independent residual, not of one point
    dof = max(residual.size - jacobian.shape[1] * inflation, residual.size / 10)
    variance = float(np.sum(residual**2)) / dof * inflation
    information = jacobian.T @ jacobian / variance
    # Lengths in pixels and plain numbers: to one scale before the inversion
    scale = 1 / np.sqrt(np.maximum(np.diag(information), 1e-300))
    scales = np.outer(scale, scale)
    return np.linalg.pinv(information * scales) * scales, variance


def _circle(points: np.ndarray) -> tuple[np.ndarray, float]:
    """Circle through points by the linear least squares of Kasa."""
    system = np.column_stack([2 * points, np.ones(len(points))])
    solution = np.linalg.lstsq(system, (points**2).sum(axis=1), rcond=None)[0]
    centre = solution[:2]
    return centre, float(np.sqrt(max(solution[2] + centre @ centre, 1.0)))

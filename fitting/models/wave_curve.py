"""A smooth curve through wave optics over height, correlation length and index.

For each direction the logarithm of M00 at one index is smooth in the logarithms of height
and length, and so is every element over that M00; in the index elements are smooth as
Fresnel's coefficients are. They are computed at the nodes of polynomials and interpolated,
which gives a solver exact derivatives of any order.
"""

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from fitting.models.index_grid import IndexGrid, Range, chebyshev
from fitting.readings.observations import Geometry
from pbrdf.errors import AccuracyWarning

if TYPE_CHECKING:
    from pbrdf import WaveModel

__all__ = ["HEIGHTS", "WaveCurve"]

HEIGHTS = ("height_rms", "corr_length")
# Degrees in height and length that are tried, and the error in parts of M00 that is enough
_DEGREES, _ENOUGH = (5, 8, 12, 17), 1e-4
# Places at which the curve is compared with the model, and the part of the brightest
# reading below which one does not count
_PLACES, _DARK = 8, 1e-9
# A logarithm needs more than nothing, and no kink where there is nothing [1/sr]
_LEAST = 1e-290
# Elements of I and Q, which no retardance of s over p changes in plane, and those that
# mix them with U and V, which vanish there
_POWERS = {0, 1, 4, 5}
_VANISHING = {2, 3, 6, 7, 8, 9, 12, 13}
_IN_PLANE = 1e-9

Place = Mapping[str, float]


@dataclass(frozen=True, eq=False)
class WaveCurve:
    """Interpolation of the elements of a wave model at N directions.

    Attributes
    ----------
    ranges : mapping of str to (low, high)
        Of height and length, where they vary. [um]
    grid : IndexGrid or None
        Of the index, if it varies.
    degree : int
        Of the polynomials in log height and log length.
    elements : tuple of int
        Numbers of the elements along the rows of the matrix.
    brightness : ndarray, shape (terms, N)
        Of log M00 at the middle index; terms in height and length.
    shares : ndarray, shape (elements, terms, N)
        Of the elements over that M00; terms in height, length and index.
    error : float
        Largest difference from the model that was seen, in parts of M00. [1]
    """

    ranges: Mapping[str, Range]
    grid: IndexGrid | None
    degree: int
    elements: tuple[int, ...]
    brightness: np.ndarray
    shares: np.ndarray
    error: float = 0.0

    @classmethod
    def through(
        cls,
        model: "WaveModel",
        ranges: Mapping[str, Range],
        held: Mapping[str, np.ndarray],
        geometry: Geometry,
        elements: Sequence[int],
    ) -> "WaveCurve":
        """Interpolate over what is not held, as finely as it takes.

        Parameters
        ----------
        model : WaveModel
            Its kind of autocorrelation, and method.
        ranges : mapping of str to (low, high)
            Of height_rms and corr_length [um], n and kappa.
        held : mapping of str to ndarray, shape (N,)
            Values of what does not vary.
        geometry : Geometry
            Directions and wavelengths.
        elements : sequence of int
            Numbers along the rows of the matrix.
        """
        vary = {k: v for k, v in ranges.items() if k in HEIGHTS and k not in held}
        grid = None
        if not {"n", "kappa"} <= set(held):
            grid = IndexGrid(ranges["n"], ranges["kappa"])
        # M00 is what errors are measured by
        exact = _Exact(model, held, geometry, tuple(dict.fromkeys((0, *elements))), grid)
        rng = np.random.default_rng(0)
        places = [_between(vary, rng) for _ in range(_PLACES)]
        indices = None if grid is None else _some_indices(grid, rng)
        truth = [exact.at(place, indices) for place in places]
        error = np.inf
        for degree in _DEGREES if vary else (0,):
            fitted = _solved(vary, grid, degree, exact)
            finer = cls(vary, grid, degree, exact.elements, *fitted)
            left = max(
                finer._error(place, indices, one)
                for place, one in zip(places, truth, strict=True)
            )
            # What is left then is not of the polynomials in height and length
            if left > 0.5 * error:
                break
            curve, error = replace(finer, error=left), left
            if error <= _ENOUGH:
                break
        return curve

    def expression(self, values: Mapping[str, Any]) -> Any:
        """Return `elements` (E, N) as symbols, of values that are rows (1, N). [1/sr]"""
        import casadi

        size = self.brightness.shape[1]
        heights = casadi.DM.ones(1, size)
        for column in _columns(self.ranges, self.degree, values, casadi):
            rows = casadi.vertcat(*column)
            blocks = [
                casadi.repmat(heights[row, :], len(column), 1) * rows
                for row in range(heights.shape[0])
            ]
            heights = casadi.vertcat(*blocks)
        m00 = casadi.exp(casadi.sum1(casadi.DM(self.brightness) * heights))
        index = (
            [1.0] if self.grid is None else self.grid.terms(values["n"], values["kappa"])
        )
        shares = self.shares.reshape(len(self.elements), heights.shape[0], len(index), size)
        rows = [
            sum(
                casadi.sum1(casadi.DM(share[:, term]) * heights) * index[term]
                for term in range(len(index))
            )
            for share in shares
        ]
        return casadi.vertcat(*(m00 * row for row in rows))

    def _error(
        self, place: Place, indices: np.ndarray | None, exact: tuple[np.ndarray, np.ndarray]
    ) -> float:
        """Largest difference from what is exact at a place, in parts of M00."""
        rows = {name: np.array([value]) for name, value in place.items()}
        heights = np.ones(1)
        for column in _columns(self.ranges, self.degree, rows, np):
            heights = np.outer(heights, np.stack(column)).ravel()
        index = np.ones((1, 1))
        if self.grid is not None and indices is not None:
            index = self.grid.basis(indices.real, indices.imag)
        brightness = heights @ self.brightness
        shares = self.shares.reshape(len(self.elements), len(heights), index.shape[1], -1)
        found = np.einsum("h,it,ehtn->ien", heights, index, shares)
        found = found * np.exp(brightness - exact[0])
        bright = exact[0] > exact[0].max() + np.log(_DARK)
        apart = np.abs(found - exact[1]) / exact[1][:, :1]
        return float(apart[..., bright].max())


@dataclass(frozen=True, eq=False)
class _Exact:
    """The model itself at places in the space of what varies."""

    model: "WaveModel"
    held: Mapping[str, np.ndarray]
    geometry: Geometry
    elements: tuple[int, ...]
    grid: IndexGrid | None

    def at(self, place: Place, indices: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
        """Return log M00 at the middle index (N,), and the elements over that M00.

        The latter are at the indices (I, elements, N), or as held.
        """
        heights = {
            name: float(place[name] if name in place else self.held[name][0])
            for name in HEIGHTS
            if name in place or name in self.held
        }
        where = self.geometry
        if indices is None or self.grid is None:
            kinds = [(self.held["n"], self.held["kappa"])]
        else:
            middle = complex(*np.mean([self.grid.n, self.grid.kappa], axis=1))
            every = np.ones(where.size)
            kinds = [(one.real * every, one.imag * every) for one in [middle, *indices]]
        angles = where.theta_i, where.theta_s, where.dphi, where.wavelength
        columns = [np.tile(one, len(kinds)).astype(float) for one in angles]
        columns += [np.concatenate(one).astype(float) for one in zip(*kinds, strict=True)]
        with warnings.catch_warnings():
            # Corners of the ranges may be steep; the fitted model tells of its own slope
            warnings.simplefilter("ignore", AccuracyWarning)
            surface = self.model.with_parameters(**heights).surface
            azimuth = np.tile(where.phi_i, len(kinds))
            rows = surface.matrices(columns, dressed=self.retarded, phi_i=azimuth)
        rows = rows.reshape(len(kinds), where.size, 16)
        m00 = rows[0, :, 0] + _LEAST
        wanted = rows[min(1, len(kinds) - 1) :, :, list(self.elements)] / m00[:, None]
        return np.log(m00), np.moveaxis(wanted, -1, 1)

    @property
    def retarded(self) -> bool:
        """Whether elements are asked that the phase of the mean field changes."""
        plain = np.abs(np.sin(self.geometry.dphi)).max() < _IN_PLANE
        return not set(self.elements) <= (_POWERS | _VANISHING if plain else _POWERS)


def _solved(
    ranges: Mapping[str, Range], grid: IndexGrid | None, degree: int, exact: _Exact
) -> tuple[np.ndarray, np.ndarray]:
    """Return the coefficients of a curve that meets the model at the nodes."""
    x = np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
    inverse = np.linalg.inv(np.stack(chebyshev(x, degree), axis=-1))
    axes = [
        [{name: float(np.sqrt(low * high) * (high / low) ** (0.5 * one))} for one in x]
        for name, (low, high) in ranges.items()
    ]
    places = [{k: v for one in both for k, v in one.items()} for both in product(*axes)]
    nodes = None if grid is None else grid.nodes
    pairs = [exact.at(place, nodes) for place in places]
    sizes = [degree + 1] * len(ranges)
    # Terms first, then elements and directions
    brightness = np.stack([one for one, _ in pairs]).reshape(*sizes, -1)
    shares = np.stack([two for _, two in pairs])
    shares = shares.reshape(*sizes, *shares.shape[1:])
    for axis in range(len(sizes)):
        brightness, shares = (
            np.moveaxis(np.tensordot(inverse, one, axes=(1, axis)), 0, axis)
            for one in (brightness, shares)
        )
    if grid is not None:
        axis = len(sizes)
        shares = np.moveaxis(
            np.tensordot(grid.coefficients, shares, axes=(1, axis)), 0, axis
        )
    terms = shares.reshape(-1, *shares.shape[-2:])
    return brightness.reshape(-1, brightness.shape[-1]), np.moveaxis(terms, 1, 0)


def _columns(
    ranges: Mapping[str, Range], degree: int, values: Mapping[str, Any], of: Any
) -> Iterator[list[Any]]:
    """Yield the polynomials in log height and in log length."""
    for name, (low, high) in ranges.items():
        x = (2.0 * of.log(values[name]) - np.log(low * high)) / np.log(high / low)
        yield chebyshev(x, degree)


def _between(ranges: Mapping[str, Range], rng: np.random.Generator) -> dict[str, float]:
    """Return a place between the nodes."""
    return {k: low * (high / low) ** rng.random() for k, (low, high) in ranges.items()}


def _some_indices(grid: IndexGrid, rng: np.random.Generator) -> np.ndarray:
    """Return indices between the nodes, complex."""
    n, kappa = (
        low + (high - low) * rng.random(_PLACES) for low, high in (grid.n, grid.kappa)
    )
    return n + 1j * kappa

r"""Slopes that light sees on a height map: patches, their diffraction, and the density.

A patch of the surface, weighted by a Gaussian of standard deviation s, mirrors light into
its own slope, blurred per axis by its diffraction,

.. math::
   b = \frac{1}{2 s q_z} = \frac{\lambda}{8 \pi s}

at normal incidence (q_z = 4 pi / lambda). A large patch hides the slopes within it, a
small one diffracts. At each place the patch is taken on which both are equal: the blur
then gives back the variance that the smoothing took, and the lobe of the patch is as narrow
as it can be. Where the surface is smooth the patch is large and its lobe sharp; where it is
rugged the patch is small. On a smooth map both vanish beside the slopes. Over a brushed map
patches are longer along the grooves, so that each axis gets back what it lost.

An instrument of resolution r > s hid the slopes between s and r from the map. Slopes within
a distance grow as a power p of it in their variance, and within s they are b, so that

.. math::
   h^2 = b^2 [(r / s)^p - 1]

is added. Within a smooth hill p = 2, where nothing finer is hidden p = 0; p = 1 between.
The slopes within r that the map lacks follow from those that it has between r and
sqrt(2) r, with p = 1: they are 1/(sqrt(2) - 1) as large in their variance. What a map holds
that is finer than the spot of the instrument is noise, and smoothed away first, so that r
is sqrt(2) times the standard deviation of the point spread.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import ndimage

from pbrdf.surface.heightmap import HeightMap

Array = np.ndarray

# Principal slopes that differ by less than this factor are those of an isotropic surface
_ISOTROPIC = 1.2
# Slopes that are those of rounding
_FLAT = 1e-6
# Patches are sought between a twentieth of a wavelength and this many, each so much larger
_LARGEST = 20.0
_RATIO = 1.1
# Facets left when the search ends; the largest patch so far takes them
_REST = 1e-3


@dataclass(frozen=True, kw_only=True, eq=False)
class Facets:
    """Slopes of the patches of a map, and the blur of each.

    Parameters
    ----------
    slope_x, slope_y : ndarray, shape (n,)
        Of the patches, about the mean plane; those of one size together. [1]
    sizes, counts : ndarray, shape (k,)
        Standard deviation of the Gaussian weight of the patches, and how many there are of
        each. [um]
    wavelength : float
        In vacuum. [um]
    aspect : float
        Length of the patches along y over that along x; `sizes` is their geometric mean.
    resolution : float
        Standard deviation of the instrument's point spread. [um]
    exponent : float
        Of the variance of the slopes within a distance, p. [1]
    bridged : ndarray of bool, shape (n,), optional
        Facets that the instrument did not see.
    """

    slope_x: Array
    slope_y: Array
    sizes: Array
    counts: Array
    wavelength: float
    aspect: float = 1.0
    resolution: float = 0.0
    exponent: float = 1.0
    bridged: Array | None = None

    @property
    def patch(self) -> float:
        """Median size. [um]"""
        half = np.searchsorted(np.cumsum(self.counts), self.counts.sum() / 2)
        return float(self.sizes[half])

    @property
    def blurs(self) -> Array:
        """Diffraction and hidden slopes of each size along x and y, shape (k, 2). [1]"""
        patch = self.sizes[:, None] * np.array([self.aspect**-0.5, self.aspect**0.5])
        hides = np.maximum(self.resolution / patch, 1.0) ** self.exponent
        return diffraction(patch, self.wavelength) * np.sqrt(hides)

    @property
    def blur(self) -> float:
        """Rms of the blur over the patches, per axis. [1]"""
        square = np.mean(self.blurs**2, axis=1)
        return float(np.sqrt(np.average(square, weights=self.counts)))

    @property
    def hidden(self) -> float:
        """Rms of the slopes that the instrument hid from light's patches, per axis. [1]"""
        seen = replace(self, resolution=0.0).blur
        return float(np.sqrt(max(self.blur**2 - seen**2, 0.0)))

    def stretched(self, factor: float) -> "Facets":
        """Return the facets with those the instrument did not see so much steeper."""
        if self.bridged is None:
            return self
        scale = np.where(self.bridged, factor, 1.0)
        return replace(self, slope_x=scale * self.slope_x, slope_y=scale * self.slope_y)

    @property
    def slope_rms(self) -> float:
        """Of patches and blur together, per axis. [1]"""
        square = (np.mean(self.slope_x**2) + np.mean(self.slope_y**2)) / 2
        return float(np.sqrt(square + self.blur**2))

    @cached_property
    def principal(self) -> tuple[Array, Array]:
        """Rms slopes along the principal axes, and the axes as columns; equal if nearly."""
        slopes = np.stack([self.slope_x, self.slope_y])
        values, axes = np.linalg.eigh(slopes @ slopes.T / slopes.shape[1])
        if values[1] < _ISOTROPIC**2 * values[0]:
            values = np.full(2, values.mean())
        return np.sqrt(np.maximum(values, 1e-16)), axes

    @cached_property
    def radius(self) -> Array:
        """|slope| of each facet in units of its rms along the principal axes. [1]"""
        widths, axes = self.principal
        return np.hypot(*((axes / widths).T @ np.stack([self.slope_x, self.slope_y])))

    def groups(self) -> Iterator[tuple[Array, slice]]:
        """Yield the blur along x and y, and the facets, of each size. [1]"""
        ends = np.cumsum(self.counts)
        for blur, begin, end in zip(self.blurs, ends - self.counts, ends, strict=True):
            yield blur, slice(int(begin), int(end))


def facets_of(
    surface: HeightMap,
    wavelength: float,
    *,
    criterion: float = 1.0,
    resolution: float = 0.0,
    lost: Array | None = None,
) -> Facets:
    """Find the patches of a map and their slopes about the mean plane.

    Parameters
    ----------
    criterion : float
        Slope within a patch over the diffraction of the patch. [1]
    resolution : float
        Standard deviation of the instrument's point spread; slopes are smoothed by what a
        patch is larger only. [um]
    lost : ndarray of bool, shape (nx, ny), optional
        Nodes that the instrument did not see, bridged.

    Raises
    ------
    ValueError
        If the map has fewer than 100 cells of known heights, or is flat.
    """
    slopes, known = known_slopes(surface)
    if resolution > 0:
        # What is finer than the spot is noise; taken off, the map is as if seen twice
        once = _Mean(surface, known, (resolution, resolution))
        slopes = [np.where(known, once(s), 0.0) for s in slopes]
        resolution *= np.sqrt(2)
    extent = min(n * d for n, d in zip(surface.shape, surface.spacing, strict=True))
    smallest, largest = 0.05 * wavelength, min(_LARGEST * wavelength, extent / 12)
    steps = max(int(np.log(largest / smallest) / np.log(_RATIO)), 0)
    sizes = smallest * _RATIO ** np.arange(steps + 1)
    left = known.copy()
    aspect = _aspect(slopes, known, surface)
    found: list[Array] = []
    bridged: list[Array] = []
    bridges = None if lost is None else _beside(lost, surface)
    counts = np.zeros(sizes.size, dtype=int)
    unseen: Array | float = 0.0
    if resolution > 0:
        blind = _Mean(surface, known, (resolution, resolution))
        unseen = _hidden(blind, slopes, 1.0)[1] / (np.sqrt(2) - 1)
    for i, size in enumerate(sizes):
        whole = size**2 * np.array([1 / aspect, aspect])
        mean = _Mean(surface, known, np.sqrt(np.maximum(whole - resolution**2, 0.0)))
        smooth, within = _hidden(mean, slopes, aspect)
        within = within + unseen * min(size / max(resolution, size), 1.0)
        take = left & (within >= (criterion * wavelength / (8 * np.pi * size)) ** 2)
        last = i == steps or (left.sum() - take.sum()) < _REST * known.sum()
        take = left if last else take
        found.append(np.stack([m[take] for m in smooth]))
        if bridges is not None:
            bridged.append(bridges[take])
        counts[i] = take.sum()
        left = left & ~take
        if last:
            break
    x, y = np.concatenate(found, axis=1)
    filled = counts > 0
    return Facets(
        slope_x=x - x.mean(), slope_y=y - y.mean(), sizes=sizes[filled],
        counts=counts[filled], wavelength=wavelength, aspect=aspect,
        resolution=resolution, bridged=np.concatenate(bridged) if bridged else None,
    )  # fmt: skip


def known_slopes(surface: HeightMap) -> tuple[list[Array], Array]:
    """Slopes of the cells about their mean, 0 where missing, and which are known."""
    slopes = _cell_slopes(surface.heights, surface)
    known = np.isfinite(slopes[0]) & np.isfinite(slopes[1])
    if known.sum() < 100:
        msg = (
            f"surface must have 100 cells of known heights at least, got {known.sum()}. "
            "Give a larger map."
        )
        raise ValueError(msg)
    about = [np.where(known, s - s[known].mean(), 0.0) for s in slopes]
    if not any(np.abs(s).max() > _FLAT for s in about):
        msg = (
            f"surface must be rough, got slopes below {_FLAT:g} about its mean plane. "
            "A mirror sends all light into one beam and has no BRDF."
        )
        raise ValueError(msg)
    return about, known


def _hidden(mean: "_Mean", slopes: list[Array], aspect: float) -> tuple[list[Array], Array]:
    """Mean slopes, and the variance within, each axis by the length of patches there."""
    smooth = [mean(s) for s in slopes]
    spread = [mean(s**2) - m**2 for s, m in zip(slopes, smooth, strict=True)]
    return smooth, np.maximum(spread[0] / aspect + spread[1] * aspect, 0.0) / 2


def _aspect(slopes: list[Array], known: Array, surface: HeightMap) -> float:
    """Length of patches along y over x that hide on each axis what they diffract there."""
    bends = []
    for axis, (slope, step) in enumerate(zip(slopes, surface.spacing, strict=True)):
        both = np.diff(known.astype(int), axis=axis) == 0
        change = np.diff(slope, axis=axis)[both & np.delete(known, 0, axis)]
        bends.append(np.sqrt(np.mean(change**2)) / step if change.size else 0.0)
    if min(bends) == 0:
        return 1.0
    ratio = float(np.clip(np.sqrt(bends[0] / bends[1]), 0.1, 10.0))
    return 1.0 if 1 / _ISOTROPIC < ratio < _ISOTROPIC else ratio


class _Mean:
    """Gaussian mean over the known cells of a map, of a standard deviation an axis [um]."""

    def __init__(self, surface: HeightMap, known: Array, sizes: Sequence[float]) -> None:
        pairs = zip(sizes, surface.spacing, strict=True)
        self.widths = [size / step for size, step in pairs]
        self.mode = "wrap" if surface.periodic else "nearest"
        self.weight = None
        if not known.all():
            self.weight = np.maximum(self._filtered(known.astype(float)), 1e-9)

    def __call__(self, values: Array) -> Array:
        """Mean of values that are 0 where missing."""
        mean = self._filtered(values)
        return mean if self.weight is None else mean / self.weight

    def _filtered(self, values: Array) -> Array:
        return np.asarray(ndimage.gaussian_filter(values, self.widths, mode=self.mode))


def _cell_slopes(heights: Array, surface: HeightMap) -> tuple[Array, Array]:
    """Slopes of the cells of a map, NaN beside missing heights."""
    dx, dy = surface.spacing
    if surface.periodic:
        x = (np.roll(heights, -1, 0) - heights) / dx
        y = (np.roll(heights, -1, 1) - heights) / dy
    else:
        x = np.diff(heights, axis=0)[:, :-1] / dx
        y = np.diff(heights, axis=1)[:-1] / dy
    return x, y


def _beside(nodes: Array, surface: HeightMap) -> Array:
    """Tell which cells of a map have one of the nodes at a corner."""
    x, y = _cell_slopes(np.where(nodes, np.nan, 0.0), surface)
    return np.asarray(np.isnan(x) | np.isnan(y))


def diffraction(patch: Array, wavelength: float) -> Array:
    """Blur of the slope of a patch per axis, at normal incidence. [1]"""
    return wavelength / (8 * np.pi * patch)

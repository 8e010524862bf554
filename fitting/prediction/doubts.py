"""What a map leaves open about the slopes that light sees, each with its size."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from fitting.prediction.facets import Facets, known_slopes
from pbrdf.surface.heightmap import HeightMap

# Relative error of the slope from one map's own extent that is told
_SMALL = 0.08
# Share of the slope that an unknown instrument, or a known one, hides, and is told
_UNKNOWN = 0.03
_HIDDEN = 0.25
# Share of a map that was bridged
_BRIDGED = 0.05


def place_error(surface: HeightMap) -> float:
    """Relative standard error of the rms slope, from the extent of the map alone.

    The variance of a mean is the spectrum of what is averaged, here the squared slope, at
    frequency 0; the eight longest waves of the map stand for it.
    """
    slopes, known = known_slopes(surface)
    square = slopes[0] ** 2 + slopes[1] ** 2
    mean = square[known].mean()
    waves = np.fft.fft2(np.where(known, square - mean, 0.0))
    longest = [waves[1, 0], waves[0, 1], waves[1, 1], waves[1, -1]]
    variance = np.mean(np.abs(longest) ** 2) / known.sum() ** 2
    return float(np.sqrt(variance) / (2 * mean))


def what_is_open(
    surface: HeightMap, facets: Facets, *, own: float, lost: float, blurred: Facets | None
) -> Iterator[str]:
    """Yield what a reader must know before trusting the prediction.

    Parameters
    ----------
    own : float
        `place_error` of the map.
    lost : float
        Share of the map that was bridged.
    blurred : Facets, optional
        Those of an objective that just resolves two steps of the map, where nobody named
        the one that measured it.
    """
    if own > _SMALL:
        across = min(n * d for n, d in zip(surface.shape, surface.spacing, strict=True))
        yield (
            f"the map is small beside its own structure: {across:.3g} um leave the rms "
            f"slope uncertain by {own:.0%}. Measure more places"
        )
    rms = facets.slope_rms
    if blurred is not None:
        if blurred.slope_rms > (1 + _UNKNOWN) * rms:
            yield (
                f"the instrument is not known, the map is taken as sharp to its step. An "
                f"objective that resolves two steps would have hidden slopes: rms "
                f"{blurred.slope_rms:.3g} per axis instead of {rms:.3g}. Give its aperture"
            )
    elif facets.hidden > _HIDDEN * rms:
        most = replace(facets, exponent=2.0).hidden
        yield (
            f"spot and smoothing of {facets.resolution:.3g} um together hide slopes that "
            f"light sees on patches of {facets.patch:.3g} um: {facets.hidden:.2g} per axis "
            f"is added, between 0 and {most:.2g}, to an rms of {rms:.3g} in all"
        )
    if lost > _BRIDGED:
        yield (
            f"{lost:.0%} of the map is missing or too steep for the aperture, and bridged "
            "from the rims"
        )

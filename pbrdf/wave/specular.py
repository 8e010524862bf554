"""Mean field of given heights: the specular beam, and what it does to phases."""

import warnings
from functools import lru_cache

import numpy as np

from pbrdf.errors import AccuracyWarning
from pbrdf.kernels.wave import orders
from pbrdf.optics.fresnel import fresnel_amplitudes
from pbrdf.wave.coherent import MeanField, Medium, Waves, mean_field
from pbrdf.wave.directional import Directional
from pbrdf.wave.statistics import Exponential, Gaussian, Statistics

__all__ = ["Dressing", "mean_jones", "mueller_of"]

Array = np.ndarray

# Zeniths at which phase and loss of the mean field are found; both are smooth between them
PHASE_ZENITHS = np.r_[np.linspace(0.0, 0.5 * np.pi, 19)[:-1], np.deg2rad(89.5)]
# Heights that are told by height and length alone
LAWS = {orders.GAUSSIAN: Gaussian, orders.EXPONENTIAL: Exponential}
# On the horizon proper some of the waves have no normal part
LARGEST_SINE = 1.0 - 1e-9
# Amplitude of second order that is no small change any more; 0.29 at the most in the tables
# on which the beam is right to 0.02
DOUBTFUL = 0.5


def mean_jones(
    heights: Statistics, dimensions: int, kind: str, columns: tuple[Array, ...]
) -> Array:
    """Jones matrices of the specular beam.

    Parameters
    ----------
    heights : Statistics
        The heights.
    dimensions : int
        1 for a profile, 2 for a surface.
    kind : str
        "second-order", "kirchhoff" or "none", as in `pbrdf.wave.methods.Method`.
    columns : arrays that broadcast to (...)
        theta_i [rad], wavelength [um], n, kappa, phi_i [rad].

    Returns
    -------
    ndarray, shape (..., 2, 2)
        Complex, (s, p). [1]
    """
    columns = np.broadcast_arrays(*columns)
    out = np.zeros((*columns[0].shape, 2, 2), dtype=np.complex128)
    if kind == "none":
        return out
    doubt, where = DOUBTFUL, None
    for at in np.ndindex(columns[0].shape):
        given = [float(c[at]) for c in columns]
        if kind == "kirchhoff":
            out[at] = _kirchhoff(heights, *given[:4])
            continue
        found = _second_order(heights, dimensions, *given)
        out[at] = found.jones
        if found.doubt > doubt:
            doubt, where = found.doubt, given
    if where is not None:
        warnings.warn(
            "The beam is known to second order in the heights, which changes its amplitude "
            f"by {doubt:.2g} at {np.rad2deg(where[0]):.4g} degrees and {where[1]:g} um: no "
            "small change. Its reflectance may be off by as much.",
            AccuracyWarning, stacklevel=4,
        )  # fmt: skip
    return out


def mueller_of(jones: Array) -> Array:
    """Mueller matrices (..., 4, 4) of Jones matrices (..., 2, 2)."""
    pauli = np.array([
        [[1, 0], [0, 1]], [[1, 0], [0, -1]], [[0, 1], [1, 0]], [[0, 1j], [-1j, 0]],
    ])  # fmt: skip
    # I, Q, U, V of E_i E_j*: traces with these matrices, V = 2 Im(E_s E_p*)
    found: Array = 0.5 * np.einsum(
        "aij,...jk,bkl,...il->...ab", pauli, jones, pauli.conj().swapaxes(1, 2),
        jones.conj(), optimize=True,
    ).real  # fmt: skip
    return found


def _second_order(
    heights: Statistics, dimensions: int, theta: float, wavelength: float, n: float,
    kappa: float, phi_i: float = 0.0,
) -> MeanField:  # fmt: skip
    """Mean field of one incidence and wavelength, to second order."""
    k = 2 * np.pi / wavelength
    unit = k ** (2 + dimensions)
    directional = isinstance(heights, Directional)

    def spectrum(along: Array, across: Array) -> Array:
        wave = np.hypot(along, across) * k
        if isinstance(heights, Directional):
            # Light travels away from the source
            cos, sin = -np.cos(phi_i) * k, -np.sin(phi_i) * k
            wave = heights.lateral(cos * along - sin * across, sin * along + cos * across)
        return heights.spectrum(wave, dimensions) * unit

    lengths = heights.lengths if isinstance(heights, Directional) else 2 * (
        heights.corr_length,
    )  # fmt: skip
    surface = Waves(
        k * heights.height_rms, (k * min(lengths), k * max(lengths)), spectrum, dimensions,
        heights.bounded, mirrored=not directional,
    )  # fmt: skip
    return mean_field(_sine(theta), Medium.of(n, kappa), surface)


def _sine(theta: float) -> float:
    """Sine of an incidence, short of grazing."""
    return min(float(np.sin(theta)), LARGEST_SINE)


def _kirchhoff(
    heights: Statistics, theta: float, wavelength: float, n: float, kappa: float
) -> Array:
    """Fresnel times exp(-2 (k h cos theta)^2)."""
    cosine = float(np.cos(theta))
    height = 2 * np.pi / wavelength * heights.height_rms
    fall = np.exp(-2.0 * (height * cosine) ** 2)
    return fall * np.diag(np.ravel(fresnel_amplitudes(cosine, n, kappa)))


class Dressing:
    """What the mean field does to E_s E_p* of light on its way in or out.

    Light that the mean field loses beyond the Kirchhoff factor is scattered once more, by
    waves of all directions: its power stays, and s and p of it have no common phase.

    Parameters
    ----------
    heights : Statistics
        Of an isotropic surface or a profile.
    dimensions : int
        1 for a profile, 2 for a surface.
    """

    def __init__(self, heights: Statistics, dimensions: int) -> None:
        self._heights, self._dimensions = heights, dimensions
        self._known: dict[tuple[float, float, float], Array] = {}

    def at(self, zenith: Array, wavelength: float, n: float, kappa: float) -> Array:
        """Logarithms at zeniths of light of one wavelength, complex. [1]"""
        key = wavelength, n, kappa
        if key not in self._known:
            self._known[key] = self._tabulated(*key)
        found: Array = np.interp(zenith, PHASE_ZENITHS, self._known[key])
        return found

    def _tabulated(self, wavelength: float, n: float, kappa: float) -> Array:
        """Logarithms at `PHASE_ZENITHS`, which go with the square of the height."""
        k, heights = 2 * np.pi / wavelength, self._heights
        if heights.law in LAWS:
            length = k * heights.corr_length
            unit = unit_dressings(heights.law, length, self._dimensions, n, kappa)
            return (k * heights.height_rms) ** 2 * unit
        means = [
            _second_order(heights, self._dimensions, float(zenith), wavelength, n, kappa)
            for zenith in PHASE_ZENITHS
        ]
        return np.array([mean.dressing for mean in means])


@lru_cache(maxsize=4096)
def unit_dressings(
    law: int, length: float, dimensions: int, n: float, kappa: float
) -> Array:
    """Logarithms at `PHASE_ZENITHS` over (k h)², of heights of length k l."""
    heights = LAWS[law](1.0, length)
    # Of a wavelength at which k is 1
    means = (
        _second_order(heights, dimensions, float(zenith), 2 * np.pi, n, kappa)
        for zenith in PHASE_ZENITHS
    )
    return np.array([mean.dressing for mean in means])

"""Physical optics of a given map: no statistics assumed, every wave that leaves it."""

import warnings

import numpy as np
import scipy.fft
import xarray as xr

from pbrdf.analytic.geometry import checked_zenith
from pbrdf.conventions import RESULT_VARIABLES, STOKES, detector_bins
from pbrdf.errors import AccuracyWarning, require
from pbrdf.kernels.wave.modes import fill_modes
from pbrdf.optics import library
from pbrdf.optics.fresnel import specular_mueller
from pbrdf.optics.materials import Material
from pbrdf.surface import HeightMap
from pbrdf.wave.directional import smith
from pbrdf.wave.maps.fields import Relief, phase_orders
from pbrdf.wave.specular import mueller_of

__all__ = ["map_scattering"]

Array = np.ndarray

# Forms that need no more than the field on the map
METHODS = ("order-weighted", "kirchhoff")
# Largest error of a phase q h from waves of one ring sharing q [rad]
PHASE_STEP = 0.1
FEWEST_RINGS = 24
# Neighbouring waves of a faded map share light: the error of a mean over that of as many
# independent ones, 1 + 2 (4/9 + 1/36) along each axis
HANN_KINSHIP = 1.0 + 2.0 * (4.0 / 9.0 + 1.0 / 36.0)


def map_scattering(
    height_map: HeightMap,
    material: Material | str,
    theta_i: float,
    *,
    wavelength: float,
    phi_i: float = 0.0,
    n_theta: int = 45,
    n_dphi: int = 90,
    method: str = "order-weighted",
) -> xr.Dataset:
    """Mueller BRDF of one map, wave by wave, averaged over bins.

    Transforms of exp(-iqh), and of its orders divided by their number, for each ring of
    exit angles give the waves that leave the map; each carries its power into a bin of the
    detector.

    Parameters
    ----------
    height_map : HeightMap
        Spacing below half a wavelength. One that is not periodic is faded to its rims.
    material : Material or str
        What is below the surface.
    theta_i, phi_i : float
        Zenith and azimuth of the source. [rad]
    wavelength : float
        Vacuum wavelength. [um]
    n_theta, n_dphi : int
        Bins as in `simulate`.
    method : str
        "order-weighted": order n of the heights has one n-th of the way from tangent plane
        to first order, and Smith's factor of the slopes of the map; "kirchhoff": tangent
        plane without shadowing.

    Returns
    -------
    xarray.Dataset
        `brdf` and `brdf_stderr` [1/sr] (theta_s, dphi, stokes_out, stokes_in) without the
        specular beam, `coherent` for the beam, `waves`, the number that a bin holds. The
        error is the scatter of the speckle in the bin; NaN in bins of fewer than two waves.
        A bin of a map says what this map does: other maps of its kind differ by their
        speckle.

    Notes
    -----
    Single scattering. Heights need not be Gaussian for the tangent plane; the change
    towards first order takes the powers of the heights less their contractions with the rms
    height of the map, as suits smooth maps and Gaussian ones. The beam, `coherent`, is that
    of the mean phase.
    """
    _check_method(method)
    angle = float(checked_zenith("theta_i", theta_i))
    wave = one_positive("wavelength", wavelength)
    substance = material if isinstance(material, Material) else library.get(material)
    n, kappa = substance.index(wave)
    steps = np.broadcast_to(np.asarray(height_map.spacing, dtype=np.float64), (2,))
    if steps.max() >= 0.5 * wave:
        msg = (
            f"spacing must be below half the wavelength, {0.5 * wave:.4g} um, got "
            f"{steps.max():.4g} um. Interpolate the map, or take a longer wavelength."
        )
        raise ValueError(msg)
    _tell_what_is_missing(float(steps.max()), angle, wave)
    heights = np.asarray(height_map.heights, dtype=np.float64)
    relief = Relief(heights, steps, periodic=height_map.periodic)
    k = 2 * np.pi / wave
    travel = np.array([np.cos(phi_i + np.pi), np.sin(phi_i + np.pi)])
    leaving, cosine, turned = _leaving(relief, np.sin(angle), travel, k)
    plane, first = np.empty((2, cosine.size, 4), dtype=np.complex128)
    fill_modes(angle, turned, n, kappa, plane, first)
    weighted = method == "order-weighted"
    whole, parts, mean = _amplitudes(relief, leaving, cosine, np.cos(angle), k, weighted)
    jones = plane * whole[:, None]
    # Efficiency (cos_s/cos_i) |2 cos_i b T/q|^2 with b = jones/(cos_s cos_i)
    factor = 4.0 / (cosine * np.cos(angle))
    if weighted:
        jones += (first - plane) * parts[:, None]
        factor *= _seen(relief.gradients(2 * k), angle, cosine, turned, travel)
    matrices = mueller_of(jones.reshape(-1, 2, 2)) * factor[:, None, None]
    # Each wave stands for (wavelength/side)^2 of projected solid angle
    matrices /= wave**2 / (heights.size * steps[0] * steps[1])
    kinship = 1.0 if height_map.periodic else HANN_KINSHIP
    result = _binned(matrices, turned, cosine, kinship, (n_theta, n_dphi))
    beam = mean * specular_mueller(np.cos(angle), n, kappa)
    result["coherent"] = (("stokes_out", "stokes_in"), beam)
    result.attrs["wave"] = method
    for name in ("brdf", "brdf_stderr", "coherent"):
        entry = RESULT_VARIABLES[name]
        result[name].attrs = {"units": entry.units, "long_name": entry.long_name}
    return result.assign_coords(theta_i=angle, wavelength=wave)


def _tell_what_is_missing(step: float, angle: float, wave: float) -> None:
    """Warn of directions behind the source that need finer steps."""
    reached = 0.5 * wave / step - np.sin(angle)
    if reached < 1.0:
        where = (
            "all" if reached <= 0 else f"beyond {np.rad2deg(np.arcsin(reached)):.3g} deg"
        )
        msg = (
            f"steps of {step:.4g} um leave directions behind the source out ({where}; nan, "
            f"or without part of their light). All need steps below "
            f"{0.5 * wave / (1 + np.sin(angle)):.4g} um: interpolate the map."
        )
        warnings.warn(msg, AccuracyWarning, stacklevel=3)


def one_positive(name: str, value: float) -> float:
    """One positive number."""
    return float(require(name, value, lambda v: v > 0, "be one positive number [um]", ""))


def _check_method(method: str) -> None:
    """Refuse a form that needs statistics."""
    if method not in METHODS:
        msg = (
            f"method must be one of {', '.join(METHODS)} for a map, got {method!r}. The "
            "others need statistics: WaveModel has them."
        )
        raise ValueError(msg)


def _leaving(
    relief: Relief, sine: float, travel: Array, k: float
) -> tuple[Array, Array, Array]:
    """Find the waves that leave: places in a transform, cosines, lateral vectors over k.

    The vectors k_s = k_i + K are (2, N), in the frame of the incident wave.
    """
    grids = [
        2 * np.pi * scipy.fft.fftfreq(count, step) / k
        for count, step in zip(relief.heights.shape, relief.spacing, strict=True)
    ]
    east = grids[0][:, None] + sine * travel[0]
    north = grids[1][None, :] + sine * travel[1]
    cosine2 = 1.0 - east**2 - north**2
    leaving = np.argwhere(cosine2 > 1e-6)
    at = tuple(leaving.T)
    x, y = (np.broadcast_to(part, cosine2.shape)[at] for part in (east, north))
    turned = np.stack([travel[0] * x + travel[1] * y, travel[0] * y - travel[1] * x])
    return leaving, np.sqrt(cosine2[at]), turned


def _amplitudes(
    relief: Relief, leaving: Array, cosine: Array, cos_i: float, k: float, weighted: bool
) -> tuple[Array, Array, float]:
    """Transform the map for every wave that leaves, means taken out.

    The phase exp(-iqh) over q/k, and where `weighted` its orders over their number and q/k;
    third comes the power of the mean phase in the specular beam. Waves go together in rings
    of nearly one q, which so cancels for small heights.
    """
    heights, fade, total = relief.heights, relief.fade, relief.fade.sum()

    def transform(field: Array, rows: Array) -> Array:
        mean = (field * fade).sum() / total
        spectrum = scipy.fft.fft2((field - mean) * fade, workers=1) / heights.size
        return np.asarray(spectrum[tuple(leaving[rows].T)])

    largest = k * np.abs(heights).max()
    rings = max(int(np.ceil(largest / (2 * PHASE_STEP))), FEWEST_RINGS)
    which = np.minimum((cosine * rings).astype(int), rings - 1)
    whole, parts = np.zeros((2, cosine.size), dtype=np.complex128)
    for ring in np.unique(which):
        rows = which == ring
        rise = float(cosine[rows].mean()) + cos_i
        if not weighted:
            whole[rows] = transform(np.exp(-1j * k * rise * heights), rows) / rise
            continue
        field, orders = phase_orders(heights, k * rise, relief.height_rms)
        whole[rows], parts[rows] = (transform(f, rows) / rise for f in (field, orders))
    specular = (np.exp(-2j * k * cos_i * heights) * fade).sum() / total
    return whole, parts, abs(specular) ** 2


def _seen(
    slopes: Array, theta_i: float, cosine: Array, turned: Array, travel: Array
) -> Array:
    """Smith's factor of every wave, with the slopes of the map along its azimuth."""
    theta_s = np.arccos(np.clip(cosine, 0.0, 1.0))
    turn = np.arctan2(turned[1], turned[0])
    azimuth = turn + np.arctan2(travel[1], travel[0])

    def along(angle: Array | float) -> Array:
        x, y = np.cos(angle), np.sin(angle)
        square = slopes[0, 0] * x * x + 2 * slopes[0, 1] * x * y + slopes[1, 1] * y * y
        return np.sqrt(np.maximum(square, 0.0))

    slope_i = along(float(np.arctan2(travel[1], travel[0])))
    full = np.full(theta_s.size, theta_i)
    # The source lies where the light comes from
    return smith(full, theta_s, turn + np.pi, slope_i, along(azimuth))


def _binned(
    matrices: Array,
    lateral: Array,
    cosine: Array,
    kinship: float,
    bins_asked: tuple[int, int],
) -> xr.Dataset:
    """Average the waves of each bin; speckle tells the error, `kinship` times as large."""
    n_theta, n_dphi = bins_asked
    theta_s, dphi, area = detector_bins(n_theta, n_dphi)
    row = np.minimum((np.arccos(cosine) * n_theta / (0.5 * np.pi)).astype(int), n_theta - 1)
    # The source lies where the light comes from
    turn = np.arctan2(lateral[1], lateral[0]) + np.pi
    column = np.rint(turn * n_dphi / (2 * np.pi)).astype(int) % n_dphi
    bins = row * n_dphi + column
    size = n_theta * n_dphi
    count = np.bincount(bins, minlength=size)
    flat = matrices.reshape(-1, 16)
    total = np.stack([np.bincount(bins, v, size) for v in flat.T], axis=-1)
    square = np.stack([np.bincount(bins, v**2, size) for v in flat.T], axis=-1)
    # Waves are even in projected solid angle: their mean is that of the bin, and does not
    # have the noise of how many of the lattice fall into it
    several = np.where(count > 1, count, np.nan)[:, None]
    mean = total / np.where(count > 0, count, np.nan)[:, None]
    spread = np.maximum(square / several - mean**2, 0.0) / (several - 1)
    shape = (n_theta, n_dphi, 4, 4)
    value = mean.reshape(shape)
    error = kinship * np.sqrt(spread.reshape(shape))
    axes = ("theta_s", "dphi", "stokes_out", "stokes_in")
    return xr.Dataset(
        {
            "brdf": (axes, value),
            "brdf_stderr": (axes, error),
            "waves": (axes[:2], count.reshape(shape[:2])),
            "projected_solid_angle": (axes[:2], area),
        },
        {
            "theta_s": theta_s, "dphi": dphi,
            "stokes_out": list(STOKES), "stokes_in": list(STOKES),
        },
    )  # fmt: skip

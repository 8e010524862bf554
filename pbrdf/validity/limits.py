"""The limits of geometric optics, as numbers and in words."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from pbrdf.conventions import RESULT_VARIABLES
from pbrdf.errors import percent
from pbrdf.validity.roughness import FLAT, Roughness

# Share of the light in a coherent beam that geometric optics may miss
MOST_COHERENT = 0.01
# k R cos³θ from which the tangent plane holds: its error is of the order of the inverse.
# At normal incidence a radius of five wavelengths
LEAST_CURVATURE = 10.0 * np.pi
# Below this correlation of slopes from cell to cell, structure goes on below the cells
LEAST_SMOOTH = 0.5
# How far coarse grids change light of one bounce and of three and more, by the cells a
# correlation length [1]: what studies/surface_resolution found, or more
CELLS = (0.5, 1.0, 2.0, 3.0, 4.0, 6.0, 8.0)
OF_ONE = (0.004, 0.002, 0.002, 0.002, 0.0015, 0.001, 0.0005)
OF_THREE = (0.45, 0.28, 0.14, 0.14, 0.13, 0.05, 0.02)
LEAST_CELLS = 5.0
# Short periods change light of one bounce by at most this, times the square of the slope
# over that of the study and over the square of the correlation lengths a period
OF_PERIOD, SLOPE = 0.08, 0.3
# Change of M00 in the lobe that needs no word
LEAST_CHANGE = 0.002


@dataclass(frozen=True, kw_only=True)
class Judgement:
    """Numbers by the names of `RESULT_VARIABLES`, and what they mean in sentences.

    `notes` are warnings; `remarks` belong into the result but are no fault of it.
    """

    numbers: Mapping[str, np.ndarray] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()


def judge(
    rough: Roughness, theta_i: np.ndarray, wavelength: np.ndarray | float
) -> Judgement:
    """Judge a surface under light of zenith angles [rad] and wavelengths [um].

    - `coherent_share`: light that stays in a specular beam, |<exp(2 i k h cosθ)>|²
      (Davies 1954), which geometric optics spreads over the lobe.
    - `curvature_number`: k R cos³θ with the typical radius of curvature R over half a
      wavelength; the tangent plane errs by the order of its inverse (Brekhovskikh 1952).
    - `corr_length_in_waves`, `cell_in_waves`: lengths over the wavelength; roughness
      shorter than the wavelength diffracts.

    Examples
    --------
    >>> from pbrdf.validity.roughness import gaussian_roughness
    >>> found = judge(gaussian_roughness(2.8, 0.2), np.array([0.3, 1.2]), np.array([0.55]))
    >>> found.numbers["curvature_number"].round(0)
    array([[427.],
           [ 23.]])
    >>> print(*found.notes)
    The tangent plane errs by about 4.3 % at theta_i 68.75 deg and 0.55 um: k R cos³ \
theta_i is 23 with a typical radius of curvature R of 42.9 um, and should be above 31.
    """
    theta = np.atleast_1d(np.asarray(theta_i, dtype=np.float64))
    waves = np.atleast_1d(np.asarray(wavelength, dtype=np.float64))
    # Bodies without ground look into all directions, whatever theta_i is
    cosine = np.ones((theta.size, 1)) if rough.bodies else np.cos(theta)[:, None]
    radius = rough.curvature_radius(waves / 2)
    with np.errstate(over="ignore", invalid="ignore"):
        curvature = 2 * np.pi * radius / waves * cosine**3
    share = rough.coherent_share(4 * np.pi * cosine / waves)
    shortest = rough.corr_length / waves
    cell = rough.cell / waves
    numbers = {
        "coherent_share": share,
        "curvature_number": curvature,
        "corr_length_in_waves": shortest,
        "cell_in_waves": cell,
    }
    if rough.slope_rms <= FLAT:
        return Judgement(numbers=numbers)

    notes = _of_beam(rough, share, theta, waves)
    if curvature.min() < LEAST_CURVATURE:
        a, w = np.unravel_index(np.argmin(curvature), curvature.shape)
        size = 100 / curvature[a, w]
        by = f"by about {size:.2g} %" if size < 100 else "by as much as the light itself"
        notes.append(
            f"The tangent plane errs {by} at {_place(theta[a], waves[w])}: k R cos³ "
            f"theta_i is {curvature[a, w]:.2g} with a typical radius of curvature R of "
            f"{radius[w]:.3g} um, and should be above {LEAST_CURVATURE:.2g}"
            f"{_others(curvature < LEAST_CURVATURE)}."
        )
    if shortest.min() < 1.0:
        what = "width of features" if rough.facets else "correlation length"
        notes.append(
            f"The {what}, {rough.corr_length:.3g} um, is below the wavelength, "
            f"{waves[np.argmin(shortest)]:g} um: such roughness diffracts"
            f"{_others(shortest < 1.0)}."
        )
    remarks: list[str] = []
    if not rough.generated and rough.smooth < LEAST_SMOOTH and cell.max() > 0.5:
        said = remarks if rough.facets else notes
        said.append(_between_nodes(rough, waves[np.argmax(cell)]))
    return Judgement(numbers=numbers, notes=tuple(notes), remarks=tuple(remarks))


def _of_beam(
    rough: Roughness, share: np.ndarray, theta: np.ndarray, waves: np.ndarray
) -> list[str]:
    """Say where more or less light stays in a beam than flat parts mirror in the tracer.

    `share` (angles, wavelengths) is what stays in a beam. [1]
    """
    notes = []
    missed = share - rough.flat
    # Those at other heights take from the beam what they cannot add in phase, and send it
    # into the angles of their own diffraction, which wide ones keep in the beam's bin
    spread = waves / (2 * np.pi * rough.corr_length)
    taken = np.where(spread > 1 / LEAST_CURVATURE, -missed, 0.0)
    if taken.max() > MOST_COHERENT:
        a, w = np.unravel_index(np.argmax(taken), taken.shape)
        notes.append(
            f"{percent(rough.flat)} of the surface is flat and is traced as a mirror, "
            "but its parts lie at different heights and interfere: "
            f"{percent(share[a, w])} of the light stays in the specular beam at "
            f"{_place(theta[a], waves[w])}, the rest spreads by about "
            f"{np.rad2deg(spread[w]):.2g} deg"
            f"{_others(taken > MOST_COHERENT)}."
        )
    if missed.max() > MOST_COHERENT:
        a, w = np.unravel_index(np.argmax(missed), missed.shape)
        notes.append(
            f"{percent(missed[a, w])} of the light stays in a coherent specular beam at "
            f"{_place(theta[a], waves[w])} (rms height {rough.height_rms:.3g} um), which "
            "geometric optics spreads over the lobe"
            f"{_others(missed > MOST_COHERENT)}."
        )
    return notes


def _between_nodes(rough: Roughness, wave: float) -> str:
    """Say that facets or cells are wide beside the wavelength [um], and not smooth."""
    if rough.facets:
        return (
            f"Facets of {rough.cell:.3g} um are wider than half the wavelength, and "
            f"normals change from one to the next (correlation {rough.smooth:.2g}): they "
            "are traced as flat faces. Refine the mesh if they stand for a smooth surface."
        )
    return (
        f"Cells of {rough.cell:.3g} um are wider than half the wavelength, "
        f"{wave:g} um, and slopes change from cell to cell "
        f"(correlation {rough.smooth:.2g}): roughness between them, which the map does "
        "not hold, scatters too. Measure with smaller pixels."
    )


def resolution_warnings(rough: Roughness) -> list[str]:
    """Say how far the grid and the period of a random surface change its reflectance.

    Sizes are those of slopes of 0.3 at 60 degrees (studies/surface_resolution).

    Examples
    --------
    >>> from pbrdf.surface import GaussianSurface
    >>> from pbrdf.validity.roughness import roughness_of
    >>> coarse = GaussianSurface(shape=(64, 64), spacing=1.0, corr_length=1, slope_rms=0.3)
    >>> print(*resolution_warnings(roughness_of(coarse)))
    1 cells a correlation length are too few: light of one bounce changes by up to 0.2 %, \
of three and more by up to 28 %. Take at least 5, a spacing of corr_length / 5 or less.
    """
    notes = []
    if rough.cells < LEAST_CELLS:
        one, three = (100 * np.interp(rough.cells, CELLS, by) for by in (OF_ONE, OF_THREE))
        notes.append(
            f"{rough.cells:.3g} cells a correlation length are too few: light of one "
            f"bounce changes by up to {one:.2g} %, of three and more by up to {three:.2g} "
            f"%. Take at least {LEAST_CELLS:g}, a spacing of corr_length / "
            f"{LEAST_CELLS:g} or less."
        )
    size = OF_PERIOD * (rough.slope_rms / SLOPE / rough.lengths) ** 2
    if size > LEAST_CHANGE:
        least = rough.lengths * np.sqrt(size / LEAST_CHANGE)
        notes.append(
            f"A period of {rough.lengths:.3g} correlation lengths is too short: light of "
            f"one bounce changes by up to {percent(size)}. Take shape times spacing of "
            f"{least:.2g} corr_length or more, better 16."
        )
    return notes


def variables(
    numbers: Mapping[str, np.ndarray], *, spectral: bool, axis: str = "theta_i"
) -> dict[str, tuple[tuple[str, ...], np.ndarray, dict[str, str]]]:
    """Dimensions, values and attributes of numbers of a judgement, for a result.

    `axis` is the dimension of the result along which theta_i runs; without `spectral` it
    has none of the wavelength.
    """
    found = {}
    for name, values in numbers.items():
        entry = RESULT_VARIABLES[name]
        dims = tuple(axis if dim == "theta_i" else dim for dim in entry.dims)
        if "wavelength" in dims and not spectral:
            values = np.squeeze(values, dims.index("wavelength"))
            dims = tuple(dim for dim in dims if dim != "wavelength")
        found[name] = (dims, values, entry.about)
    return found


def _place(theta: float, wave: float) -> str:
    """Say where the worst is."""
    return f"theta_i {np.rad2deg(theta):.4g} deg and {wave:g} um"


def _others(broken: np.ndarray) -> str:
    """Say how many others break a limit too."""
    count = int(broken.sum())
    return "" if count < 2 else f"; the worst of {count} of {broken.size} such cases"

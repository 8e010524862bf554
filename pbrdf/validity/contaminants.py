"""Limits of geometric optics for drops, spheres and films."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from pbrdf.errors import percent, require
from pbrdf.optics.materials import Material
from pbrdf.validity.limits import Judgement

# Size parameter 2 π R / λ from which reflection and refraction hold to 1 %
LEAST_SIZE_PARAMETER = 400.0
# Bandwidth of a filter radiometer, where nothing is known of the detector [um]
BANDWIDTH = 0.01
# What contaminants consist of, and what bounds light, where nothing is given
WATER, AIR, MIRROR = Material(4.0 / 3.0), Material(1.0), Material.mirror()
# Powers add up in a film that hardly absorbs or lets nothing through; between the two the
# waves in it overlap, and the sum of powers departs from their field
ABSORBS, DEEP_ENOUGH = 0.05, 1.0
# Change of a film's reflectance by interference that needs no word
LEAST_FRINGE = 0.01


def judge_contaminants(
    reports: Sequence[Mapping[str, Any]],
    wavelength: np.ndarray | float,
    materials: Sequence[Material] | None = None,
    grounds: Sequence[Material] = (MIRROR,),
    bandwidth: float = BANDWIDTH,
) -> Judgement:
    """Judge what lies on a surface at wavelengths [um].

    Parameters
    ----------
    reports : sequence of mappings
        What contaminants became, from `pbrdf.contaminants.bodies.place`.
    wavelength : array_like
        Of the light. [um]
    materials : sequence of Material, optional
        Of each contaminant; clear water if not given.
    grounds : sequence of Material
        What a film lies on; the worst counts.
    bandwidth : float
        Of the light; films are coherent within its coherence length λ²/Δλ. [um]

    Notes
    -----
    A drop or sphere needs a size parameter 2πR/λ of about 400 for 1 % in reflection and
    refraction, more for rainbows: `size_parameter` is the smallest. A film interferes below
    three coherence lengths of 2 n d, if light comes back from under it: `film_field` is the
    field that does, exp(-4πκd/λ) times the reflection of film on ground, and 0 in a
    film thick enough. The waves of both sides change the film's reflectance at normal
    incidence by at most 2ab/(a² + b²), if they are a and b; the warning names that.
    """
    waves = np.atleast_1d(
        require(
            "wavelength", wavelength, lambda v: (v > 0) & np.isfinite(v),
            "be positive [um]", "Wavelengths are micrometres.",
        )
    )  # fmt: skip
    numbers: dict[str, np.ndarray] = {}
    notes = []
    for number, report in enumerate(reports):
        radius, thickness = report.get("curvature_radius"), report.get("thickness")
        if radius is not None:
            size = 2 * np.pi * radius / waves
            numbers["size_parameter"] = np.fmin(numbers.get("size_parameter", size), size)
            if size.min() < LEAST_SIZE_PARAMETER:
                notes.append(
                    f"The median radius of curvature of {report['kind']}, {radius:.3g} um, "
                    f"has a size parameter of {size.min():.3g} at "
                    f"{waves[np.argmin(size)]:g} um; geometric optics holds to 1 % above "
                    f"{LEAST_SIZE_PARAMETER:g}, and rainbows need more."
                )
        if thickness is not None:
            film = WATER if materials is None else materials[number]
            field, note = _of_film(film, grounds, thickness, waves, bandwidth)
            numbers["film_field"] = np.fmax(numbers.get("film_field", field), field)
            notes += note
    return Judgement(numbers=numbers, notes=tuple(notes))


def _of_film(
    film: Material,
    grounds: Sequence[Material],
    thickness: float,
    waves: np.ndarray,
    bandwidth: float,
) -> tuple[np.ndarray, list[str]]:
    """Field from under a film that interferes [1], and what to say of it."""
    n, kappa = (np.broadcast_to(one, waves.shape) for one in film.indices(waves))
    least = 3 * waves**2 / (2 * np.minimum(n, 1e3) * bandwidth)
    depth = 4 * np.pi * kappa * thickness / waves
    under = np.max([_reflection(film, ground, waves) for ground in grounds], axis=0)
    # Nothing comes back through a mirror or through what absorbs all
    thin = (thickness < least) & np.isfinite(n) & (not film.absorbs_all)
    field = np.where(thin, under * np.exp(-depth), 0.0)
    top = _reflection(AIR, film, waves)
    back = (1.0 - top**2) * field
    fringe = 2 * top * back / np.maximum(top**2 + back**2, 1e-300)
    # Thin absorbers have a warning of their own, with the wave solution beside
    fringe[(kappa > ABSORBS) & (depth < DEEP_ENOUGH)] = 0.0
    if fringe.max() <= LEAST_FRINGE:
        return field, []
    w = int(np.argmax(fringe))
    return field, [
        f"A film of {thickness:.3g} um is thinner than {least[w]:.2g} um, three coherence "
        f"lengths at {waves[w]:g} um and a bandwidth of {bandwidth:g} um: it interferes, "
        "which geometric optics does not know; its reflectance changes by up to "
        f"{percent(fringe[w])} at normal incidence."
    ]


def _reflection(one: Material, other: Material, waves: np.ndarray) -> np.ndarray:
    """Amount of the amplitude reflected between two media at normal incidence. [1]"""
    if one.absorbs_all or other.absorbs_all:
        return np.zeros(waves.shape)
    (n, kappa), (n_other, kappa_other) = one.indices(waves), other.indices(waves)
    if np.isinf(n).any() or np.isinf(n_other).any():
        return np.ones(waves.shape)
    here, there = n + 1j * kappa, n_other + 1j * kappa_other
    amount: np.ndarray = np.abs((here - there) / (here + there))
    return np.broadcast_to(amount, waves.shape)


def contamination_warnings(
    reports: Sequence[Mapping[str, Any]], wavelength: float, bandwidth: float = BANDWIDTH
) -> list[str]:
    """Say which limits drops, spheres and films of clear water break.

    Examples
    --------
    >>> print(*contamination_warnings([{"kind": "film", "thickness": 10.0}], 0.55))
    A film of 10 um is thinner than 34 um, three coherence lengths at 0.55 um and a \
bandwidth of 0.01 um: it interferes, which geometric optics does not know; its \
reflectance changes by up to 29 % at normal incidence.
    """
    return list(judge_contaminants(reports, wavelength, bandwidth=bandwidth).notes)

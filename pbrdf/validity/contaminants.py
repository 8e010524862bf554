"""Limits of geometric optics for drops, spheres and films."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from pbrdf.errors import require
from pbrdf.validity.limits import Judgement

# Size parameter 2 π R / λ from which reflection and refraction hold to 1 %
LEAST_SIZE_PARAMETER = 400.0
# Bandwidth of a filter radiometer, where nothing is known of the detector [um]
BANDWIDTH = 0.01
# Index of the film where none is given, that of water [1]
WATER = 4.0 / 3.0
# Powers add up in a film that hardly absorbs or lets nothing through; between the two the
# waves in it overlap, and the sum of powers departs from their field
ABSORBS, DEEP_ENOUGH = 0.05, 1.0
# Field from under a film, as a share of what entered, that interferes visibly
LEAST_FIELD = 0.01


def judge_contaminants(
    reports: Sequence[Mapping[str, Any]],
    wavelength: np.ndarray | float,
    indices: Sequence[tuple[np.ndarray, np.ndarray]] | None = None,
    bandwidth: float = BANDWIDTH,
) -> Judgement:
    """Judge what lies on a surface at wavelengths [um].

    Parameters
    ----------
    reports : sequence of mappings
        What contaminants became, from `pbrdf.contaminants.bodies.place`.
    wavelength : array_like
        Of the light. [um]
    indices : sequence of (n, kappa), optional
        Of each contaminant at the wavelengths; clear water if not given. [1]
    bandwidth : float
        Of the light; films are coherent within its coherence length λ²/Δλ. [um]

    Notes
    -----
    A drop or sphere needs a size parameter 2πR/λ of about 400 for 1 % in reflection and
    refraction, more for rainbows: `size_parameter` is the smallest. A film interferes below
    three coherence lengths of 2 n d, if light comes back from under it: `film_field` is the
    field that does, exp(-4πκd/λ), and 0 in a film thick enough.
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
        n, kappa = np.full(waves.shape, WATER), np.zeros(waves.shape)
        if indices is not None:
            n, kappa = (np.broadcast_to(one, waves.shape) for one in indices[number])
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
            least = 3 * waves**2 / (2 * np.minimum(n, 1e3) * bandwidth)
            field = np.exp(-4 * np.pi * kappa * thickness / waves)
            # Nothing comes back through a mirror
            field = np.where((thickness < least) & np.isfinite(n), field, 0.0)
            numbers["film_field"] = np.fmax(numbers.get("film_field", field), field)
            # Thin absorbers have a warning of their own, with the wave solution beside
            depth = 4 * np.pi * kappa * thickness / waves
            told = (kappa > ABSORBS) & (depth < DEEP_ENOUGH)
            rest = np.where(told, 0.0, field)
            if rest.max() > LEAST_FIELD:
                w = int(np.argmax(rest))
                notes.append(
                    f"A film of {thickness:.3g} um is thinner than {least[w]:.2g} um, "
                    f"three coherence lengths at {waves[w]:g} um and a bandwidth of "
                    f"{bandwidth:g} um: it interferes, which geometric optics does not "
                    "know."
                )
    return Judgement(numbers=numbers, notes=tuple(notes))


def contamination_warnings(
    reports: Sequence[Mapping[str, Any]], wavelength: float, bandwidth: float = BANDWIDTH
) -> list[str]:
    """Say which limits drops, spheres and films of clear water break.

    Examples
    --------
    >>> print(*contamination_warnings([{"kind": "film", "thickness": 10.0}], 0.55))
    A film of 10 um is thinner than 34 um, three coherence lengths at 0.55 um and a \
bandwidth of 0.01 um: it interferes, which geometric optics does not know.
    """
    return list(judge_contaminants(reports, wavelength, bandwidth=bandwidth).notes)

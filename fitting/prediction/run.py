"""From a map to a prediction: mend, find the patches, and spread what is not known."""

import warnings
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fitting.prediction.facets import Facets, facets_of, slope_table
from fitting.prediction.prediction import Draw, Prediction
from fitting.statistics.mended import mended_once
from pbrdf import HeightMap, Material, MicrofacetModel
from pbrdf.errors import one_number
from pbrdf.optics import library

__all__ = ["predict"]

# Standard deviations of the priors. Of the criterion for a patch, of order 1, in its
# logarithm: sizes move by about 0.65 of it
_CRITERION = 0.5
# Slopes of two maps of one coating at different places differ by 12 and 31 %
_PLACE = 0.15
# The best facet model of a real coating is 9 to 17 % off
_MODEL = 0.15
# Of the index of a dielectric that was not measured
_INDEX = 0.1
# Largest Lambertian albedo of a base that is not given: black coatings
_BASE = 0.05
_DRAWS = 24
_WITHIN = 32
# Nodes of the slope tables of the draws
_NODES = 71


def predict(
    surface: HeightMap,
    material: Material | str,
    *,
    wavelength: float,
    resolution: float = 0.0,
    index_stderr: float | None = None,
    place: float = _PLACE,
    base_albedo: float | None = None,
    seed: int = 0,
) -> Prediction:
    """Predict the Mueller BRDF of a surface from its height map; nothing is fitted.

    Terraces and other faults of the map are mended first. The slopes are those of patches
    that diffract as much as they hide, each place with its own
    (`fitting.prediction.facets`), with no parameter of the coating. Light mirrored once and
    twice is counted; of the base under the interface, only what the material states.

    Parameters
    ----------
    surface : HeightMap
        As measured. [um]
    material : Material or str
        Index of the facets.
    wavelength : float
        In vacuum. [um]
    resolution : float
        Standard deviation of the instrument's point spread, about 0.21 of its wavelength
        over its numerical aperture. The map is not smoothed again by what it is smoothed
        already. [um]
    index_stderr : float, optional
        Standard error of n; by default 0.1 for a dielectric, 0 for what absorbs.
    place : float
        Relative standard deviation of the slope between the place of the map and that of
        the scan.
    base_albedo : float, optional
        Largest Lambertian albedo that the interval allows for; by default 0.05 where the
        material states no base, as of black paint, else 0.
    seed : int
        Of the draws.

    Returns
    -------
    Prediction

    Raises
    ------
    ValueError
        If the map is too small, or a number out of range.

    Examples
    --------
    >>> from pbrdf import GaussianSurface
    >>> ground = GaussianSurface(shape=(128, 128), spacing=1.0, corr_length=8.0,
    ...                          slope_rms=0.2).sample(seed=1)
    >>> found = predict(ground, Material(1.5), wavelength=0.65)
    >>> low, high = found.interval(0.5, 0.5, np.pi)
    >>> bool(low < found.brdf(0.5, 0.5, np.pi)[0, 0] < high)
    True
    """
    if not isinstance(surface, HeightMap):
        msg = (
            f"surface must be a HeightMap, got {type(surface).__name__}. A profile tells "
            "slopes along one axis only."
        )
        raise TypeError(msg)
    one_number(
        "wavelength", wavelength, lambda v: (v > 0) & np.isfinite(v), "be positive [um]",
        "Wavelengths are micrometres.",
    )  # fmt: skip
    given = {"resolution": resolution, "place": place, "index_stderr": index_stderr or 0.0}
    given["base_albedo"] = base_albedo or 0.0
    for name, value in given.items():
        one_number(name, value, lambda v: (v >= 0) & np.isfinite(v), "be >= 0", "")
    material = library.get(material) if isinstance(material, str) else material
    n, kappa = material.index(wavelength)
    optics = material if not material.dispersive else replace(material, n=n, kappa=kappa)
    bare = not material.has_base
    if index_stderr is None:
        index_stderr = _INDEX if kappa == 0 and np.isfinite(n) else 0.0
    if base_albedo is None:
        base_albedo = _BASE if bare and np.isfinite(n) else 0.0
    mended = mended_once(surface)
    facets = facets_of(mended, wavelength, resolution=resolution)
    patch = facets.patch
    notes = [
        f"patches of {patch:.3g} um (median standard deviation) diffract by a slope of "
        f"{facets.blur:.3g}; slope rms {facets.slope_rms:.3g}",
        f"the interval holds: criterion within a factor {np.exp(_CRITERION):.2g}, slope "
        f"{place:.0%} between places, n +- {index_stderr:g}, facet model {_MODEL:.0%}, "
        f"Lambertian base 0 to {base_albedo:g}",
    ]
    if resolution > patch:
        text = (
            f"resolution {resolution:.3g} um hides slopes that light at {wavelength:g} um "
            f"sees, on patches of {patch:.3g} um: the predicted lobe is too narrow"
        )
        warnings.warn(text, UserWarning, stacklevel=2)
        notes.append(text)
    # Three sizes of patches carry the prior; slopes are scaled within them
    sizes = [
        facets_of(
            mended, wavelength, criterion=np.exp(_CRITERION * z), resolution=resolution
        )
        for z in np.sqrt(1.5) * np.array([-1.0, 0.0, 1.0])
    ]
    draws = _ensemble(
        sizes, optics, seed, place=place, index_stderr=index_stderr, base_albedo=base_albedo
    )
    return Prediction(
        model=_model(facets, optics), wavelength=float(wavelength), facets=facets,
        draws=draws, notes=tuple(notes),
    )  # fmt: skip


def _ensemble(
    sizes: Sequence[Facets], optics: Material, seed: int, *, place: float,
    index_stderr: float, base_albedo: float,
) -> tuple[Draw, ...]:  # fmt: skip
    """Draw models from all that is not known, over each size of patches in turn."""
    rng = np.random.default_rng(seed)
    draws = []
    for i in range(_DRAWS):
        scale = float(np.exp(place * rng.standard_normal()))
        shift = float(index_stderr * rng.standard_normal())
        draws.append(
            Draw(
                model=_model(
                    sizes[i % 3], _shifted(optics, shift), scale=scale, nodes=_NODES
                ),
                gain=np.exp(_MODEL * rng.standard_normal(_WITHIN)),
                base=base_albedo * rng.random(_WITHIN),
            )
        )
    return tuple(draws)


def _model(
    facets: Facets, material: Material, *, scale: float = 1.0, nodes: int = 161
) -> MicrofacetModel:
    table = slope_table(facets, scale=scale, nodes=nodes)
    return MicrofacetModel(material, slope_distribution=table)


def _shifted(material: Material, shift: float) -> Material:
    """Return the material with another n, no nearer to vacuum than 1.01."""
    if shift == 0:
        return material
    n, _ = material.index()
    return replace(material, n=max(n + shift, min(n, 1.01)))

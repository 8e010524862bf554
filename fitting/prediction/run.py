"""From a map to a prediction: mend, find the patches, and spread what is not known."""

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from fitting.prediction.density import slope_table
from fitting.prediction.doubts import place_error, what_is_open
from fitting.prediction.facets import Facets, facets_of
from fitting.prediction.instrument import Instrument, widest_spread
from fitting.prediction.prediction import Draw, Prediction
from fitting.prediction.steep import bridged
from fitting.prediction.waves import density_of, is_smooth, smooth_notes, wave_model
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
# Slopes over bridged holes; of rendered interferograms they are 10 to 20 % too flat
_BRIDGE = 0.2
# Exponent of the variance of slopes within a distance: none hidden, to those of a hill
_EXPONENT = (0.0, 2.0)
_DRAWS = 24
_WITHIN = 32
# Nodes of the slope tables of the draws
_NODES = 71


def predict(  # noqa: PLR0913  (the public signature)
    surface: HeightMap,
    material: Material | str,
    *,
    wavelength: float,
    instrument: Instrument | None = None,
    resolution: float = 0.0,
    index_stderr: float | None = None,
    place: float = _PLACE,
    base_albedo: float | None = None,
    seed: int = 0,
    wave: bool | None = None,
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
    instrument : Instrument, optional
        That measured the map. Facets too steep for its aperture are taken out and bridged
        from their rims, and its spread is the resolution.
    resolution : float
        Instead of an instrument, the standard deviation of its point spread. The map is
        not smoothed again by what it is smoothed already, and slopes between patch and
        resolution are added. 0 stands for a sharp map, or one of an unknown instrument.
        [um]
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
    wave : bool, optional
        Whether waves scatter at the spectral density of the map, or facets mirror; by
        default waves where 1 % or more of the specular beam remains at normal incidence.

    Returns
    -------
    Prediction

    Raises
    ------
    ValueError
        If the map is too small, a number out of range, or half of the map too steep for
        the instrument.

    Warns
    -----
    UserWarning
        Of what the map leaves open, with its size: an instrument that is not known,
        slopes that it hid, holes, an area small beside the structure.

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
    _check(
        surface, instrument, wavelength, resolution=resolution, place=place,
        index_stderr=index_stderr or 0.0, base_albedo=base_albedo or 0.0,
    )  # fmt: skip
    material = library.get(material) if isinstance(material, str) else material
    n, kappa = material.index(wavelength)
    optics = material if not material.dispersive else replace(material, n=n, kappa=kappa)
    bare = not material.has_base
    if index_stderr is None:
        index_stderr = _INDEX if kappa == 0 and np.isfinite(n) else 0.0
    if base_albedo is None:
        base_albedo = _BASE if bare and np.isfinite(n) else 0.0
    if instrument is None:
        mended, lost = mended_once(surface), None
    else:
        seen = bridged(surface, instrument)
        mended, lost = seen.surface, seen.lost
        resolution = instrument.spread(max(surface.spacing))
    facets = facets_of(mended, wavelength, resolution=resolution, lost=lost)
    own = place_error(mended)
    if is_smooth(mended, wavelength) if wave is None else wave:
        return _by_waves(
            mended, optics, facets, seed, wavelength=float(wavelength),
            resolution=resolution, place=max(place, own), index_stderr=index_stderr,
            base_albedo=base_albedo,
        )  # fmt: skip
    # A periodic map was made, and seen by no instrument
    unknown = resolution == 0 and not surface.periodic
    blurred = widest_spread(max(surface.spacing)) if unknown else resolution
    # Three sizes of patches carry the prior, one of them the doubt of the instrument;
    # slopes are scaled within them
    sizes = [
        facets_of(
            mended, wavelength, criterion=np.exp(_CRITERION * z), lost=lost,
            resolution=resolution if z else blurred,
        )
        for z in np.sqrt(1.5) * np.array([-1.0, 0.0, 1.0])
    ]  # fmt: skip
    notes = [*_assumed(facets, max(place, own), index_stderr, base_albedo)]
    for text in what_is_open(
        mended, facets, own=own, lost=0.0 if lost is None else float(lost.mean()),
        blurred=sizes[1] if unknown else None,
    ):  # fmt: skip
        warnings.warn(text, UserWarning, stacklevel=2)
        notes.append(text)
    draws = _ensemble(
        sizes, optics, seed, place=max(place, own), index_stderr=index_stderr,
        base_albedo=base_albedo,
    )  # fmt: skip
    return Prediction(
        model=_model(facets, optics), wavelength=float(wavelength), facets=facets,
        draws=draws, notes=tuple(notes),
    )  # fmt: skip


def _by_waves(
    surface: HeightMap, optics: Material, facets: Facets, seed: int, **known: float
) -> Prediction:
    """Predict a smooth map: waves at its spectral density."""
    wavelength, resolution = known["wavelength"], known["resolution"]
    place, index_stderr = known["place"], known["index_stderr"]
    base_albedo = known["base_albedo"]
    density = density_of(surface, resolution)
    model = wave_model(density, optics)
    notes = [*smooth_notes(surface, model, wavelength, resolution)]
    for text in notes[1:]:
        warnings.warn(text, UserWarning, stacklevel=3)
    notes.append(
        f"the interval holds: heights {place:.0%} between places, n +- {index_stderr:g}, "
        f"model {_MODEL:.0%}, Lambertian base 0 to {base_albedo:g}"
    )
    rng = np.random.default_rng(seed)
    draws = tuple(
        Draw(
            model=wave_model(
                density, _shifted(optics, float(index_stderr * rng.standard_normal())),
                scale=float(np.exp(place * rng.standard_normal())),
            ),
            gain=np.exp(_MODEL * rng.standard_normal(_WITHIN)),
            base=base_albedo * rng.random(_WITHIN),
        )
        for _ in range(_DRAWS)
    )  # fmt: skip
    return Prediction(
        model=model, wavelength=wavelength, facets=facets, draws=draws, notes=tuple(notes),
    )  # fmt: skip


def _check(
    surface: HeightMap, instrument: Instrument | None, wavelength: float, **given: float
) -> None:
    """Refuse what is no map, numbers out of range, and a resolution given twice."""
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
    for name, value in given.items():
        one_number(name, value, lambda v: (v >= 0) & np.isfinite(v), "be >= 0", "")
    if instrument is not None and given["resolution"] > 0:
        msg = (
            f"resolution must be 0 beside an instrument, which has its own, got "
            f"{given['resolution']:g}. Give one of them."
        )
        raise ValueError(msg)


def _assumed(
    facets: Facets, place: float, index_stderr: float, base_albedo: float
) -> Iterator[str]:
    """Yield what was found and what the interval holds."""
    yield (
        f"patches of {facets.patch:.3g} um (median standard deviation) blur by a slope of "
        f"{facets.blur:.3g}, of which {facets.hidden:.2g} that the instrument hid; slope "
        f"rms {facets.slope_rms:.3g}"
    )
    yield (
        f"the interval holds: criterion within a factor {np.exp(_CRITERION):.2g}, slope "
        f"{place:.0%} between places, hidden slopes by an exponent of 0 to 2, bridged "
        f"slopes {_BRIDGE:.0%}, n +- {index_stderr:g}, facet model {_MODEL:.0%}, "
        f"Lambertian base 0 to {base_albedo:g}"
    )


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
        facets = replace(
            sizes[i % 3].stretched(float(np.exp(_BRIDGE * rng.standard_normal()))),
            exponent=rng.uniform(*_EXPONENT),
        )
        draws.append(
            Draw(
                model=_model(facets, _shifted(optics, shift), scale=scale, nodes=_NODES),
                gain=np.exp(_MODEL * rng.standard_normal(_WITHIN)),
                base=base_albedo * rng.random(_WITHIN),
            )
        )
    return tuple(draws)


def _model(
    facets: Facets, material: Material, *, scale: float = 1.0, nodes: int | None = None
) -> MicrofacetModel:
    table = slope_table(facets, scale=scale, nodes=nodes)
    return MicrofacetModel(material, slope_distribution=table)


def _shifted(material: Material, shift: float) -> Material:
    """Return the material with another n, no nearer to vacuum than 1.01."""
    if shift == 0:
        return material
    n, _ = material.index()
    return replace(material, n=max(n + shift, min(n, 1.01)))

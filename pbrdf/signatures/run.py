"""Stokes radiance at a sensor: sun, sky and own warmth, put together."""

import warnings
from collections.abc import Mapping, Sequence
from itertools import product
from math import pi
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from pbrdf._version import __version__
from pbrdf.conventions import STOKES
from pbrdf.errors import AccuracyWarning, require
from pbrdf.signatures.function_surface import BLACK, FunctionSurface
from pbrdf.signatures.planck import (
    black_body,
    checked_temperature,
    spectral,
    tell_cold,
)
from pbrdf.signatures.result_surface import ResultSurface, SunlitResult
from pbrdf.signatures.results import Result
from pbrdf.signatures.skies import Sky
from pbrdf.signatures.sun import Sun

__all__ = ["signature"]

# From the far ultraviolet to the far infrared; beyond, another unit was meant [um]
SHORTEST, LONGEST = 0.1, 100.0
# Part of the direct light that may be in the sky too
MOST_TWICE = 0.01
ABSOLUTE, RELATIVE = "W m-2 sr-1 um-1", "sr-1"
LONG_NAMES = {
    "radiance": "Stokes radiance at the sensor",
    "reflected_sun": "sunlight off the surface",
    "reflected_sky": "light of the sky off the surface",
    "emitted": "light emitted by the surface",
    "emissivity": "Stokes emissivity",
}


def signature(  # noqa: PLR0913  (the public signature)
    source: Any,
    theta_s: npt.ArrayLike,
    *,
    phi_s: npt.ArrayLike = 0.0,
    wavelength: npt.ArrayLike | None = None,
    sun: Sun | None = None,
    sky: Sky | Sequence[Sky] | None = None,
    temperature: float | None = None,
    rel_error: float = 1e-6,
    simulation: Mapping[str, Any] | None = None,
) -> xr.Dataset:
    """Stokes radiance of a surface at a sensor under sun and sky and by its own warmth.

    Parameters
    ----------
    source : Scene, xarray.Dataset or with a method brdf(theta_i, theta_s, dphi...)
        A `MicrofacetModel`, a `WaveModel` (with its specular beam), a `SmoothSurface`, any
        other such object, a result of `simulate` with all Stokes elements, or a scene,
        which is then simulated with `simulation`. Sky and emission of a result are known,
        by reciprocity, for sensors at its incident zeniths; sunlight alone also for a sun
        there.
    theta_s, phi_s : array_like, shape () or (angles,)
        Zeniths and azimuths of the direction to the sensor; every pair of them. [rad]
    wavelength : array_like, shape () or (wavelengths,), optional
        Those of the dataset if not given. [um]
    sun : Sun, optional
        Direct sunlight.
    sky : ClearSky, RayleighSky, OvercastSky, ThermalSky, SkyTable, or several
        Light of the sky, or another object with stokes(theta, phi, wavelength); that of
        several is added.
    temperature : float, optional
        Of the surface, which then emits by Kirchhoff's law; what is transmitted into the
        substrate counts as absorbed there, at this temperature. [K]
    rel_error : float
        Error of integrals over the sky for sources that are functions.
    simulation : mapping, optional
        Arguments of `simulate` for a scene: n_rays, realizations, seed, ...; phi_i is
        "uniform" unless given.

    Returns
    -------
    xarray.Dataset
        radiance (wavelength, theta_s, phi_s, stokes), its parts reflected_sun,
        reflected_sky and emitted where asked for, and the emissivity, each with its
        `*_stderr`: the standard error of a simulation, or the error of the quadrature.
        Q > 0 is horizontal, U > 0 half way from right to up, V > 0 right-circular, all as
        the sensor sees it with up towards the zenith; see `image_axes`. In W m-2 sr-1 um-1,
        or in sr-1 where the sun's irradiance is 1.

    Raises
    ------
    ValueError
        If there is no light, a sensor's zenith was not simulated, or relative and absolute
        sources are mixed.

    Warns
    -----
    AccuracyWarning
        If a result has lost light, which would count as emitted, or was traced at another
        azimuth; if the surface is colder than 100 K; if the sun is dimmed less than its
        clear sky scatters away; if a wavelength lies beyond 0.1 to
        100 um, as one in nanometres does.

    Examples
    --------
    A white plate under a sun at 60 degrees has the radiance E cos(60 deg) / pi:

    >>> from pbrdf import Material, MicrofacetModel
    >>> from pbrdf.signatures import Sun
    >>> white = MicrofacetModel(Material(1.5), 0.2, specular_gain=0.0, diffuse_albedo=1.0)
    >>> seen = signature(white, 0.5, sun=Sun(theta=pi / 3, irradiance=1000.0))
    >>> seen.radiance.values.round(2) + 0.0
    array([159.15, 0. , 0. , 0. ])
    """
    views, azimuths, waves = _axes(theta_s, phi_s, wavelength)
    skies = [] if sky is None else list(sky) if isinstance(sky, Sequence) else [sky]
    _check_light(sun, skies, temperature)
    if temperature is not None:
        temperature = checked_temperature("temperature", temperature)
        tell_cold(temperature)
    result = _as_result(source, views, waves, simulation)
    if result is not None:
        waves = result.waves if waves is None else waves
    if waves is None and temperature is not None:
        msg = "wavelength must be given where temperature is. Pass wavelength=10.0."
        raise ValueError(msg)
    sun_only = sun if not skies and temperature is None else None
    each = [None] if waves is None else np.atleast_1d(waves).tolist()
    seen = []
    for wave, theta, phi in product(each, np.atleast_1d(views), np.atleast_1d(azimuths)):
        surface: Any
        if result is None:
            surface = FunctionSurface(source, float(theta), float(phi), wave, rel_error)
        else:
            surface = result.surface(wave, float(theta), float(phi), sun_only)
        seen.append(_look(surface, wave, sun, skies, temperature))
    if sun is not None:
        _tell_two_suns(sun, skies, each)
        _tell_dimming(sun, skies, each)
    relative = (sun is not None and sun.relative) or any(map(_relative, skies))
    axes = {"wavelength": waves, "theta_s": views, "phi_s": azimuths}
    dataset = _dataset(seen, axes, RELATIVE if relative else ABSOLUTE)
    dataset.attrs |= {
        "source": type(source).__name__,
        "sun": repr(sun),
        "sky": [_name(one) for one in skies],
        "temperature": np.nan if temperature is None else temperature,
        "frame": "meridian: Q > 0 horizontal, up towards the zenith",
        "version": __version__,
    }
    if result is not None:
        dataset.attrs["scene"] = result.dataset.attrs.get("scene", "")
    return dataset


def _look(
    surface: FunctionSurface | ResultSurface | SunlitResult,
    wave: float | None,
    sun: Sun | None,
    skies: list[Sky],
    temperature: float | None,
) -> dict[str, np.ndarray]:
    """All that is seen in one direction at one wavelength."""
    found: dict[str, np.ndarray] = {}
    total, error = np.zeros(4), np.zeros(4)

    def light(theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
        return np.asarray(sum(_lit(one, theta, phi, wave) for one in skies))

    if sun is not None:
        part, spread = surface.facing(sun, sun.at_ground(wave))
        found |= {"reflected_sun": part, "reflected_sun_stderr": spread}
        total, error = total + part, error + spread
    if isinstance(surface, SunlitResult):
        return {"radiance": total, "radiance_stderr": error, **found}
    if skies:
        part, spread = surface.gather(light)
        found |= {"reflected_sky": part, "reflected_sky_stderr": spread}
        total, error = total + part, error + spread
    if temperature is not None:
        own = float(black_body(wave, temperature))  # type: ignore[arg-type]
        part, spread = surface.emissivity()
        found |= {"emissivity": part, "emissivity_stderr": spread}
        found |= {"emitted": own * part, "emitted_stderr": own * spread}
        total, error = total + own * part, error + own * spread
        if skies and isinstance(surface, ResultSurface):
            # Both come of the same rays: what more is reflected is less emitted
            _, spread = surface.gather(lambda t, p: light(t, p) - own * BLACK)
            error = spread + found.get("reflected_sun_stderr", np.zeros(4))
    return {"radiance": total, "radiance_stderr": error, **found}


def _lit(sky: Sky, theta: np.ndarray, phi: np.ndarray, wave: float | None) -> np.ndarray:
    """Return the light of a sky; refuse one that has gaps."""
    found = np.asarray(sky.stokes(theta, phi, wave))
    gaps = ~np.isfinite(found).all(-1)
    if gaps.any():
        at = (np.broadcast_to(np.rad2deg(one), gaps.shape)[gaps][0] for one in (theta, phi))
        zenith, azimuth = at
        msg = (
            f"sky must be finite, {int(gaps.sum())} of {gaps.size} directions of "
            f"{type(sky).__name__} are not, the first at theta {zenith:.4g}, phi "
            f"{np.mod(azimuth, 360.0):.4g} degrees. Mend it there."
        )
        raise ValueError(msg)
    return found


def _axes(
    theta_s: npt.ArrayLike, phi_s: npt.ArrayLike, wavelength: npt.ArrayLike | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    views = require(
        "theta_s", theta_s, lambda v: (v >= 0) & (v < pi / 2), "lie in [0, 1.571) rad",
        "It is the zenith of the sensor; angles are radians, use np.deg2rad.",
    )  # fmt: skip
    azimuths = require(
        "phi_s", phi_s, lambda v: np.abs(v) <= 4 * pi, "lie in [-12.57, 12.57] rad",
        "Angles are radians; use np.deg2rad.",
    )  # fmt: skip
    waves = None
    if wavelength is not None:
        waves = require(
            "wavelength", wavelength, lambda v: (v > 0) & np.isfinite(v), "be > 0 [um]",
            "Wavelengths are micrometres.",
        )  # fmt: skip
        _tell_unit(np.ravel(waves))
    for name, axis in (("theta_s", views), ("phi_s", azimuths), ("wavelength", waves)):
        if axis is not None and (axis.ndim > 1 or not axis.size):
            msg = f"{name} must be one number or a list, got shape {axis.shape}. Ravel it."
            raise ValueError(msg)
    return views, azimuths, waves


def _tell_unit(waves: np.ndarray) -> None:
    """Warn of wavelengths [um] that are light in another unit."""
    beyond = waves[(waves < SHORTEST) | (waves > LONGEST)]
    if not beyond.size:
        return
    one = float(beyond[0])
    if one > LONGEST:
        cure = f"{one:g} nm are {1e-3 * one:g} um"
        how = f"{one / LONGEST:.3g} times the longest"
    else:
        cure = f"{one:g} mm are {1e3 * one:g} um"
        how = f"{one / SHORTEST:.3g} of the shortest"
    msg = (
        f"wavelength is {one:g} um, {how} of light ({SHORTEST:g} to {LONGEST:g} um). "
        f"Wavelengths are micrometres: {cure}."
    )
    warnings.warn(msg, AccuracyWarning, stacklevel=4)


def _tell_dimming(sun: Sun, skies: list[Any], waves: Sequence[float | None]) -> None:
    """Warn of direct sunlight that a clear sky has scattered already."""
    worst, told = MOST_TWICE, ""
    for wave in waves:
        depth = sum(one.depth(wave) for one in skies if hasattr(one, "depth"))
        passed = spectral("optical_depth", sun.optical_depth, wave)
        twice = -np.expm1(-max(depth - passed, 0.0) / np.cos(sun.theta))
        if twice > worst:
            worst = twice
            told = (
                f"direct sunlight is dimmed by an optical depth of {passed:.3g}, and its "
                f"sky scatters that of {depth:.3g}: {100 * twice:.2g} % of the direct "
                f"light are counted twice. Give Sun(optical_depth={depth:.3g})."
            )
    if told:
        warnings.warn(told, AccuracyWarning, stacklevel=3)


def _tell_two_suns(sun: Sun, skies: list[Any], waves: Sequence[float | None]) -> None:
    """Warn of a sky that another sun lights."""
    for sky in skies:
        other = getattr(sky, "sun", None)
        if not isinstance(other, Sun) or other.relative != sun.relative:
            continue
        pairs = [
            (name, getattr(sun, name), getattr(other, name))
            for name in ("theta", "phi", "distance")
        ]
        pairs += [("irradiance", sun.above(wave), other.above(wave)) for wave in waves]
        for name, one, two in pairs:
            same = np.cos(one - two) > 1 - 1e-12 if name == "phi" else np.isclose(one, two)
            if not same:
                msg = (
                    f"sun has {name} {one:.6g}, but the sun of {type(sky).__name__} has "
                    f"{two:.6g}: sky and sunlight are of two suns. Give both the same Sun."
                )
                warnings.warn(msg, AccuracyWarning, stacklevel=3)
                break


def _check_light(sun: Any, skies: list[Any], temperature: Any) -> None:
    if sun is not None and not isinstance(sun, Sun):
        msg = f"sun must be a pbrdf.signatures.Sun, got {type(sun).__name__}."
        raise TypeError(msg)
    for one in skies:
        if not hasattr(one, "stokes"):
            msg = (
                "sky must be a sky of pbrdf.signatures or have stokes(theta, phi, "
                f"wavelength), got {type(one).__name__}."
            )
            raise TypeError(msg)
    if sun is None and not skies and temperature is None:
        msg = "signature must have light: give sun, sky, temperature or several of them."
        raise ValueError(msg)
    rayleigh = [one for one in skies if hasattr(one, "relative")]
    relative = [one for one in (sun, *rayleigh) if one is not None and one.relative]
    absolute = len(skies) - len(rayleigh) + (temperature is not None)
    absolute += sum(not one.relative for one in (sun, *rayleigh) if one is not None)
    if relative and absolute:
        msg = (
            "irradiance of the sun must be given where other sources are absolute. "
            "Pass Sun(irradiance=...) or use Sun.planck."
        )
        raise ValueError(msg)


def _as_result(
    source: Any,
    views: np.ndarray,
    waves: np.ndarray | None,
    simulation: Mapping[str, Any] | None,
) -> Result | None:
    """Return a simulated source; None of one that is a function."""
    from pbrdf.scene.scene import Scene

    if isinstance(source, Scene):
        from pbrdf.simulation.run import simulate

        given = {"phi_i": "uniform", **(simulation or {})}
        return Result(simulate(source, np.unique(views), wavelength=waves, **given))
    if simulation is not None:
        msg = f"simulation belongs to a Scene, got {type(source).__name__}. Leave it out."
        raise ValueError(msg)
    if isinstance(source, xr.Dataset):
        return Result(source)
    if not callable(getattr(source, "brdf", None)):
        msg = (
            "source must be a Scene, a result of simulate or have brdf(theta_i, theta_s, "
            f"dphi), got {type(source).__name__}."
        )
        raise TypeError(msg)
    return None


def _relative(sky: Any) -> bool:
    return bool(getattr(sky, "relative", False))


def _name(sky: Any) -> str:
    text = repr(sky)
    return text if len(text) < 500 else type(sky).__name__


def _dataset(
    seen: list[dict[str, np.ndarray]], axes: dict[str, np.ndarray | None], units: str
) -> xr.Dataset:
    """Label what was seen; one number makes no dimension."""
    given = {name: axis for name, axis in axes.items() if axis is not None}
    dims = [name for name, axis in given.items() if axis.ndim]
    shape = tuple(axis.size for axis in given.values() if axis.ndim)
    dataset = xr.Dataset(
        {
            name: ((*dims, "stokes"), np.reshape([one[name] for one in seen], (*shape, 4)))
            for name in seen[0]
        },
        {name: (name if axis.ndim else (), axis) for name, axis in given.items()}
        | {"stokes": list(STOKES)},
    )
    for name, variable in dataset.data_vars.items():
        plain = str(name).removesuffix("_stderr")
        text = LONG_NAMES[plain]
        variable.attrs = {
            "units": "1" if plain == "emissivity" else units,
            "long_name": text if plain == name else f"standard error of {plain}",
        }
    angles = {"theta_s": "zenith of the sensor", "phi_s": "azimuth of the sensor"}
    for name, text in angles.items():
        dataset[name].attrs = {"units": "rad", "long_name": text}
    if "wavelength" in dataset.coords:
        dataset.wavelength.attrs = {"units": "um", "long_name": "vacuum wavelength"}
    return dataset

"""Sun and skies as the options of `pbrdf radiance` describe them."""

from enum import StrEnum
from pathlib import Path
from typing import Any, NamedTuple

__all__ = ["Clear", "Place", "lights", "place_at"]


class Clear(StrEnum):
    """Skies without numbers of their own."""

    none = "none"
    rayleigh = "rayleigh"
    clear = "clear"
    overcast = "overcast"


# Skies of air that the sun lights
AIR = (Clear.rayleigh, Clear.clear)


class Place(NamedTuple):
    """Where the sun is: zenith and azimuth [deg], how far [au]."""

    zenith: float | None
    azimuth: float | None
    distance: float = 1.0


def place_at(
    time: str | None, latitude: float | None, longitude: float | None, angles: Place
) -> Place:
    """Return where the sun is for a place on Earth and a time."""
    from math import degrees, radians

    from pbrdf.signatures import sun_distance, sun_position

    given = angles.zenith is not None or angles.azimuth is not None
    if time is None or latitude is None or longitude is None or given:
        msg = (
            "--time, --latitude-deg and --longitude-deg must be given together, and "
            "without --sun-zenith-deg and --sun-azimuth-deg."
        )
        raise ValueError(msg)
    theta, phi = sun_position(time, radians(latitude), radians(longitude))
    return Place(degrees(theta), degrees(phi), sun_distance(time))


def lights(
    *,
    place: Place,
    sun_irradiance: float | None,
    planck_sun: bool,
    optical_depth: float | None,
    sky: Clear,
    sky_radiance: float | None,
    sky_table: Path | None,
    sky_temperature: float | None,
    ground_albedo: float | None,
    pressure: float | None,
) -> tuple[Any, list[Any]]:
    """Return the sun and the skies that the options describe."""
    from pbrdf.signatures import (
        ClearSky,
        OvercastSky,
        RayleighSky,
        ThermalSky,
        read_sky,
    )

    of_air, clear = (sky in AIR) or None, (sky is Clear.clear) or None
    overcast = (sky is Clear.overcast) or None
    zenith = ("--sun-zenith-deg", place.zenith)
    _check_pairs(
        {
            "--sun-irradiance": (sun_irradiance, *zenith),
            "--sun-azimuth-deg": (place.azimuth, *zenith),
            "--planck-sun": (planck_sun or None, *zenith),
            f"--sky {sky.value}": (of_air, *zenith),
            "--sky overcast": (overcast, "--sky-radiance", sky_radiance),
            "--sky-radiance": (sky_radiance, "--sky overcast", overcast),
            "--optical-depth": (optical_depth, *zenith),
            "--ground-albedo": (ground_albedo, "--sky clear", clear),
            "--pressure-hpa": (pressure, "--sky rayleigh or clear", of_air),
        }
    )
    depth = _depth(optical_depth, pressure, of_air=bool(of_air))
    sun = _sun(place, sun_irradiance, depth, planck=planck_sun)
    skies: list[Any] = []
    if sky is Clear.rayleigh:
        skies.append(RayleighSky(sun=sun, optical_depth=depth))
    if sky is Clear.clear:
        albedo = ground_albedo or 0.0
        skies.append(ClearSky(sun=sun, optical_depth=depth, ground_albedo=albedo))
    if sky is Clear.overcast and sky_radiance is not None:
        skies.append(OvercastSky(radiance=sky_radiance))
    if sky_table is not None:
        skies.append(read_sky(sky_table))
    if sky_temperature is not None:
        skies.append(ThermalSky(temperature=sky_temperature))
    return sun, skies


def _sun(place: Place, irradiance: float | None, depth: Any, *, planck: bool) -> Any:
    """Return the sun behind air of an optical depth; None without its zenith."""
    from math import radians

    from pbrdf.signatures import Sun

    if planck and irradiance is not None:
        msg = "--planck-sun and --sun-irradiance are two suns. Give one of them."
        raise ValueError(msg)
    if place.zenith is None:
        return None
    azimuth = 180.0 if place.azimuth is None else place.azimuth
    there: dict[str, Any] = {
        "theta": radians(place.zenith), "phi": radians(azimuth),
        "distance": place.distance, "optical_depth": depth,
    }  # fmt: skip
    return Sun.planck(**there) if planck else Sun(**there, irradiance=irradiance)


def _depth(optical_depth: float | None, pressure: float | None, *, of_air: bool) -> Any:
    """Return the optical depth between sun and ground, that of clean air for its skies."""
    from pbrdf.signatures import rayleigh_optical_depth

    if pressure is not None and optical_depth is not None:
        msg = "--pressure-hpa and --optical-depth are two atmospheres. Give one of them."
        raise ValueError(msg)
    here = {} if pressure is None else {"pressure": pressure}

    def clean_air(wavelength: float) -> float:
        return float(rayleigh_optical_depth(wavelength, **here))

    if optical_depth is not None:
        return optical_depth
    return clean_air if of_air else 0.0


def _check_pairs(pairs: dict[str, tuple[Any, str, Any]]) -> None:
    """Refuse an option that lacks the other it needs."""
    for option, (given, needed, there) in pairs.items():
        if given is not None and there is None:
            msg = f"{option} needs {needed}. Give both or neither."
            raise ValueError(msg)

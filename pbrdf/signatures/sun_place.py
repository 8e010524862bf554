"""Where the sun stands, by pvlib."""

from datetime import datetime
from math import pi
from typing import Any

import numpy as np

from pbrdf.errors import one_number

__all__ = ["sun_distance", "sun_position"]


def sun_position(
    time: datetime | str,
    latitude: float,
    longitude: float,
    *,
    altitude: float = 0.0,
    x_azimuth: float = pi / 2,
) -> tuple[float, float]:
    """Zenith and azimuth of the sun, as `Sun(theta=, phi=)` takes them. [rad]

    How far it is then, and so how bright, is `Sun(distance=sun_distance(time))`.

    By the NREL algorithm of pvlib [1]_, to some 1e-5 rad, with refraction in mean air.

    Parameters
    ----------
    time : datetime or str
        With its time zone; text in ISO 8601, "2026-06-21T12:00+02:00".
    latitude, longitude : float
        Positive north and east. [rad]
    altitude : float
        Above sea level. [m]
    x_azimuth : float
        Compass direction of the x axis of the surface, clockwise from north: pi/2, east,
        unless given. [rad]

    Raises
    ------
    ValueError
        If pvlib is not installed, the time has no zone, a value is out of its range, or
        the sun is below the horizon.

    References
    ----------
    .. [1] I. Reda, A. Andreas, Solar Energy 76, 577 (2004).

    Examples
    --------
    >>> theta, phi = sun_position("2026-03-20T12:00Z", 0.0, 0.0)  # doctest: +SKIP
    """
    place = [
        one_number(
            "latitude", latitude, lambda v: np.abs(v) <= pi / 2,
            "lie in [-1.571, 1.571] rad", "Use np.deg2rad.",
        ),
        one_number(
            "longitude", longitude, lambda v: np.abs(v) <= pi,
            "lie in [-3.142, 3.142] rad", "Use np.deg2rad.",
        ),
    ]  # fmt: skip
    moment = _moment(time)
    found = (
        _pvlib("sun_position")
        .get_solarposition(_index(moment), *np.rad2deg(place), altitude=altitude)
        .iloc[0]
    )
    theta, compass = np.deg2rad([found["apparent_zenith"], found["azimuth"]])
    if theta >= pi / 2:
        msg = (
            f"sun must be above the horizon, got {np.rad2deg(pi / 2 - theta):.4g} degrees "
            f"at {moment.isoformat()}. Leave it out."
        )
        raise ValueError(msg)
    # Azimuths of surfaces run counter-clockwise, those of the compass clockwise
    return float(theta), float(np.mod(x_azimuth - compass, 2 * pi))


def sun_distance(time: datetime | str) -> float:
    """Distance of the sun at a time, as `Sun(distance=)` takes it. [au]

    Raises
    ------
    ValueError
        If pvlib is not installed or the time has no zone.

    Examples
    --------
    >>> round(sun_distance("2026-07-06T18:00Z"), 4)  # doctest: +SKIP
    1.0166
    """
    moment = _moment(time)
    found = _pvlib("sun_distance").nrel_earthsun_distance(_index(moment))
    return float(found.iloc[0])


def _pvlib(asked: str) -> Any:
    """Return the module of pvlib on the sun's place."""
    try:
        from pvlib import solarposition
    except ImportError as error:
        msg = f"{asked} must have the package pvlib, which is not here. Install it: "
        raise ValueError(msg + 'pip install "pbrdf[sun]".') from error
    return solarposition


def _index(moment: datetime) -> Any:
    import pandas as pd

    return pd.DatetimeIndex([moment])


def _moment(time: datetime | str) -> datetime:
    try:
        moment = datetime.fromisoformat(time) if isinstance(time, str) else time
    except ValueError as error:
        msg = f'time must be ISO 8601, as "2026-06-21T12:00+02:00", got {time!r}.'
        raise ValueError(msg) from error
    if not isinstance(moment, datetime) or moment.tzinfo is None:
        msg = f'time must have a time zone, as "2026-06-21T12:00+02:00", got {time!r}.'
        raise ValueError(msg)
    return moment

"""`pbrdf radiance`: what a sensor sees of a surface under sun and sky, or warm."""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pbrdf.cli import option_text, options

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    import xarray as xr


class Clear(StrEnum):
    """Skies without numbers of their own."""

    none = "none"
    rayleigh = "rayleigh"
    overcast = "overcast"


def command(
    source: Annotated[
        Path,
        typer.Argument(
            help="Model (.toml) of a fit, or result (.nc, .zarr) of simulate.",
            show_default=False,
        ),
    ],
    view_zenith: Annotated[
        str, typer.Option("--view-zenith-deg", help="Zeniths of the sensor, by commas.")
    ] = "45",
    view_azimuth: Annotated[
        str, typer.Option("--view-azimuth-deg", help="Azimuths of the sensor, by commas.")
    ] = "0",
    sun_zenith: Annotated[
        float | None,
        typer.Option("--sun-zenith-deg", min=0.0, max=89.9, help="No sun without it."),
    ] = None,
    sun_azimuth: Annotated[
        float | None,
        typer.Option(
            "--sun-azimuth-deg", min=-360.0, max=360.0, help="180 degrees without it."
        ),
    ] = None,
    time: Annotated[
        str | None,
        typer.Option(
            help="In place of the sun's angles, with --latitude-deg, --longitude-deg: "
            "2026-06-21T12:00+02:00. Azimuths are then counter-clockwise from east."
        ),
    ] = None,
    latitude: Annotated[
        float | None, typer.Option("--latitude-deg", min=-90.0, max=90.0, help="North.")
    ] = None,
    longitude: Annotated[
        float | None, typer.Option("--longitude-deg", min=-180.0, max=180.0, help="East.")
    ] = None,
    sun_irradiance: Annotated[
        float | None,
        typer.Option(
            "--sun-irradiance",
            min=0.0,
            help="Above the atmosphere, facing the sun [W/(m2 um)]; else relative to it.",
        ),
    ] = None,
    planck_sun: Annotated[
        bool, typer.Option("--planck-sun", help="A black body of 5772 K as the sun.")
    ] = False,
    optical_depth: Annotated[
        float | None,
        typer.Option(
            "--optical-depth",
            min=0.0,
            max=50.0,
            help="Vertical, of the air between sun and ground; that of clean air for a "
            "rayleigh sky, none otherwise.",
        ),
    ] = None,
    sky: Annotated[Clear, typer.Option(help="Kind of sky.")] = Clear.none,
    sky_radiance: Annotated[
        float | None,
        typer.Option("--sky-radiance", min=0.0, help="Of clouds [W/(m2 sr um)]."),
    ] = None,
    sky_table: Annotated[
        Path | None,
        typer.Option("--sky-table", help="CSV: theta_deg, phi_deg, I, Q, U, V."),
    ] = None,
    sky_temperature: Annotated[
        float | None,
        typer.Option("--sky-temperature-k", min=0.1, max=1e5, help="Of a warm sky [K]."),
    ] = None,
    temperature: Annotated[
        float | None,
        typer.Option("--temperature-k", min=0.1, max=1e5, help="Of the surface [K]."),
    ] = None,
    wavelength: Annotated[
        str | None, typer.Option("--wavelength-um", help="Wavelengths, by commas.")
    ] = None,
    band: Annotated[
        Path | None,
        typer.Option(
            help="CSV of a band: wavelength_um, response. The mean over it, weighted, from "
            "--wavelength-um that cover it."
        ),
    ] = None,
    output: options.Output = None,
    force: options.Force = False,
) -> None:
    """Write the Stokes radiance at a sensor as a table (.csv) or a dataset (.nc).

    Q is along the horizontal, U half way from right to up, V right-circular as the sensor
    sees them. A result is known at its incident zeniths: simulate those of the sensor, or,
    for sunlight alone, that of the sun.

    Example: pbrdf radiance model.toml --sun-zenith-deg 40 --sky rayleigh --wavelength-um 1
    """
    import pbrdf
    from data_io import write_result
    from pbrdf.cli.staging import staged_file
    from pbrdf.signatures import in_band, read_response

    waves = option_text.wavelengths(wavelength)
    views = option_text.angles(view_zenith, "--view-zenith-deg", below=90.0)
    azimuths = _azimuths(view_azimuth)
    if time is not None or latitude is not None or longitude is not None:
        angles = sun_zenith, sun_azimuth
        sun_zenith, sun_azimuth = _sun_at(time, latitude, longitude, angles)
    response = None if band is None else read_response(band)
    sun, skies = _lights(
        sun_zenith=sun_zenith, sun_azimuth=sun_azimuth, sun_irradiance=sun_irradiance,
        planck_sun=planck_sun, optical_depth=optical_depth, sky=sky,
        sky_radiance=sky_radiance, sky_table=sky_table, sky_temperature=sky_temperature,
    )  # fmt: skip
    if sun is None and not skies and temperature is None:
        msg = "radiance needs light: give --sun-zenith-deg, --sky, --temperature-k or more."
        raise ValueError(msg)
    if sun is not None and sun.relative:
        _check_relative(
            {
                "--temperature-k": temperature, "--sky-radiance": sky_radiance,
                "--sky-table": sky_table, "--sky-temperature-k": sky_temperature,
            }
        )  # fmt: skip
    target = output or source.with_name(f"{source.stem}-radiance.csv")
    if target.suffix not in (".csv", ".nc"):
        msg = f"--output must end in .csv or .nc, got {target.name}."
        raise ValueError(msg)
    with staged_file(target, force=force) as stage:
        seen = pbrdf.signature(
            _read(source), views, phi_s=azimuths, wavelength=waves, sun=sun,
            sky=skies or None, temperature=temperature,
        )  # fmt: skip
        if response is not None:
            if seen.sizes.get("wavelength", 1) < 2:
                msg = (
                    "--wavelength-um must have two wavelengths or more with --band, which "
                    "cover it."
                )
                raise ValueError(msg)
            seen = in_band(seen, response)
        if target.suffix == ".nc":
            write_result(seen, stage)
        else:
            head = f"# {seen.radiance.units}; frame {seen.frame}\n"
            text = _table(seen).to_csv(index=False, float_format="%.8g")
            stage.write_text(head + text, encoding="utf-8")
    brightest = seen.radiance.sel(stokes="I")
    typer.echo(f"largest I {float(brightest.max()):.5g} {seen.radiance.units}")
    typer.echo(f"Result: {target}")


def _sun_at(
    time: str | None,
    latitude: float | None,
    longitude: float | None,
    angles: tuple[float | None, float | None],
) -> tuple[float, float]:
    """Return zenith and azimuth of the sun at a place and time. [deg]"""
    from math import degrees, radians

    from pbrdf.signatures import sun_position

    if time is None or latitude is None or longitude is None or angles != (None, None):
        msg = (
            "--time, --latitude-deg and --longitude-deg must be given together, and "
            "without --sun-zenith-deg and --sun-azimuth-deg."
        )
        raise ValueError(msg)
    theta, phi = sun_position(time, radians(latitude), radians(longitude))
    return degrees(theta), degrees(phi)


def _azimuths(text: str) -> "np.ndarray":
    """Return azimuths of the sensor. [rad]"""
    import numpy as np

    degrees = np.array(option_text.numbers(text, "--view-azimuth-deg"))
    for one in degrees[np.abs(degrees) > 720.0]:
        msg = f"--view-azimuth-deg must lie in [-720, 720] degrees, got {one:g}."
        raise ValueError(msg)
    return np.deg2rad(degrees)


def _check_relative(absolute: dict[str, Any]) -> None:
    """Refuse light in units of power beside a sun of irradiance 1."""
    for option, given in absolute.items():
        if given is not None:
            msg = (
                "--sun-irradiance or --planck-sun must be given where other light is in "
                f"W/(m2 sr um), as by {option}."
            )
            raise ValueError(msg)


def _lights(
    *,
    sun_zenith: float | None,
    sun_azimuth: float | None,
    sun_irradiance: float | None,
    planck_sun: bool,
    optical_depth: float | None,
    sky: Clear,
    sky_radiance: float | None,
    sky_table: Path | None,
    sky_temperature: float | None,
) -> tuple[Any, list[Any]]:
    """Return the sun and the skies that the options describe."""
    from math import radians

    from pbrdf.signatures import (
        OvercastSky,
        RayleighSky,
        Sun,
        ThermalSky,
        rayleigh_optical_depth,
        read_sky,
    )

    _check_pairs(
        {
            "--sun-irradiance": (sun_irradiance, "--sun-zenith-deg", sun_zenith),
            "--sun-azimuth-deg": (sun_azimuth, "--sun-zenith-deg", sun_zenith),
            "--planck-sun": (planck_sun or None, "--sun-zenith-deg", sun_zenith),
            "--sky rayleigh": (
                sky if sky is Clear.rayleigh else None, "--sun-zenith-deg", sun_zenith
            ),
            "--sky overcast": (
                sky if sky is Clear.overcast else None, "--sky-radiance", sky_radiance
            ),
            "--sky-radiance": (
                sky_radiance, "--sky overcast", sky if sky is Clear.overcast else None
            ),
            "--optical-depth": (optical_depth, "--sun-zenith-deg", sun_zenith),
        }
    )  # fmt: skip
    if planck_sun and sun_irradiance is not None:
        msg = "--planck-sun and --sun-irradiance are two suns. Give one of them."
        raise ValueError(msg)

    def clean_air(wavelength: float) -> float:
        return float(rayleigh_optical_depth(wavelength))

    depth: Any = 0.0 if optical_depth is None else optical_depth
    if optical_depth is None and sky is Clear.rayleigh:
        depth = clean_air
    sun: Sun | None = None
    skies: list[Any] = []
    if sun_zenith is not None:
        azimuth = 180.0 if sun_azimuth is None else sun_azimuth
        place = {"theta": radians(sun_zenith), "phi": radians(azimuth)}
        if planck_sun:
            sun = Sun.planck(**place, optical_depth=depth)
        else:
            sun = Sun(**place, irradiance=sun_irradiance, optical_depth=depth)
    if sky is Clear.rayleigh and sun is not None:
        skies.append(RayleighSky(sun=sun, optical_depth=depth))
    if sky is Clear.overcast and sky_radiance is not None:
        skies.append(OvercastSky(radiance=sky_radiance))
    if sky_table is not None:
        skies.append(read_sky(sky_table))
    if sky_temperature is not None:
        skies.append(ThermalSky(temperature=sky_temperature))
    return sun, skies


def _check_pairs(pairs: dict[str, tuple[Any, str, Any]]) -> None:
    """Refuse an option that lacks the other it needs."""
    for option, (given, needed, there) in pairs.items():
        if given is not None and there is None:
            msg = f"{option} needs {needed}. Give both or neither."
            raise ValueError(msg)


def _read(source: Path) -> Any:
    """Read a model or a result by the end of its name."""
    from data_io import read_model, read_result
    from pbrdf.files import read_toml
    from pbrdf.stored.whole import is_sweep_store

    if is_sweep_store(source):
        msg = (
            f"source must be one surface, {source.name} is the store of a sweep. Take one "
            "in Python: pbrdf.signature(pbrdf.from_store(path).at(...), ...)."
        )
        raise ValueError(msg)
    if source.suffix in (".nc", ".zarr"):
        return read_result(source)
    if source.suffix != ".toml":
        msg = f"source must be a model (.toml) or a result (.nc, .zarr), got {source.name}."
        raise ValueError(msg)
    tables = read_toml(source)
    # The model of a pipeline notes the statistics of its surface
    if "surface" in tables and "model" not in tables:
        msg = (
            f"source must be a model or a result, {source.name} is a scene. Run `pbrdf "
            "simulate` with --theta-i-deg at the zeniths of the sensor, and give its .nc."
        )
        raise ValueError(msg)
    return read_model(source)


def _table(seen: "xr.Dataset") -> "pd.DataFrame":
    """One row a direction and wavelength, columns I, Q, ... and the parts."""
    import numpy as np
    import pandas as pd

    stacked = seen.stack(row=[d for d in seen.radiance.dims if d != "stokes"])
    columns = {
        "theta_s_deg": np.rad2deg(stacked.theta_s.to_numpy()).round(9),
        "phi_s_deg": np.rad2deg(stacked.phi_s.to_numpy()).round(9),
    }
    if "wavelength" in stacked.coords:
        columns["wavelength_um"] = np.broadcast_to(
            stacked.wavelength.to_numpy(), columns["theta_s_deg"].shape
        )
    for name in stacked.data_vars:
        plain = str(name).removesuffix("_stderr")
        end = "_stderr" if plain != name else ""
        head = "" if plain == "radiance" else f"{plain}_"
        for element in "IQUV":
            values = stacked[name].sel(stokes=element).to_numpy()
            columns[f"{head}{element}{end}"] = values
    return pd.DataFrame(columns)

"""`pbrdf radiance`: what a sensor sees of a surface under sun and sky, or warm."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pbrdf.cli import option_text, options
from pbrdf.cli.lighting import Clear, Place, lights, place_at

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd
    import xarray as xr


def command(
    source: Annotated[
        Path,
        typer.Argument(
            help="Model (.toml) of a fit, result (.nc, .zarr) of simulate, or store of a "
            "sweep (.zarr) with --at.",
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
            "rayleigh or clear sky, none otherwise.",
        ),
    ] = None,
    sky: Annotated[
        Clear,
        typer.Option(
            help="Kind of sky. rayleigh: light scattered once; clear: any number of times, "
            "over ground of --ground-albedo."
        ),
    ] = Clear.none,
    ground_albedo: Annotated[
        float | None,
        typer.Option(
            "--ground-albedo",
            min=0.0,
            max=1.0,
            help="Of the ground around, which lights a clear sky from below; 0 without it.",
        ),
    ] = None,
    pressure: Annotated[
        float | None,
        typer.Option(
            "--pressure-hpa",
            min=1.0,
            max=1200.0,
            help="Of the air of a rayleigh or clear sky; 1013.25 without it.",
        ),
    ] = None,
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
    at: options.At = None,
    output: options.Output = None,
    force: options.Force = False,
) -> None:
    """Write the Stokes radiance at a sensor as a table (.csv) or a dataset (.nc).

    Q is along the horizontal, U half way from right to up, V right-circular as the sensor
    sees them. A result is known at its incident zeniths: simulate those of the sensor, or,
    for sunlight alone, that of the sun. A store is interpolated at --at and at the zeniths
    of the sensor.

    Example: pbrdf radiance model.toml --sun-zenith-deg 40 --sky rayleigh --wavelength-um 1
    """
    import pbrdf
    from data_io import write_result
    from pbrdf.cli.staging import staged_file
    from pbrdf.signatures import in_band, read_response

    waves = option_text.wavelengths(wavelength)
    views = option_text.angles(view_zenith, "--view-zenith-deg", below=90.0)
    azimuths = _azimuths(view_azimuth)
    place = Place(sun_zenith, sun_azimuth)
    if time is not None or latitude is not None or longitude is not None:
        place = place_at(time, latitude, longitude, place)
    response = None if band is None else read_response(band)
    sun, skies = lights(
        place=place, sun_irradiance=sun_irradiance,
        planck_sun=planck_sun, optical_depth=optical_depth, sky=sky,
        sky_radiance=sky_radiance, sky_table=sky_table, sky_temperature=sky_temperature,
        ground_albedo=ground_albedo, pressure=pressure,
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
    surface = _read(source, at, views, waves)
    with staged_file(target, force=force) as stage:
        seen = pbrdf.signature(
            surface, views, phi_s=azimuths, wavelength=waves, sun=sun,
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


def _read(
    source: Path, at: list[str] | None, views: list[float], waves: list[float] | None
) -> Any:
    """Read a model or a result by the end of its name; of a store the surface at `at`."""
    from data_io import read_model, read_result
    from pbrdf.files import read_toml
    from pbrdf.stored.whole import is_sweep_store

    if is_sweep_store(source):
        return _surface_of(source, at, views, waves)
    if at:
        msg = f"--at must be left out, it is for a store of a sweep, got {source.name!r}."
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


def _surface_of(
    store: Path, at: list[str] | None, views: list[float], waves: list[float] | None
) -> "xr.Dataset":
    """Interpolate a store at the zeniths of the sensor, its incidences by reciprocity."""
    from math import degrees

    from pbrdf import from_store
    from pbrdf.cli.places import written_places

    places = written_places(at, "Give --view-zenith-deg.")
    if "wavelength" in places:
        msg = "--at must leave the wavelength out, it is that of --wavelength-um."
        raise ValueError(msg)
    held = from_store(store)
    low, high = held.ranges["theta_i"]
    for view in views:
        if not low - 1e-6 <= view <= high + 1e-6:
            msg = (
                f"--view-zenith-deg must lie within the incidences of the store, "
                f"{degrees(low):.6g} to {degrees(high):.6g} degrees, got "
                f"{degrees(view):.6g}."
            )
            raise ValueError(msg)
    # A store of one wavelength, or of none, is checked by the signature
    known = waves if "wavelength" in held.ranges else None
    return held.at(sorted(set(views)), known, **places)


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

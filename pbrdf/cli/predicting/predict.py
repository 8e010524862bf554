"""`pbrdf predict`: reflectance from a height map and an index, nothing fitted."""

import warnings
from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pbrdf.cli import declaring, option_text, options

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr

    from fitting import Instrument
    from fitting.prediction.prediction import Prediction

# Of the sources of most goniometers; only where neither scan nor user says
_ASSUMED = 0.65
# Beyond this zenith goniometers see their own sample holder [deg]
_FURTHEST = 80.0
# Fewer readings than nodes of a slope density determine none
_FEWEST = 40


def command(
    surface: Annotated[
        Path, typer.Argument(help="Height map of the coating.", show_default=False)
    ],
    n: options.OptionalIndex = None,
    kappa: options.Kappa = None,
    material_file: options.MaterialFile = None,
    material_ignore: options.MaterialIgnore = "",
    scan: Annotated[
        Path | None,
        typer.Option(help="Goniometer file to compare with afterwards."),
    ] = None,
    wavelength: Annotated[
        float | None,
        typer.Option(
            "--wavelength-um", min=0.01, max=1e3, help="Wavelength; that of the scan."
        ),
    ] = None,
    theta_i: options.Incidences = "10,30,50,70",
    aperture: options.Aperture = None,
    instrument_wavelength: options.InstrumentWavelength = 0.55,
    pixel: options.Pixel = None,
    resolution: Annotated[
        float,
        typer.Option(
            "--resolution-um",
            min=0.0,
            max=1e3,
            help="Of an instrument without an aperture, the standard deviation of its "
            "point spread.",
        ),
    ] = 0.0,
    diffuse_albedo: Annotated[
        float, typer.Option(min=0.0, max=1.0, help="Of the base under the interface.")
    ] = 0.0,
    wave: Annotated[
        bool | None,
        typer.Option(
            "--waves/--facets",
            help="Whether waves scatter or facets mirror; by the roughness if not given.",
        ),
    ] = None,
    spacing: options.Spacing = None,
    unit: options.Unit = None,
    channel: options.Channel = None,
    columns: options.ColumnsOption = None,
    block: options.Block = None,
    um_per_level: options.UmPerLevel = None,
    mend: options.MendOption = "all",
    azimuth_of_forward: declaring.Forward = None,
    output: options.Output = None,
    force: options.Force = False,
    seed: options.Seed = 0,
) -> None:
    """Predict the Mueller BRDF of a coating from its height map and its index.

    Nothing is fitted. A scan is compared only afterwards: absolute, with gain and
    Lambertian base freed, and with the slopes freed too, as far as any facet model can
    come. With --output writes the prediction at the directions of the
    scan, or in the plane, as a goniometer file (.csv).

    Example: pbrdf predict map.npy --spacing-um 0.2268 --n 1.5 --scan scan.csv
    """
    from dataclasses import replace

    from fitting import predict
    from pbrdf import HeightMap
    from pbrdf.cli.reading import read_material, read_scan, read_surface
    from pbrdf.cli.staging import staged_file

    material = read_material(n, kappa, material_file, option_text.names(material_ignore))
    if material is None:
        msg = "--n must be given, got none. Or give a --material-file."
        raise ValueError(msg)
    if diffuse_albedo:
        material = replace(material, diffuse_albedo=diffuse_albedo)
    declared = declaring.declarations(None, azimuth_of_forward, None, None, None)
    measured = None if scan is None else read_scan(scan, declared=declared)
    if measured is not None and wavelength is not None and "wavelength" in measured.coords:
        measured = read_scan(scan, wavelength=wavelength, declared=declared)  # type: ignore[arg-type]
    light = _wavelength(wavelength, measured)
    heights = read_surface(
        surface, kind=options.Kind.map, spacing=spacing, unit=unit, channel=channel,
        columns=columns, block=block, um_per_level=um_per_level, mend=mend,
    )  # fmt: skip
    if not isinstance(heights, HeightMap):
        msg = f"{surface.name} must be a height map, a profile has slopes along one axis."
        raise ValueError(msg)
    found = predict(
        heights, material, wavelength=light, resolution=resolution, seed=seed, wave=wave,
        instrument=_instrument(aperture, instrument_wavelength, pixel),
    )  # fmt: skip
    geometry = _plane(option_text.incidences(theta_i)) if measured is None else measured
    predicted = _readings(found, geometry)
    if output is not None:
        from data_io import write_goniometer

        with staged_file(output, force=force) as stage:
            write_goniometer(predicted.drop_vars(["low", "high"]), stage)
    for note in found.notes:
        typer.echo(note)
    lines = (
        _brightest(predicted)
        if measured is None
        else chain(_compared(predicted, measured), _free_slopes(found, measured))
    )
    for line in chain(lines, _beams(found, geometry)):
        typer.echo(line)
    if output is not None:
        typer.echo(f"Result: {output}")


def _wavelength(given: float | None, scan: "xr.Dataset | None") -> float:
    """Return the wavelength that was given, else the scan's only one, else a usual one."""
    import numpy as np

    if given is not None:
        return given
    if scan is not None and "wavelength" in scan.coords:
        waves = np.unique(scan.wavelength.values)
        if waves.size == 1 and np.isfinite(waves[0]):
            return float(waves[0])
        known = ", ".join(f"{wave:g}" for wave in waves)
        msg = f"--wavelength-um must be one of {known} of the scan, got none."
        raise ValueError(msg)
    text = f"no wavelength is known: {_ASSUMED:g} um assumed (--wavelength-um)"
    warnings.warn(text, UserWarning, stacklevel=2)
    return _ASSUMED


def _instrument(
    aperture: float | None, wavelength: float, pixel: float | None
) -> "Instrument | None":
    """Return the microscope that the options name, if they do."""
    from fitting import Instrument

    if aperture is not None:
        return Instrument(aperture=aperture, wavelength=wavelength, pixel=pixel)
    if pixel is not None:
        msg = f"--pixel-um must come with --na, got {pixel:g} alone. Give --na too."
        raise ValueError(msg)
    return None


def _plane(incidences: list[float]) -> "xr.Dataset":
    """Return view angles in the plane, every 5 degrees."""
    import numpy as np
    import xarray as xr

    views = np.deg2rad(np.arange(-80.0, 81.0, 5.0))
    source, view = (m.ravel() for m in np.meshgrid(incidences, views, indexing="ij"))
    angles = {
        "theta_i": source, "theta_s": np.abs(view), "dphi": np.where(view < 0, 0.0, np.pi)
    }  # fmt: skip
    return xr.Dataset(coords={k: ("geometry", v) for k, v in angles.items()})


def _readings(found: "Prediction", geometry: "xr.Dataset") -> "xr.Dataset":
    """Return the prediction at the directions of a scan, with its interval."""
    import numpy as np
    import xarray as xr

    names = ("theta_i", "theta_s", "dphi")
    angles = geometry.theta_i.values, geometry.theta_s.values, geometry.dphi.values
    matrices = found.brdf(*angles)
    low, high = found.interval(*angles)
    data: dict[str, Any] = {
        f"M{i}{j}": ("geometry", matrices[:, i, j]) for i in range(4) for j in range(4)
    }
    # The half of an interval of 95 % is 1.96 standard errors
    data["M00_stderr"] = ("geometry", (high - low) / 3.92)
    data |= {"low": ("geometry", low), "high": ("geometry", high)}
    coords: dict[str, Any] = {
        name: ("geometry", a) for name, a in zip(names, angles, strict=True)
    }
    coords["wavelength"] = ("geometry", np.full(low.size, found.wavelength))
    return xr.Dataset(data, coords=coords)


def _beams(found: "Prediction", geometry: "xr.Dataset") -> Iterator[str]:
    """Yield the specular beams of a smooth map, which are no BRDF."""
    import numpy as np

    for theta in np.unique(geometry.theta_i.values):
        beam = found.coherent(theta)[0, 0]
        if beam > 0:
            yield (
                f"incidence {np.rad2deg(theta):.3g} deg: reflectance of the specular beam "
                f"{beam:.3g}, not in M00"
            )


def _brightest(predicted: "xr.Dataset") -> Iterator[str]:
    """Yield the specular readings with their intervals."""
    import numpy as np

    for theta in np.unique(predicted.theta_i.values):
        here = predicted.isel(geometry=np.flatnonzero(predicted.theta_i.values == theta))
        at = int(np.argmax(here.M00.values))
        one = here.isel(geometry=at)
        yield (
            f"incidence {np.rad2deg(theta):.3g} deg: M00 greatest at view "
            f"{np.rad2deg(float(one.theta_s)):.3g} deg, {float(one.M00):.3g} 1/sr "
            f"(95 %: {float(one.low):.3g} .. {float(one.high):.3g})"
        )


def _counted(scan: "xr.Dataset") -> "np.ndarray":
    """Return which readings of M00 are compared."""
    import numpy as np

    measured = scan.M00.values
    low_enough = scan.theta_s.values <= np.deg2rad(_FURTHEST + 0.01)
    return np.asarray(np.isfinite(measured) & (measured > 0) & low_enough)


def _free_slopes(found: "Prediction", scan: "xr.Dataset") -> Iterator[str]:
    """Yield what the best isotropic slope density leaves, and its |slope| beside the map's.

    Diagnostic of the scan: nothing of it goes into the prediction.
    """
    import numpy as np

    from fitting.prediction.scan_density import free_density
    from pbrdf import Material

    counted = _counted(scan)
    if counted.sum() < _FEWEST:
        return
    theta_i, theta_s, dphi = (
        scan[name].values[counted] for name in ("theta_i", "theta_s", "dphi")
    )
    index = Material(*found.model.material.index(found.wavelength))
    best = free_density(theta_i, theta_s, dphi, scan.M00.values[counted], index)
    yield (
        f"Any isotropic slopes whatever, single bounces: off by {best.error:.0%} with gain "
        f"{best.gain:.3g} and base {best.diffuse_albedo:.3g}"
    )
    shares = np.array([0.25, 0.5, 0.75, 0.9])
    patches = np.hypot(found.facets.slope_x, found.facets.slope_y)
    of_scan = " / ".join(f"{v:.2f}" for v in best.quantile(shares))
    of_map = " / ".join(f"{v:.2f}" for v in np.quantile(patches, shares))
    yield (
        f"  |slope| at 25/50/75/90 %: scan {of_scan}; patches of the map {of_map}, before "
        f"a blur of {found.facets.blur:.2f} per axis"
    )


def _compared(predicted: "xr.Dataset", scan: "xr.Dataset") -> Iterator[str]:
    """Yield the misfit by angle and over all."""
    import numpy as np

    from fitting.prediction.comparison import misfit

    if "M00" not in scan:
        msg = (
            f"scan must hold M00 to be compared, got {', '.join(map(str, scan.data_vars))}."
        )
        raise ValueError(msg)
    if scan.attrs.get("quantity") == "relative":
        yield "The scan is relative: look at the misfit with free gain only."
    measured = scan.M00.values
    counted = _counted(scan)
    yield f"M00 against the scan, {int(counted.sum())} readings to {_FURTHEST:g} deg:"
    thetas = np.round(predicted.theta_i.values, 6)
    for theta in [*np.unique(thetas[counted]), None]:
        here = counted if theta is None else counted & (thetas == theta)
        if here.sum() < 3:
            continue
        name = "all" if theta is None else f"incidence {np.rad2deg(theta):.3g} deg"
        off = misfit(predicted.M00.values[here], measured[here])
        inside = (predicted.low.values <= measured) & (measured <= predicted.high.values)
        yield (
            f"  {name}: off by {off.absolute:.0%} rms as predicted; {off.base_free:.0%} "
            f"with a Lambertian base of {off.base:.3g}; {off.gain_free:.0%} with gain "
            f"{off.gain:.3g} and base {off.gain_base:.3g}; the 95 % interval holds "
            f"{inside[here].mean():.0%}"
        )

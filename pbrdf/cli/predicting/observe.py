"""`pbrdf observe`: the readings of a goniometer, from each detector back to the source."""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pbrdf.cli import declaring, option_text, options
from pbrdf.cli.options import Stokes

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    import numpy as np
    import xarray as xr


class Estimator(StrEnum):
    """How light that reaches the source is valued."""

    facets = "facets"
    paths = "paths"
    corners = "corners"
    counting = "count"


class Start(StrEnum):
    """End of the scan at which rays start."""

    detector = "detector"
    source = "source"


def command(
    scene: Annotated[Path, typer.Argument(help="Scene file (TOML).", show_default=False)],
    scan: Annotated[
        Path | None,
        typer.Option(help="Goniometer file whose geometries are to be simulated."),
    ] = None,
    columns: declaring.ScanColumns = None,
    azimuth_of_forward: declaring.Forward = None,
    angles: declaring.Angles = None,
    quantity: declaring.QuantityOption = None,
    normalised: declaring.Normalised = None,
    theta_i: options.Incidences = "30",
    theta_view: Annotated[
        str,
        typer.Option(
            "--theta-view-deg",
            help="View angles in the plane, by commas; positive on the specular side.",
        ),
    ] = "-60,-45,-30,-15,0,15,20,25,30,35,40,45,60",
    phi_i: options.Azimuth = "uniform",
    source_half_angle: Annotated[
        float,
        typer.Option(
            "--source-half-angle-deg", min=0.006, max=28.0, help="Half-angle of the source."
        ),
    ] = 0.5,
    detector_half_angle: Annotated[
        float,
        typer.Option(
            "--detector-half-angle-deg",
            min=0.006,
            max=28.0,
            help="Half-angle of the detector.",
        ),
    ] = 0.5,
    output: options.Output = None,
    force: options.Force = False,
    n_rays: options.Bundles = 20_000,
    realizations: options.Realizations = 16,
    target: options.Target = None,
    max_bounces: options.Bounces = None,
    hemisphere_samples: Annotated[
        float,
        typer.Option(min=0.1, max=1e4, help="Rays above a point of a diffuse base."),
    ] = 2.0,
    sample_decay: Annotated[
        float,
        typer.Option(min=0.01, max=1.0, help="Factor on them for each bounce before."),
    ] = 0.5,
    estimator: Annotated[
        Estimator, typer.Option(help="How light that reaches the source is valued.")
    ] = Estimator.facets,
    start: Annotated[
        Start,
        typer.Option(help="Where rays start; from the source long scans are quicker."),
    ] = Start.detector,
    wavelength: options.Wavelengths = None,
    stokes: options.StokesOption = Stokes.full,
    seed: options.Seed = 0,
    workers: options.Workers = None,
) -> None:
    """Simulate the readings of a goniometer with its finite source and detector.

    The result is a scan (.csv) or, with bounces apart, a dataset (.nc, .zarr), by the name
    of the output.

    Example: pbrdf observe scene.toml --scan measured.csv -o simulated.csv
    """
    import numpy as np

    import pbrdf
    from data_io import write_goniometer, write_result
    from data_io.reflectance.result_store import fill_store
    from pbrdf.cli.progress import progress_bar
    from pbrdf.cli.staging import staged_file, staged_store
    from pbrdf.observation.readings import as_scan

    loaded = pbrdf.load_scene(scene)
    target_file = output or scene.with_name(f"{scene.stem}-scan.csv")
    waves = option_text.wavelengths(wavelength)
    if waves is not None and len(waves) > 1 and target_file.suffix not in (".nc", ".zarr"):
        msg = (
            f"--wavelength-um must be one number for a scan, got {len(waves)}. "
            "Name an output that ends in .nc or .zarr."
        )
        raise ValueError(msg)
    declared = declaring.declarations(
        columns, azimuth_of_forward, angles, quantity, normalised
    )
    if scan is None:
        _only_with_scan(declared)
        geometry = _plane(theta_i, theta_view)
    else:
        geometry, waves = _of_scan(scan, waves, declared)
    azimuth = _one_azimuth(phi_i)
    store = target_file.suffix == ".zarr"
    staged = staged_store if store else staged_file
    with staged(target_file, force=force) as stage:
        with progress_bar("observing") as progress:
            result = pbrdf.observe(
                loaded,
                *geometry,
                phi_i=azimuth,
                source_half_angle=float(np.deg2rad(source_half_angle)),
                detector_half_angle=float(np.deg2rad(detector_half_angle)),
                n_rays=n_rays,
                realizations=realizations,
                target_rel_error=target,
                max_bounces=max_bounces,
                hemisphere_samples=hemisphere_samples,
                sample_decay=sample_decay,
                estimator=estimator.value,
                start=start.value,
                wavelength=waves if waves is None or len(waves) > 1 else waves[0],
                stokes=stokes.value,
                seed=seed,
                workers=workers,
                progress=progress,
            )
        if store:
            fill_store([result], stage)
        elif target_file.suffix == ".nc":
            write_result(result, stage)
        else:
            write_goniometer(as_scan(result), stage)
    for line in _brightest(result):
        typer.echo(line)
    typer.echo(f"Result: {target_file}")


def _plane(theta_i: str, theta_view: str) -> "tuple[np.ndarray, np.ndarray, np.ndarray]":
    """Return every view angle at every incidence. [rad]"""
    import numpy as np

    incidences = np.deg2rad(option_text.numbers(theta_i, "--theta-i-deg"))
    views = np.deg2rad(option_text.numbers(theta_view, "--theta-view-deg"))
    source, view = (mesh.ravel() for mesh in np.meshgrid(incidences, views, indexing="ij"))
    return source, np.abs(view), np.where(view >= 0.0, np.pi, 0.0)


def _one_azimuth(text: str) -> str | float:
    """Return "uniform" or the one azimuth. [rad]"""
    azimuth = option_text.azimuths(text)
    if isinstance(azimuth, list):
        msg = (
            f"--phi-i-deg must be one number or uniform here, got {len(azimuth)}. "
            "Run observe once for each."
        )
        raise ValueError(msg)
    return azimuth


def _only_with_scan(declared: "Mapping[str, object]") -> None:
    """Refuse what says how a scan is to be read where there is none."""
    for name, value in declared.items():
        if value is not None:
            option = f"--{name.replace('_', '-')}"
            msg = f"{option} says how to read a --scan, got none. Leave it out."
            raise ValueError(msg)


def _of_scan(
    path: Path, waves: list[float] | None, declared: "Mapping[str, Any]"
) -> "tuple[tuple[np.ndarray, np.ndarray, np.ndarray], list[float] | None]":
    """Return the geometries of a measured scan, each once, and the wavelengths to trace.

    A scan that names none holds geometries of any; of one that names one, it is taken where
    none was asked for. [rad], [um]
    """
    import numpy as np

    from pbrdf.cli.reading import read_scan

    scan = read_scan(path, declared=declared)
    if "wavelength" in scan.coords:
        if waves is not None:
            scan = read_scan(path, wavelength=waves[0], declared=declared)
        elif scan.wavelength.size == 1 or np.ptp(scan.wavelength.values) == 0.0:
            waves = [float(scan.wavelength.values.flat[0])]
    rows = np.stack([scan[name].values for name in ("theta_i", "theta_s", "dphi")], axis=1)
    _, first = np.unique(rows.round(9), axis=0, return_index=True)
    columns = rows[np.sort(first)].T
    return (columns[0], columns[1], columns[2]), waves


def _brightest(result: "xr.Dataset") -> "Iterator[str]":
    """Yield the brightest reading of each incidence (the first wavelength)."""
    import numpy as np

    if "wavelength" in result.dims:
        result = result.isel(wavelength=0)
    for theta_i in np.unique(result.theta_i.values):
        here = result.isel(geometry=np.flatnonzero(result.theta_i.values == theta_i))
        m00 = here.brdf_total[:, 0, 0].values
        place = int(m00.argmax())
        error = here.brdf_total_stderr[place, 0, 0].item()
        yield (
            f"{np.rad2deg(theta_i):.4g}°  largest M00 {m00[place]:.5g} ± {error:.1g} 1/sr "
            f"at theta_s {np.rad2deg(here.theta_s.values[place]):.4g}°, dphi "
            f"{np.rad2deg(here.dphi.values[place]):.4g}°"
        )

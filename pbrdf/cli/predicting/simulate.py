"""`pbrdf simulate`: trace a scene described by a TOML file."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pbrdf.cli import options
from pbrdf.cli.options import Stokes

if TYPE_CHECKING:
    import xarray as xr


def command(
    scene: Annotated[Path, typer.Argument(help="Scene file (TOML).", show_default=False)],
    theta_i: options.Incidences = "30",
    phi_i: options.Azimuths = "0",
    source_half_angle: options.SourceHalfAngle = 0.0,
    fold: options.Fold = False,
    output: options.Output = None,
    force: options.Force = False,
    n_rays: options.PlannedRays = None,
    realizations: options.PlannedRealizations = None,
    target: options.Target = None,
    max_bounces: options.Bounces = None,
    wavelength: options.Wavelengths = None,
    n_theta: options.ThetaBins = 45,
    n_dphi: options.DphiBins = 90,
    stokes: options.StokesOption = Stokes.full,
    seed: options.Seed = 0,
    workers: options.Workers = None,
    explain: Annotated[
        bool, typer.Option("--explain", help="Say what was not computed, and why.")
    ] = False,
    wave: Annotated[
        str | None,
        typer.Option(
            "--wave",
            help="Let waves do the first bounce, by this form: auto, order-weighted, ...",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Simulate the Mueller BRDF of a rough surface over the whole hemisphere.

    Example: pbrdf simulate scene.toml --theta-i-deg 10,30,60 -o result.nc
    """
    given = dict(locals())
    import numpy as np

    import pbrdf
    from data_io import write_result
    from fitting.report.record import record_of
    from pbrdf.cli.progress import progress_bar
    from pbrdf.cli.staging import staged_file
    from pbrdf.cli.typed import words_typed
    from pbrdf.simulation.memory import CURE, asked_size
    from pbrdf.tracer.memory import check_room, stored

    loaded = pbrdf.load_scene(scene)
    target_file = options.result_file(output or scene.with_suffix(".nc"))
    if target is None or n_rays is not None or realizations is not None:
        n_rays, realizations = n_rays or 100_000, realizations or 16
    waves = None if wavelength is None else options.numbers(wavelength, "--wavelength-um")
    size = asked_size(
        options.incidences(theta_i), options.azimuths(phi_i), waves, n_theta, n_dphi,
        stokes.value,
    )  # fmt: skip
    check_room(stored(size), f"{size.words()}, written to netCDF", f"{CURE}.")
    with staged_file(target_file, force=force) as stage:
        with progress_bar("tracing") as progress:
            result = pbrdf.simulate(
                loaded,
                options.incidences(theta_i),
                phi_i=options.azimuths(phi_i),
                n_rays=n_rays,
                realizations=realizations,
                seed=seed,
                max_bounces=max_bounces,
                target_rel_error=target,
                wavelength=waves,
                n_theta=n_theta,
                n_dphi=n_dphi,
                stokes=stokes.value,
                workers=workers,
                progress=progress,
                explain=explain,
                source_half_angle=float(np.deg2rad(source_half_angle)),
                fold=fold,
                wave=wave,
            )
        result.attrs["made_by"] = record_of(
            {"scene": scene}, command="simulate", options=options.recorded(given),
            typed=words_typed(),
        )  # fmt: skip
        write_result(result, stage)
    for line in [*result.attrs["plan"], *result.attrs["explanation"]]:
        typer.echo(line)
    for line in budget(result):
        typer.echo(line)
    typer.echo(f"Result: {target_file}")


def budget(result: "xr.Dataset") -> Iterator[str]:
    """Yield where the light went, one line an incidence (the first wavelength)."""
    import numpy as np

    if "phi_i" in result.dims:
        for position, phi_i in enumerate(result.phi_i.values):
            yield f"azimuth {np.rad2deg(phi_i):.4g}°:"
            yield from budget(result.isel(phi_i=position))
        return
    if "wavelength" in result.dims:
        result = result.isel(wavelength=0)
    for position, theta_i in enumerate(result.theta_i.values):
        here = result.isel(theta_i=position)
        parts = [
            f"{name} {float(here[name]):.6f}"
            for name in ("absorbed", "transmitted", "truncated", "leaked")
        ]
        albedo = ", ".join(
            f"{label}: {float(value):.6f} ± {float(error):.1g}"
            for label, value, error in zip(
                here.bounces.values, here.albedo, here.albedo_stderr, strict=True
            )
        )
        if "coherent" in here:
            parts.insert(0, f"beam of the mean field {float(here.coherent[0, 0]):.6f}")
        yield f"{np.rad2deg(theta_i):.4g}°  albedo by bounces {albedo}; {', '.join(parts)}"

"""`pbrdf simulate`: trace a scene described by a TOML file."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pbrdf.cli import option_text, options
from pbrdf.cli.options import Stokes

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

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

    A result that does not fit into memory goes to a store, direction by direction.

    Example: pbrdf simulate scene.toml --theta-i-deg 10,30,60 -o result.nc

    Example: pbrdf simulate scene.toml --theta-i-deg 0,10,20,30 -o result.zarr
    """
    given = dict(locals())
    import numpy as np

    import pbrdf
    from fitting.report.record import record_of
    from pbrdf.cli.progress import progress_bar
    from pbrdf.cli.typed import words_typed
    from pbrdf.simulation import simulate_parts

    loaded = pbrdf.load_scene(scene)
    target_file = option_text.result_file(output or scene.with_suffix(".nc"))
    if target is None or n_rays is not None or realizations is not None:
        n_rays, realizations = n_rays or 100_000, realizations or 16
    waves = option_text.wavelengths(wavelength)
    directions, azimuths = option_text.incidences(theta_i), option_text.azimuths(phi_i)
    size: dict[str, Any] = {
        "phi_i": azimuths, "wavelength": waves, "n_theta": n_theta, "n_dphi": n_dphi,
        "stokes": stokes.value,
    }  # fmt: skip
    record = record_of(
        {"scene": scene}, command="simulate", options=option_text.recorded(given),
        typed=words_typed(),
    )  # fmt: skip
    store = target_file.suffix == ".zarr"
    if not store:
        _check_file(directions, size)
    lines: list[str] = []
    # A target error is reached by all directions together
    apart = store and target is None
    with (
        _staged(target_file, force=force, store=store) as stage,
        progress_bar("tracing") as progress,
    ):
        run: Any = partial(
            simulate_parts if apart else pbrdf.simulate, loaded, directions, n_rays=n_rays,
            realizations=realizations, seed=seed, max_bounces=max_bounces,
            target_rel_error=target, workers=workers, progress=progress, explain=explain,
            fold=fold, wave=wave, source_half_angle=float(np.deg2rad(source_half_angle)),
        )  # fmt: skip
        made = run(**size) if apart else [run(**size)]
        parts = (part.assign_attrs(made_by=record) for part in made)
        _write(_told(parts, lines), stage, store=store)
    for line in dict.fromkeys(lines):
        typer.echo(line)
    typer.echo(f"Result: {target_file}")


def _check_file(directions: Any, size: dict[str, Any]) -> None:
    """Refuse a result that could be computed, but not written to one file."""
    from pbrdf.memory import check_room, stored
    from pbrdf.simulation.memory import CURE, asked_size

    asked = asked_size(directions, **size)
    cure = f"{CURE}, or write it part by part, -o name.zarr."
    check_room(stored(asked), f"{asked.words()}, written to netCDF", cure)


def _staged(target: Path, *, force: bool, store: bool) -> "AbstractContextManager[Path]":
    from pbrdf.cli.staging import staged_file, staged_store

    return (staged_store if store else staged_file)(target, force=force)


def _write(parts: "Iterator[xr.Dataset]", stage: Path, *, store: bool) -> None:
    from data_io import write_result
    from data_io.reflectance.result_store import fill_store

    if store:
        fill_store(parts, stage)
        return
    for result in parts:
        write_result(result, stage)


def _told(parts: "Iterator[xr.Dataset]", lines: list[str]) -> "Iterator[xr.Dataset]":
    """Put down what is to be said of each part, on its way."""
    for part in parts:
        lines += [*part.attrs["plan"], *part.attrs["explanation"], *budget(part)]
        yield part


# Wavelengths that the lines on the terminal go through
_MOST_WAVES = 8


def budget(result: "xr.Dataset") -> Iterator[str]:
    """Yield where the light went, one line an incidence, under azimuth and wavelength."""
    import numpy as np

    if "phi_i" in result.dims:
        for position, phi_i in enumerate(result.phi_i.values):
            yield f"azimuth {np.rad2deg(phi_i):.4g}°:"
            yield from budget(result.isel(phi_i=position))
        return
    if "wavelength" in result.dims:
        waves = result.wavelength.values
        # Of many the ends
        for position in range(len(waves)) if len(waves) <= _MOST_WAVES else (0, -1):
            yield f"{waves[position]:.6g} um:"
            yield from budget(result.isel(wavelength=position))
        return
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

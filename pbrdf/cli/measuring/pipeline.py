"""`pbrdf pipeline`: surface and scan in, reflectance model out."""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pbrdf.cli import declaring, options
from pbrdf.cli.options import Kind

if TYPE_CHECKING:
    from fitting.pipeline import PipelineResult
    from pbrdf import Material


def command(
    surface: options.Surface,
    scan: options.Scan,
    n: options.OptionalIndex = None,
    kappa: options.Kappa = 0.0,
    material_file: options.MaterialFile = None,
    output: options.Output = None,
    force: options.Force = False,
    kind: options.KindOption = Kind.auto,
    um_per_pixel: options.UmPerPixel = None,
    spacing: options.Spacing = None,
    unit: options.Unit = None,
    channel: options.Channel = None,
    columns: options.ColumnsOption = None,
    block: options.Block = None,
    um_per_level: options.UmPerLevel = None,
    mend: options.MendOption = "all",
    form: options.FormOption = "tilt",
    wavelength: options.Wavelength = None,
    scan_columns: declaring.PipelineScanColumns = None,
    azimuth_of_forward: declaring.Forward = None,
    angles: declaring.Angles = None,
    quantity: declaring.QuantityOption = None,
    normalised: declaring.Normalised = None,
    accept: declaring.Accept = "",
    free: options.Free = "specular_gain,diffuse_albedo",
    shadowing: options.Shadowing = "smith-correlated",
    blocked: options.Blocked = 0.0,
    n_rays: options.Rays = 200_000,
    realizations: options.Realizations = 32,
    seed: options.Seed = 0,
    workers: options.Workers = None,
    quick: Annotated[
        bool,
        typer.Option("--quick", help="The analytical fit alone: a first look in seconds."),
    ] = False,
) -> None:
    """Turn a measured surface and its goniometer scan into a polarised reflectance model.

    Writes a folder with report.html, model.toml (load it with data_io.read_model),
    result.nc and the figures. With --quick nothing is simulated, and there is no result.nc.

    Example: pbrdf pipeline edge.png scan.csv --um-per-pixel 0.5 --n 1.53
    """
    given, begin = dict(locals()), perf_counter()
    from pbrdf.cli.progress import StageBars
    from pbrdf.cli.reading import read_material, read_scan, read_surface
    from pbrdf.cli.staging import staged_folder
    from pbrdf.cli.typed import words_typed

    target = output or Path(f"{scan.stem}-model")
    material = _needed(read_material(n, kappa, material_file))
    declared = declaring.declarations(
        scan_columns, azimuth_of_forward, angles, quantity, normalised,
        option="--scan-columns",
    )  # fmt: skip
    with ExitStack() as stack:
        # A target that may not be written is refused before the work, not after
        stage = stack.enter_context(staged_folder(target, force=force))
        heights = read_surface(
            surface, kind=kind, um_per_pixel=um_per_pixel, spacing=spacing, unit=unit,
            channel=channel, columns=columns, block=block, um_per_level=um_per_level,
            mend=mend,
        )  # fmt: skip
        measurement = read_scan(scan, wavelength=wavelength, declared=declared)
        reading = perf_counter() - begin

        from fitting.readings.masks import blocked_detector, zeros
        from fitting.report.record import record_of

        bars = stack.enter_context(StageBars())
        common: dict[str, Any] = {
            "material": material,
            "free": options.names(free),
            "shadowing": shadowing,
            "form": options.form(form),
            "mask": (zeros(), blocked_detector(blocked)) if blocked else (zeros(),),
            "accept": options.names(accept),
            "progress": bars.update,
        }
        record = record_of(
            {"surface": surface, "scan": scan, "material": material_file},
            command="pipeline",
            options=options.recorded(given),
            typed=words_typed(),
        )
        if quick:
            _first_look(heights, measurement, common, stage, record, surface)
            typer.echo(f"Report:  {target / 'report.html'}")
            return
        index = material_file or f"{n:g} + {kappa:g} i"
        inputs = {
            "surface": surface.name, "scan": scan.name, "index": index, "fitted": free
        }  # fmt: skip
        tracing = {
            "n_rays": n_rays, "realizations": realizations, "seed": seed, "workers": workers
        }  # fmt: skip
        told = _whole_way(
            heights, measurement, common | tracing, stage, record, surface, inputs, reading
        )
    typer.echo("\n".join(told))
    typer.echo(f"Report:  {target / 'report.html'}")


def _whole_way(
    heights: Any,
    measurement: Any,
    chosen: dict[str, Any],
    stage: Path,
    record: dict[str, Any],
    picture: Path,
    inputs: dict[str, str],
    reading: float,
) -> list[str]:
    """Fit, simulate and write everything; return what to print."""
    from fitting.pipeline import run_pipeline
    from fitting.report.write import write_report

    result = run_pipeline(heights, measurement, **chosen)
    begin, seconds = perf_counter(), {"reading": reading}
    write_report(
        result, stage, inputs=inputs, seconds=seconds, record=record, picture=picture
    )
    stages = {**seconds, **result.seconds, "report": perf_counter() - begin}
    return [*summary(result), _times(stages)]


def _needed(material: "Material | None") -> "Material":
    """Return the material, refused where none is given."""
    if material is None:
        msg = "--n must be given, got none. Or give a --material-file."
        raise ValueError(msg)
    return material


def _times(stages: dict[str, float]) -> str:
    """Return the seconds of each stage and of all, in one line."""
    whole = stages | {"in all": sum(stages.values())}
    return "\nSeconds: " + ", ".join(f"{name} {s:.1f}" for name, s in whole.items())


def _first_look(
    heights: Any,
    measurement: Any,
    common: dict[str, Any],
    stage: Path,
    record: dict[str, Any],
    picture: Path,
) -> None:
    """Fit the analytical curve, write and print it."""
    from fitting.quick import run_quick
    from fitting.report.quick_page import write_quick

    result = run_quick(heights, measurement, **common)
    write_quick(result, stage, record=record, picture=picture)
    typer.echo(str(result.statistics))
    typer.echo(result.analytic.summary())
    typer.echo("Nothing was simulated; without --quick, light of several bounces is.")


def summary(result: "PipelineResult") -> Iterator[str]:
    """Yield what a reader at the terminal wants to know."""
    from fitting.report.write import fit_columns

    yield "Surface"
    for name, (estimate, unit) in result.statistics.estimates().items():
        if name in ("height_rms", "corr_length", "slope_rms", "noise_rms"):
            yield f"  {name:<16} {estimate} {'' if unit == '1' else unit}".rstrip()
    for title, fit in fit_columns(result).items():
        yield title
        for name, estimate in fit.estimates.items():
            yield f"  {name:<16} {estimate}"
        yield from (f"  {name} {estimate}" for name, estimate in fit.ratios.items())
        if not fit.n_estimated:
            yield f"  {'chi2 / dof':<16} {fit.chi2 / fit.dof:.3g}"
        yield f"  {'misfit':<16} {fit.misfit}"
    if result.unknown:
        yield "What these data cannot tell"
        for text in result.unknown:
            yield f"  - {text}"

"""`pbrdf pipeline`: surface and scan in, reflectance model out."""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pbrdf.cli import declaring, option_text, options
from pbrdf.cli.options import Kind

if TYPE_CHECKING:
    import xarray as xr

    from fitting.pipeline import PipelineResult
    from pbrdf import Material


def command(
    surface: options.Surface,
    scan: options.Scan,
    n: options.OptionalIndex = None,
    kappa: options.Kappa = None,
    material_file: options.MaterialFile = None,
    material_ignore: options.MaterialIgnore = "",
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
    source_half_angle: declaring.SourceCone = None,
    detector_half_angle: declaring.DetectorCone = None,
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
    result.nc and the figures. Of several wavelengths each has such a folder in it, beside
    spectrum.csv and spectrum.png. With --quick nothing is simulated, and there is neither
    result.nc nor spectrum.

    Example: pbrdf pipeline edge.png scan.csv --um-per-pixel 0.5 --n 1.53
    """
    given, begin = dict(locals()), perf_counter()
    from pbrdf.cli.progress import StageBars
    from pbrdf.cli.reading import read_material, read_scan, read_surface
    from pbrdf.cli.staging import staged_folder
    from pbrdf.cli.typed import words_typed

    target = output or Path(f"{scan.stem}-model")
    material = _needed(
        read_material(n, kappa, material_file, option_text.names(material_ignore))
    )
    declared = declaring.declarations(
        scan_columns, azimuth_of_forward, angles, quantity, normalised,
        source_half_angle=source_half_angle, detector_half_angle=detector_half_angle,
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
            "free": option_text.names(free),
            "shadowing": shadowing,
            "form": option_text.form(form),
            "mask": (zeros(), blocked_detector(blocked)) if blocked else (zeros(),),
            "accept": option_text.names(accept),
            "progress": bars.update,
        }
        record = record_of(
            {"surface": surface, "scan": scan, "material": material_file},
            command="pipeline",
            options=option_text.recorded(given),
            typed=words_typed(),
        )
        if quick:
            told = _first_looks(heights, measurement, common, stage, record, surface)
        else:
            index = material_file or f"{n:g} + {kappa or 0.0:g} i"
            inputs = {
                "surface": surface.name, "scan": scan.name, "index": index, "fitted": free
            }  # fmt: skip
            tracing = {"n_rays": n_rays, "realizations": realizations, "seed": seed,
                       "workers": workers}  # fmt: skip
            told = _whole_way(
                heights, measurement, common | tracing, stage, record, surface, inputs,
                reading,
            )  # fmt: skip
    _say(told, target, quick=quick)
    typer.echo(f"Seconds in all: {perf_counter() - begin:.1f}")


def _say(told: dict[str, str], target: Path, *, quick: bool) -> None:
    """Print what each wavelength gave and where its report is."""
    for folder, text in told.items():
        typer.echo(f"{text}\nReport:  {target / folder / 'report.html'}")
    if len(told) > 1:
        typer.echo(
            "\nEach wavelength was fitted for itself; pbrdf fit shares slopes between them."
            + ("" if quick else f"\nSpectrum: {target / 'spectrum.csv'}")
        )


def _parts(
    measurement: "xr.Dataset", stage: Path
) -> "Iterator[tuple[float | None, str, xr.Dataset]]":
    """Yield each wavelength [um], its folder's name, and its readings; make the folder."""
    from fitting.readings.wavelengths import by_wavelength

    for wave, part in by_wavelength(measurement).items():
        name = "" if wave is None else f"{wave:.9g}um"
        (stage / name).mkdir(exist_ok=True)
        yield wave, name, part


def _at(wave: float | None) -> list[str]:
    return [] if wave is None else [f"\nAt {wave:.9g} um"]


def _whole_way(
    heights: Any,
    measurement: "xr.Dataset",
    chosen: dict[str, Any],
    stage: Path,
    record: dict[str, Any],
    picture: Path,
    inputs: dict[str, str],
    reading: float,
) -> dict[str, str]:
    """Fit, simulate and write everything; return what to print, by the folder's name."""
    from fitting.pipeline import run_pipeline
    from fitting.report.write import write_report, write_spectrum

    told, results = {}, {}
    for wave, name, part in _parts(measurement, stage):
        result = run_pipeline(heights, part, **chosen)
        begin, seconds = perf_counter(), {"reading": reading}
        named = inputs | ({} if wave is None else {"wavelength": f"{wave:.9g} um"})
        write_report(
            result, stage / name, inputs=named, seconds=seconds, record=record,
            picture=picture,
        )  # fmt: skip
        stages = {**seconds, **result.seconds, "report": perf_counter() - begin}
        told[name] = "\n".join([*_at(wave), *summary(result), _times(stages)])
        if wave is not None:
            results[wave] = result
    if results:
        write_spectrum(results, stage)
    return told


def _needed(material: "Material | None") -> "Material":
    """Return the material, refused where none is given."""
    if material is None:
        msg = "--n must be given, got none. Or give a --material-file."
        raise ValueError(msg)
    return material


def _times(stages: dict[str, float]) -> str:
    """Return the seconds of each stage, in one line."""
    return "\nSeconds: " + ", ".join(f"{name} {s:.1f}" for name, s in stages.items())


def _first_looks(
    heights: Any,
    measurement: "xr.Dataset",
    common: dict[str, Any],
    stage: Path,
    record: dict[str, Any],
    picture: Path,
) -> dict[str, str]:
    """Fit the analytical curve and write it; return what to print, by the folder's name."""
    from fitting.quick import run_quick
    from fitting.report.quick_page import write_quick

    told = {}
    for wave, name, part in _parts(measurement, stage):
        result = run_quick(heights, part, **common)
        write_quick(result, stage / name, record=record, picture=picture)
        said = [*_at(wave), str(result.statistics), result.analytic.summary()]
        said.append("Nothing was simulated; without --quick, light of several bounces is.")
        told[name] = "\n".join(said)
    return told


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
    if result.measured_slopes is not None:
        yield "Slopes as measured"
        yield from (f"  {text}" for text in result.measured_slopes.texts)
    if result.unknown:
        yield "What these data cannot tell"
        for text in result.unknown:
            yield f"  - {text}"

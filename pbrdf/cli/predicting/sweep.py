"""`pbrdf sweep`: many simulations of a scene with varied values."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pbrdf.cli import option_text, options
from pbrdf.cli.options import Stokes
from pbrdf.cli.unused import was_typed

if TYPE_CHECKING:
    from pbrdf.sweeps import Report, Sweep

# How many failures and warnings are told one by one
TOLD = 5
# Options that a sweep file has under [simulate]
_IN_FILE = (
    "theta_i", "phi_i", "source_half_angle", "fold", "n_rays", "realizations", "target",
    "max_bounces", "wavelength", "n_theta", "n_dphi", "stokes", "seed", "vary",
)  # fmt: skip


def command(
    context: typer.Context,
    source: Annotated[
        Path,
        typer.Argument(help="Sweep file, or scene file with --vary (TOML)."),
    ],
    vary: Annotated[
        list[str] | None,
        typer.Option(
            help="NAME=VALUE,VALUE,... once or more: a key of the scene file, or its path "
            "such as contaminants[0].coverage."
        ),
    ] = None,
    theta_i: options.Incidences = "30",
    phi_i: options.Azimuths = "uniform",
    source_half_angle: options.SourceHalfAngle = 0.0,
    fold: options.Fold = False,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            help="NAME.zarr: a store that grows while the sweep runs, and goes on after a "
            "kill. NAME.nc: one file at the end.",
        ),
    ] = None,
    force: options.Force = False,
    n_rays: options.Rays = 100_000,
    realizations: options.Realizations = 16,
    target: options.Target = None,
    max_bounces: options.Bounces = None,
    wavelength: options.Wavelengths = None,
    n_theta: options.ThetaBins = 45,
    n_dphi: options.DphiBins = 90,
    stokes: options.StokesOption = Stokes.full,
    seed: options.Seed = 0,
    workers: options.Workers = None,
    scheduler: Annotated[
        str | None,
        typer.Option(help="Scheduler of Dask whose workers compute: tcp://host:8786."),
    ] = None,
    part: Annotated[
        str | None,
        typer.Option(help="I/N: compute part I of N only, as in a job array."),
    ] = None,
    dry_run: Annotated[
        bool,
        typer.Option("--dry-run", help="Say how many tasks, how much memory and time."),
    ] = False,
) -> None:
    """Simulate a scene for many values: a grid, a list or a sampled design.

    The same command goes on where a killed one stopped, and computes failed points again.
    All points share the seed, so that differences between them are less noisy than the
    results.

    Example: pbrdf sweep scene.toml --vary slope_rms=0.05,0.15,0.3 --theta-i-deg 10,60

    Example: pbrdf sweep sweep.toml -o coatings.zarr --part 3/20
    """
    sweep = _described(context, source, vary or [])
    suffix = ".nc" if vary else ".zarr"
    target_path = output or source.with_name(f"{source.stem}-sweep{suffix}")
    if target_path.suffix not in (".nc", ".zarr"):
        msg = f"--output must end in .zarr (a store) or .nc, got {target_path.name!r}."
        raise ValueError(msg)
    if dry_run:
        from pbrdf.sweeps.expectation import forecast

        for line in forecast(sweep, workers=workers).sentences():
            typer.echo(line)
        return
    if target_path.suffix == ".nc":
        if scheduler or part:
            msg = f"--output must end in .zarr for that, got {target_path.name!r}."
            raise ValueError(msg)
        report = _one_file(context, sweep, target_path)
    else:
        if part and force:
            msg = (
                "--force must be left out with --part, it would delete what the other "
                f"parts have computed. Delete {target_path.name} before the first of them."
            )
            raise ValueError(msg)
        report = _store(sweep, target_path, workers, scheduler, _part(part), force)
    _tell(report)
    what = "simulations" if target_path.suffix == ".nc" else "groups computed"
    typer.echo(f"{report.computed} {what}, {report.kept} kept: {target_path}")
    if report.errors:
        raise typer.Exit(1)


def _described(context: typer.Context, source: Path, vary: list[str]) -> "Sweep":
    """Return the sweep of a file, or that of a scene file and the options."""
    from pbrdf.files import read_toml
    from pbrdf.sweeps import load_sweep, sweep_of

    given = [name for name in _IN_FILE if was_typed(context, name)]
    if not vary and ("vary" in read_toml(source) or "scene" in read_toml(source)):
        if given:
            option = given[0].replace("_", "-")
            msg = (
                f"--{option} must be left out with a sweep file. Write it in [simulate] of "
                f"{source.name}."
            )
            raise ValueError(msg)
        return load_sweep(source)
    if not vary:
        msg = (
            "--vary must be given with a scene file. Or write a sweep file with a table "
            "[vary]."
        )
        raise ValueError(msg)
    axes = dict(_axis(text) for text in vary)
    if len(axes) < len(vary):
        msg = f"--vary must name each value once, got {', '.join(vary)}."
        raise ValueError(msg)
    return sweep_of(read_toml(source), source, axes, _settings(context.params))


def _settings(params: dict[str, Any]) -> dict[str, Any]:
    """Return the table [simulate] that the options say."""
    azimuths: Any = params["phi_i"].strip()
    if azimuths != "uniform":
        listed = option_text.numbers(azimuths, "--phi-i-deg")
        azimuths = listed[0] if len(listed) == 1 else listed
    option_text.incidences(params["theta_i"])
    table = {
        "theta_i_deg": option_text.numbers(params["theta_i"], "--theta-i-deg"),
        "phi_i_deg": azimuths,
        "source_half_angle_deg": params["source_half_angle"],
        "target_rel_error": params["target"],
        "stokes": params["stokes"].value,
    }
    plain = ("fold", "n_rays", "realizations", "max_bounces", "n_theta", "n_dphi", "seed")
    table |= {name: params[name] for name in plain}
    table["wavelength_um"] = option_text.wavelengths(params["wavelength"])
    return {key: value for key, value in table.items() if value is not None}


def _one_file(context: typer.Context, sweep: "Sweep", target: Path) -> "Report":
    from data_io import write_result
    from fitting.report.record import record_of
    from pbrdf.cli.progress import progress_bar
    from pbrdf.cli.staging import staged_file
    from pbrdf.cli.typed import words_typed
    from pbrdf.sweeps.in_memory import computed

    given = context.params
    workers = given["workers"]
    record = record_of(
        {"scene": given["source"]}, command="sweep", options=option_text.recorded(given),
        typed=words_typed(),
    )  # fmt: skip
    with staged_file(target, force=given["force"]) as stage:
        with progress_bar("sweep") as progress:
            dataset, report = computed(sweep, workers=workers, progress=progress)
        write_result(dataset.assign_attrs(made_by=record), stage)
    return report


def _store(
    sweep: "Sweep",
    target: Path,
    workers: int | None,
    scheduler: str | None,
    part: tuple[int, int] | None,
    force: bool,
) -> "Report":
    from contextlib import nullcontext

    from pbrdf.cli.progress import progress_bar
    from pbrdf.sweeps import run_sweep
    from pbrdf.sweeps.workers import connected

    with (
        connected(scheduler) if scheduler else nullcontext() as client,
        progress_bar("sweep") as progress,
    ):
        try:
            return run_sweep(
                sweep, target, client=client, workers=workers, part=part, replace=force,
                progress=progress,
            )  # fmt: skip
        except BaseException as error:
            if not isinstance(error, Exception):
                # Ended from outside
                error.add_note(f"{target} keeps what is finished, the same command goes on")
            raise


def _tell(report: "Report") -> None:
    """Say what failed and what was warned of."""
    from pbrdf.cli.progress import Talk, talk

    for point, error in list(report.errors.items())[:TOLD]:
        typer.echo(f"error: at {point}: {error}", err=True)
    if len(report.errors) > TOLD:
        typer.echo(f"error: and at {len(report.errors) - TOLD} other places", err=True)
    if report.errors:
        typer.echo(
            "The others are done. Mend the cause; the same command computes these again.",
            err=True,
        )
    if talk() is Talk.QUIET:
        return
    from pbrdf.sweeps.store import said

    lines = said(report.warnings)
    for line in lines[:TOLD]:
        typer.echo(f"warning: {line}", err=True)
    if len(lines) > TOLD:
        more = len(lines) - TOLD
        typer.echo(f"warning: and {more} other kinds, see the marks of the store", err=True)


def _part(text: str | None) -> tuple[int, int] | None:
    """Return i and n of I/N."""
    if text is None:
        return None
    words = text.split("/")
    if len(words) != 2 or not all(word.isdigit() for word in words):
        msg = f"--part must be I/N, such as 3/20, got {text!r}."
        raise ValueError(msg)
    return int(words[0]), int(words[1])


def _axis(text: str) -> tuple[str, list[Any]]:
    """Return name and values of NAME=VALUE,VALUE,..."""
    name, equals, values = text.partition("=")
    words = option_text.names(values)
    if not equals or not words:
        msg = f"--vary must be NAME=VALUE,VALUE,... got {text!r}."
        raise ValueError(msg)
    return name.strip(), [_value(word) for word in words]


def _value(word: str) -> Any:
    for kind in (int, float):
        try:
            return kind(word)
        except ValueError:
            continue
    return word

"""`pbrdf fit`: bring the analytical model, or a simulated surface, to scans."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pbrdf.cli import declaring, option_text, options
from pbrdf.cli.typed import words_typed
from pbrdf.cli.unused import refuse_unused

if TYPE_CHECKING:
    import xarray as xr

    from fitting.models.simulated import SimulatedModel
    from fitting.models.waves import WaveSurface
    from pbrdf import Material, MicrofacetModel


def command(
    context: typer.Context,
    scans: Annotated[
        list[Path],
        typer.Argument(
            help="Goniometer files; several are fitted together.", show_default=False
        ),
    ],
    n: Annotated[
        float | None,
        typer.Option("--n", min=0.01, max=1e6, help="Real part of the refractive index."),
    ] = None,
    slope_rms: Annotated[
        float | None,
        typer.Option(
            min=1e-3, max=10.0, help="Slope rms per axis, as `pbrdf statistics` gives."
        ),
    ] = None,
    height_rms: Annotated[
        float | None,
        typer.Option(
            "--height-rms-um",
            min=1e-5,
            max=1e3,
            help="Rms height: the surface is seen by waves, in place of a slope.",
        ),
    ] = None,
    corr_length: Annotated[
        float | None,
        typer.Option(
            "--corr-length-um", min=1e-3, max=1e5, help="Its 1/e length, with it."
        ),
    ] = None,
    reach: Annotated[
        float, typer.Option(min=1.01, max=10.0, help="How far both may go, as a factor.")
    ] = 2.0,
    kappa: options.Kappa = None,
    material_file: options.MaterialFile = None,
    material_ignore: options.MaterialIgnore = "",
    scene: Annotated[
        Path | None,
        typer.Option(
            help="Scene (TOML) to simulate with all bounces, in place of index and slope."
        ),
    ] = None,
    slope_stderr: Annotated[
        float | None,
        typer.Option(
            min=1e-9, max=10.0, help="Its standard error, passed on to the results."
        ),
    ] = None,
    free: options.Free = "specular_gain,diffuse_albedo",
    separate: Annotated[
        str,
        typer.Option(
            help="Those of them that each scan has for itself; or n=wavelength, n=nothing."
        ),
    ] = "",
    slope_distribution: options.SlopeLaw = None,
    shadowing: options.Shadowing = "smith-correlated",
    wavelength: options.Wavelength = None,
    columns: declaring.ScanColumns = None,
    azimuth_of_forward: declaring.Forward = None,
    angles: declaring.Angles = None,
    quantity: declaring.QuantityOption = None,
    normalised: declaring.Normalised = None,
    accept: declaring.Accept = "",
    blocked: options.Blocked = 0.0,
    source_half_angle: declaring.SourceCone = None,
    detector_half_angle: declaring.DetectorCone = None,
    solver: Annotated[
        str, typer.Option(help="Solver; an unknown name lists all that exist.")
    ] = "casadi",
    loss: Annotated[
        str, typer.Option(help="linear, or soft_l1, huber, cauchy against outliers.")
    ] = "linear",
    n_rays: options.Rays = 10_000,
    realizations: options.Realizations = 160,
    seed: options.Seed = 0,
    workers: options.Workers = None,
    output: options.Output = None,
    as_json: options.AsJson = None,
    force: options.Force = False,
) -> None:
    """Fit gains, albedos, index or slope to scans, with errors and correlations.

    With --scene the surface is traced once, and everything is fitted to all its bounces.
    Several wavelengths have gains, albedos and index of their own and share the slope.
    With --height-rms-um and --corr-length-um the surface is seen by waves, and --free may
    name height_rms and corr_length.
    With --output writes a folder with fit.json, model.toml and scan.png, and of several
    wavelengths a model each, spectrum.csv and spectrum.png.

    Example: pbrdf fit scan.csv --n 1.53 --slope-rms 0.252
    """
    given = {name: value for name, value in locals().items() if name != "context"}
    from pbrdf.cli.progress import progress_bar
    from pbrdf.cli.reading import read_material
    from pbrdf.cli.staging import answer, staged_folder

    declared = declaring.declarations(
        columns, azimuth_of_forward, angles, quantity, normalised,
        source_half_angle=source_half_angle, detector_half_angle=detector_half_angle,
    )  # fmt: skip
    measured = _read_scans(scans, wavelength, declared)

    from fitting.readings.masks import blocked_detector, zeros
    from fitting.run import fit as fit_model

    with progress_bar("tracing") as progress:
        model: MicrofacetModel | SimulatedModel | WaveSurface
        heights = height_rms, corr_length, reach
        _check_used(context, scene, heights)
        if scene is None:
            ignored = option_text.names(material_ignore)
            material = read_material(n, kappa, material_file, ignored)
            rules = {"shadowing": shadowing, "slope_distribution": slope_distribution}
            model = _closed_form(material, slope_rms, rules, heights)
        else:
            traced = {
                "n_rays": n_rays, "realizations": realizations, "seed": seed,
                "workers": workers, "progress": progress,
            }  # fmt: skip
            names = option_text.names(free)
            model = _simulated(scene, measured.values(), names, **traced)
        result = fit_model(
            measured,
            model,
            free=option_text.names(free),
            solver=solver,
            priors=None if slope_stderr is None else _slope(model, slope_stderr),
            separate=_separate(separate),
            mask=(zeros(), blocked_detector(blocked)) if blocked else (zeros(),),
            loss=loss,
            accept=option_text.names(accept),
        )
    if output is not None:
        with staged_folder(output, force=force) as stage:
            from fitting.report.fit_files import write_fit
            from fitting.report.record import record_of

            files = {"scan": scans, "scene": scene, "material": material_file}
            told, chosen = words_typed(), option_text.recorded(given)
            record = record_of(files, command="fit", options=chosen, typed=told)
            write_fit(result, measured, stage, record=record)
    answer(result.summary(), result.as_dict(), as_json, force=force)
    if not result.converged:
        raise typer.Exit(1)


# Parameters that describe a surface for the closed form, those of waves, and of a tracing
_OF_SLOPE = {"slope_rms", "slope_distribution", "shadowing", "slope_stderr"}
_OF_WAVES = {"height_rms", "corr_length", "reach"}
_OF_MATERIAL = {"n", "kappa", "material_file", "material_ignore"}
_OF_TRACING = {"n_rays", "realizations", "seed", "workers"}


def _check_used(
    context: typer.Context,
    scene: Path | None,
    heights: tuple[float | None, float | None, float],
) -> None:
    """Refuse what has no part in the model that the other options choose."""
    if scene is not None:
        held = (_OF_SLOPE - {"slope_stderr"}) | _OF_WAVES | _OF_MATERIAL
        refuse_unused(context, held, "beside --scene, which has a surface of its own")
        return
    refuse_unused(context, _OF_TRACING, "without --scene: nothing is traced")
    if heights[:2] == (None, None):
        refuse_unused(context, {"reach"}, "without --height-rms-um")
    else:
        made = "beside --height-rms-um: height and length make the slope"
        refuse_unused(context, _OF_SLOPE, made)


def _read_scans(
    paths: list[Path], wavelength: float | None, declared: dict[str, Any]
) -> "dict[str, xr.Dataset]":
    """Return the scans of several files by their names."""
    from pbrdf.cli.reading import read_scan

    found = {
        path.stem: read_scan(path, wavelength=wavelength, declared=declared)
        for path in paths
    }
    if len(found) < len(paths):
        msg = "scans must have names of their own, got two files of one name. Rename one."
        raise ValueError(msg)
    return found


def _separate(text: str) -> dict[str, str]:
    """Return by what each parameter named is told apart.

    >>> _separate("scale, n=wavelength")
    {'scale': 'scan', 'n': 'wavelength'}
    """
    pairs = (word.partition("=") for word in option_text.names(text))
    return {name.strip(): by.strip() or "scan" for name, _, by in pairs}


def _analytic(
    material: "Material | None", slope_rms: float | None, rules: dict[str, Any]
) -> "MicrofacetModel":
    """Return the analytical model to start from."""
    from pbrdf import MicrofacetModel

    if material is None or slope_rms is None:
        option = "--n" if material is None else "--slope-rms"
        msg = f"{option} must be given, got none. Or give a --scene, which has both."
        raise ValueError(msg)
    chosen = {name: rule for name, rule in rules.items() if rule is not None}
    return MicrofacetModel(material, slope_rms=slope_rms, **chosen)


def _closed_form(
    material: "Material | None",
    slope_rms: float | None,
    rules: dict[str, Any],
    heights: tuple[float | None, float | None, float],
) -> "MicrofacetModel | WaveSurface":
    """Return the model to start from: by slope, or by height, length and reach."""
    height_rms, corr_length, reach = heights
    if height_rms is None and corr_length is None:
        return _analytic(material, slope_rms, rules)
    from fitting import WaveSurface
    from pbrdf import WaveModel

    given = {
        "--n": material,
        "--height-rms-um": height_rms,
        "--corr-length-um": corr_length,
    }
    for option, value in given.items():
        if value is None:
            msg = f"{option} must be given where waves are fitted, got none."
            raise ValueError(msg)
    assert material is not None  # looked at above
    model = WaveModel(material, height_rms=height_rms, corr_length=corr_length)
    return WaveSurface(model, reach=reach)


def _simulated(
    scene: Path, scans: "Iterable[xr.Dataset]", free: tuple[str, ...], **options: Any
) -> "SimulatedModel":
    """Return the simulated surface to start from, ready for what is read and varied."""
    import pbrdf
    from fitting import SimulatedModel

    names = {str(name) for scan in scans for name in scan.data_vars}
    circular = any(name[0] in "Mm" and "3" in name[1:3] for name in names)
    loaded = pbrdf.load_scene(scene)
    material, held = loaded.materials[0], None
    if not {"n", "kappa"} & set(free) and not material.dispersive:
        n, kappa = material.index()
        held = ((n, n), (kappa, kappa))
    stokes = "full" if circular else "linear"
    return SimulatedModel(loaded, index_range=held, stokes=stokes, **options)


def _slope(
    model: "MicrofacetModel | SimulatedModel | WaveSurface", stderr: float
) -> dict[str, tuple[float, float]]:
    """Return what is known of the slope."""
    of = model if hasattr(model, "slope_rms") else model.model
    slope = getattr(of, "slope_rms", None)
    if slope is None:
        msg = "--slope-stderr needs a slope, got heights seen by waves. Leave it out."
        raise ValueError(msg)
    if isinstance(slope, tuple):
        msg = "--slope-stderr needs an isotropic surface, got two slopes. Leave it out."
        raise ValueError(msg)
    return {"slope_rms": (slope, stderr)}

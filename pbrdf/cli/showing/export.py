"""`pbrdf export`: results and models in the formats of other programs."""

from collections.abc import Iterator
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pbrdf.cli import option_text, options
from pbrdf.cli.unused import refuse_unused

if TYPE_CHECKING:
    import xarray as xr

    from pbrdf import MicrofacetModel


class Convention(StrEnum):
    """Whose signs, frames and azimuths a table has."""

    pbrdf = "pbrdf"
    scatmech = "scatmech"
    mitsuba = "mitsuba"
    paper = "paper"


# First comment of a table that nobody measured
MODEL, SIMULATION = "values of a model", "values of a simulation"
# Formats of meshes
MESHES = (".glb", ".stl", ".ply")


def command(
    context: typer.Context,
    source: Annotated[
        Path,
        typer.Argument(
            help="Result (.nc, .zarr), store of a sweep (.zarr), model or scene (.toml).",
            show_default=False,
        ),
    ],
    output: Annotated[
        Path,
        typer.Option(
            "--output",
            "-o",
            help=".pbsdf: polarised measured BSDF of Mitsuba 3. .csv: goniometer table. "
            ".glb, .stl, .ply: mesh of a scene, in micrometres.",
        ),
    ],
    theta_i: options.Incidences = "30,60",
    force: options.Force = False,
    wavelength: options.Wavelength = None,
    base: Annotated[
        float | None,
        typer.Option(
            "--base-um", help="Close a height map to a block this thick below it, to print."
        ),
    ] = None,
    seed: options.Seed = 0,
    convention: Annotated[
        Convention, typer.Option(help="Of a .csv: whose signs, frames and azimuths.")
    ] = Convention.pbrdf,
    at: options.At = None,
) -> None:
    """Write a BRDF for a renderer or as a table, or a scene as a mesh.

    A table of a model has the incidences of --theta-i-deg and the hemisphere by 5 degrees;
    that of a result or of a store has its incidences and bins. A store is interpolated at
    the values of --at.

    With --convention the columns bear its name; `pbrdf` reads none but its own again.

    Of a random scene one realisation is written, that of --seed.

    Example: pbrdf export model.toml -o vinyl.pbsdf
    """
    import data_io
    from pbrdf.cli.staging import staged_file

    if output.suffix in MESHES:
        refuse_unused(context, {"theta_i", "wavelength", "convention", "at"}, "for a mesh")
        export_mesh(source, output, base, seed, force=force)
        return
    _check(source, output, convention, at)
    _check_used(context, source, output)
    accuracy = None
    with staged_file(output, force=force) as stage:
        model = data_io.read_model(source) if source.suffix == ".toml" else None
        if output.suffix == ".csv":
            rows = (
                as_rows(_result(source, at, wavelength))
                if model is None
                else model_rows(model, option_text.incidences(theta_i), wavelength)
            )
            write_table(rows, stage, convention)
        else:
            accuracy = _renderer_file(source, model, at, wavelength, stage)
            beside = stage.with_name(f"{stage.name}.json")
            beside.replace(output.with_name(f"{output.name}.json"))
    typer.echo(f"Written: {output}")
    for line in () if accuracy is None else _accuracy_lines(accuracy):
        typer.echo(line)


def _check(
    source: Path, output: Path, convention: Convention, at: list[str] | None
) -> None:
    """Refuse what cannot be written."""
    from data_io import is_result_store

    if str(output) == "-":
        msg = "--output must be a file, got '-': nothing goes to standard output. Name one."
        raise ValueError(msg)
    if output.suffix not in (".pbsdf", ".csv"):
        known = ", ".join((".pbsdf", ".csv", *MESHES))
        msg = f"--output must end in one of {known}, got {output.name!r}."
        raise ValueError(msg)
    if source.suffix not in (".nc", ".zarr", ".toml"):
        msg = (
            "source must be a result (.nc), a store (.zarr) or a model (.toml), got "
            f"{source.name!r}."
        )
        raise ValueError(msg)
    if at and (source.suffix != ".zarr" or is_result_store(source)):
        msg = f"--at must be left out, it is for a store of a sweep, got {source.name!r}."
        raise ValueError(msg)
    if convention is not Convention.pbrdf and output.suffix != ".csv":
        msg = (
            f"--convention must be left out of {output.suffix}, which has its own, got "
            f"{convention.value}."
        )
        raise ValueError(msg)


def _check_used(context: typer.Context, source: Path, output: Path) -> None:
    """Refuse what would not change the file."""
    refuse_unused(context, {"base", "seed"}, f"for {output.suffix}, only for meshes")
    own = "has incidences of its own"
    if output.suffix == ".pbsdf":
        refuse_unused(context, {"theta_i"}, f"for .pbsdf, which {own}")
    if source.suffix != ".toml":
        refuse_unused(context, {"theta_i"}, f"for {source.name}, which {own}")
        from data_io import is_result_store

        if source.suffix == ".nc" or is_result_store(source):
            whole = f"for {source.name}: all its wavelengths are written"
            refuse_unused(context, {"wavelength"}, whole)


def _renderer_file(
    source: Path,
    model: "MicrofacetModel | None",
    at: list[str] | None,
    wavelength: float | None,
    stage: Path,
) -> "xr.Dataset":
    """Write a .pbsdf; return how far it is from its source."""
    import data_io

    if model is None:
        return data_io.export_mitsuba(_result(source, at, wavelength), stage)
    return data_io.export_mitsuba(model, stage, wavelength=wavelength)


def _result(source: Path, at: list[str] | None, wavelength: float | None) -> "xr.Dataset":
    """Return a result, or a store at one value of each thing that varied."""
    import data_io

    if source.suffix == ".zarr" and not data_io.is_result_store(source):
        from pbrdf.cli.reading import read_store

        cure = "Leave it out, all of the store are written."
        return read_store(source, at, wavelength=wavelength, cure=cure)
    return data_io.read_result(source)


def write_table(rows: "xr.Dataset", path: Path, convention: Convention) -> None:
    """Write goniometer rows in a convention."""
    import data_io

    if convention is Convention.pbrdf:
        data_io.write_goniometer(rows, path)
        return
    from pbrdf.cli.converted import in_convention

    frame = in_convention(rows, convention.value)
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write(f"# {frame.attrs['convention']}\n")
        frame.to_csv(file, index=False, float_format="%.8g")


def _accuracy_lines(accuracy: "xr.Dataset") -> Iterator[str]:
    """Yield how far the file is from its source, a line a class of brightness."""
    from data_io.reflectance.table_accuracy import GRAZING

    yield "Between its nodes it differs from the source, in parts of M00:"
    for name in accuracy.brightness.values:
        here = accuracy.sel(brightness=name)
        if int(here["count"]) == 0:
            continue
        first = here.error.isel(stokes_out=0, stokes_in=0)
        others = here.error.max(["stokes_out", "stokes_in"])
        shares = ", ".join(
            f"{label} {_size(first.sel(quantile=label))} (worst element "
            f"{_size(others.sel(quantile=label))})"
            for label in here["quantile"].values
        )
        what = f"M00 {name} of its peak" if "%" in name else f"zeniths {name}"
        yield f"  {what}: {shares}"
        if name == GRAZING:
            yield (
                "    It matters only where the light or the viewer grazes: 0.8 % of the "
                "light of an evenly bright surface lies there (cos² 85°)."
            )


def _size(error: "xr.DataArray") -> str:
    """Return a part of M00 as a percentage, or as a multiple."""
    part = float(error)
    return f"{100 * part:.2g} %" if part < 1 else f"{part:.3g} times M00"


def export_mesh(
    source: Path, output: Path, base: float | None, seed: int, *, force: bool
) -> None:
    """Write one realisation of a scene as a mesh."""
    from pbrdf import load_scene
    from pbrdf.cli.staging import staged_file
    from pbrdf.scene.solids import export_scene

    if source.suffix != ".toml":
        msg = (
            f"source must be a scene (.toml) to be written as a mesh, got {source.name!r}."
        )
        raise ValueError(msg)
    scene = load_scene(source)
    with staged_file(output, force=force) as stage:
        export_scene(scene, stage, seed=seed, base=base)
    typer.echo(f"Written: {output}")


def model_rows(
    model: "MicrofacetModel", incidences: list[float], wavelength: float | None
) -> "xr.Dataset":
    """Return goniometer rows of a model over the hemisphere, all sixteen elements."""
    import numpy as np
    import xarray as xr

    steps = np.radians(5.0) * np.arange(17), np.radians(5.0) * np.arange(72)
    theta_i, theta_s, dphi = (
        axis.ravel() for axis in np.meshgrid(incidences, *steps, indexing="ij")
    )
    brdf = model.brdf(theta_i, theta_s, dphi, wavelength=wavelength)
    rows = {f"M{i}{j}": ("geometry", brdf[:, i, j]) for i in range(4) for j in range(4)}
    coords = {"theta_i": theta_i, "theta_s": theta_s, "dphi": dphi}
    if wavelength is not None:
        coords["wavelength"] = np.full(len(theta_i), wavelength)
    held = {name: ("geometry", value) for name, value in coords.items()}
    return xr.Dataset(rows, held, {"comments": MODEL})


def as_rows(result: "xr.Dataset") -> "xr.Dataset":
    """Return a simulated hemisphere as goniometer rows, all bounces, with its errors."""
    import numpy as np
    import xarray as xr

    axes = [
        name for name in ("wavelength", "theta_i", "theta_s", "dphi") if name in result.dims
    ]
    labels = {name: number for number, name in enumerate("IQUV")}
    total = result.brdf_total.stack(geometry=axes).reset_index("geometry")
    error = result.brdf_total_stderr.stack(geometry=axes).reset_index("geometry")
    rows = {}
    for out in total.stokes_out.values:
        for into in total.stokes_in.values:
            element = f"M{labels[out]}{labels[into]}"
            here = {"stokes_out": out, "stokes_in": into}
            rows[element] = ("geometry", total.sel(here).values)
            # An empty bin has no spread, which is not the same as no error
            spread = error.sel(here).values
            rows[f"{element}_stderr"] = ("geometry", np.where(spread > 0.0, spread, np.nan))
    coords = {name: ("geometry", np.asarray(total[name])) for name in axes}
    return xr.Dataset(rows, coords, {"comments": SIMULATION})

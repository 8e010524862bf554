"""`pbrdf dew`: the same water on a surface at several contact angles."""

import csv
from collections.abc import Hashable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pbrdf.cli import option_text, options
from pbrdf.cli.typed import words_typed

if TYPE_CHECKING:
    import xarray as xr

    from pbrdf import Material
    from pbrdf.surface import Surface


# Columns of the table: a quantity, its error, what dew adds to it and the error of that
VARIABLES = ("signature", "signature_stderr", "added", "added_stderr")


def command(
    contact_angles: Annotated[
        str, typer.Option("--contact-angles-deg", help="Contact angles, by commas.")
    ] = "15,90,179",
    theta_i: options.Incidences = "40",
    volume: Annotated[
        float,
        typer.Option(
            "--volume-per-area-um", min=1e-6, max=1e6, help="Water on the surface [um]."
        ),
    ] = 2.0,
    density: Annotated[
        float,
        typer.Option(
            "--number-density-per-mm2",
            min=1e-6,
            max=1e9,
            help="Drops on a square millimetre; of a breath figure its nuclei.",
        ),
    ] = 15.0,
    sizes: Annotated[
        str, typer.Option(help="equal, lognormal, or breath-figure, which merges.")
    ] = "equal",
    scene: Annotated[
        Path | None,
        typer.Option(
            help="Scene file of surface and substrate, for those of the options below."
        ),
    ] = None,
    slope_rms: Annotated[
        float, typer.Option(min=1e-3, max=3.0, help="Slope rms of the surface per axis.")
    ] = 0.05,
    n: options.Index = 1.5,
    diffuse_albedo: Annotated[
        float, typer.Option(min=0.0, max=1.0, help="Of the paint under its interface.")
    ] = 0.0,
    wavelength: options.Wavelengths = None,
    water_n: Annotated[
        float | None,
        typer.Option(
            min=1.0001,
            max=5.0,
            help="Index of water that does not absorb; if not given, 1.333 without "
            "wavelengths, and with them the constants of the library.",
        ),
    ] = None,
    output: options.Output = None,
    force: options.Force = False,
    n_rays: Annotated[
        int,
        typer.Option(
            "--n-rays",
            min=1000,
            max=10**9,
            help="Rays an incidence, state and run: fewer than simulate's, as means over "
            "regions are compared, not bins.",
        ),
    ] = 20_000,
    runs: Annotated[
        int,
        typer.Option(
            min=4,
            max=10_000,
            help="Independent runs, each with a surface and drops of its own: as "
            "realisations, but compared dry and wet one by one.",
        ),
    ] = 8,
    seed: options.Seed = 0,
    workers: options.Workers = None,
) -> None:
    """Compare a surface dry and with dew of several contact angles.

    Writes a folder with dew.nc, dew.csv (means over the specular lobe, its skirt, the wings
    and the hemisphere, with errors), polar plots and model.toml, the dry scene.

    Example: pbrdf dew --contact-angles-deg 15,90,179 --theta-i-deg 40 -o dew
    """
    given = dict(locals())
    import pbrdf
    from data_io import write_result
    from fitting.report.record import record_of
    from pbrdf.cli.progress import progress_bar
    from pbrdf.cli.staging import staged_folder
    from pbrdf.dew import compare_dew

    if scene is None:
        # A patch of a millimetre with facets of a fifteenth of the length
        surface: Surface = pbrdf.GaussianSurface(
            shape=(512, 512), spacing=2.0, corr_length=30.0, slope_rms=slope_rms
        )
        substrate = pbrdf.Material(n, diffuse_albedo=diffuse_albedo)
    else:
        surface, substrate = _clean(scene)
    angles = option_text.angles(contact_angles, "--contact-angles-deg", below=180.0)
    incidences = option_text.incidences(theta_i)
    target = output or Path("dew")
    waves = option_text.wavelengths(wavelength)
    liquid = pbrdf.materials.get("water")
    if waves is None or water_n is not None:
        liquid = pbrdf.Material(water_n or 1.333, name="water")
    with staged_folder(target, force=force) as stage:
        results = []
        amount = {
            "volume_per_area": volume, "number_density": density * 1e-6, "sizes": sizes
        }  # fmt: skip
        with progress_bar("tracing") as progress:
            for number, wave in enumerate(waves or [None]):

                def told(done: int, total: int, number: int = number) -> None:
                    progress(number * total + done, len(waves or [None]) * total)

                one = compare_dew(
                    surface, substrate, angles, incidences, amount=amount, water=liquid,
                    runs=runs, seed=seed, progress=told, n_rays=n_rays, n_theta=36,
                    n_dphi=72, workers=workers, wavelength=wave,
                )  # fmt: skip
                results.append(one)
        whole = _joined(results)
        chosen = option_text.recorded(given)
        whole.attrs["made_by"] = record_of(
            {"scene": scene}, command="dew", options=chosen, typed=words_typed()
        )
        write_result(whole, stage / "dew.nc")
        pbrdf.Scene(surface, substrate).to_toml(stage / "model.toml")
        _write_tables_and_figures(results, stage)
    for result in results:
        for line in table(result):
            typer.echo(line)
    typer.echo(f"Result: {target}")


def _clean(scene: Path) -> "tuple[Surface, Material]":
    """Return surface and material of a scene file, which must be dry."""
    import pbrdf

    loaded = pbrdf.load_scene(scene)
    if loaded.contaminants or not isinstance(loaded.substrate, pbrdf.Material):
        msg = (
            f"--scene must hold a clean surface of one material, got {scene.name}. "
            "The water is laid on it by the options."
        )
        raise ValueError(msg)
    return loaded.surface, loaded.substrate


def _write_tables_and_figures(results: "list[xr.Dataset]", stage: Path) -> None:
    """Write dew.csv, and the figures of each wavelength."""
    import numpy as np

    from pbrdf.cli.dew_figures import signature_figure
    from pbrdf.dew import DRY
    from pbrdf.plots import hemisphere

    with (stage / "dew.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        for number, result in enumerate(results):
            writer.writerows(list(rows(result))[min(number, 1) :])
    for result in results:
        place = "" if len(results) == 1 else f"_{float(result.wavelength):g}um"
        for number, angle in enumerate(result.theta_i.values):
            name = f"hemisphere_{np.rad2deg(angle):.3g}deg{place}.png"
            hemisphere(
                result.isel(theta_i=number), ("M00", "M10", "M20", "DOLP"), minus=DRY
            ).savefig(stage / name, dpi=200)
        signature_figure(result).savefig(stage / f"polarised{place}.png", dpi=130)


def _joined(results: "list[xr.Dataset]") -> "xr.Dataset":
    """Return the results of several wavelengths as one, with a dimension for them."""
    import xarray as xr

    if len(results) == 1:
        return results[0]
    # Coverage and bins are those of any wavelength
    spectral: list[Hashable] = [
        name for name, data in results[0].data_vars.items() if "theta_i" in data.dims
    ]
    whole = xr.concat(
        results, "wavelength", data_vars=spectral, coords="minimal", compat="override",
        combine_attrs="drop_conflicts",
    )  # fmt: skip
    notes = dict.fromkeys(note for one in results for note in one.attrs["warnings"])
    return whole.assign_attrs(warnings=list(notes))


def rows(result: "xr.Dataset") -> Iterator[list[str]]:
    """Yield the table of signatures, one row for each state, incidence and region."""
    import numpy as np

    quantities = [str(name) for name in result.quantity.values]
    spectral = "wavelength" in result.coords
    head = ["wavelength_um"] if spectral else []
    head += ["state", "contact_angle_deg", "theta_i_deg", "region"]
    columns = [
        column
        for name in quantities
        for column in (name, f"{name}_stderr", f"{name}_added", f"{name}_added_stderr")
    ]
    yield head + columns
    for state in result.state.values:
        for theta_i in result.theta_i.values:
            for region in result.region.values:
                here = result.sel(state=state, theta_i=theta_i, region=region)
                numbers = [
                    f"{float(here[variable].sel(quantity=name)):.6g}"
                    for name in quantities
                    for variable in (
                        "signature",
                        "signature_stderr",
                        "added",
                        "added_stderr",
                    )
                ]
                contact = np.rad2deg(float(here.contact_angle))
                wet = "" if np.isnan(contact) else f"{contact:.6g}"
                place = [f"{float(result.wavelength):.6g}"] if spectral else []
                place += [str(state), wet, f"{np.rad2deg(theta_i):.6g}", str(region)]
                yield place + numbers


def table(result: "xr.Dataset") -> Iterator[str]:
    """Yield what a reader at the terminal wants to know."""
    import numpy as np

    for theta_i in result.theta_i.values:
        wave = ""
        if "wavelength" in result.coords:
            wave = f"{float(result.wavelength):g} um, "
        yield (
            f"{wave}incidence {np.rad2deg(theta_i):.4g} deg; means in 1/sr, one standard "
            "error"
        ).capitalize()
        for region in result.region.values:
            yield f"  {region}"
            for state in result.state.values:
                here = result.sel(state=state, theta_i=theta_i, region=region)
                cells = [
                    f"{name} {float(here.signature.sel(quantity=name)):.4g} ± "
                    f"{float(here.signature_stderr.sel(quantity=name)):.1g}"
                    for name in ("M00", "M10", "|M20|", "P", "DOLP")
                ]
                yield f"    {state!s:<8} {'  '.join(cells)}"

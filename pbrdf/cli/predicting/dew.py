"""`pbrdf dew`: the same water on a surface at several contact angles."""

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pbrdf.cli import options

if TYPE_CHECKING:
    import xarray as xr


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
    water_n: Annotated[
        float, typer.Option(min=1.0001, max=5.0, help="Refractive index of the water.")
    ] = 1.333,
    output: options.Output = None,
    force: options.Force = False,
    n_rays: Annotated[
        int,
        typer.Option(
            "--n-rays", min=1000, max=10**8, help="Rays an incidence, state and run."
        ),
    ] = 20_000,
    runs: Annotated[
        int, typer.Option(min=4, max=10_000, help="Independent runs, for the errors.")
    ] = 8,
    seed: options.Seed = 0,
    workers: options.Workers = None,
) -> None:
    """Compare a surface dry and with dew of several contact angles.

    Writes a folder with dew.nc, dew.csv (means over the specular lobe, its skirt, the wings
    and the hemisphere, with errors), polar plots and model.toml, the dry scene.

    Example: pbrdf dew --contact-angles-deg 15,90,179 --theta-i-deg 40 -o dew
    """
    import numpy as np

    import pbrdf
    from data_io import write_result
    from pbrdf.cli.dew_figures import polar_figure, signature_figure
    from pbrdf.cli.progress import progress_bar
    from pbrdf.cli.staging import staged_folder
    from pbrdf.dew import compare_dew

    if scene is None:
        # A patch of a millimetre with facets of a fifteenth of the length
        surface: pbrdf.scene.scene.Surface = pbrdf.GaussianSurface(
            shape=(512, 512), spacing=2.0, corr_length=30.0, slope_rms=slope_rms
        )
        substrate = pbrdf.Material(n, diffuse_albedo=diffuse_albedo)
    else:
        loaded = pbrdf.load_scene(scene)
        if loaded.contaminants or not isinstance(loaded.substrate, pbrdf.Material):
            msg = (
                f"--scene must hold a clean surface of one material, got {scene.name}. "
                "The water is laid on it by the options."
            )
            raise ValueError(msg)
        surface, substrate = loaded.surface, loaded.substrate
    angles = options.angles(contact_angles, "--contact-angles-deg", below=180.0)
    incidences = options.incidences(theta_i)
    target = output or Path("dew")
    with staged_folder(target, force=force) as stage:
        with progress_bar("tracing") as progress:
            result = compare_dew(
                surface,
                substrate,
                angles,
                incidences,
                amount={
                    "volume_per_area": volume,
                    "number_density": density * 1e-6,
                    "sizes": sizes,
                },
                water=pbrdf.Material(water_n, name="water"),
                runs=runs,
                seed=seed,
                progress=progress,
                n_rays=n_rays,
                n_theta=36,
                n_dphi=72,
                workers=workers,
            )
        write_result(result, stage / "dew.nc")
        pbrdf.Scene(surface, substrate).to_toml(stage / "model.toml")
        with (stage / "dew.csv").open("w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows(rows(result))
        for number, angle in enumerate(result.theta_i.values):
            name = f"hemisphere_{np.rad2deg(angle):.3g}deg.png"
            polar_figure(result, number).savefig(stage / name, dpi=110)
        signature_figure(result).savefig(stage / "polarised.png", dpi=130)
    for line in table(result):
        typer.echo(line)
    typer.echo(f"Result: {target}")


def rows(result: "xr.Dataset") -> Iterator[list[str]]:
    """Yield the table of signatures, one row for each state, incidence and region."""
    import numpy as np

    quantities = [str(name) for name in result.quantity.values]
    head = ["state", "contact_angle_deg", "theta_i_deg", "region"]
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
                yield [str(state), wet, f"{np.rad2deg(theta_i):.6g}", str(region), *numbers]


def table(result: "xr.Dataset") -> Iterator[str]:
    """Yield what a reader at the terminal wants to know."""
    import numpy as np

    for theta_i in result.theta_i.values:
        yield f"Incidence {np.rad2deg(theta_i):.4g} deg; means in 1/sr, one standard error"
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

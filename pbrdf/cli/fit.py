"""`pbrdf fit`: bring the analytical model to goniometer scans."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pbrdf.cli import options

if TYPE_CHECKING:
    import xarray as xr

    from fitting.result import FitResult


def fit(
    scans: Annotated[
        list[Path],
        typer.Argument(
            help="Goniometer files; several are fitted together.", show_default=False
        ),
    ],
    n: options.Index,
    slope_rms: Annotated[
        float,
        typer.Option(
            min=1e-3, max=10.0, help="Slope rms per axis, as `pbrdf statistics` gives."
        ),
    ],
    kappa: options.Kappa = 0.0,
    slope_stderr: Annotated[
        float | None,
        typer.Option(
            min=1e-9, max=10.0, help="Its standard error, passed on to the results."
        ),
    ] = None,
    free: options.Free = "specular_gain,diffuse_albedo",
    separate: Annotated[
        str, typer.Option(help="Those of them that each scan has for itself.")
    ] = "",
    shadowing: options.Shadowing = "smith-correlated",
    wavelength: options.Wavelength = None,
    blocked: options.Blocked = 0.0,
    solver: Annotated[str, typer.Option(help="casadi or nlopt.")] = "casadi",
    loss: Annotated[
        str, typer.Option(help="linear, or soft_l1, huber, cauchy against outliers.")
    ] = "linear",
    output: options.Output = None,
    force: options.Force = False,
) -> None:
    """Fit gains, albedos, index or slope to scans, with errors and correlations.

    With --output writes a folder with fit.json, model.toml and scan.png.

    Example: pbrdf fit scan.csv --n 1.53 --slope-rms 0.252
    """
    from pbrdf import Material, MicrofacetModel
    from pbrdf.cli.reading import read_scan
    from pbrdf.cli.staging import staged_folder

    model = MicrofacetModel(Material(n, kappa), slope_rms=slope_rms, shadowing=shadowing)
    measured = {path.stem: read_scan(path, wavelength=wavelength) for path in scans}
    if len(measured) < len(scans):
        msg = "scans must have names of their own, got two files of one name. Rename one."
        raise ValueError(msg)

    from fitting.fit import fit as fit_model
    from fitting.masks import blocked_detector, zeros

    result = fit_model(
        measured,
        model,
        free=options.names(free),
        solver=solver,
        priors={"slope_rms": (slope_rms, slope_stderr)} if slope_stderr else None,
        separate=options.names(separate),
        mask=(zeros(), blocked_detector(blocked)) if blocked else (zeros(),),
        loss=loss,
    )
    if output is not None:
        with staged_folder(output, force=force) as stage:
            _write(result, measured, stage)
    typer.echo(result.summary())
    if not result.converged:
        raise typer.Exit(1)


def _write(result: "FitResult", measured: "Mapping[str, xr.Dataset]", folder: Path) -> None:
    """Write the numbers, the model and a figure; of several scans one figure each."""
    import numpy as np

    from data_io import in_plane, write_model
    from fitting.curves import plane_curves
    from fitting.figures import scan_figure

    text = json.dumps(result.as_dict(), indent=2)
    (folder / "fit.json").write_text(f"{text}\n", encoding="utf-8")
    notes = {name: estimate.as_dict() for name, estimate in result.estimates.items()}
    write_model(result.model, folder / "model.toml", notes={"uncertainty": notes})
    zeniths = np.deg2rad(np.arange(0.5, 90.0))
    for label, scan in measured.items():
        plane = in_plane(scan)
        if not plane.sizes["geometry"]:
            continue
        curves = plane_curves(
            np.unique(plane.theta_i.values), zeniths, analytic=result.models[label]
        )
        name = "scan.png" if len(measured) == 1 else f"{label}.png"
        scan_figure(plane, curves).savefig(folder / name, dpi=140)

"""`pbrdf plot`: a scan, or a simulated hemisphere, as a figure."""

from pathlib import Path
from typing import Annotated

import typer

from pbrdf.cli import options


def plot(
    source: Annotated[
        Path,
        typer.Argument(help="Result (.nc) or goniometer file.", show_default=False),
    ],
    output: options.Output = None,
    force: options.Force = False,
    theta_i: Annotated[
        float,
        typer.Option(
            "--theta-i-deg", min=0.0, max=90.0, help="Incidence of a result to draw."
        ),
    ] = 30.0,
    wavelength: options.Wavelength = None,
) -> None:
    """Draw M00, M10 and DOLP: of a scan in the plane, of a result over the hemisphere.

    Example: pbrdf plot result.nc --theta-i-deg 60 -o result.png
    """
    import numpy as np

    import data_io
    from fitting.figures import hemisphere_figure, scan_figure
    from pbrdf.cli.reading import read_scan
    from pbrdf.cli.staging import staged_file

    target = output or source.with_suffix(".png")
    with staged_file(target, force=force) as stage:
        if source.suffix == ".nc":
            result = data_io.read_result(source)
            if "brdf_total" not in result:
                msg = (
                    f"{source.name} must hold brdf_total, got {list(result.data_vars)[:5]}."
                )
                raise ValueError(msg)
            figure = hemisphere_figure(result, float(np.deg2rad(theta_i)))
        else:
            scan = data_io.in_plane(read_scan(source, wavelength=wavelength))
            if not scan.sizes["geometry"]:
                msg = f"{source.name} must have rows in the plane of incidence, got none."
                raise ValueError(msg)
            figure = scan_figure(scan)
        figure.savefig(stage, dpi=140)
    typer.echo(f"Figure: {target}")

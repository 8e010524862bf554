"""`pbrdf check`: look at scans before they are believed."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pbrdf.cli import declaring, options

if TYPE_CHECKING:
    import xarray as xr


def command(
    scans: Annotated[
        list[Path], typer.Argument(help="Goniometer files.", show_default=False)
    ],
    wavelength: options.Wavelength = None,
    columns: declaring.ScanColumns = None,
    azimuth_of_forward: declaring.Forward = None,
    angles: declaring.Angles = None,
    quantity: declaring.QuantityOption = None,
    normalised: declaring.Normalised = None,
    as_json: options.AsJson = None,
    force: options.Force = False,
) -> None:
    """Say what a goniometer file holds, and what in it contradicts physics.

    Compares forward with backward brightness, adds up the light, compares exchanged
    directions, and looks for saturation, a floor, repeats and noise. Each finding names
    the option that would mend it. Exits 1 if an error of physics was found.

    Example: pbrdf check scan.csv
    """
    from fitting.checks import check_scan
    from pbrdf.cli.reading import read_scan
    from pbrdf.cli.staging import alone, write_numbers

    declared = declaring.declarations(
        columns, azimuth_of_forward, angles, quantity, normalised
    )
    found: list[dict[str, Any]] = []
    for path in scans:
        scan = read_scan(path, wavelength=wavelength, declared=declared)
        findings = check_scan(scan)
        lines = [f"{path.name}: {_content(scan)}", *(f"  {one}" for one in findings)]
        if not {one.severity for one in findings} & {"error", "warning"}:
            lines.append("  Nothing contradicts physics.")
        if not alone(as_json):
            typer.echo("\n".join(lines))
        told = [asdict(one) for one in findings]
        found.append({"file": path.name, "holds": _content(scan), "findings": told})
    if as_json is not None:
        write_numbers({"scans": found}, as_json, force=force)
    if any(one["severity"] == "error" for scan in found for one in scan["findings"]):
        raise typer.Exit(1)


def _content(scan: "xr.Dataset") -> str:
    """Return what a scan holds, in a line."""
    import numpy as np

    names = [str(name) for name in scan.data_vars if not str(name).endswith("_stderr")]
    zeniths = np.unique(np.degrees(scan.theta_i.values).round(6))
    shown = ", ".join(f"{angle:g}" for angle in zeniths[:8])
    more = ", ..." if zeniths.size > 8 else ""
    count = scan.sizes["geometry"]
    text = f"{count} readings of {', '.join(names)} at theta_i {shown}{more} deg"
    if "phi_i" in scan.coords:
        turns = np.unique(np.degrees(np.atleast_1d(scan.phi_i.values)).round(6))
        text += f"; phi_i {', '.join(f'{turn:g}' for turn in turns[:8])} deg"
    for key in ("converted_from", "declared"):
        if key in scan.attrs:
            text += f"; {key.replace('_', ' ')} {scan.attrs[key]}"
    return f"{text}; format {scan.attrs.get('format', 'unknown')}"

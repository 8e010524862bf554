"""Run the pipeline on two real coatings and fit PTFE; see README.md.

Run it:  PBRDF_SHARED=folder python studies/real_coatings/run.py
"""

import os
import sys
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

import data_io
from fitting.models.cuts import plane_curves
from fitting.pipeline import PipelineResult, run_pipeline
from fitting.result.fit_result import FitResult
from fitting.run import fit
from pbrdf import Material, MicrofacetModel
from pbrdf.plots import new_figure, scan_figure

HERE = Path(__file__).parent
# Step of both maps; the file names none [um]
STEP = 0.2268
# Black binders: the index of a dielectric paint, as good a guess as any
INDEX = Material(1.5)


@dataclass(frozen=True, kw_only=True)
class Coating:
    """Files of one coating, below the folder of measured data."""

    name: str
    surface: str
    scan: str


COATINGS = (
    Coating(
        name="EC1",
        surface="data/topography/EC1_1.npy",
        scan="data/goniometer/ualoft_AnoBlackEC1onAlum.txt",
    ),
    Coating(
        name="NiTE",
        surface="data/topography/NiTE_on_Steel_1.npy",
        scan="data/goniometer/ualoft_AnoBlackNiTEonSteel.txt",
    ),
)


def main() -> None:
    """Print the numbers of README.md and draw its figures."""
    folder = os.environ.get("PBRDF_SHARED")
    if folder is None:
        print("PBRDF_SHARED does not name the folder of measured data: nothing to do.")
        return
    # What the surface statistics warn of stands in the findings
    warnings.simplefilter("ignore")
    for coating in COATINGS:
        study_coating(coating, Path(folder))
    study_ptfe(Path(folder))


def study_coating(coating: Coating, shared: Path) -> None:
    """Pipeline at the slope of the map, then what the scan itself asks for."""
    surface = data_io.read_height_map(shared / coating.surface, spacing=STEP)
    scan = data_io.read_goniometer(shared / coating.scan)
    print(f"\n== {coating.name}")
    result = run_pipeline(surface, scan, material=INDEX, form="curvature", n_rays=100_000)
    slope = result.statistics.slope_rms
    print(f"slope rms of the map: {slope}")
    if result.measured_slopes is not None:
        print(*result.measured_slopes.texts, sep="\n")
        for row in result.measured_slopes.table_rows():
            print("    " + " | ".join(row))
    fits = {
        "analytical, slope of the map": result.analytic,
        "Monte Carlo, slope of the map": result.monte_carlo,
        "the same, n and kappa free": fit(
            scan, result.model, free=("specular_gain", "diffuse_albedo", "n", "kappa"),
            priors={"slope_rms": slope}, bounds={"n": (1.0, 4.0)},
        ),
    }  # fmt: skip
    if result.scan_slope is not None:
        fits["Monte Carlo, slope of the scan"] = result.scan_slope
        fits["analytical, slope, n and kappa free"] = fit(
            scan, result.scan_slope.model.model,
            free=("specular_gain", "diffuse_albedo", "slope_rms", "n", "kappa"),
            bounds={"n": (1.0, 4.0)},
        )  # fmt: skip
    print_fits(fits)
    print("slope and gains free, analytical, other distributions of the slope:")
    others = ("gaussian", "exponential", "trowbridge-reitz")
    models = {
        name: result.model.with_parameters(slope_distribution=name, slope_rms=0.24)
        for name in others
    }
    free = ("specular_gain", "diffuse_albedo", "slope_rms")
    print_fits({name: fit(scan, model, free=free) for name, model in models.items()})
    bandwidth(coating, result)
    figure = scan_figure(data_io.in_plane(scan), result.curves)
    save(figure, f"{coating.name}_map_slope.png")
    if result.scan_slope is not None:
        model = result.scan_slope.model
        curves = plane_curves(
            np.unique(scan.theta_i.values), result.simulation.theta_s.values,
            analytic=model.model, monte_carlo=model,
        )  # fmt: skip
        save(scan_figure(data_io.in_plane(scan), curves), f"{coating.name}_scan_slope.png")


def bandwidth(coating: Coating, result: PipelineResult) -> None:
    """Draw the slope of the map against the shortest wavelength that counts."""
    figure, axes = new_figure(1, 1, (5.0, 3.4))
    axis = axes[0, 0]
    wanted = None if result.scan_slope is None else result.scan_slope.values["slope_rms"]
    cutoffs = np.geomspace(0.5, 60.0, 40)
    for direction in "xy":
        bands = [result.statistics.slope_at(c, axis=direction).value for c in cutoffs]
        axis.plot(cutoffs, bands, label=f"map, along {direction}")
    if wanted is not None:
        axis.axhline(
            wanted, color="0.3", linestyle="--", label="Gaussian fitted to the scan"
        )
    axis.set(
        xscale="log", xlabel="shortest wavelength counted [um]", ylabel="slope rms [1]",
        title=coating.name,
    )  # fmt: skip
    axis.legend(frameon=False)
    save(figure, f"{coating.name}_bandwidth.png")


def study_ptfe(shared: Path) -> None:
    """Fit the in-plane Mueller scans of sintered PTFE at 633 nm, all incidences at once."""
    scans = data_io.read_goniometer(shared / "data/goniometer/nist_ptfe_inplane.csv")
    scan = scans.isel(geometry=np.flatnonzero(np.isclose(scans.wavelength, 0.633)))
    start = MicrofacetModel(Material(1.35), slope_rms=0.3)
    print("\n== PTFE, 633 nm")
    gains = ("specular_gain", "diffuse_albedo", "slope_rms")
    volume = ("specular_gain", "diffuse_albedo", "volume_albedo", "slope_rms")
    layered = start.with_parameters(volume_albedo=0.5, diffuse_albedo=0.5)
    fits = {
        "facets + Lambertian": fit(scan, start, free=gains),
        "facets + Lambertian + volume": fit(scan, layered, free=volume),
    }
    print_fits(fits)
    best = fits["facets + Lambertian + volume"].model
    curves = plane_curves(
        np.unique(scan.theta_i.values), np.deg2rad(np.arange(0.5, 90.0)), analytic=best
    )
    save(scan_figure(data_io.in_plane(scan), curves), "PTFE.png")


def print_fits(fits: Mapping[str, FitResult]) -> None:
    """Print values and misfit of each fit."""
    for title, result in fits.items():
        values = ", ".join(
            f"{name} {value:.4g} ± {result.stderr[name]:.2g}{_interval(result, name)}"
            for name, value in result.values.items()
        )
        state = "" if result.converged else f" NOT CONVERGED: {result.status}"
        print(f"{title}: {values};{state}\n    {'; '.join(misfit(result.readings))}")


def _interval(result: FitResult, name: str) -> str:
    """Return the likelihood interval where a bound makes the symmetric one wrong."""
    return f" ({result.profiles[name].interval})" if name in result.profiles else ""


def misfit(readings: xr.Dataset) -> Iterator[str]:
    """Yield the rms misfit of each observable, relative to the reading for M00."""
    for name in dict.fromkeys(readings.observable.values.tolist()):
        here = readings.isel(reading=readings.observable.values == name)
        lacking = here.measured - here.model
        if name == "M00":
            yield f"M00 off by {100 * rms(lacking / here.measured):.0f} % rms"
        else:
            yield f"{name} off by {rms(lacking):.2g} of {rms(here.measured):.2g} rms"


def rms(values: xr.DataArray) -> float:
    """Return the root mean square."""
    return float(np.sqrt((values**2).mean()))


def save(figure: object, name: str) -> None:
    """Save a figure beside this script."""
    folder = HERE / "figures"
    folder.mkdir(exist_ok=True)
    figure.savefig(folder / name, dpi=110)  # type: ignore[attr-defined]


if __name__ == "__main__":
    sys.exit(main())

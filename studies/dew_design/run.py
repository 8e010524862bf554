"""Which contact angle leaves the polarimetric signature of a painted surface alone?"""

import argparse
import csv
from pathlib import Path
from time import perf_counter

import numpy as np
import xarray as xr

from pbrdf import GaussianSurface, Material
from pbrdf.cli.predicting.dew import rows
from pbrdf.dew import REGIONS, compare_dew
from pbrdf.plots import COLOURS

HERE = Path(__file__).parent
SURFACE = GaussianSurface(shape=(512, 512), spacing=2.0, corr_length=30.0, slope_rms=0.05)
PAINTS = {"dielectric": Material(1.5), "diffuse": Material(1.5, diffuse_albedo=0.5)}
WATER = Material(1.333, name="water")
CONTACT = (10.0, 15.0, 30.0, 60.0, 90.0, 120.0, 150.0, 179.0)
INCIDENCE = (30.0, 60.0)
NUMBER_DENSITY = 15e-6  # drops on a square micrometre
VOLUME = 1.0  # um
VOLUMES = (0.25, 0.5, 1.0, 2.0)
VOLUME_CONTACT = (15.0, 90.0, 179.0)
SHOWN = ("M00", "M10", "|M20|", "P", "DOLP")


def compare(paint: str, contact: tuple[float, ...], volume: float, options) -> xr.Dataset:
    return compare_dew(
        SURFACE, PAINTS[paint], np.deg2rad(contact), np.deg2rad(INCIDENCE),
        amount={"volume_per_area": volume, "sizes": options.sizes,
                "number_density": options.number_density},
        water=WATER, runs=options.runs, n_rays=options.rays, n_theta=36, n_dphi=72,
        seed=options.seed,
    )  # fmt: skip


def show(result: xr.Dataset, title: str) -> None:
    """Print what dew multiplies and adds, in every region."""
    print(f"\n{title}")
    for theta_i in result.theta_i.values:
        for region in result.region.values:
            print(f"  incidence {np.rad2deg(theta_i):.0f} deg, {region}")
            for state in result.state.values:
                here = result.sel(theta_i=theta_i, region=region, state=state)
                dry = result.isel(state=0).sel(theta_i=theta_i, region=region)
                cells = []
                for name in SHOWN:
                    value = float(here.signature.sel(quantity=name))
                    error = float(here.signature_stderr.sel(quantity=name))
                    base = float(dry.signature.sel(quantity=name))
                    ratio = f" x{value / base:6.3f}" if base > 5 * error else ""
                    cells.append(f"{name} {value:.4g} ± {error:.1g}{ratio}")
                print(f"    {state!s:<8} {'  '.join(cells)}")


def save(results: dict[str, xr.Dataset], path: Path) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        for number, (label, result) in enumerate(results.items()):
            for line, row in enumerate(rows(result)):
                if line or not number:
                    writer.writerow(["case" if not line else label, *row])


def saved(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def figure(path: Path) -> None:
    """Polarised radiance and its degree in a saved table, dry as a line."""
    from matplotlib.figure import Figure

    table = [row for row in saved(path) if row["theta_i_deg"] == "60"]
    sheet = Figure(figsize=(13, 6.8), layout="constrained")
    axes = sheet.subplots(2, 4, sharex=True)
    for row, quantity in zip(axes, ("P", "DOLP"), strict=True):
        for axis, region in zip(row, REGIONS, strict=True):
            for colour, paint in zip(COLOURS, PAINTS, strict=False):
                here = [r for r in table if (r["case"], r["region"]) == (paint, region)]
                if not here:
                    continue
                dry, *wet = here
                axis.errorbar(
                    [float(r["contact_angle_deg"]) for r in wet],
                    [float(r[quantity]) for r in wet],
                    [2 * float(r[f"{quantity}_stderr"]) for r in wet],
                    marker="o", ms=3.5, capsize=2, color=colour, label=paint,
                )  # fmt: skip
                axis.axhline(float(dry[quantity]), ls="--", lw=0.9, color=colour)
            axis.set_title(region if quantity == "P" else "")
            axis.grid(alpha=0.25)
        row[0].set_ylabel(f"{quantity} [{'1' if quantity == 'DOLP' else '1/sr'}]")
    for axis in axes[1]:
        axis.set_xlabel("contact angle [deg]")
    sheet.legend(
        *axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=2,
        frameon=False, title="incidence 60 deg; dashed: dry",
    )  # fmt: skip
    sheet.savefig(path.with_suffix(".png"), dpi=90)


def summary(path: Path, quantity: str) -> None:
    """Print, from a table that was saved, how dew changes a quantity."""
    table = saved(path)
    for case in dict.fromkeys(row["case"] for row in table):
        for theta_i in dict.fromkeys(row["theta_i_deg"] for row in table):
            here = [r for r in table if (r["case"], r["theta_i_deg"]) == (case, theta_i)]
            print(
                f"\n{case}, incidence {theta_i} deg: {quantity} over dry (or in 1e-4 / sr)"
            )
            states = list(dict.fromkeys(row["state"] for row in here))
            for region in dict.fromkeys(row["region"] for row in here):
                rows = {r["state"]: r for r in here if r["region"] == region}
                dry = float(rows["dry"][quantity])
                cells = []
                for state in states[1:]:
                    value = float(rows[state][quantity])
                    # Wet and dry share their surfaces: the error is that of the difference
                    error = float(rows[state][f"{quantity}_added_stderr"])
                    unit = dry if dry != 0.0 else 1e-4
                    cells.append(f"{value / unit:7.3f} ± {abs(error / unit):.3f}")
                head = " ".join(f"{state:>15}" for state in states[1:])
                if region == "lobe":
                    print(f"{'':<11}{head}")
                print(f"{region:<11}{' '.join(cells)}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rays", type=int, default=8_000, help="an incidence and run")
    parser.add_argument("--runs", type=int, default=8)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--sizes", default="equal")
    parser.add_argument("--number-density", type=float, default=NUMBER_DENSITY)
    parser.add_argument("--paint", choices=tuple(PAINTS), help="only this one")
    parser.add_argument("--no-volumes", action="store_true", help="contact angles only")
    parser.add_argument(
        "--summary", action="store_true", help="and figures of what was saved"
    )
    parser.add_argument("--quantity", default="P", choices=SHOWN, help="of the summary")
    options = parser.parse_args()
    if options.summary:
        for path in sorted(HERE.glob("*.csv")):
            print(f"\n== {path.name}")
            summary(path, options.quantity)
            if path.name != "volumes.csv":
                figure(path)
        return
    begin = perf_counter()
    paints = [options.paint] if options.paint else list(PAINTS)
    angles = {paint: compare(paint, CONTACT, VOLUME, options) for paint in paints}
    for paint, result in angles.items():
        show(result, f"{paint} paint, {VOLUME} um of water, {options.sizes} drops")
    suffix = "" if options.sizes == "equal" else f"_{options.sizes}"
    save(angles, HERE / f"contact_angles{suffix}.csv")
    figure(HERE / f"contact_angles{suffix}.csv")
    if not options.no_volumes:
        volumes = {
            f"{paint} {volume}": compare(paint, VOLUME_CONTACT, volume, options)
            for paint in paints
            for volume in VOLUMES
        }
        for label, result in volumes.items():
            show(result, f"{label} um of water")
        save(volumes, HERE / "volumes.csv")
    print(f"\n{perf_counter() - begin:.0f} s")


if __name__ == "__main__":
    main()

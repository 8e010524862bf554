"""Figure 10 of the paper: M00, M10 and M20 over the hemisphere, dry and with dew."""

import argparse
from pathlib import Path
from time import perf_counter

import numpy as np

from pbrdf import GaussianSurface, Material
from pbrdf.cli.predicting.dew import table
from pbrdf.dew import compare_dew
from pbrdf.plots import hemisphere

HERE = Path(__file__).parent
SURFACE = GaussianSurface(shape=(512, 512), spacing=2.0, corr_length=30.0, slope_rms=0.05)
PAINT, WATER = Material(1.5), Material(1.333, name="water")
CONTACT = (15.0, 90.0, 179.0)
INCIDENCE = (20.0, 40.0, 60.0)
AMOUNT = {"volume_per_area": 1.0, "number_density": 15e-6}


def in_plane_figure(result, path: Path) -> None:
    """M00 and M10 in the plane of incidence, with bars of two standard errors."""
    from matplotlib.figure import Figure

    sheet = Figure(figsize=(12.5, 6.7), layout="constrained")
    axes = sheet.subplots(2, len(INCIDENCE), sharex=True, squeeze=False)
    zenith = np.rad2deg(result.theta_s.values)
    view = np.concatenate([-zenith[::-1], zenith])
    for column, theta_i in enumerate(INCIDENCE):
        for row, (name, out) in enumerate({"M00": 0, "M10": 1}.items()):
            for state in result.state.values:
                here = result.sel(state=state).isel(
                    theta_i=column, stokes_out=out, stokes_in=0
                )
                half = result.sizes["dphi"] // 2
                # Forward to the right; the two bins beside the plane narrow the error
                value, error = (
                    np.concatenate([part.isel(dphi=0)[::-1], part.isel(dphi=half)])
                    for part in (here.brdf, here.brdf_stderr)
                )
                axes[row, column].errorbar(
                    view, value, 2 * error, lw=1, elinewidth=0.7, label=str(state)
                )
            axes[row, column].set_yscale("symlog", linthresh=1e-4)
            axes[row, column].grid(alpha=0.25)
            axes[row, column].set_ylabel(f"{name} [1/sr]")
        axes[0, column].set_title(f"incidence {theta_i:g} deg")
        axes[1, column].set_xlabel("view zenith [deg], forward positive")
    sheet.legend(
        *axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=4,
        frameon=False,
    )  # fmt: skip
    sheet.savefig(path, dpi=90)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rays", type=int, default=15_000, help="an incidence and run")
    parser.add_argument("--runs", type=int, default=12)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    begin = perf_counter()
    result = compare_dew(
        SURFACE, PAINT, np.deg2rad(CONTACT), np.deg2rad(INCIDENCE), amount=AMOUNT,
        water=WATER, runs=options.runs, n_rays=options.rays, n_theta=36, n_dphi=72,
        seed=options.seed,
    )  # fmt: skip
    for line in table(result):
        print(line)
    error = result.albedo_stderr / result.albedo
    print("hemispherical error of M00, percent:", (100 * error).round(2).values.tolist())
    print(f"{perf_counter() - begin:.0f} s")
    for number, theta_i in enumerate(INCIDENCE):
        sheet = hemisphere(result.isel(theta_i=number), ("M00", "M10", "M20"))
        sheet.savefig(HERE / f"figure10_{theta_i:g}deg.png", dpi=160)
    in_plane_figure(result, HERE / "in_plane.png")


if __name__ == "__main__":
    main()

"""Figure 5 of the paper: M00, M10 and M20 of clean surfaces, Monte Carlo against model.

Takes a file of parameters and --quick.
"""

from pathlib import Path

import numpy as np

from pbrdf import GaussianSurface, Material, MicrofacetModel, Scene, simulate
from pbrdf.plots import hemisphere, plane_cuts
from studies.arguments import told

HERE = Path(__file__).parent


def traced(settings, slope, n, **options):
    """Monte Carlo of one surface and index at all incidences.

    The plain estimator: the other takes single bounces from the very integral that it is
    compared with here, and only their shadowing from the surface.
    """
    scene, run = settings["scene"], settings["run"]
    surface = GaussianSurface(
        shape=(scene["cells"], scene["cells"]), spacing=1.0,
        corr_length=scene["corr_length_um"], slope_rms=slope,
    )  # fmt: skip
    return simulate(
        Scene(surface, Material(n)), np.deg2rad(scene["incidences_deg"]), phi_i="uniform",
        stokes="linear", variance_reduction=False, **(run | options),
    )  # fmt: skip


def compare(single, model):
    """Residuals of the single bounces in standard errors and in per cent, by incidence."""
    seen = single.brdf.values
    error = single.brdf_stderr.values
    off = seen - model.brdf_total.values
    peak = seen[..., 0, 0].max((1, 2))
    rows = []
    for k in range(len(seen)):
        bright = seen[k, ..., 0, 0] > 0.1 * peak[k]
        weight = single.projected_solid_angle.values
        row = {"bins": int(bright.sum())}
        for name in ("M00", "M10", "M20"):
            at = (k, ..., int(name[1]), int(name[2]))
            row[name] = np.sqrt((off[at][bright] ** 2).mean()) / peak[k]
            row[f"{name} error"] = np.sqrt((error[at][bright] ** 2).mean()) / peak[k]
        light = (weight * seen[k, ..., 0, 0]).sum()
        row["light"] = (weight * model.brdf_total.values[k, ..., 0, 0]).sum() / light - 1
        rows.append(row)
    return rows


def table(settings, options):
    """Every slope and index against the model, single bounces only."""
    print(
        "rms over bins above a tenth of the peak, in per cent of the peak: model - traced"
    )
    print("(its standard error)\n")
    print("| slope | n | incidence | M00 | M10 | M20 | light of the model |")
    print("|---|---|---|---|---|---|---|")
    for slope in settings["scene"]["slopes"]:
        for n in settings["scene"]["n"]:
            result = traced(settings, slope, n, **options)
            model = result.pbrdf.beside(MicrofacetModel(Material(n), slope))
            rows = compare(result.sel(bounces="1"), model.sel(state="model"))
            for theta, row in zip(settings["scene"]["incidences_deg"], rows, strict=True):
                cells = " | ".join(
                    f"{100 * row[m]:.2f} ({100 * row[m + ' error']:.2f})"
                    for m in ("M00", "M10", "M20")
                )
                print(
                    f"| {slope:g} | {n:g} | {theta:g} | {cells} | "
                    f"{100 * row['light']:+.2f} % |",
                    flush=True,
                )


def draw(settings, options):
    """Polar plots of both, and both in the plane of incidence."""
    drawn = settings["drawn"]
    result = traced(settings, drawn["slope"], drawn["n"], **options)
    both = result.pbrdf.beside(MicrofacetModel(Material(drawn["n"]), drawn["slope"]))
    place = {"theta_i": np.deg2rad(drawn["incidence_deg"])}
    for name, state in (("traced", "simulated"), ("model", "model")):
        figure = hemisphere(both.sel(state=state), drawn["elements"], places=place)
        figure.savefig(HERE / f"{name}.png", dpi=160)
    plane_cuts(both, drawn["elements"], places=place).savefig(HERE / "plane.png", dpi=160)


def main():
    settings, options = told(__file__, __doc__)
    table(settings, options)
    draw(settings, options)


if __name__ == "__main__":
    main()

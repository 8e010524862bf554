"""Figure 3 of the paper: a rough surface with spheres on it, and its light.

Takes a file of parameters and --quick.
"""

from pathlib import Path

import numpy as np

from pbrdf import GaussianSurface, Material, Scene, Spheres, simulate
from pbrdf.plots import COLOURS, new_figure
from pbrdf.plots.bodies import scene_picture
from studies.arguments import told

HERE = Path(__file__).parent
CAPTION_SLOPE = 0.05


def scenes(settings):
    """Return the surface clean and with spheres."""
    surface = GaussianSurface(
        shape=(settings["cells"],) * 2, spacing=settings["spacing_um"],
        corr_length=settings["corr_length_um"], height_rms=settings["height_rms_um"],
    )  # fmt: skip
    spheres = Spheres(
        radius=settings["spheres"]["radius_um"], coverage=settings["spheres"]["coverage"],
        material=Material(settings["spheres"]["n"]), seed=settings["spheres"]["seed"],
    )  # fmt: skip
    base = Material(settings["n"])
    return {"clean": Scene(surface, base), "with spheres": Scene(surface, base, spheres)}


def traced(scene, settings, options):
    """Light of every bounce at one incidence."""
    run = settings["run"] | options
    incidence = np.deg2rad(run.pop("incidence_deg"))
    return simulate(scene, incidence, phi_i="uniform", stokes="linear", **run).isel(
        theta_i=0
    )


def draw(results, incidence):
    """M00 and M10 in the plane of incidence, bands of two standard errors."""
    figure, axes = new_figure(1, 2, (6.7, 2.8))
    for (name, result), colour in zip(results.items(), COLOURS, strict=False):
        cut = result.pbrdf.in_plane()
        view = np.rad2deg(cut.theta_view.values)
        for axis, out in zip(axes.flat, (0, 1), strict=True):
            line = cut.brdf_total.isel(stokes_out=out, stokes_in=0).values
            error = 2 * cut.brdf_total_stderr.isel(stokes_out=out, stokes_in=0).values
            axis.plot(view, line, color=colour, label=name, linewidth=1.2)
            axis.fill_between(
                view, line - error, line + error, color=colour, alpha=0.25, linewidth=0
            )
    for axis, element in zip(axes.flat, ("M00", "M10"), strict=True):
        axis.axvline(incidence, color="0.6", linewidth=0.7, linestyle=":")
        axis.set(xlabel="view angle, forward positive [deg]", ylabel=f"{element} [1/sr]")
        axis.legend(frameon=False)
    figure.savefig(HERE / "plane.png", dpi=160)


def main():
    settings, options = told(__file__, __doc__)
    made = scenes(settings)
    slope = made["clean"].surface.facet_slope_rms[0]
    print(f"facet slope rms {slope:.4f}; the caption says {CAPTION_SLOPE:g}\n")
    scene_picture(made["with spheres"]).savefig(HERE / "figure3.png", dpi=160)
    results = {name: traced(scene, settings, options) for name, scene in made.items()}
    print("| surface | reflected | on the side of the source |")
    print("|---|---|---|")
    for name, result in results.items():
        total = float(result.albedo.sum())
        error = float(np.sqrt((result.albedo_stderr**2).sum()))
        light = result.brdf_total[..., 0, 0] * result.projected_solid_angle
        back = float(light.where(np.cos(result.dphi) > 0, 0.0).sum())
        print(f"| {name} | {total:.4f} ± {error:.4f} | {back:.4f} |")
    draw(results, settings["run"]["incidence_deg"])


if __name__ == "__main__":
    main()

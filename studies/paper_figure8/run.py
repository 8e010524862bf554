"""Figure 8 of the paper: vinyl in the plane of incidence, and what its gain would mean.

Takes a file of parameters and --quick.
"""

from pathlib import Path

import numpy as np

from pbrdf import GaussianSurface, Material, MicrofacetModel, Scene, simulate
from pbrdf.plots import COLOURS, new_figure
from studies.arguments import told

HERE = Path(__file__).parent
FARTHEST_DEG = 75.0


def traced(settings, options):
    """Trace the specular light in the plane: view angle, M00 and M10, their errors."""
    surface = GaussianSurface(
        shape=(settings["cells"],) * 2, spacing=settings["spacing_um"],
        corr_length=settings["corr_length_um"], height_rms=settings["height_rms_um"],
    )  # fmt: skip
    result = simulate(
        Scene(surface, Material(settings["n"])), np.deg2rad(settings["incidence_deg"]),
        phi_i="uniform", stokes="linear", **(settings["run"] | options),
    )  # fmt: skip
    plane = result.pbrdf.in_plane().isel(theta_i=0)
    plane = plane.transpose("theta_view", "stokes_out", "stokes_in", ...)
    view = np.rad2deg(plane.theta_view.values)
    value = plane.brdf_total.values[:, :2, 0]
    error = plane.brdf_total_stderr.values[:, :2, 0]
    return surface.facet_slope_rms[0], view, value.T, error.T


def with_base(gain, albedo, specular):
    """M00 and DOLP of gain times the specular part over a Lambertian one."""
    m00 = gain * specular[0] + albedo / np.pi
    return m00, np.abs(gain * specular[1]) / m00


def draw(view, columns):
    """M00, M10 and DOLP for each gain, Monte Carlo (points) and model (lines)."""
    figure, axes = new_figure(2, len(columns), (3.4 * len(columns), 4.6), sharex=True)
    for column, (gain, parts) in enumerate(columns.items()):
        for name, (m00, m10, dolp) in parts.items():
            mark = {"linewidth": 1.2} if name == "model" else {"marker": ".", "ls": ""}
            top, low = axes[:, column]
            top.plot(view, m00, color=COLOURS[0], label=f"M00, {name}", **mark)
            top.plot(view, m10, color=COLOURS[1], label=f"M10, {name}", **mark)
            low.plot(view, 100 * dolp, color=COLOURS[2], label=name, **mark)
        axes[0, column].set(title=f"gain {gain:g}", ylabel="[1/sr]")
        axes[1, column].set(ylabel="DOLP [%]", xlabel="view angle, forward positive [deg]")
        axes[0, column].legend(frameon=False, fontsize=7)
        axes[1, column].legend(frameon=False, fontsize=7)
    figure.savefig(HERE / "figure8.png", dpi=160)


def main():
    settings, options = told(__file__, __doc__)
    slope, view, value, error = traced(settings, options)
    model = MicrofacetModel(Material(settings["n"]), slope)
    theta = np.deg2rad(view)
    matrix = model.brdf(
        np.deg2rad(settings["incidence_deg"]),
        np.abs(theta),
        np.where(theta > 0, np.pi, 0.0),
    )
    specular = {"Monte Carlo": value, "model": matrix[:, :2, 0].T}
    albedo = settings["diffuse_albedo"]
    seen = np.abs(view) <= FARTHEST_DEG
    print(f"facet slope {slope:.4f}; M00 of the specular part in the plane, largest:")
    for name, part in specular.items():
        print(f"  {name}: {part[0][seen].max():.4f} / sr")
    print(f"  standard error of the Monte Carlo there: {error[0][seen].max():.4f} / sr\n")
    print("| gain | largest DOLP to 75 deg, Monte Carlo | model | at view angle |")
    print("|---|---|---|---|")
    columns = {}
    for gain in settings["gains"]:
        parts, best = {}, {}
        for name, part in specular.items():
            m00, dolp = with_base(gain, albedo, part)
            parts[name] = (m00, gain * part[1], dolp)
            best[name] = np.where(seen, dolp, 0.0)
        columns[gain] = parts
        top = best["model"].argmax()
        print(
            f"| {gain:g} | {100 * best['Monte Carlo'].max():.2f} % | "
            f"{100 * best['model'].max():.2f} % | {view[top]:.0f} deg |"
        )
    draw(view, columns)


if __name__ == "__main__":
    main()

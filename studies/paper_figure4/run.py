"""Figure 4 of the paper: what several bounces add, on glass and on a perfect mirror.

Takes a file of parameters and --quick.
"""

from pathlib import Path

import numpy as np

from pbrdf import GaussianSurface, Material, Scene, simulate
from pbrdf.plots import COLOURS, new_figure
from studies.arguments import told

HERE = Path(__file__).parent


def traced(settings, case, n, options):
    """Trace one case."""
    surface = GaussianSurface(
        shape=(settings["cells"], settings["cells"]), spacing=1.0,
        corr_length=settings["corr_length_um"], slope_rms=case["slope"],
    )  # fmt: skip
    return simulate(
        Scene(surface, Material(n)), np.deg2rad(case["incidence_deg"]), phi_i="uniform",
        stokes="linear", **(settings["run"] | options),
    ).isel(theta_i=0)  # fmt: skip


def boost(result):
    """Light of several bounces over that of one, and its standard error."""
    one, several = result.albedo.values[0], result.albedo.values[1:].sum()
    parts = result.albedo_stderr.values
    # What gains a bounce leaves another class: take the errors as if they added up
    error = np.hypot(np.hypot(*parts[1:]) / one, several * parts[0] / one**2)
    return several / one, error


def plane(result):
    """View angle and M00 of one and of several bounces with errors, in the plane."""
    cut = result.pbrdf.in_plane().isel(stokes_out=0, stokes_in=0)
    value = cut.brdf.transpose("bounces", "theta_view").values
    error = cut.brdf_stderr.transpose("bounces", "theta_view").values
    return (
        np.rad2deg(cut.theta_view.values),
        np.array([value[0], value[1:].sum(0)]),
        np.array([error[0], np.sqrt((error[1:] ** 2).sum(0))]),
    )


def draw(drawn, incidence):
    """M00 in the plane of incidence, one and several bounces, a panel an index."""
    figure, axes = new_figure(1, len(drawn), (3.3 * len(drawn), 2.8), sharey=False)
    for axis, (n, result) in zip(axes.flat, drawn.items(), strict=True):
        view, value, error = plane(result)
        for k, (name, colour) in enumerate(
            zip(("one bounce", "more bounces", "all"), COLOURS, strict=False)
        ):
            line = value[k] if k < 2 else value.sum(0)
            around = error[k] if k < 2 else np.hypot(*error)
            axis.plot(view, line, color=colour, label=name, linewidth=1.2)
            axis.fill_between(
                view, line - 2 * around, line + 2 * around, color=colour, alpha=0.25,
                linewidth=0,
            )  # fmt: skip
        axis.axvline(incidence, color="0.6", linewidth=0.7, linestyle=":")
        axis.set(title=f"n = {n:g}", xlabel="view angle, forward positive [deg]")
        axis.set_ylabel("M00 [1/sr]")
        axis.legend(frameon=False)
    figure.savefig(HERE / "figure4.png", dpi=160)


def main():
    settings, options = told(__file__, __doc__)
    print("| slope | incidence | n | one bounce | more | more over one |")
    print("|---|---|---|---|---|---|")
    for k, case in enumerate(settings["case"]):
        drawn = {}
        for n in settings["n"]:
            result = drawn[n] = traced(settings, case, n, options)
            ratio, error = boost(result)
            albedo = result.albedo.values
            print(
                f"| {case['slope']:g} | {case['incidence_deg']:g} | {n:g} | "
                f"{albedo[0]:.5f} | {albedo[1:].sum():.5f} | {ratio:.5f} ± {error:.5f} |",
                flush=True,
            )
        if k == 0:
            draw(drawn, case["incidence_deg"])


if __name__ == "__main__":
    main()

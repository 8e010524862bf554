"""Figure 7 of the paper: heights and slopes of a vinyl edge, read from its micrograph."""

import argparse
import tomllib
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.stats import norm

from data_io import read_profile_image
from examples.micrograph import Camera, make_micrograph
from fitting import surface_statistics
from fitting.statistics.slopes import slope_distribution
from pbrdf.plots import COLOURS, new_figure

HERE = Path(__file__).parent


def measured(settings):
    """Return the drawn edge, and the profile that was read from its picture."""
    camera = Camera(um_per_pixel=settings["um_per_pixel"])
    with TemporaryDirectory() as folder:
        picture = Path(folder) / "edge.png"
        edge = make_micrograph(picture, settings["seed"], camera)
        profile = read_profile_image(picture, settings["um_per_pixel"])
    return edge, profile


def draw(edge, profile, found, n_bins):
    """Height and slope histograms of the picture beside the Gaussians of the truth."""
    heights = found.residual[np.isfinite(found.residual)]
    slopes = slope_distribution(profile, cutoff=found.cutoff)
    figure, axes = new_figure(1, 2, (6.7, 2.7))
    left, right = axes.flat
    left.hist(heights, bins=n_bins, density=True, color=COLOURS[5], label="read")
    z = np.linspace(-4, 4, 200)
    left.plot(
        z * edge.height_rms, norm.pdf(z) / edge.height_rms, color="black",
        label=f"Gaussian, rms {edge.height_rms:g} um",
    )  # fmt: skip
    read = found.height_rms.value
    left.plot(z * read, norm.pdf(z) / read, "--", color="black", label=f"rms {read:.3g} um")
    left.set(xlabel="height [um]", ylabel="density [1/um]")
    middle = (slopes.edges[1:] + slopes.edges[:-1]) / 2
    right.errorbar(
        middle, slopes.density["x"], yerr=2 * slopes.stderr["x"], fmt=".",
        color=COLOURS[0], markersize=3, elinewidth=0.7, label="read, two errors",
    )  # fmt: skip
    right.plot(
        z * edge.slope_rms, norm.pdf(z) / edge.slope_rms, color="black",
        label=f"Gaussian, rms {edge.slope_rms:.4f}",
    )  # fmt: skip
    read = found.slope_rms.value
    right.plot(z * read, norm.pdf(z) / read, "--", color="black", label=f"rms {read:.3g}")
    right.set(xlabel="slope", ylabel="density", xlim=(-1.1, 1.1))
    for axis in axes.flat:
        axis.set_ylim(0.0, 1.45 * axis.get_ylim()[1])
        axis.legend(frameon=False, fontsize=7, ncols=2, loc="upper center")
    figure.savefig(HERE / "figure7.png", dpi=160)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parameters", nargs="?", default=HERE / "parameters.toml")
    parser.add_argument("--quick", action="store_true", help="the same: it takes seconds")
    settings = tomllib.loads(Path(parser.parse_args().parameters).read_text())
    edge, profile = measured(settings)
    found = surface_statistics(profile)
    own = {
        "height_rms": f"{np.std(edge.z):.4g}",
        "slope_rms": f"{np.sqrt(np.mean(np.gradient(edge.z, edge.x) ** 2)):.4g}",
    }
    print("| quantity | ensemble | this edge | read from its picture | 95 % |")
    print("|---|---|---|---|---|")
    for name in ("height_rms", "corr_length", "slope_rms"):
        one = getattr(found, name)
        print(
            f"| {name} | {getattr(edge, name):.4g} | {own.get(name, '')} | "
            f"{one.value:.4g} ± {one.stderr:.2g} | {one.low:.4g} .. {one.high:.4g} |"
        )
    heights = found.gaussianity
    print(
        f"\nheights: p = {heights.p_value:.2f} for a Gaussian, skewness "
        f"{heights.skewness.value:.2f} ± {heights.skewness.stderr:.2f}, excess kurtosis "
        f"{heights.kurtosis.value:.2f} ± {heights.kurtosis.stderr:.2f}"
    )
    draw(edge, profile, found, settings["bins"])


if __name__ == "__main__":
    main()

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
    right.set(xlabel="slope", ylabel="density", xlim=(-1.1, 1.1))
    for axis in axes.flat:
        axis.legend(frameon=False, fontsize=7)
    figure.savefig(HERE / "figure7.png", dpi=160)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("parameters", nargs="?", default=HERE / "parameters.toml")
    parser.add_argument("--quick", action="store_true", help="the same: it takes seconds")
    settings = tomllib.loads(Path(parser.parse_args().parameters).read_text())
    edge, profile = measured(settings)
    found = surface_statistics(profile)
    print("| quantity | truth of the ensemble | read from the picture | 95 % |")
    print("|---|---|---|---|")
    for name in ("height_rms", "corr_length", "slope_rms"):
        one = getattr(found, name)
        print(
            f"| {name} | {getattr(edge, name):.4g} | {one.value:.4g} ± {one.stderr:.2g} | "
            f"{one.low:.4g} .. {one.high:.4g} |"
        )
    print(f"\nheights: {found.gaussianity}")
    draw(edge, profile, found, settings["bins"])


if __name__ == "__main__":
    main()

"""How good is each form of wave scattering? Run `python -m studies.wave_optics.run`."""

import argparse
import time
import warnings
from pathlib import Path

import numpy as np
import pandas as pd

from pbrdf import AccuracyWarning, GaussianSurface, Material, Scene, WaveModel, simulate
from pbrdf.wave import METHODS, TwoScaleModel
from tests import wave_reference

HERE = Path(__file__).parent
MATERIALS = {"n1.5": Material(1.5), "pec": Material.mirror()}
STEEPEST = 0.45


def errors(name: str, method: str) -> pd.DataFrame:
    """Errors of a form in every case of a table."""
    return wave_reference.errors(
        name,
        lambda height, length: WaveModel(
            MATERIALS[name], height_rms=height, corr_length=length, method=method
        ),
    )


def forms() -> None:
    """Print the table of errors by form, for slopes up to STEEPEST."""
    print("\nErrors of 72 cases a table (slope up to 0.45, s and p) in dB; re, im in means")
    for name in MATERIALS:
        for method in METHODS:
            found = errors(name, method)
            gentle = found[found.slope <= STEEPEST]
            both = np.r_[gentle.s, gentle.p]
            steep = np.r_[found[found.slope > STEEPEST].s, found[found.slope > STEEPEST].p]
            print(
                f"{name:5} {method:16} median {np.median(both):6.3f}  within 1 dB "
                f"{100 * np.mean(both < 1):5.1f} %  largest {both.max():7.2f}  re "
                f"{gentle.re.max():7.3f}  im {gentle.im.max():.3f}  steep: median "
                f"{np.median(steep):5.2f}"
            )


def coherent() -> None:
    """Print the largest errors of the mean field."""
    print("\nLargest error of the coherent reflectance, lengths >= 1 and all lengths")
    table = wave_reference.table("coherent")
    for method in ("auto", "kirchhoff"):
        for name, material in MATERIALS.items():
            for height in (0.02, 0.05, 0.1, 0.2):
                worst = {True: 0.0, False: 0.0}
                rows = table[
                    (table.material == name) & (table.height_rms_per_wavelength == height)
                ]
                for row in rows.itertuples():
                    length = row.corr_length_per_wavelength
                    model = WaveModel(
                        material, height_rms=height, corr_length=length, method=method
                    )
                    angles, weights = wave_reference.beam(row.theta_i_deg)
                    found = weights @ model.profile_coherent(np.abs(angles), 1.0)
                    off = abs(found["sp".index(row.pol)] - row.coherent_R)
                    worst[False] = max(worst[False], off)
                    worst[True] = max(worst[True], off if length >= 1 else 0.0)
                pair = f"{worst[True]:.4f} {worst[False]:.4f}"
                print(f"{method:10} {name:5} height {height}: {pair}")


def energy() -> None:
    """Print what single scattering and the mean field of a mirror add up to."""
    print(
        "\nEnergy of mirrors: 1 - coherent - incoherent at incidence 0, 15, 30, 60 degrees"
    )
    for height, length in (
        (0.01, 0.2), (0.02, 0.4), (0.05, 0.5), (0.05, 1.0), (0.1, 1.0), (0.2, 2.0),
        (0.4, 4.0), (1.0, 10.0), (3.0, 40.0), (0.3, 1.0),
    ):  # fmt: skip
        model = WaveModel(Material.mirror(), height_rms=height, corr_length=length)
        left = model.energy(np.deg2rad([0.0, 15.0, 30.0, 60.0]), 1.0).multiple
        slope = np.sqrt(2) * height / length
        print(f"height {height:5} length {length:5} slope {slope:.3f}:", np.round(left, 4))


def joined() -> None:
    """Print the energy of mirrors with waves once and rays of later bounces."""
    print(
        "\nWaves once, rays of later bounces, mean field: sum for mirrors at 0, 30, 60 deg"
    )
    for height, length in ((0.1, 1.0), (0.3, 1.0), (0.4, 2.0), (1.0, 4.0)):
        surface = GaussianSurface(
            shape=(256, 256), spacing=length / 16, corr_length=length, height_rms=height
        )
        run = simulate(
            Scene(surface, Material.mirror()), np.deg2rad([0.0, 30.0, 60.0]), n_rays=20000,
            realizations=16, wavelength=1.0, n_theta=30, n_dphi=36, phi_i="uniform",
            wave="auto",
        )  # fmt: skip
        once = run.albedo.sel(bounces="1").values
        later = run.albedo.sum("bounces").values - once
        total = once + later + run.coherent[:, 0, 0].values
        slope = np.sqrt(2) * height / length
        print(f"height {height} length {length} slope {slope:.2f}: {total.round(4)}")
        print(f"  of which later bounces {later.round(4)}")


def rough() -> None:
    """Print the deviation from single bounces of rays, in bins above 5 % of the peak."""
    print("\nRough limit: height >= 2 wavelengths, against 64 surfaces of rays")
    bins, azimuths = 30, 36
    x, w = np.polynomial.legendre.leggauss(4)
    for slope, length in ((0.1, 30.0), (0.15, 20.0), (0.25, 12.0)):
        surface = GaussianSurface(
            shape=(256, 256), spacing=length / 16, corr_length=length, slope_rms=slope
        )
        for theta in np.deg2rad([0.0, 40.0, 60.0]):
            run = simulate(
                Scene(surface, Material(1.5)), theta, phi_i="uniform", n_rays=60000,
                realizations=64, seed=3, max_bounces=1, n_theta=bins, n_dphi=azimuths,
                variance_reduction=False,
            )  # fmt: skip
            once = run.brdf.sel(bounces="1").isel(theta_i=0).values[..., 0, 0]
            error = run.brdf_stderr.sel(bounces="1").isel(theta_i=0).values[..., 0, 0]
            height = slope * length / np.sqrt(2)
            model = WaveModel(Material(1.5), height_rms=height, corr_length=length)
            theta_s = run.theta_s.values[:, None] + x * np.pi / 4 / bins
            dphi = run.dphi.values[:, None] + x * np.pi / azimuths
            weight = (np.cos(theta_s) * np.sin(theta_s) * w)[:, :, None, None] * w
            found = model.brdf(theta, theta_s[:, :, None, None], dphi, 1.0)[..., 0, 0]
            found = (found * weight).sum((1, 3)) / weight.sum((1, 3))
            counted = (run.theta_s.values[:, None] <= np.deg2rad(70)) & (
                once > 0.05 * once.max()
            )
            found, once, error = found[counted], once[counted], error[counted]
            off = found / once - 1
            beyond = (np.abs(found - once) - 0.02 * once) / error
            print(
                f"slope {slope} incidence {np.rad2deg(theta):3.0f}: {once.size:4} bins, "
                f"mean {100 * off.mean():+.2f} %, rms {100 * off.std():.2f} %, stderr "
                f"{100 * np.median(error / once):.2f} %, worst beyond 2 %: "
                f"{beyond.max():.2f} stderr"
            )


def draw_map() -> None:
    """Draw the error of auto over height, length, incidence, material and polarisation."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, 4, figsize=(12, 5.4), sharex=True, sharey=True)
    for row, name in zip(axes, MATERIALS, strict=True):
        found = errors(name, "auto")
        for axis, (theta, pol) in zip(
            row, [(0, "s"), (0, "p"), (60, "s"), (60, "p")], strict=True
        ):
            part = found[found.theta_i_deg == theta]
            points = axis.scatter(
                part.corr_length_per_wavelength, part.height_rms_per_wavelength,
                c=part[pol], s=330, cmap="viridis_r", vmin=0, vmax=1.5, marker="s",
            )  # fmt: skip
            for case in part.itertuples():
                value = getattr(case, pol)
                axis.text(
                    case.corr_length_per_wavelength, case.height_rms_per_wavelength,
                    f"{value:.2f}", ha="center", va="center", fontsize=7,
                    color="white" if value > 0.7 else "black",
                )  # fmt: skip
            axis.set(xscale="log", yscale="log", xlim=(0.35, 6), ylim=(0.014, 1.2))
            axis.set_title(f"{name}, {pol}, {theta} deg", fontsize=9)
            edge = np.array([0.35, 6])
            axis.plot(edge, STEEPEST * edge / np.sqrt(2), color="0.6", lw=0.8)
    for axis in axes[-1]:
        axis.set_xticks([0.5, 1, 2, 4], ["0.5", "1", "2", "4"])
        axis.minorticks_off()
        axis.set_xlabel("corr_length / wavelength")
    for axis in axes[:, 0]:
        axis.set_ylabel("height_rms / wavelength")
    figure.colorbar(points, ax=axes, label="rms error [dB]")
    figure.savefig(HERE / "error_map.png", dpi=110, bbox_inches="tight")
    plt.close(figure)


def draw_sweep() -> None:
    """Draw one paint from 0.35 to 20 um, and print the largest step between wavelengths."""
    import matplotlib.pyplot as plt

    waves = np.geomspace(0.35, 20.0, 61)
    paint = WaveModel(Material(1.5), height_rms=0.8, corr_length=12.0)
    rays = paint.with_method("geometric")
    theta = np.deg2rad(45.0)
    mean = paint.coherent(theta, waves)[:, 0, 0]
    flat = WaveModel(Material(1.5), height_rms=1e-6, corr_length=12.0)
    share = mean / flat.coherent(theta, 1.0)[0, 0]
    view = np.deg2rad(np.linspace(0, 89, 357))
    lobe = paint.brdf(theta, view[:, None], np.pi, waves)
    peak = lobe[..., 0, 0].max(axis=0)
    beside = paint.brdf(theta, np.deg2rad(55.0), np.pi, waves)
    dolp = np.hypot(beside[:, 1, 0], beside[:, 2, 0]) / beside[:, 0, 0]
    facets = rays.brdf(theta, view[:, None], np.pi, waves)[..., 0, 0].max(axis=0)
    figure, axes = plt.subplots(3, 1, figsize=(6, 7), sharex=True)
    axes[0].plot(waves, share)
    axes[0].set_ylabel("coherent share")
    axes[1].plot(waves, peak, label="waves")
    axes[1].plot(waves, facets, "--", color="0.6", label="facets")
    axes[1].set(yscale="log", ylabel="peak of the rest [1/sr]")
    axes[1].legend()
    axes[2].plot(waves, dolp)
    axes[2].set(ylabel="DOLP 10 deg beyond", xlabel="wavelength [um]", xscale="log")
    figure.savefig(HERE / "sweep.png", dpi=110, bbox_inches="tight")
    plt.close(figure)
    print(
        "\nSweep of a paint (height 0.8, length 12 um) at 45 degrees: wavelength, coherent"
    )
    print("share, peak [1/sr], DOLP; the largest step to a neighbour, in ln peak, is")
    for k in range(0, 61, 6):
        print(f"{waves[k]:7.3f} {share[k]:.3e} {peak[k]:.4e} {dolp[k]:.4f}")
    print(f"largest step of DOLP {np.abs(np.diff(dolp)).max():.1e}, of its step "
          f"{np.abs(np.diff(dolp, 2)).max():.1e}")  # fmt: skip
    steps = np.diff(np.log(peak))
    bends = np.abs(np.diff(steps)).max()
    print(f"{np.abs(steps).max():.3f}; second differences up to {bends:.3f}")


def scales() -> None:
    """Print facets with a fine structure beside waves over both scales at once."""
    coarse, small = (1.5, 15.0), (0.05, 0.5)
    variance = coarse[0] ** 2 + small[0] ** 2
    views = np.deg2rad([0, 20, 35, 50, 60, 70, 80])

    def correlation(x: np.ndarray) -> np.ndarray:
        parts = [h**2 * np.exp(-((x / length) ** 2)) for h, length in (coarse, small)]
        return sum(parts) / variance

    print(
        "\nTwo scales at 35 degrees, in plane: ratio of M00 at zeniths", np.rad2deg(views)
    )
    for material in (Material(1.5), Material(1.2, 6.9), Material.mirror()):
        fine = WaveModel(material, height_rms=small[0], corr_length=small[1])
        two = TwoScaleModel(fine, np.sqrt(2) * coarse[0] / coarse[1])
        both = WaveModel(
            material, height_rms=np.sqrt(variance), autocorrelation=correlation
        )
        ratio = two.brdf(views[2], views, np.pi, 1.0) / both.brdf(
            views[2], views, np.pi, 1.0
        )
        shares = two.shares(views[2], 1.0)
        print(
            f"n {material.n:4}: {ratio[:, 0, 0].round(3)}; mirrored "
            f"{shares['mirrored']:.4f}, scattered {shares['scattered']:.4f}, rest "
            f"{shares['rest']:.4f}"
        )


def speed() -> None:
    """Print Mueller matrices a second for one surface."""
    rng = np.random.default_rng(1)
    theta_i, theta_s = rng.uniform(0, 1.5, (2, 500_000))
    dphi = rng.uniform(0, 2 * np.pi, 500_000)
    print("\nMillion Mueller matrices a second, wall clock and one core's time, best of 5")
    for method in ("auto", "order-weighted"):
        model = WaveModel(Material(1.5), height_rms=0.05, corr_length=1.0, method=method)
        model.brdf(theta_i[:9], theta_s[:9], dphi[:9], 0.5)
        walls, cores = [], []
        for _ in range(5):
            wall, core = time.perf_counter(), time.process_time()
            model.brdf(theta_i, theta_s, dphi, 0.5)
            walls.append(time.perf_counter() - wall)
            cores.append(time.process_time() - core)
        print(f"{method:16} {0.5 / min(walls):.2f} {0.5 / min(cores):.2f}")


PARTS = {
    "forms": forms, "coherent": coherent, "energy": energy, "rough": rough,
    "joined": joined, "scales": scales, "map": draw_map, "sweep": draw_sweep,
    "speed": speed,
}  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--part", choices=PARTS, action="append")
    warnings.simplefilter("ignore", AccuracyWarning)
    for name in parser.parse_args().part or PARTS:
        PARTS[name]()


if __name__ == "__main__":
    main()

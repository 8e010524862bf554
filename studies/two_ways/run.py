"""From source to hemisphere or from detector to source: time to 1 %, and who errs where."""

import argparse
import time
import warnings
from dataclasses import dataclass

import numpy as np

from pbrdf import AccuracyWarning, GaussianSurface, Material, Scene, observe, simulate

THETA_I = np.deg2rad(41.0)
HALF = 0.01
# Bins of simulate: 1 x 2 degrees, at 41 degrees the solid angle of a cone of 0.7 degrees
N_THETA, N_DPHI = 90, 180
MATERIAL = Material(1.5)
NAMES = ("peak", "wing", "far wing")
# Zenith and azimuth bins: the brightest, a tenth of it or so, and far out; by slope
PLACES = {
    0.3: ((50, 90), (75, 88), (10, 30)),
    0.05: ((41, 90), (50, 90), (53, 84)),
}


@dataclass(frozen=True)
class Effort:
    """CPU seconds of a run and the relative errors that it reached."""

    seconds: float
    errors: np.ndarray

    def to_one_percent(self):
        """CPU seconds to 1 % of M00; realisations and rays both grow as the square."""
        return self.seconds * (self.errors / 0.01) ** 2


def scene_of(slope, material=MATERIAL):
    """Surface of the comparison: 16 correlation lengths wide, 16 cells each."""
    surface = GaussianSurface(
        shape=(256, 256), spacing=1.0, corr_length=16.0, slope_rms=slope
    )
    return Scene(surface, material)


def geometry(places):
    """Zenith of the detector and dphi of bins. [rad]"""
    theta, phi = np.array(places).T
    return (theta + 0.5) * (np.pi / 2 / N_THETA), phi * (2 * np.pi / N_DPHI)


def timed(work):
    """Run once to compile, then again against the clock of the CPU."""
    start = time.process_time()
    result = work()
    return result, time.process_time() - start


def relative(error, value):
    """Return errors over values; infinite where nothing was seen."""
    return np.divide(error, value, out=np.full_like(value, np.inf), where=value > 0.0)


def by_bins(scene, places, n_rays, realizations, seed):
    """Run the first way: every direction at once."""
    result, seconds = timed(
        lambda: simulate(
            scene, THETA_I, n_rays=n_rays, realizations=realizations, seed=seed,
            phi_i="uniform", n_theta=N_THETA, n_dphi=N_DPHI, workers=1,
        )
    )  # fmt: skip
    theta, phi = np.array(places).T
    value = result.brdf_total.values[0, theta, phi, 0, 0]
    error = result.brdf_total_stderr.values[0, theta, phi, 0, 0]
    return Effort(seconds, relative(error, value)), value, error


def by_cones(scene, places, n_rays, realizations, seed, **options):
    """Run the second way: the geometries asked for."""
    theta_s, dphi = geometry(places)
    result, seconds = timed(
        lambda: observe(
            scene, THETA_I, theta_s, dphi, n_rays=n_rays, realizations=realizations,
            seed=seed, phi_i="uniform", source_half_angle=HALF,
            detector_half_angle=HALF, workers=1, **options,
        )
    )  # fmt: skip
    value, error = (
        result[name].values[:, 0, 0] for name in ("brdf_total", "brdf_total_stderr")
    )
    return Effort(seconds, relative(error, value)), value, error


def race(slope, realizations):
    """CPU seconds to 1 % at three geometries, for each way with its best number of rays."""
    scene, places = scene_of(slope), PLACES[slope]
    ways = {
        "simulate": (by_bins, {}, (100_000, 400_000)),
        "observe, facets": (by_cones, {"estimator": "facets"}, (3000, 20_000)),
        "observe, facets, from the source": (
            by_cones, {"estimator": "facets", "start": "source"}, (3000, 20_000),
        ),
        "observe, corners": (by_cones, {"estimator": "corners"}, (60_000,)),
        "observe, count": (by_cones, {"estimator": "count"}, (60_000,)),
    }  # fmt: skip
    print(f"\nslope {slope:g}: CPU seconds to 1 % of M00, all bounces, {realizations} "
          f"realisations measured")  # fmt: skip
    print(f"  {'':34s}" + "".join(f"{name:>10s}" for name in NAMES) + "   all three")
    for label, (way, options, counts) in ways.items():
        efforts = []
        for n_rays in counts:
            way(scene, places, 1000, 2, 0, **options)
            efforts.append(way(scene, places, n_rays, realizations, 1, **options)[0])
        each = np.min([effort.to_one_percent() for effort in efforts], axis=0)
        longest = min(effort.to_one_percent().max() for effort in efforts)
        numbers = "".join(f"{value:10.3g}" for value in each)
        print(f"  {label:34s}{numbers}{longest:12.3g}", flush=True)


def scan_race(realizations):
    """Print the same for a whole scan in the plane: 59 detectors of one source."""
    scene = scene_of(0.3)
    theta = np.arange(0, 75, 2.5).astype(int)
    places = [(k, 90) for k in theta] + [(k, 0) for k in theta[1:]]
    _, first, _ = by_bins(scene, places, 400_000, realizations, 3)
    bright = first > 0.1 * first.max()
    print(f"\nscan of {len(places)} detectors, slope 0.3: CPU seconds until the worst of "
          f"the {bright.sum()} above a tenth of the peak has 1 %")  # fmt: skip
    for label, way, options, counts in (
        ("simulate", by_bins, {}, (100_000, 400_000)),
        ("observe, facets", by_cones, {}, (5000,)),
        ("observe, facets, from the source", by_cones, {"start": "source"},
         (20_000, 100_000)),
    ):  # fmt: skip
        efforts = [way(scene, places, n, realizations, 1, **options)[0] for n in counts]
        best = min(effort.to_one_percent()[bright].max() for effort in efforts)
        print(f"  {label:34s}{best:10.3g}", flush=True)


def rates():
    """Print bundles and readings a core-second."""
    print("rates (16 surfaces of 256 x 256 cells drawn with them):")
    scene, places = scene_of(0.3), PLACES[0.3]
    for label, options in (
        ("glass, facets", {}),
        ("glass, corners", {"estimator": "corners"}),
        ("glass, single bounces alone", {"max_bounces": 1}),
    ):
        work = {"n_rays": 20_000, "realizations": 16, "seed": 1} | options
        by_cones(scene, places, **work | {"realizations": 2})
        effort, _, _ = by_cones(scene, places, **work)
        readings = 16 * len(places) / effort.seconds
        print(
            f"  {label:30s}{20_000 * readings / 1e6:6.2f} M bundles, "
            f"{readings:7.0f} readings of one surface each a core-second"
        )


def approximations(n_rays):
    """Print what F' and the corner rays leave out, by the width of the cones.

    All on one surface of 32 x 32 correlation lengths, whose own grain drops out.
    """
    theta_s = np.deg2rad([40.0, 55.0, 20.0, 65.0])
    dphi = np.deg2rad([180.0, 165.0, 180.0, 180.0])
    print("\nlargest difference of four geometries, in per cent of M00; both cones alike")
    print("  slope  half-angle   F' against each path   corners against paths")
    print("                        (any element)                (M00)")
    for slope in (0.1, 0.3):
        surface = GaussianSurface(
            shape=(512, 512), spacing=1.0, corr_length=16.0, slope_rms=slope
        )
        scene = Scene(surface.sample(5), MATERIAL)
        for half in (0.01, 0.03, 0.06, 0.1):
            run = {
                "source_half_angle": half, "detector_half_angle": half, "seed": 3,
                "phi_i": "uniform", "max_bounces": 1,
            }  # fmt: skip
            angles = (scene, np.deg2rad(40.0), theta_s, dphi)
            # The same points of the same facets: no noise between the two
            mean = observe(*angles, n_rays=320, **run).brdf_total.values
            exact = observe(*angles, n_rays=320, estimator="paths", **run)
            scale = exact.brdf_total.values[:, :1, :1]
            shortcut = np.abs(mean - exact.brdf_total.values) / scale
            corners = observe(
                *angles, n_rays=n_rays, estimator="corners", start="source", **run
            )
            off = (corners.brdf_total - exact.brdf_total).values[:, 0, 0] / scale[:, 0, 0]
            noise = np.hypot(corners.brdf_total_stderr, exact.brdf_total_stderr)
            noise = noise.values[:, 0, 0] / scale[:, 0, 0]
            worst = np.argmax(np.abs(off))
            print(
                f"  {slope:5.2f}  {half:10.3f}   {100 * shortcut.max():12.3f}"
                f"{100 * off[worst]:22.2f} ± {100 * noise[worst]:.2f}",
                flush=True,
            )


def second_bounces(n_rays):
    """Print what corner rays leave out of the light of two bounces, against counting."""
    theta_s, dphi = np.array([0.7, 0.9]), np.array([np.pi, 3.4])
    surface = GaussianSurface(shape=(128, 128), spacing=1.0, corr_length=8.0, slope_rms=0.4)
    scene = Scene(surface.sample(3), Material(3.0))
    print("\ntwo bounces, slope 0.4, n = 3: corner rays over counting, in per cent")
    print("  half-angle  specular direction     0.2 rad behind it and 15 degrees aside")
    for half in (0.06, 0.12, 0.2):
        run = {
            "source_half_angle": half, "detector_half_angle": half, "phi_i": "uniform",
            "start": "source",
        }  # fmt: skip
        counted, bundled = (
            observe(scene, 0.7, theta_s, dphi, n_rays=rays, estimator=name, **run)
            for name, rays in (("count", n_rays), ("corners", n_rays // 4))
        )
        value, reference = (each.brdf.values[1, :, 0, 0] for each in (bundled, counted))
        noise = np.hypot(
            *(each.brdf_stderr.values[1, :, 0, 0] for each in (bundled, counted))
        )
        parts = "".join(
            f"{100 * (a / b - 1):14.1f} ± {100 * c / b:.1f}"
            for a, b, c in zip(value, reference, noise, strict=True)
        )
        print(f"  {half:10.2f}{parts}", flush=True)


def agreement(seeds):
    """Differences of the two ways in combined standard errors, by class of bounces."""
    # Bins of 2 x 4 degrees: two bounces are rarer
    places = ((11, 45), (15, 40), (20, 45), (20, 35), (25, 42), (27, 50), (30, 44))
    theta, phi = np.array(places).T
    theta_s, dphi = (theta + 0.5) * (np.pi / 90), phi * (np.pi / 45)
    print("\ndifferences in combined standard errors, elements above 2 % of M00:")
    for name, material in (
        ("glass", MATERIAL),
        ("aluminium", Material(0.958, 6.69)),
        ("paint", Material(1.5, diffuse_albedo=0.6)),
    ):
        scores = {"1": [], "2": [], "3+": []}
        for seed in range(seeds):
            run = {"realizations": 32, "phi_i": "uniform"}
            bins = simulate(
                scene_of(0.3, material), THETA_I, n_rays=60_000, seed=seed,
                n_theta=45, n_dphi=90, **run,
            )  # fmt: skip
            cones = observe(
                scene_of(0.3, material), THETA_I, theta_s, dphi, n_rays=10_000,
                seed=1000 + seed, start="source", source_half_angle=2 * HALF,
                detector_half_angle=2 * HALF, **run,
            )  # fmt: skip
            value = bins.brdf.values[:, 0, theta, phi]
            noise = bins.brdf_stderr.values[:, 0, theta, phi]
            z = cones.brdf.values - value
            z = z / np.maximum(np.hypot(noise, cones.brdf_stderr.values), 1e-300)
            seen = np.abs(value) > 0.02 * value[..., :1, :1]
            for k, order in enumerate(scores):
                scores[order].append(z[k][seen[k]])
        for order, parts in scores.items():
            z = np.concatenate(parts)
            if z.size:
                print(
                    f"  {name:10s} bounces {order:2s}  rms {np.sqrt(np.mean(z**2)):.2f}  "
                    f"mean {z.mean():+.2f}  largest {np.abs(z).max():.2f} of {z.size}",
                    flush=True,
                )


def main():
    """Print every table, or one; with --quick from fewer realisations."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--table", choices=("rates", "race", "widths", "agreement"))
    chosen = parser.parse_args()
    warnings.simplefilter("ignore", AccuracyWarning)
    realizations = 12 if chosen.quick else 32
    if chosen.table in (None, "rates"):
        rates()
    if chosen.table in (None, "race"):
        for slope in PLACES:
            race(slope, realizations)
        scan_race(realizations)
    if chosen.table in (None, "widths"):
        approximations(1_000_000 if chosen.quick else 4_000_000)
        second_bounces(1_000_000 if chosen.quick else 12_000_000)
    if chosen.table in (None, "agreement"):
        agreement(1 if chosen.quick else 6)


if __name__ == "__main__":
    main()

"""Predict known surfaces from rendered interferograms of them; see README.md.

Run it:  python studies/predict_coatings/synthetic.py
"""

import sys
import warnings
from collections.abc import Iterator

import numpy as np
import xarray as xr

from fitting import Instrument, Prediction, predict
from pbrdf import HeightMap, Material, Scene, simulate
from pbrdf.derived import bin_averages
from studies.predict_coatings.interferometer import Interferometer, digitised
from studies.predict_coatings.true_surfaces import true_surface

GLASS = Material(1.5)
WAVELENGTH = 0.65
INCIDENCES = np.deg2rad([10.0, 30.0, 50.0])
NODES, PIXEL = 512, 2
# Kind, rms slope, correlation length and step [um], aperture
CASES = (
    ("grains", 0.25, 8.0, 0.2268, 0.55),
    ("pits", 0.2, 10.0, 0.2268, 0.55),
    ("ridges", 0.2, 8.0, 0.2268, 0.55),
    ("grains", 0.12, 10.0, 0.2268, 0.3),
    ("grains", 0.25, 4.0, 0.1134, 0.55),
)
# Bands of a digitised map, beside its rms height
BAND = 0.15
# Share of the peak above which bins are compared, and noise above which they are not
SEEN, NOISY = 0.05, 0.1
FURTHEST = np.deg2rad(80.0)


def main() -> None:
    """Print the table of README.md."""
    warnings.simplefilter("ignore")
    for kind, slope, length, step, aperture in CASES:
        surface = true_surface(
            kind, slope_rms=slope, corr_length=length, nodes=NODES, step=step, seed=1
        )
        run = simulate(
            Scene(surface, GLASS), INCIDENCES, phi_i="uniform", n_rays=300_000, n_theta=30,
            n_dphi=36, stokes="linear", seed=4,
        )  # fmt: skip
        print(f"\n== {kind}, slope {slope}, {length} um; NA {aperture}")
        for name, found in predictions(surface, aperture):
            errors = [off_by(found, run, element) for element in ((0, 0), (1, 0))]
            facets = found.facets
            tilts = np.quantile(np.hypot(facets.slope_x, facets.slope_y), [0.5, 0.9, 0.99])
            lost = 0.0 if facets.bridged is None else facets.bridged.mean()
            print(
                f"  {name:34s} M00 {errors[0]:.3f}  M10 {errors[1]:.3f}  bridged "
                f"{lost:.2f}  |slope| {tilts.round(2)}  hidden {facets.hidden:.3f}",
                flush=True,
            )


def predictions(surface: HeightMap, aperture: float) -> Iterator[tuple[str, Prediction]]:
    """Yield what each stage of the measurement predicts."""
    begin = slice(PIXEL // 2, None, PIXEL)
    sharp = HeightMap(surface.heights[begin, begin], surface.spacing[0] * PIXEL)
    seen = Interferometer(aperture=aperture, pixel=PIXEL).image(surface)
    band = BAND * float(surface.heights.std())
    instrument = Instrument(aperture=aperture)
    maps = {
        "sharp": (sharp, None),
        "sharp, in bands": (digitised(sharp, band), None),
        "interferometer, not named": (seen, None),
        "interferometer, named": (seen, instrument),
        "interferometer, in bands, not named": (digitised(seen, band), None),
        "interferometer, in bands, named": (digitised(seen, band), instrument),
    }
    for name, (one, by) in maps.items():
        yield name, predict(one, GLASS, wavelength=WAVELENGTH, instrument=by)


def off_by(found: Prediction, run: xr.Dataset, element: tuple[int, int]) -> float:
    """Rms of prediction less Monte Carlo, beyond the noise of the latter.

    Over each M00 for M00, over the rms of M10 for M10.
    """
    at = (..., *element)
    mean = np.stack(
        [bin_averages(found, float(t), *run.brdf_total.shape[1:3], order=3)
         for t in run.theta_i.values]
    )[at]  # fmt: skip
    traced = run.brdf_total.values[at]
    noise = np.sqrt((run.brdf_stderr.values**2).sum(0))
    whole = run.brdf_total.values[..., 0, 0]
    seen = whole > SEEN * whole.max(axis=(1, 2), keepdims=True)
    seen &= noise[..., 0, 0] < NOISY * whole
    seen &= (run.theta_s.values < FURTHEST)[:, None]
    size = np.where(seen, whole, 1.0)
    if element != (0, 0):
        size = np.full_like(whole, np.sqrt(np.mean(traced[seen] ** 2)))
    off, chance = ((mean - traced) / size)[seen], (noise[at] / size)[seen]
    return float(np.sqrt(max(np.mean(off**2) - np.mean(chance**2), 0.0)))


if __name__ == "__main__":
    sys.exit(main())

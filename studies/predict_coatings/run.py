"""Predict two real coatings from their own maps and compare afterwards; see README.md.

Run it:  PBRDF_SHARED=folder python studies/predict_coatings/run.py
"""

import os
import sys
import warnings
from pathlib import Path

import numpy as np

import data_io
from fitting import Instrument, predict, surface_statistics
from fitting.prediction.comparison import misfit
from fitting.prediction.scan_density import free_density
from pbrdf import HeightMap, Material, MicrofacetModel

INDEX = Material(1.5)
WAVELENGTH = 0.65
# Aperture of an objective of such pixels; that of these maps is not stated
ASSUMED = 0.55
# Distance over which slopes of places are compared [um]
FAR = 3.6
# Map, its step [um], and the scan of the same coating
PAIRS = (
    ("EC1_1", 0.2268, "ualoft_AnoBlackEC1onAlum"),
    ("EC1_2", 0.2268, "ualoft_AnoBlackEC1onAlum"),
    ("NiTE_on_Steel_1", 0.2268, "ualoft_AnoBlackNiTEonSteel"),
    ("NiTE_on_Steel_2", 0.2274, "ualoft_AnoBlackNiTEonSteel"),
)


def main() -> None:
    """Print the tables of README.md."""
    folder = os.environ.get("PBRDF_SHARED")
    if folder is None:
        print("PBRDF_SHARED does not name the folder of measured data: nothing to do.")
        return
    warnings.simplefilter("ignore")
    for name, step, scan_name in PAIRS:
        study(Path(folder) / "data", name, step, scan_name)


def study(folder: Path, name: str, step: float, scan_name: str) -> None:
    """Print what each model makes of one pair of map and scan."""
    scan = data_io.read_goniometer(folder / f"goniometer/{scan_name}.txt")
    measured = scan.M00.values
    counted = (scan.theta_s.values <= np.deg2rad(80.01)) & (measured > 0)
    angles = [scan[key].values[counted] for key in ("theta_i", "theta_s", "dphi")]
    measured = measured[counted]
    surface = data_io.read_height_map(folder / f"topography/{name}.npy", spacing=step)
    print(f"\n== {name}, {measured.size} readings")
    slope = surface_statistics(surface).slope_rms.value
    gaussian = MicrofacetModel(INDEX, slope_rms=slope).brdf(*angles)[..., 0, 0]
    line(f"Gaussian, slope of the map {slope:.3f}", gaussian, measured)
    found = predict(surface, INDEX, wavelength=WAVELENGTH)
    line("predicted", found.brdf(*angles)[..., 0, 0], measured)
    low, high = found.interval(*angles)
    inside = np.mean((low <= measured) & (measured <= high))
    print(
        f"  95 % interval holds {inside:.1%}, median high/low {np.median(high / low):.2g}"
    )
    print("  " + "\n  ".join(found.notes))
    named = predict(
        surface, INDEX, wavelength=WAVELENGTH, instrument=Instrument(aperture=ASSUMED)
    )
    line(f"if the aperture were {ASSUMED}", named.brdf(*angles)[..., 0, 0], measured)
    print(f"  rms slope over {FAR:g} um: {far_slope(surface):.3f}; {named.notes[0]}")
    best = free_density(*angles, measured, INDEX)
    shares = np.array([0.25, 0.5, 0.75, 0.9])
    patches = np.hypot(found.facets.slope_x, found.facets.slope_y)
    print(
        f"  any isotropic density: {best.error:.3f}, gain {best.gain:.2f}, base "
        f"{best.diffuse_albedo:.4f}\n  |slope| at 25/50/75/90 %: scan "
        f"{best.quantile(shares).round(2)}, patches {np.quantile(patches, shares).round(2)}"
    )


def far_slope(surface: HeightMap) -> float:
    """Rms slope over a distance that terraces, noise and resolution do not reach. [1]"""
    steps = round(FAR / surface.spacing[0])
    heights = surface.heights
    rises = [heights[steps:] - heights[:-steps], heights[:, steps:] - heights[:, :-steps]]
    squares = np.concatenate([np.ravel(rise) ** 2 for rise in rises])
    return float(np.sqrt(np.nanmean(squares)) / (steps * surface.spacing[0]))


def line(title: str, curve: np.ndarray, measured: np.ndarray) -> None:
    """Print the misfit of one curve."""
    off = misfit(curve, measured)
    print(
        f"  {title}: {off.gain_free:.3f} (gain {off.gain:.2f}, base {off.gain_base:.4f}); "
        f"gain 1 {off.base_free:.3f} (base {off.base:.4f}); as predicted {off.absolute:.3f}"
    )


if __name__ == "__main__":
    sys.exit(main())

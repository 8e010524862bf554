"""Statistics of the real profiles and maps, with a figure of each.

Set PBRDF_SHARED to the folder that holds data/topography; the files are not part of the
project. Run

    python studies/surface_statistics/real_files.py
"""

import os
import time
from pathlib import Path

import numpy as np

from data_io import Profile, read_height_map, read_profile
from fitting import SurfaceStatistics, surface_statistics
from pbrdf.surface import HeightMap

FIGURES = Path(__file__).parent / "figures"

# Name, what is removed, unit of the file where it names none, rms its instrument states
FILES = (
    ("uncd_stylus.txt", "curvature", "mm", None),
    ("uncd_tem_side_profile.asc", "tilt", "nm", None),
    ("Luftpresser_1_56_ak.csv", "tilt", None, None),
    ("EC1_1.npy", "tilt", "um", 1.336),
    ("NiTE_on_Steel_1.npy", "tilt", "um", 1.553),
    ("sample-land.x3p", "curvature", None, None),
)
OPTICAL_WAVELENGTH = 0.55


def read(path: Path, unit: str | None) -> Profile | HeightMap:
    if path.suffix == ".npy":
        return read_height_map(path, spacing=0.2268, unit=unit)
    if path.suffix == ".x3p":
        return read_height_map(path)
    return read_profile(path, unit=unit) if unit else read_profile(path)


def draw(found: SurfaceStatistics, name: str) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(13, 3.2), layout="constrained")
    axes = figure.subplots(1, 4)
    for axis, histogram in zip(
        axes, (found.height_histogram(), found.slope_histogram()), strict=False
    ):
        axis.stairs(histogram.density, histogram.edges, fill=True, alpha=0.4)
        x = np.linspace(histogram.edges[0], histogram.edges[-1], 300)
        axis.plot(x, histogram.gaussian(x))
        axis.set(xlabel=f"{histogram.quantity} [{histogram.units}]", ylabel="density")
    for part in found.axes:
        curve = part.autocorrelation
        axes[2].plot(curve.lag, curve.measured, ".", label=part.axis)
        axes[2].plot(curve.lag, curve.fitted, label=curve.form)
        bands = found.slope_against_cutoff(axis=part.axis)
        values = [band.value for band in bands.slope_rms]
        axes[3].loglog(bands.cutoff, values, "--")
        axes[3].loglog(bands.cutoff[bands.measured], np.array(values)[bands.measured], "o-")
    axes[2].set(xlabel="lag [um]", ylabel="autocorrelation")
    axes[2].legend(fontsize="small")
    axes[3].set(xlabel="cut-off wavelength [um]", ylabel="slope rms (dashed: extrapolated)")
    figure.suptitle(name)
    FIGURES.mkdir(exist_ok=True)
    figure.savefig(FIGURES / f"{Path(name).stem}.png", dpi=80)


def main() -> None:
    root = os.environ.get("PBRDF_SHARED")
    if not root:
        print("PBRDF_SHARED is not set: the real files are not at hand, nothing measured.")
        return
    for name, form, unit, stated in FILES:
        surface = read(Path(root) / "data" / "topography" / name, unit)
        started = time.perf_counter()
        found = surface_statistics(surface, form=form)
        print(f"\n{name}: {surface}, {form} removed, {time.perf_counter() - started:.1f} s")
        print(found)
        if stated:
            print(
                f"{'instrument Sq':>18}  {stated} um: measured "
                f"{100 * (found.height_rms.value / stated - 1):+.1f} % of it"
            )
        for part in found.axes:
            at = found.slope_at(OPTICAL_WAVELENGTH, axis=part.axis)
            how = "measured" if part.cutoff <= OPTICAL_WAVELENGTH else "extrapolated"
            print(f"{'slope at 0.55 um':>18}  {at} along {part.axis}, {how}")
        plain = found.plain
        print(
            f"{'uncorrected':>18}  height {plain.height_rms:.4g} um, length "
            f"{plain.corr_length:.4g} um, slope {plain.slope_rms:.4g}"
        )
        draw(found, name)


if __name__ == "__main__":
    main()

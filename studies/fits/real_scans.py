"""How far the analytical model describes measured coatings, and what it lacks.

    PBRDF_SHARED=... python studies/fits/real_scans.py

Fits PTFE (Mueller matrix, 633 nm), two black coatings (unpolarised, four incidences, slope
from their own height maps) and a spacecraft chassis (eight decades), and prints the misfit.
"""

import os
from pathlib import Path

import numpy as np

from data_io import read_goniometer, read_height_map
from fitting import fit, surface_statistics
from pbrdf import Material, MicrofacetModel

SHARED = Path(os.environ["PBRDF_SHARED"]) / "data"
GAINS = ("specular_gain", "diffuse_albedo")
COATINGS = {
    "EC1": ("ualoft_AnoBlackEC1onAlum.txt", "EC1_1.npy"),
    "NiTE on steel": ("ualoft_AnoBlackNiTEonSteel.txt", "NiTE_on_Steel_1.npy"),
}


def show(title, result):
    """Print the result and the misfit of each observable by incidence."""
    print(f"\n## {title}\n{result.summary()}")
    readings = result.readings
    miss = (readings.measured - readings.model).values
    for name in dict.fromkeys(readings.observable.values.tolist()):
        rows = []
        for theta_i in np.unique(readings.theta_i.values):
            here = (readings.observable.values == name) & (
                readings.theta_i.values == theta_i
            )
            size = np.sqrt((readings.measured.values[here] ** 2).mean())
            rms = np.sqrt((miss[here] ** 2).mean())
            rows.append(f"{np.rad2deg(theta_i):.0f} deg {rms / size:.2f}")
        print(f"  rms misfit / rms of {name}: {', '.join(rows)}", flush=True)


def ptfe():
    """Fit PTFE with a Lambertian and with a polarised volume term."""
    scan = read_goniometer(SHARED / "goniometer/nist_ptfe_inplane.csv")
    scan = scan.isel(geometry=np.abs(scan.wavelength.values - 0.633) < 1e-6)
    model = MicrofacetModel(Material(1.35), slope_rms=0.3)
    show("PTFE, Lambertian", fit(scan, model, (*GAINS, "slope_rms")))
    free = ("specular_gain", "slope_rms", "volume_albedo", "volume_depolarization")
    show("PTFE, volume term", fit(scan, model, free))


def coating(name):
    """Fit a coating with the slope of its height map, and with the slope free."""
    scan_file, map_file = COATINGS[name]
    scan = read_goniometer(SHARED / "goniometer" / scan_file)
    height_map = read_height_map(SHARED / "topography" / map_file, spacing=0.2268)
    slope = surface_statistics(height_map).slope_rms
    print(f"\n{name}: slope_rms of the height map {slope}")
    model = MicrofacetModel(Material(1.5, 0.1), slope_rms=slope.value)
    show(f"{name}, slope of the map", fit(scan, model, priors={"slope_rms": slope}))
    show(f"{name}, slope free", fit(scan, model, (*GAINS, "slope_rms")))


def chassis():
    """Fit eight decades: absolute, relative and robust relative weights."""
    scan = read_goniometer(SHARED / "goniometer/spacecraft_chassis_brdf.csv")
    model = MicrofacetModel(Material(1.5), slope_rms=0.05)
    for options in (
        {"noise": "absolute"}, {"noise": "relative"},
        {"noise": "relative", "loss": "cauchy"},
    ):  # fmt: skip
        result = fit(scan, model, (*GAINS, "slope_rms"), **options)
        show(f"chassis, {options}", result)
        readings = result.readings
        decades = np.abs(np.log10(readings.model.values / readings.measured.values))
        print(f"  median misfit {np.median(decades):.2f} decades", flush=True)


if __name__ == "__main__":
    chassis()
    for coating_name in COATINGS:
        coating(coating_name)
    ptfe()

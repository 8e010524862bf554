"""How far the analytical model describes measured samples, and what it lacks.

    PBRDF_SHARED=... python studies/fits/real_scans.py

Fits PTFE (Mueller matrix, 633 nm), two black coatings (unpolarised, four incidences, slope
from their own height maps) and a spacecraft chassis (eight decades). Prints, for each model
tried, the parameters, how far it is from the readings, and where: the mean residual by tilt
of the facet that would mirror, or by scattering angle.
"""

import os
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np

from data_io import read_goniometer, read_height_map
from fitting import Noise, fit, surface_statistics
from fitting.models.analytic import AnalyticModel
from pbrdf import Material, MicrofacetModel

SHARED = Path(os.environ.get("PBRDF_SHARED", ".")) / "data"
GAINS = ("specular_gain", "diffuse_albedo")
COATINGS = {
    "EC1": ("ualoft_AnoBlackEC1onAlum.txt", "EC1_1.npy"),
    "NiTE on steel": ("ualoft_AnoBlackNiTEonSteel.txt", "NiTE_on_Steel_1.npy"),
}
TILTS = (0.0, 2.0, 5.0, 15.0, 30.0, 90.0)
TURNS = (0.0, 45.0, 90.0, 135.0, 180.0)


class TwoSlopes:
    """Facets of two slopes: the model's own, and a share of much flatter ones."""

    bounds: Mapping[str, tuple[float, float]] = {"flat_slope": (1e-3, 0.05)}
    replicas = ()

    def __init__(self, model, *, flat_gain=0.1, flat_slope=0.01):
        self.model, self.flat_gain, self.flat_slope = model, flat_gain, flat_slope

    def values(self, geometry):
        """Return every parameter at each geometry."""
        own = {"flat_gain": self.flat_gain, "flat_slope": self.flat_slope}
        own = {name: np.full(geometry.size, value) for name, value in own.items()}
        return {**AnalyticModel(self.model).values(geometry), **own}

    def mueller(self, values, geometry, elements):
        """Return elements of the BRDF as an expression."""
        model = AnalyticModel(self.model)
        rough = {k: v for k, v in values.items() if k not in ("flat_gain", "flat_slope")}
        none = 0.0 * values["diffuse_albedo"]
        flat = {**rough, "specular_gain": values["flat_gain"], "diffuse_albedo": none,
                "slope_rms": values["flat_slope"]}  # fmt: skip
        return model.mueller(rough, geometry, elements) + model.mueller(
            flat, geometry, elements
        )

    def updated(self, values):
        """Return the model with these values."""
        own = {"flat_gain": self.flat_gain, "flat_slope": self.flat_slope}
        own |= {name: value for name, value in values.items() if name in own}
        rest = {name: value for name, value in values.items() if name not in own}
        return TwoSlopes(AnalyticModel(self.model).updated(rest), **own)


def angles(readings):
    """Return facet tilt and scattering angle of each reading. [deg]"""
    theta_i, theta_s = readings.theta_i.values, readings.theta_s.values
    across = np.sin(theta_i) * np.sin(theta_s) * np.cos(readings.dphi.values)
    twice = np.arccos(np.clip(np.cos(theta_i) * np.cos(theta_s) + across, -1.0, 1.0))
    half = np.maximum(np.cos(0.5 * twice), 1e-9)
    cosine = (np.cos(theta_i) + np.cos(theta_s)) / (2.0 * half)
    tilt = np.arccos(np.clip(cosine, -1.0, 1.0))
    return np.rad2deg(tilt), 180.0 - np.rad2deg(twice)


def by_bins(where, values, edges):
    """Return the mean of values in each bin, as text."""
    cells = []
    for low, high in pairwise(edges):
        here = (where >= low) & (where < high + (high == edges[-1]))
        mean = f"{np.mean(values[here]):+.3f}" if here.any() else "none"
        cells.append(f"{low:.0f}-{high:.0f}: {mean}")
    return ", ".join(cells)


def show(title, result):
    """Print a fit in a line, its misfit by incidence, and where the misfit is."""
    found = ", ".join(f"{name} {estimate}" for name, estimate in result.estimates.items())
    print(f"\n### {title}: {found}; {result.status}, AIC {result.aic:.0f}, {result.noise}")
    readings = result.readings
    measured, model = readings.measured.values, readings.model.values
    tilt, turn = angles(readings)
    for name in dict.fromkeys(readings.observable.values.tolist()):
        rows = []
        mine = readings.observable.values == name
        for theta_i in np.unique(readings.theta_i.values):
            here = mine & (readings.theta_i.values == theta_i)
            rms = np.sqrt(np.mean((measured - model)[here] ** 2))
            size = np.sqrt(np.mean(measured[here] ** 2))
            rows.append(f"{np.rad2deg(theta_i):.0f} deg {rms / size:.2f}")
        print(f"  {name}: rms misfit / rms, {', '.join(rows)}")
        if name == "M00":
            off = measured[mine] / model[mine] - 1.0
            print(f"    measured / model - 1 by tilt: {by_bins(tilt[mine], off, TILTS)}")
            m00 = dict(zip(map(tuple, _places(readings, mine)), model[mine], strict=True))
        else:
            scale = np.array([m00.get(tuple(p), np.nan) for p in _places(readings, mine)])
            off = (measured - model)[mine] / scale
            print(
                f"    (measured - model) / M00 by turn: {by_bins(turn[mine], off, TURNS)}"
            )
    decades = np.abs(np.log10(np.maximum(model, 1e-30) / np.maximum(measured, 1e-30)))
    if set(readings.observable.values.tolist()) == {"M00"}:
        print(
            f"  off by {100 * np.sqrt(np.mean((measured / model - 1.0) ** 2)):.0f} % rms; "
            f"median {np.median(decades):.3f}, worst {decades.max():.2f} decades"
        )
    for warning in result.warnings:
        print(f"  warning: {warning}")
    print(end="", flush=True)


def _places(readings, mine):
    keys = ("theta_i", "theta_s", "dphi")
    return np.stack([readings[key].values[mine] for key in keys], axis=1).round(9)


def ptfe():
    """Fit PTFE with ever more of the light that comes from inside."""
    scan = read_goniometer(SHARED / "goniometer/nist_ptfe_inplane.csv")
    scan = scan.isel(geometry=np.abs(scan.wavelength.values - 0.633) < 1e-6)
    model = MicrofacetModel(Material(1.35), slope_rms=0.3)
    print("\n## PTFE")
    show("facets and Lambertian", fit(scan, model, (*GAINS, "slope_rms")))
    free = ("specular_gain", "slope_rms", "volume_albedo", "volume_depolarization")
    show("volume term", fit(scan, model, free))
    # One instrument, one noise: not a smaller one for what is dark anyway
    show("volume term, 1 % of M00", fit(scan, model, free, noise=Noise(relative=0.01)))


def coating(name):
    """Fit a coating with the slope of its height map, and with the slope free."""
    scan_file, map_file = COATINGS[name]
    scan = read_goniometer(SHARED / "goniometer" / scan_file)
    height_map = read_height_map(SHARED / "topography" / map_file, spacing=0.2268)
    slope = surface_statistics(height_map).slope_rms
    print(f"\n## {name}: slope_rms of the height map {slope}")
    model = MicrofacetModel(Material(1.5, 0.1), slope_rms=slope.value)
    show("slope of the map", fit(scan, model, priors={"slope_rms": slope}))
    free = (*GAINS, "slope_rms")
    for law in ("gaussian", "trowbridge-reitz"):
        lobe = model.with_parameters(slope_distribution=law, slope_rms=0.25)
        show(f"slope free, {law}", fit(scan, lobe, free))
    bounds = {"n": (1.0, 4.0)}
    start = model.with_parameters(slope_rms=0.25)
    show("slope, n, kappa free", fit(scan, start, (*free, "n", "kappa"), bounds))


def chassis():
    """Fit eight decades: absolute, relative and robust weights, other slopes."""
    scan = read_goniometer(SHARED / "goniometer/spacecraft_chassis_brdf.csv")
    model = MicrofacetModel(Material(1.5), slope_rms=0.05)
    free = (*GAINS, "slope_rms")
    print("\n## Spacecraft chassis")
    for options in (
        {"noise": "absolute"}, {"noise": "relative"},
        {"noise": "relative", "loss": "cauchy"},
    ):  # fmt: skip
        show(f"Gaussian, {options}", fit(scan, model, free, **options))
    for law in ("trowbridge-reitz", "modified-cauchy"):
        lobe = model.with_parameters(slope_distribution=law)
        show(f"{law}, relative", fit(scan, lobe, free, noise="relative"))
    rough = model.with_parameters(slope_distribution="trowbridge-reitz", slope_rms=0.1)
    for title, base in (
        ("Gaussian and flat facets, relative", model.with_parameters(slope_rms=0.2)),
        ("Trowbridge-Reitz and flat facets, relative", rough),
    ):
        two = (*free, "flat_gain", "flat_slope")
        limits = {"flat_gain": (0.0, None)}
        show(title, fit(scan, TwoSlopes(base), two, limits, noise="relative"))


def main():
    """Run all, or say why not."""
    if not SHARED.is_dir() or "PBRDF_SHARED" not in os.environ:
        print("PBRDF_SHARED does not name the folder of measured data: nothing to do.")
        return
    ptfe()
    for name in COATINGS:
        coating(name)
    chassis()


if __name__ == "__main__":
    main()

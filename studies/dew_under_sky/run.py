"""Which contact angle leaves the signature of a painted surface under the sky alone?"""

import argparse
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr

from pbrdf import AccuracyWarning, Drops, GaussianSurface, Material, Scene, signature
from pbrdf.plots import COLOURS, new_figure
from pbrdf.signatures import (
    RayleighSky,
    Sun,
    ThermalSky,
    black_body,
    contrast,
    rayleigh_optical_depth,
)

HERE = Path(__file__).parent
ANGLES = (15, 25, 40, 60, 90, 120, 150)
VIEWS = (20.0, 50.0, 70.0)
# Assumed: glossy dark paint, a clear binder over a nearly black base
PAINT = Material.from_table(
    wavelength=[0.5, 0.6, 3.9, 4.1, 9.9, 10.1],
    n=[1.5, 1.5, 1.45, 1.45, 1.5, 1.5],
    diffuse_albedo=[0.05, 0.05, 0.05, 0.05, 0.02, 0.02],
)
SURFACE = GaussianSurface(shape=(128, 128), spacing=4.0, corr_length=30.0, slope_rms=0.1)
WATER = {"volume_per_area": 1.0, "number_density": 40e-6}  # um, 1/um2
# Surface at the dew point, a clear sky's air, and its optical depth in the two windows
SURFACE_K, AIR_K, DEPTH = 283.0, 278.0, {4.0: 0.35, 10.0: 0.25}
# One channel of the camera: 1 % of the dry radiance, or 50 mK where heat is seen
VISIBLE_NOISE, NOISE_K = 0.01, 0.05
MEASURES = ("I", "Q", "DOLP")


def scene(angle: int | None) -> Scene:
    """Return the paint, dry or under the same water at one contact angle."""
    wet = () if angle is None else (Drops(contact_angle=np.deg2rad(angle), **WATER),)
    return Scene(SURFACE, PAINT, wet)


def look(angle: int | None, wave: float, rays: int, draws: int, seed: int) -> xr.Dataset:
    """Stokes radiance under the sky alone: shaded from the sun, which the sky still has."""
    simulation = {
        "n_rays": rays, "realizations": draws, "seed": seed, "n_theta": 30, "n_dphi": 60,
    }  # fmt: skip
    light: dict = {"temperature": SURFACE_K}
    if wave < 3.0:
        depth = float(rayleigh_optical_depth(wave))
        sun = Sun.planck(theta=np.deg2rad(60.0), optical_depth=depth)
        light = {"sky": RayleighSky(sun=sun)}
    else:
        light["sky"] = ThermalSky(temperature=AIR_K, optical_depth=DEPTH[wave])
    with warnings.catch_warnings():
        # That 10 um is not much less than a drop: README, Limits
        warnings.simplefilter("ignore", AccuracyWarning)
        seen = signature(
            scene(angle), np.deg2rad(VIEWS), phi_s=np.pi / 2, wavelength=[wave],
            simulation=simulation, **light,
        )  # fmt: skip
    return seen.isel(wavelength=0)


def noise_of(dry: xr.Dataset, wave: float) -> float:
    """Noise of one channel. [W m-2 sr-1 um-1]"""
    if wave < 3.0:
        return VISIBLE_NOISE * float(dry.radiance.sel(stokes="I").mean())
    step = black_body(wave, SURFACE_K + NOISE_K) - black_body(wave, SURFACE_K)
    return float(step)


def table(rays: int, draws: int) -> pd.DataFrame:
    """One row a wavelength, contact angle and view."""
    rows = []
    for wave in (0.55, 4.0, 10.0):
        dry = look(None, wave, rays, draws, seed=1)
        noise = noise_of(dry, wave)
        for number, angle in enumerate(ANGLES):
            wet = look(angle, wave, rays, draws, seed=2 + number)
            found = contrast(wet, dry, noise=noise)
            for k, view in enumerate(VIEWS):
                one, seen, before = (d.isel(theta_s=k) for d in (found, wet, dry))
                row = {"wavelength_um": wave, "contact_angle_deg": angle, "view_deg": view}
                row["I_ratio"] = float(one.ratio)
                row["I_ratio_stderr"] = float(one.ratio_stderr)
                row["DOLP_dry"], row["DOLP_wet"] = _dolp(before), _dolp(seen)
                row["DOLP_difference_stderr"] = float(one.dolp_difference_stderr)
                shift = one.difference.sel(stokes="Q") / before.radiance.sel(stokes="I")
                error = one.difference_stderr.sel(stokes="Q")
                row["Q_shift"] = float(shift)
                row["Q_shift_stderr"] = float(error / before.radiance.sel(stokes="I"))
                for name in MEASURES:
                    row[f"detect_{name}"] = float(one.detectability.sel(measure=name))
                rows.append(row)
            print(f"{wave} um, {angle} deg", flush=True)
    return pd.DataFrame(rows)


def _dolp(seen: xr.Dataset) -> float:
    i, q, u = (float(seen.radiance.sel(stokes=s)) for s in "IQU")
    return float(np.hypot(q, u) / i)


def figure(rows: pd.DataFrame):
    """Draw the detectability of the water against contact angle."""
    drawn, axes = new_figure(len(VIEWS), 3, (7.0, 6.0))
    for i, view in enumerate(VIEWS):
        for j, wave in enumerate((0.55, 4.0, 10.0)):
            here = rows[(rows.view_deg == view) & (rows.wavelength_um == wave)]
            axis = axes[i][j]
            for colour, name in zip(COLOURS, MEASURES, strict=False):
                axis.plot(
                    here.contact_angle_deg, here[f"detect_{name}"], "o-", ms=3, lw=1,
                    color=colour, label=name,
                )  # fmt: skip
            axis.axhline(1.0, color="0.5", lw=0.8, ls=":")
            axis.set(yscale="log", ylim=(1e-2, 1e2))
            axis.set_title(f"{wave:g} um, view {view:g} deg", fontsize=8)
            if i == len(VIEWS) - 1:
                axis.set_xlabel("contact angle [deg]")
            if j == 0:
                axis.set_ylabel("difference / noise")
    axes[0][0].legend(fontsize=7, frameon=False)
    return drawn


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rays", type=int, default=2000)
    parser.add_argument("--draws", type=int, default=64)
    given = parser.parse_args()
    rows = table(given.rays, given.draws)
    rows.round(5).to_csv(HERE / "contrast.csv", index=False)
    figure(rows).savefig(HERE / "detectability.png", dpi=150)
    with pd.option_context("display.width", 200, "display.max_columns", 20):
        print(rows.round(4).to_string(index=False))


if __name__ == "__main__":
    main()

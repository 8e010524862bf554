"""Retro-reflection of dew on a diffuse leaf against contact angle (after Fraser 1994)."""

import argparse
from time import perf_counter

import numpy as np

from pbrdf import Drops, HeightMap, Material, Scene, simulate
from pbrdf.contaminants.shapes import cap_radius, seen_radius

LEAF = Material(1.0, diffuse_albedo=0.3, name="Lambertian leaf")
WATER = Material(1.333, name="water")
PERIOD, COVERAGE = 100.0, 0.2  # um, 1
CONTACT = (30, 60, 80, 90, 100, 110, 120, 130, 140, 150, 160, 170, 179)
# Bins of half a degree in zenith and one in azimuth about the retro-direction
N_THETA, N_DPHI = 180, 360


def drop(degrees: float) -> Drops:
    """One drop a period that covers a fifth of it, seen from above."""
    angle = np.deg2rad(degrees)
    radius = PERIOD * np.sqrt(COVERAGE / np.pi)
    unit = float(cap_radius(1.0, angle))
    volume = (radius / float(seen_radius(unit, angle))) ** 3
    return Drops.at(
        [[50.0, 50.0]], volume=volume, contact_angle=angle, material=WATER, gravity=False
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rays", type=int, default=1_000_000)
    parser.add_argument("--theta-i-deg", type=float, default=30.25)
    options = parser.parse_args()
    begin = perf_counter()
    flat = HeightMap.flat(size=(PERIOD, PERIOD))
    theta_i = np.deg2rad(options.theta_i_deg)
    lambert = LEAF.diffuse_albedo / np.pi
    print("contact   albedo of      enhancement of what is covered")
    print(" angle    the whole      retro (1 deg)     5 deg about     60 deg off")
    for degrees in CONTACT:
        result = simulate(
            Scene(flat, LEAF, drop(degrees)), theta_i, n_rays=options.rays, seed=5,
            n_theta=N_THETA, n_dphi=N_DPHI, stokes="unpolarized",
        )  # fmt: skip
        here = result.brdf_total[0, ..., 0, 0]
        error = result.brdf_total_stderr[0, ..., 0, 0]
        weight = result.projected_solid_angle
        theta_s, dphi = np.meshgrid(result.theta_s, result.dphi, indexing="ij")
        away = np.arccos(
            np.clip(
                np.cos(theta_s) * np.cos(theta_i)
                + np.sin(theta_s) * np.sin(theta_i) * np.cos(dphi),
                -1.0,
                1.0,
            )
        )
        cells = []
        for low, high in ((0.0, 0.5), (0.0, 5.0), (55.0, 65.0)):
            part = (away >= np.deg2rad(low)) & (away <= np.deg2rad(high))
            share = np.where(part, weight, 0.0)
            share = share / share.sum()
            value = float((here * share).sum()) / lambert
            spread = float(np.sqrt(((error * share) ** 2).sum())) / lambert
            cells.append(f"{1 + (value - 1) / COVERAGE:8.2f} ± {spread / COVERAGE:.2f}")
        albedo = float(result.albedo.sum())
        print(f"{degrees:5d}     {albedo:.4f}     {'  '.join(cells)}", flush=True)
    print(f"{perf_counter() - begin:.0f} s")


if __name__ == "__main__":
    main()

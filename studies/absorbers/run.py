"""How the light of absorbing films, drops and spheres depends on kappa: one line each."""

import argparse
import math
import warnings

import numpy as np

import pbrdf

WAVELENGTH, THETA, N = 1.0, 0.5, 1.333
GROUND = pbrdf.HeightMap.flat(size=(100.0, 100.0))
SHALLOW = math.radians(15.0)


def cap(angle, radius):
    """Volume of a cap of some contact angle and radius of curvature. [um^3]"""
    return math.pi * radius**3 / 3 * (2 + math.cos(angle)) * (1 - math.cos(angle)) ** 2


def film(material):
    return pbrdf.Film(thickness=3.0, material=material)


def shallow_cap(material):
    return pbrdf.Drops.at(
        [[50.0, 50.0]], volume=cap(SHALLOW, 150.0), contact_angle=SHALLOW, material=material
    )


def hemisphere(material):
    return pbrdf.Drops.at(
        [[50.0, 50.0]], volume=cap(math.pi / 2, 45.0), contact_angle=math.pi / 2,
        material=material,
    )  # fmt: skip


def sphere(material):
    return pbrdf.Spheres.at([[50.0, 50.0]], radius=45.0, material=material)


def reflectance(make, kappa, n_rays):
    """Light that comes back from a mirror under a body, its error, and the budget's."""
    scene = pbrdf.Scene(
        GROUND, pbrdf.Material.mirror(), make(pbrdf.Material(N, float(kappa)))
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", pbrdf.errors.AccuracyWarning)
        result = pbrdf.simulate(
            scene, THETA, wavelength=WAVELENGTH, n_rays=n_rays, stokes="unpolarized", seed=3
        )
    albedo = float(result.albedo.sum())
    lost = float((result.absorbed + result.truncated + result.leaked).item())
    return albedo, float(np.sqrt((result.albedo_stderr**2).sum())), albedo + lost - 1.0


def slab(kappa, thickness):
    """Give the closed form of the flat film on a mirror: powers, s and p, complex Snell."""
    index, k = complex(N, kappa), math.sin(THETA)
    q = np.sqrt(index**2 - k**2)
    cosine = math.cos(THETA)
    twice = math.exp(-8 * math.pi / WAVELENGTH * q.imag * thickness)
    total = 0.0
    for amplitude in (
        (cosine - q) / (cosine + q),
        (index**2 * cosine - q) / (index**2 * cosine + q),
    ):
        once = abs(amplitude) ** 2
        total += 0.5 * (once + (1 - once) ** 2 * twice / (1 - once * twice))
    return total


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rays", type=int, default=20_000)
    parser.add_argument("--steps", type=int, default=60)
    given = parser.parse_args()
    kappas = np.geomspace(1e-5, 10.0, given.steps)
    makers = (film, shallow_cap, hemisphere, sphere)
    print(f"pbrdf {pbrdf.__version__}; on a mirror, {WAVELENGTH} um, {THETA} rad")
    print(
        "kappa       " + "  ".join(f"{make.__name__:>18}" for make in makers),
        " film, exact",
    )
    table = []
    for kappa in kappas:
        row = [reflectance(make, kappa, given.rays) for make in makers]
        table.append(row)
        cells = "  ".join(f"{value:9.5f} ± {error:.0e}" for value, error, _ in row)
        print(f"{kappa:10.3e}  {cells}  {slab(kappa, 3.0):9.5f}")
    values = np.array(table)
    for column, make in enumerate(makers):
        albedo, error, budget = values[:, column].T
        steps = np.abs(np.diff(albedo))
        around = np.maximum(np.r_[0.0, steps[:-1]], np.r_[steps[1:], 0.0])
        noise = np.hypot(error[1:], error[:-1])
        excess = (steps - 1.5 * around) / noise
        print(
            f"{make.__name__}: largest step beyond 1.5 times those beside it, in standard "
            "errors: "
            f"{excess.max():.1f}; budget off by {np.abs(budget).max():.1e} at most"
        )
    exact = np.array([slab(kappa, 3.0) for kappa in kappas])
    off = np.abs(values[:, 0, 0] - exact) / np.maximum(values[:, 0, 1], 1e-12)
    print(f"film: off the closed form by {off.max():.1f} standard errors at most")


if __name__ == "__main__":
    main()

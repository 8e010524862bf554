"""Compare the computed second bounce with the Monte Carlo: `python run.py`."""

from argparse import ArgumentParser

import numpy as np

from pbrdf import GaussianSurface, Material, MicrofacetModel, Scene, simulate
from pbrdf.analytic import reflectance, second_bounce

ANGLES_DEG = (10.0, 41.4, 60.0, 75.0)
MATERIALS = {"n = 1.5": Material(1.5), "mirror": Material.mirror()}
SLOPES = (0.15, 0.30, 0.47)


def second_bounce_sums(model, theta_i, count=32):
    """Hemispherical M00 and M10 of the second bounce; azimuths crowd about the specular."""
    node, weight = np.polynomial.legendre.leggauss(count)
    theta_s = np.pi / 4 * (node + 1)
    dphi = np.pi + np.pi * node**3
    matrices = second_bounce(model, theta_i, theta_s[:, None], dphi, nodes=48)
    polar = np.sin(theta_s) * np.cos(theta_s) * weight * np.pi / 4
    measure = polar[:, None] * (3 * np.pi * node**2 * weight)
    total = (matrices * measure[..., None, None]).sum((0, 1))
    return total[0, 0], total[1, 0]


def main():
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--realizations", type=int, default=32)
    parser.add_argument("--rays", type=int, default=50_000)
    parser.add_argument("--workers", type=int, default=None)
    options = parser.parse_args()
    print(
        "| surface | incidence | one bounce: MC | model | two: MC | model "
        "| M10 of two: MC | model | three and more: MC |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    for slope in SLOPES:
        surface = GaussianSurface(
            shape=(512, 512), spacing=1.0, corr_length=16.0, slope_rms=slope
        )
        for name, material in MATERIALS.items():
            dataset = simulate(
                Scene(surface, material),
                np.deg2rad(ANGLES_DEG),
                phi_i="uniform",
                n_rays=options.rays,
                realizations=options.realizations,
                seed=5,
                workers=options.workers,
                n_theta=18,
                n_dphi=36,
                stokes="linear",
            )
            model = MicrofacetModel(material, slope)
            solid = dataset.projected_solid_angle
            polarised = (dataset.brdf.sel(stokes_out="Q", stokes_in="I") * solid).sum(
                ("theta_s", "dphi")
            )
            for k, theta_deg in enumerate(ANGLES_DEG):
                theta_i = np.deg2rad(theta_deg)
                one, two, more = dataset.albedo.values[:, k]
                error = dataset.albedo_stderr.values[:, k]
                once = reflectance(model, theta_i, rel_error=1e-5).value
                twice, twice_q = second_bounce_sums(model, theta_i)
                print(
                    f"| {slope}, {name} | {theta_deg:g} | {one:.5f} ± {error[0]:.5f} "
                    f"| {once:.5f} | {two:.6f} ± {error[1]:.6f} | {twice:.6f} "
                    f"| {polarised.values[1, k]:.6f} | {twice_q:.6f} | {more:.6f} |",
                    flush=True,
                )


if __name__ == "__main__":
    main()

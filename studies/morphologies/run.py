"""Surfaces that no slope distribution describes, beside the model that has only one."""

import argparse
import warnings
from pathlib import Path

import numpy as np

from fitting import surface_statistics
from pbrdf import (
    AccuracyWarning,
    GaussianSurface,
    Material,
    MeshSurface,
    MicrofacetModel,
    Scene,
    morphologies,
    simulate,
)

HERE = Path(__file__).parent
MATERIAL = Material(1.5)
THETA_I = np.deg2rad([30.0, 60.0])
N_THETA, N_DPHI = 18, 36
SIDE = 24.0
SQUARE = (SIDE, SIDE)


def control(seed):
    """Random surface of the model's own kind."""
    rough = GaussianSurface(shape=(96, 96), spacing=0.25, corr_length=3.0, slope_rms=0.3)
    return MeshSurface.of_map(rough.sample(seed))


MADE = {
    "random heights": control,
    "spheres": lambda seed: morphologies.spheres_on_plane(
        period=SQUARE, radius=1.0, coverage=0.35, seed=seed
    ),
    "grit": lambda seed: morphologies.grit(
        period=SQUARE, radius=1.2, coverage=0.4, seed=seed
    ),
    "fibres": lambda seed: morphologies.fibres(
        period=SQUARE, radius=0.6, length=20.0, coverage=1.2, layers=4, seed=seed
    ),
    "flakes": lambda seed: morphologies.flakes(
        period=SQUARE, radius=2.5, thickness=0.1, coverage=1.5, tilt_rms=0.12, seed=seed
    ),
    "capped pillars": lambda seed: morphologies.pillars(
        period=(4.0, 4.0), radius=1.0, height=2.0, overhang=0.5
    ),
    "porous sheet": lambda seed: morphologies.porous_sheet(
        period=4.0, radius=1.2, thickness=1.0
    ),
}


def look(make, seeds, rays):
    """M00 and M10 (theta_i, theta_s, dphi), shares of light; each (seeds, ...)."""
    found = []
    for seed in seeds:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", AccuracyWarning)
            result = simulate(
                Scene(make(seed), MATERIAL), THETA_I, phi_i="uniform", n_rays=rays,
                seed=seed, n_theta=N_THETA, n_dphi=N_DPHI, stokes="linear", max_bounces=200,
            )  # fmt: skip
        assert result.attrs["rays_leaked"] == [0, 0]
        found.append(
            {
                "m00": result.brdf_total.values[..., 0, 0],
                "m10": result.brdf_total.values[..., 1, 0],
                "albedo": result.albedo.values,
                "transmitted": result.transmitted.values,
            }
        )
    return {name: np.array([one[name] for one in found]) for name in found[0]}, result


def compare(name, seeds, rays):
    """One row for each incidence."""
    seen, result = look(MADE[name], seeds, rays)
    statistics = surface_statistics(MADE[name](0))
    slope = max(statistics.slope_rms.value, 0.02)
    model = result.pbrdf.beside(MicrofacetModel(MATERIAL, slope_rms=slope))
    model = model.brdf_total.sel(state="model", stokes_in="I")
    m00, m10 = (model.sel(stokes_out=row).values for row in "IQ")
    weight = result.projected_solid_angle.values
    rows = []
    for i, theta in enumerate(THETA_I):
        mean, error = seen["m00"][:, i].mean(0), seen["m00"][:, i].std(0, ddof=1)
        error = error / np.sqrt(len(seeds))
        albedo = seen["albedo"][:, :, i]
        total = albedo.sum(axis=1)
        # Light that the model sends elsewhere: half of the difference of both patterns
        pattern, own = mean * weight, m00[i] * weight
        moved = 0.5 * np.abs(pattern / pattern.sum() - own / own.sum()).sum()
        noise = 0.5 * np.sqrt(2 / np.pi) * (error * weight).sum() / pattern.sum()
        dolp = np.abs((seen["m10"][:, i].mean(0) * weight).sum() / pattern.sum())
        rows.append(
            {
                "surface": name,
                "theta_i": np.rad2deg(theta),
                "slope": slope,
                "overhang": statistics.overhang_share.value,
                "albedo": total.mean(),
                "albedo_err": total.std(ddof=1) / np.sqrt(len(seeds)),
                "model": own.sum(),
                "further": 1.0 - albedo[:, 0].mean() / total.mean(),
                "moved": moved,
                "noise": noise,
                "dolp": dolp,
                "dolp_model": abs((m10[i] * weight).sum() / own.sum()),
                "transmitted": seen["transmitted"][:, i].mean(),
            }
        )
    return rows, (seen["m00"], m00, result)


def show(rows):
    """Print the table of the README."""
    print(
        "| surface | incidence | slope, overhang | reflected | model | after more bounces "
        "| sent elsewhere | Q/I, model |\n|---|---|---|---|---|---|---|---|"
    )
    for row in rows:
        cells = [
            row["surface"],
            f"{row['theta_i']:.0f} deg",
            f"{row['slope']:.2f}, {100 * row['overhang']:.0f} %",
            f"{row['albedo']:.4f} ± {row['albedo_err']:.4f}",
            f"{row['model']:.4f}",
            f"{100 * row['further']:.1f} %",
            f"{100 * row['moved']:.0f} % (noise {100 * row['noise']:.0f})",
            f"{row['dolp']:.3f}, {row['dolp_model']:.3f}",
        ]
        print(f"| {' | '.join(cells)} |")


def draw(curves):
    """Pictures of the surfaces, and M00 in the plane of incidence beside the model."""
    import matplotlib.pyplot as plt

    figure = plt.figure(figsize=(2.6 * len(curves), 5.4), layout="constrained")
    for k, (name, (seen, model, result)) in enumerate(curves.items()):
        mesh = MADE[name](0)
        axes = figure.add_subplot(2, len(curves), k + 1, projection="3d")
        x, y, z = mesh.vertices.T
        axes.plot_trisurf(x, y, z, triangles=mesh.faces, color="0.8", linewidth=0.0)
        axes.set_box_aspect((np.ptp(x), np.ptp(y), np.ptp(z)))
        axes.set_axis_off()
        axes.set_title(name)
        axes = figure.add_subplot(2, len(curves), len(curves) + k + 1)
        view = np.rad2deg(result.theta_s.values)
        half = N_DPHI // 2
        angles = np.r_[-view[::-1], view]
        for i, colour in enumerate(("tab:blue", "tab:orange")):
            plane = [
                np.r_[field[i, ::-1, 0], field[i, :, half]]
                for field in (seen.mean(0), model)
            ]
            axes.semilogy(angles, np.maximum(plane[0], 1e-5), color=colour)
            axes.semilogy(angles, np.maximum(plane[1], 1e-5), color=colour, ls=":")
        axes.set_ylim(1e-4, 1.0)
        axes.set_xlabel("view angle [deg]")
    figure.supylabel("M00 [1/sr], dotted: model")
    figure.savefig(HERE / "patterns.png", dpi=110)


def main():
    """Print the table; draw the figure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--rays", type=int, default=20_000)
    parser.add_argument("--figure", action="store_true")
    options = parser.parse_args()
    rows, curves = [], {}
    for name in MADE:
        more, curves[name] = compare(name, range(options.seeds), options.rays)
        rows += more
    show(rows)
    if options.figure:
        draw(curves)


if __name__ == "__main__":
    main()

"""Compare every shadowing rule with single bounces of the Monte Carlo: `python run.py`."""

import json
from argparse import ArgumentParser
from pathlib import Path

import numpy as np

from pbrdf import GaussianSurface, Material, MicrofacetModel, Scene, simulate
from pbrdf.analytic import SHADOWING
from pbrdf.derived import bin_averages

FOLDER = Path(__file__).parent
ANGLES_DEG = (10.0, 41.4, 60.0, 75.0)
SLOPES = (0.15, 0.30, 0.47)
N_THETA, N_DPHI = 18, 36


def compare(dataset, slope):
    """Deviations of each rule at each incidence, as rows of the table."""
    rows = []
    solid = dataset.projected_solid_angle.values
    for theta_deg in ANGLES_DEG:
        theta_i = np.deg2rad(theta_deg)
        single = dataset.sel(bounces="1").sel(theta_i=theta_i, method="nearest")
        seen = single.brdf.values[..., 0, 0]
        error = single.brdf_stderr.values[..., 0, 0]
        near_source = np.abs(np.angle(np.exp(1j * dataset.dphi.values))) < np.deg2rad(45)
        for rule in SHADOWING:
            model = MicrofacetModel(Material.mirror(), slope, shadowing=rule)
            off = bin_averages(model, theta_i, N_THETA, N_DPHI)[..., 0, 0] - seen
            flux = solid * seen
            # Bins known to 5 %, weighted with their light; sampling noise is taken off
            known = seen > 20 * error
            weight = np.where(known, flux, 0.0) / flux[known].sum()
            square = (weight * (off**2 - error**2) / np.where(known, seen, 1.0) ** 2).sum()
            grazing = dataset.theta_s.values > np.deg2rad(75)
            rows.append(
                {
                    "slope_rms": slope,
                    "theta_i_deg": theta_deg,
                    "rule": rule,
                    "rms_percent": 100 * float(np.sqrt(max(square, 0))),
                    "albedo_percent": 100 * float((solid * off).sum() / flux.sum()),
                    "source_side_percent": _part(solid, off, flux, near_source[None, :]),
                    "grazing_percent": _part(solid, off, flux, grazing[:, None]),
                    "albedo_stderr_percent": 100
                    * float(single.albedo_stderr / single.albedo),
                }
            )
    return rows


def _part(solid, off, flux, where):
    """Relative deviation of the flux into some of the bins, in percent; NaN if faint."""
    chosen = np.broadcast_to(where, off.shape)
    share = flux[chosen].sum() / flux.sum()
    return (
        100 * float((solid * off)[chosen].sum() / flux[chosen].sum())
        if share > 0.01
        else np.nan
    )


def table(rows):
    """Markdown table: one row a rule, the worst and the typical of all cases."""
    lines = ["| rule | rms, median | rms, worst | albedo, worst | source side | grazing |"]
    lines += ["|---|---|---|---|---|---|"]
    for rule in SHADOWING:
        mine = [row for row in rows if row["rule"] == rule]
        rms = [row["rms_percent"] for row in mine]
        worst = {
            key: max((row[key] for row in mine if np.isfinite(row[key])), key=abs)
            for key in ("albedo_percent", "source_side_percent", "grazing_percent")
        }
        lines.append(
            f"| {rule} | {np.median(rms):.2f} % | {max(rms):.2f} % | "
            + " | ".join(f"{value:+.2f} %" for value in worst.values())
            + " |"
        )
    return "\n".join(lines)


def main():
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--realizations", type=int, default=32)
    parser.add_argument("--rays", type=int, default=100_000)
    parser.add_argument("--workers", type=int, default=None)
    options = parser.parse_args()
    rows = []
    for slope in SLOPES:
        surface = GaussianSurface(
            shape=(1024, 1024), spacing=1.0, corr_length=16.0, slope_rms=slope
        )
        dataset = simulate(
            Scene(surface, Material.mirror()),
            np.deg2rad(ANGLES_DEG),
            phi_i="uniform",
            n_rays=options.rays,
            realizations=options.realizations,
            seed=11,
            n_theta=N_THETA,
            n_dphi=N_DPHI,
            stokes="unpolarized",
            workers=options.workers,
        )
        rows += compare(dataset, slope)
    (FOLDER / "result.json").write_text(json.dumps(rows, indent=1))
    print(table(rows))
    for row in rows:
        if row["rule"].startswith("smith"):
            print({k: round(v, 3) if isinstance(v, float) else v for k, v in row.items()})


if __name__ == "__main__":
    main()

"""The independent float64 reference of rough surfaces as rows to compare a result with.

rough_inplane_sample.csv and rough_albedo_sample.csv in tests/reference; their heads say how
they were made. Only numbers that exceed 20 of their standard errors are compared.
"""

from pathlib import Path

import numpy as np
import pandas as pd

from pbrdf import GaussianSurface, Material, Scene, simulate

FOLDER = Path(__file__).parent / "reference"
SLOPE, INDEX, THETA_DEG = 0.15, 1.5, (10.0, 41.4, 60.0)
N_THETA, N_DPHI = 18, 36
LEAST_SIGNAL = 20.0
BOUNCES = {"b1": "1", "b2": "2", "b3p": "3+"}
ALBEDO = {"b1": "1", "b2": "2", "b3plus": "3+"}


def surface(side):
    """The reference's surface on `side` x `side` nodes: 16 cells a correlation length."""
    return GaussianSurface(
        shape=(side, side), spacing=1.0, corr_length=16.0, slope_rms=SLOPE
    )


def run(*, side, n_rays, realizations=64, seed=0, **options):
    """Simulate the reference's cases in its bins of 5 by 10 degrees."""
    return simulate(
        Scene(surface(side), Material(INDEX)), np.deg2rad(THETA_DEG), n_rays=n_rays,
        realizations=realizations, seed=seed, n_theta=N_THETA, n_dphi=N_DPHI, **options,
    )  # fmt: skip


def _bin_rows(result):
    table = pd.read_csv(FOLDER / "rough_inplane_sample.csv", comment="#")
    assert np.array_equal(np.unique(table.theta_i_deg), THETA_DEG)
    places = (
        np.searchsorted(THETA_DEG, table.theta_i_deg),
        np.rint(table.theta_s_lo_deg / 5.0).astype(int),
        np.rint(table.dphi_deg / 10.0).astype(int) % N_DPHI,
    )
    for column in table:
        if not (column.startswith("M") and f"{column}_se" in table):
            continue
        element, part = column.split("_")
        row, out = int(element[1]), int(element[2])
        if part == "tot":
            value, stderr = result.brdf_total, result.brdf_total_stderr
        else:
            value = result.brdf.sel(bounces=BOUNCES[part])
            stderr = result.brdf_stderr.sel(bounces=BOUNCES[part])
        frame = table[["theta_i_deg", "theta_s_lo_deg", "dphi_deg"]].copy()
        frame["quantity"] = column
        frame["reference"] = table[column]
        frame["reference_se"] = table[f"{column}_se"]
        frame["value"] = value.values[..., row, out][places]
        frame["stderr"] = stderr.values[..., row, out][places]
        yield frame


def _albedo_rows(result):
    table = pd.read_csv(FOLDER / "rough_albedo_sample.csv", comment="#")
    assert np.array_equal(table.theta_i_deg, THETA_DEG)
    for part, bounces in ALBEDO.items():
        frame = pd.DataFrame(
            {"theta_i_deg": table.theta_i_deg, "quantity": f"albedo_{part}"}
        )
        frame["reference"] = table[f"albedo_{part}"]
        frame["reference_se"] = table[f"se_{part}"]
        frame["value"] = result.albedo.sel(bounces=bounces).values
        frame["stderr"] = result.albedo_stderr.sel(bounces=bounces).values
        yield frame


def compare(result):
    """One row a bin and quantity: reference, value, both standard errors and z."""
    rows = pd.concat([*_bin_rows(result), *_albedo_rows(result)], ignore_index=True)
    rows = rows[np.abs(rows.reference) > LEAST_SIGNAL * rows.reference_se].copy()
    rows["z"] = (rows.value - rows.reference) / np.hypot(rows.stderr, rows.reference_se)
    return rows.reset_index(drop=True)


def statistics(rows):
    """Numbers that judge the correlated set of deviations as a whole.

    Bins share the slope variance of the surfaces, so that the mean square of z wanders far
    more than for independent bins; limits are calibrated (studies/tracer_accuracy).
    """
    by_quantity = rows.assign(square=rows.z**2).groupby("quantity").square.mean()
    return {
        "mean_square": float((rows.z**2).mean()),
        "worst_quantity": float(by_quantity.max()),
    }

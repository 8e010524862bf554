"""The Monte Carlo against the independent float64 reference of rough surfaces."""

import json
from pathlib import Path

import numpy as np
import pytest

from pbrdf import GaussianSurface, Material, Scene, simulate
from tests.rough_reference import compare, run, statistics

LIMITS = json.loads((Path(__file__).parent / "rough_limits.json").read_text())
SETTING = {k: LIMITS["setting"][k] for k in ("side", "n_rays", "realizations")}
# No single number beyond this many combined standard errors
LARGEST = 5.0


def judge(rows):
    worst = rows.loc[rows.z.abs().idxmax()]
    assert rows.z.abs().max() < LARGEST, f"\n{worst}"
    # Each limit rejects a correct program with probability LIMITS["false_alarm"] = 0.002
    found = statistics(rows)
    for name, limit in LIMITS["limits"].items():
        assert found[name] < limit, (name, found[name], limit)


def test_every_bin_and_the_whole_set():
    """Single, double, 3+ and all bounces; M00, M10 and the totals of four more elements."""
    rows = compare(run(seed=0, **SETTING))
    counts = rows.groupby("quantity").size()
    assert counts.M00_b1 > 60
    assert counts.M00_b2 > 20
    assert counts.M10_b3p > 5
    assert {"M01_tot", "M11_tot", "M22_tot", "M33_tot"} <= set(counts.index)
    assert {"albedo_b1", "albedo_b2", "albedo_b3plus"} <= set(counts.index)
    judge(rows)


@pytest.mark.slow
def test_more_rays_on_larger_surfaces():
    judge(compare(run(side=1024, n_rays=100_000, realizations=64, seed=1)))


@pytest.mark.slow
def test_through_embree():
    judge(compare(run(seed=2, skips=False, **SETTING)))


def share(sample, numerator, denominator):
    """Ratio of two albedos over bounces and its standard error, from independent runs."""
    top = np.array([s.sel(bounces=numerator).sum().item() for s in sample])
    bottom = np.array([s.sel(bounces=denominator).sum().item() for s in sample])
    ratio = top.mean() / bottom.mean()
    spread = (top - ratio * bottom).std(ddof=1) / np.sqrt(len(top)) / bottom.mean()
    return ratio, spread


# Multiple over single bounces, hemispherical: the erratum of the paper's section 4.1
@pytest.mark.slow
@pytest.mark.parametrize(
    ("slope", "theta_deg", "n", "value", "rounding"),
    [
        (0.30, 60.0, 1.5, 0.1190, 4e-5), (0.30, 60.0, 1e6, 0.1256, 4e-5),
        (0.15, 60.0, 1.5, 0.0379, 5e-5), (0.15, 60.0, 1e6, 0.0322, 5e-5),
        (0.15, 41.4, 1.5, 0.00217, 5e-6), (0.15, 41.4, 1e6, 0.00213, 5e-6),
    ],
)  # fmt: skip
def test_boost_by_multiple_bounces(slope, theta_deg, n, value, rounding):
    surface = GaussianSurface(
        shape=(512, 512), spacing=1.0, corr_length=16.0, slope_rms=slope
    )
    albedos = [
        simulate(
            Scene(surface, Material(n)), np.deg2rad(theta_deg), n_rays=30_000,
            realizations=8, seed=seed, n_theta=2, n_dphi=2,
        ).albedo
        for seed in range(12)
    ]  # fmt: skip
    ratio, spread = share(albedos, ["2", "3+"], ["1"])
    assert abs(ratio - value) < 4 * np.hypot(spread, rounding), (ratio, spread)


def test_single_bounce_share_of_a_mirror():
    """Slope 0.30 at 60 degrees: 0.8884 of the light leaves after one bounce (errata)."""
    surface = GaussianSurface(
        shape=(512, 512), spacing=1.0, corr_length=16.0, slope_rms=0.3
    )
    result = simulate(
        Scene(surface, Material.mirror()), np.deg2rad(60.0), n_rays=20_000, realizations=48,
        n_theta=2, n_dphi=2, stokes="unpolarized",
    )  # fmt: skip
    single = result.albedo.sel(bounces="1").item()
    stderr = result.albedo_stderr.sel(bounces="1").item()
    assert stderr < 2e-3
    assert abs(single - 0.8884) < 4 * np.hypot(stderr, 5e-5)

"""What a store says of its error, against a BRDF that is known everywhere.

Stores are filled with means over bins of the analytical model, with noise or without; so
their truth is known between nodes and bins. Stated over true is the factor by which what is
stated may shrink and still hold in nine of ten directions.
"""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import pbrdf
from pbrdf.analytic import MicrofacetModel
from pbrdf.conventions import STOKES, detector_bins
from pbrdf.stored.contents import Contents, Parameter
from pbrdf.stored.source import StoredBRDF

N_THETA, N_DPHI = 30, 60
SLOPES, INDICES = [0.12, 0.16, 0.22, 0.3], [1.4, 1.5, 1.7]
INCIDENCES = np.deg2rad([10.0, 25.0, 40.0, 55.0])
POINTS = np.polynomial.legendre.leggauss(3)


def model(slope: float, n: float) -> MicrofacetModel:
    return MicrofacetModel(pbrdf.Material(n, 0.05), slope_rms=slope)


def means_over_bins(one: MicrofacetModel, theta_i: float) -> np.ndarray:
    """Mean over each bin, weighted as light falls on it."""
    theta_s, dphi, _ = detector_bins(N_THETA, N_DPHI)
    total: np.ndarray = np.zeros((N_THETA, N_DPHI, 4, 4))
    weights = np.zeros((N_THETA, N_DPHI))
    for x, of_x in zip(*POINTS, strict=True):
        for y, of_y in zip(*POINTS, strict=True):
            at = np.meshgrid(
                theta_s + x * np.pi / 4 / N_THETA, dphi + y * np.pi / N_DPHI, indexing="ij"
            )
            weight = of_x * of_y * np.sin(2.0 * at[0])
            total += weight[..., None, None] * one.brdf(theta_i, *at)
            weights += weight
    return total / weights[..., None, None]


def store_of(slopes: list[float], noise: float = 0.0) -> StoredBRDF:
    value = np.array(
        [
            [[means_over_bins(model(s, n), t) for t in INCIDENCES] for n in INDICES]
            for s in slopes
        ]
    )
    stderr = noise * np.broadcast_to(value[..., :1, :1], value.shape)
    value = value + stderr * np.random.default_rng(5).standard_normal(value.shape)
    theta_s, dphi, weight = detector_bins(N_THETA, N_DPHI)
    swept = {"slope_rms": np.array(slopes), "n": np.array(INDICES)}
    dims = (*swept, "theta_i", "theta_s", "dphi", "stokes_out", "stokes_in")
    dataset = xr.Dataset(
        {
            "brdf_total": (dims, value),
            "brdf_total_stderr": (dims, stderr),
            "state": (tuple(swept), np.ones(value.shape[:2], dtype=int)),
            "projected_solid_angle": (("theta_s", "dphi"), weight),
        },
        {
            **swept, "theta_i": INCIDENCES, "theta_s": theta_s, "dphi": dphi,
            "stokes_out": list(STOKES), "stokes_in": list(STOKES),
        },
    )  # fmt: skip
    parameters = {
        name: Parameter(name=name, dim=name, unit="", nodes=nodes, number=True)
        for name, nodes in swept.items()
    }
    return StoredBRDF(
        Contents(path=Path("known.zarr"), dataset=dataset, parameters=parameters)
    )


def stated_over_true(store: StoredBRDF, places: int = 10) -> dict[str, np.ndarray]:
    """By element and place, in directions of more than 1 % of the peak."""
    rng = np.random.default_rng(1)
    theta_s, dphi = np.meshgrid(
        np.linspace(0.02, 1.5, 40), np.linspace(0.0, np.pi, 37), indexing="ij"
    )
    found: dict[str, list[float]] = {"M00": [], "M10": [], "M22": []}
    for _ in range(places):
        slope, n = rng.uniform(SLOPES[0], SLOPES[-1]), rng.uniform(1.4, 1.7)
        at = (rng.uniform(INCIDENCES[0], INCIDENCES[-1]), theta_s, dphi)
        truth = model(slope, n).brdf(*at)
        missed = np.abs(store.brdf(*at, slope_rms=slope, n=n) - truth)
        stated = store.error(*at, slope_rms=slope, n=n)
        lit = truth[..., 0, 0] > 0.01 * truth[..., 0, 0].max()
        for name, ratios in found.items():
            i, j = int(name[1]), int(name[2])
            part = missed[lit][:, i, j] / stated[lit][:, i, j]
            ratios.append(1.0 / float(np.quantile(part, 0.9)))
    return {name: np.array(ratios) for name, ratios in found.items()}


@pytest.mark.parametrize(
    "noise",
    [
        pytest.param(0.0, marks=pytest.mark.slow),
        0.01,
        pytest.param(0.04, marks=pytest.mark.slow),
    ],
)
def test_the_stated_error_is_the_true_one_within_a_factor(noise: float) -> None:
    ratios = stated_over_true(store_of(SLOPES, noise))
    for name, ratio in ratios.items():
        assert 0.9 < np.median(ratio) < 3.0, (name, ratio)
        assert np.quantile(ratio, 0.1) > 0.5, (name, ratio)
        assert ratio.max() < 6.0, (name, ratio)


def test_values_too_far_apart_are_said_to_be() -> None:
    """Lobes of slopes twice as steep have nothing in common; one left out shows it."""
    with pytest.warns(pbrdf.AccuracyWarning, match=r"of slope_rms must lie closer: "):
        store_of([0.08, 0.15, 0.3]).error(0.5, 0.5, np.pi, slope_rms=0.1, n=1.5)

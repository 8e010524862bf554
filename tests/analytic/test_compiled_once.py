"""Kernels are compiled once, however the arguments were broadcast."""

import numpy as np
import pytest

from pbrdf import GaussianSurface, HeightMap, Material, MicrofacetModel, Scene, simulate
from pbrdf.kernels.microfacet import microfacet
from pbrdf.kernels.paths import transport

FEW = np.array([0.2, 0.3])


@pytest.mark.parametrize(
    "angles",
    [
        (0.2, 0.3, 1.0),
        (FEW, 0.3, 1.0),
        (0.2, FEW, 1.0),
        (FEW[:, None], FEW, 1.0),
        (FEW, FEW[::-1], np.broadcast_to(1.0, 2)),
    ],
)
def test_one_model_for_all_shapes(angles):
    model = MicrofacetModel(Material(1.5, 0.1), slope_rms=0.2)
    model.brdf(0.4, 0.5, 2.0)
    before = len(microfacet.fill_brdf.signatures)
    model.brdf(*angles, phi_i=np.broadcast_to(0.3, np.broadcast(*angles).shape))
    assert len(microfacet.fill_brdf.signatures) == before


def test_one_tracer_for_maps_with_and_without_labels():
    heights = GaussianSurface(
        shape=(32, 32), spacing=1.0, corr_length=4.0, slope_rms=0.2
    ).sample(1)
    few = {"n_rays": 100, "n_theta": 5, "n_dphi": 6, "stokes": "unpolarized"}
    simulate(Scene(heights, Material(1.5)), 0.3, **few)
    before = len(transport.sweep_batch.signatures)
    labels = np.zeros((32, 32), dtype=int)
    labels[3:9] = 1
    two = HeightMap(heights.heights, 1.0, periodic=True, labels=labels)
    simulate(Scene(two, [Material(1.5), Material(1.2, 4.0)]), 0.3, **few)
    assert len(transport.sweep_batch.signatures) == before

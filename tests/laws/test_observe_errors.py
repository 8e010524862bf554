"""What `observe` refuses, and how it says so."""

import numpy as np
import pytest

from pbrdf import HeightMap, Material, Scene, observe

FLAT = Scene(HeightMap.flat(), Material(1.5))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"theta_i": 60.0}, r"theta_i must lie in .* rad, got 60"),
        ({"theta_s": 1.569}, "detector_half_angle must leave the cone above the horizon"),
        ({"source_half_angle": 0.0}, "source_half_angle must lie in"),
        ({"detector_half_angle": [0.1, 0.2]}, "detector_half_angle must be one number"),
        ({"estimator": "guess"}, "estimator must be one of facets, paths"),
        ({"start": "moon"}, "start must be one of detector, source"),
        ({"hemisphere_samples": 0}, "hemisphere_samples must lie in"),
        ({"sample_decay": 1.5}, "sample_decay must lie in"),
        (
            {"hemisphere_samples": 9, "sample_decay": 0.9},
            "sample_decay must be at most 0.8",
        ),
        ({"max_bounces": 0}, "max_bounces must be a whole number"),
        ({"theta_i": np.zeros((2, 2))}, "must be one-dimensional"),
    ],
)
def test_refusals_name_the_argument(change, message):
    arguments = {"theta_i": 0.5, "theta_s": 0.5, "dphi": np.pi} | change
    with pytest.raises(ValueError, match=message):
        observe(FLAT, **arguments)

"""Runs of contaminated scenes whose answers are known, and verdicts on them."""

from functools import cache

import numpy as np

from pbrdf import HeightMap, Scene, simulate

BATCHES = 32
# Two-sided 1e-5 of Student's t with 31 degrees of freedom
LIMIT = 5.26


def whole(result):
    """Mueller matrix of all light that comes back."""
    flux = result.brdf_total * result.projected_solid_angle
    return flux.isel(theta_i=0).sum(("theta_s", "dphi")).values


@cache
def _runs(scene, angles, seeds, options):
    """Run a scene under several seeds, all incidences at once."""
    return [simulate(scene, angles, seed=k, **dict(options)) for k in range(seeds)]


@cache
def _flat(described, size):
    """Return one scene of those that read alike, which `_runs` then knows again."""
    return Scene(HeightMap.flat(size=size), *_DESCRIBED[described])


_DESCRIBED = {}


def flat_runs(
    substrate, contaminants, theta, *, among=None, seeds=24, size=(1.0, 1.0), **options
):
    """Mean of the whole Mueller matrix over seeds, its standard error, and one result.

    Tests that differ in theta only share their runs if they name all angles `among`.
    """
    angles = (theta,) if among is None else tuple(among)
    described = f"{substrate!r} {contaminants!r}"
    _DESCRIBED.setdefault(described, (substrate, contaminants))
    results = _runs(_flat(described, size), angles, seeds, tuple(options.items()))
    results = [one.isel(theta_i=[angles.index(theta)]) for one in results]
    matrices = np.array([whole(one) for one in results])
    stderr = matrices.std(axis=0, ddof=1) / np.sqrt(seeds)
    return matrices.mean(axis=0), stderr, results[0]


def assert_within(value, stderr, expected, limit=LIMIT, floor=1e-12, extra=0.0):
    """Each value within `limit` of its standard errors; `floor` is for rounding."""
    error = np.abs(np.asarray(value) - expected)
    allowed = limit * np.hypot(stderr, extra) + floor
    assert np.all(error <= allowed), f"{value} +- {stderr}, expected {expected}"


def assert_closed(result):
    """Energy in and out, whatever became of it."""
    for name in ("absorbed", "truncated", "leaked", "transmitted"):
        assert (result[name].values >= 0.0).all()
    lost = result.absorbed + result.truncated + result.leaked + result.left_sideways
    return float(np.abs(result.albedo.sum("bounces") + lost - 1.0).max())


def clean_counters(result):
    """No beam went astray."""
    assert result.attrs["medium_mismatches"] == 0
    assert max(result.attrs["rays_leaked"]) == 0
    assert result.attrs["self_hits"] == 0

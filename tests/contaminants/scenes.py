"""Runs of contaminated scenes whose answers are known, and verdicts on them."""

from functools import cache

import numpy as np

from pbrdf import HeightMap, Scene, simulate

BATCHES = 32
# Two-sided 1e-5 of Student's t with 31 degrees of freedom
LIMIT = 5.26


def whole(result):
    """Mueller matrix of all light that comes back, of the first incidence."""
    return by_incidence(result)[0]


def by_incidence(result):
    """Mueller matrices of all light that comes back, one of each incidence."""
    flux = result.brdf_total * result.projected_solid_angle
    return flux.sum(("theta_s", "dphi")).values


@cache
def _runs(described, size, angles, copies, options):
    """Run a scene once, with so many independent copies of each incidence."""
    scene = Scene(HeightMap.flat(size=size), *_DESCRIBED[described])
    return simulate(scene, np.repeat(angles, copies), **dict(options))


# Scenes that read alike share their runs
_DESCRIBED = {}


def flat_runs(
    substrate, contaminants, theta, *, among=None, copies=24, size=(1.0, 1.0), **options
):
    """Mean of the whole Mueller matrix over runs, its standard error, and the runs.

    Each copy of an incidence has rays of its own: 24 copies are 24 runs, for the price of
    one call. Tests that differ in theta only share their runs if they name all angles
    `among`.
    """
    angles = (theta,) if among is None else tuple(among)
    described = f"{substrate!r} {contaminants!r}"
    _DESCRIBED.setdefault(described, (substrate, contaminants))
    result = _runs(described, size, angles, copies, tuple(options.items()))
    first = angles.index(theta) * copies
    result = result.isel(theta_i=slice(first, first + copies))
    matrices = by_incidence(result)
    stderr = matrices.std(axis=0, ddof=1) / np.sqrt(copies)
    return matrices.mean(axis=0), stderr, result


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

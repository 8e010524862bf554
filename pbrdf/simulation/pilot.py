"""Rays and realisations for a target error, from a short pilot run."""

import warnings
from ast import literal_eval
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import xarray as xr

from pbrdf.errors import AccuracyWarning
from pbrdf.scene.scene import Scene
from pbrdf.tracer import arguments

# Two pilots of so many rays tell the noise of the surfaces from that of the rays
FEW_RAYS, MORE_RAYS = 1000, 8000
PILOT_SAMPLES = 16
# Tells the streams of the pilot from those of the run
PILOT = 1
# Times of a node of a new surface, of a body that is laid on it, and of a ray with its
# looks, or among bodies with what it splits into, in any unit: their ratio on the machines
# tried. A plan by the clock would not be reproducible
NODE_TIME, BODY_TIME, RAY_TIME, WET_RAY_TIME = 0.15, 12_000.0, 1.0, 4.0
LEAST_RAYS, MOST_RAYS = 1000, 1_000_000
# Batches of rays over a fixed surface, and realisations, at least
LEAST_SAMPLES = 16
# Bins above this part of the peak count
BRIGHT = 0.1


@dataclass(frozen=True, kw_only=True)
class Choice:
    """What a pilot chose, and why."""

    n_rays: int
    realizations: int
    sentences: list[str]


def choose(
    run: Callable[..., xr.Dataset],
    scene: Scene,
    target: float,
    root: np.random.SeedSequence,
) -> Choice:
    """Choose rays and realisations so that the time to the target error is least.

    The mean square of the relative error of R realisations with n rays each is
    (v_s + v_r / n) / R, their time R (t_s + n t_r): least at n² = v_r t_s / (v_s t_r), and
    so flat there that a factor of two in n² costs 6 % at most. The pilot's samples are
    used for nothing else, so that what they show by chance does not get into the result.

    Parameters
    ----------
    run : callable
        `simulate` with all but n_rays, realizations and seed.
    scene : Scene
    target : float
        Largest relative error of M00 over the bins above a tenth of the peak.
    root : SeedSequence
        That of the run, left as it is; the pilot's streams are others.
    """
    entropy = int(root.entropy)  # type: ignore[arg-type]
    streams = np.random.SeedSequence((entropy, PILOT)).generate_state(2, np.uint64)
    fixed = not arguments.varies(scene)
    errors = []
    for n_rays, stream in zip((FEW_RAYS, MORE_RAYS), streams, strict=True):
        rays = n_rays * arguments.BATCHES if fixed else n_rays
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", AccuracyWarning)
            pilot = run(
                n_rays=rays, realizations=1 if fixed else PILOT_SAMPLES, seed=int(stream)
            )
        errors.append(_squares(pilot))
    samples = arguments.BATCHES if fixed else PILOT_SAMPLES
    (few, _), (more, worst) = errors
    if more == 0.0:
        return Choice(
            n_rays=LEAST_RAYS, realizations=1 if fixed else LEAST_SAMPLES,
            sentences=["Plan: nothing is uncertain in the bins that count."],
        )  # fmt: skip
    # v_s + v_r / n through both pilots; noise may not make either negative
    of_rays = max((few - more) / (1 / FEW_RAYS - 1 / MORE_RAYS), 0.01 * more * MORE_RAYS)
    of_rays = min(of_rays, 0.99 * more * MORE_RAYS)
    of_surfaces = more - of_rays / MORE_RAYS
    if fixed:
        needed = worst / more * of_rays * samples / target**2
        n_rays = int(np.clip(needed / 40, LEAST_RAYS, MOST_RAYS))
        return Choice(
            n_rays=n_rays * arguments.BATCHES, realizations=1,
            sentences=[
                f"Plan: batches of {n_rays} rays, about {max(needed / n_rays, 32):.0f} of "
                f"them, for {100 * target:.3g} %."
            ],
        )  # fmt: skip
    sample_time, ray_time = _times(scene, pilot)
    best = np.sqrt(of_rays * sample_time / (of_surfaces * ray_time))
    n_rays = int(np.clip(best, LEAST_RAYS, MOST_RAYS))
    square = (of_surfaces + of_rays / n_rays) * worst / more * samples
    expected = max(int(np.ceil(square / target**2)), LEAST_SAMPLES)
    return Choice(
        n_rays=n_rays, realizations=LEAST_SAMPLES,
        sentences=[
            f"Plan: {n_rays} rays a realisation, about {expected} realisations, for "
            f"{100 * target:.3g} %; the surface is taken as it is given."
        ],
    )  # fmt: skip


def _times(scene: Scene, pilot: xr.Dataset) -> tuple[float, float]:
    """Return the times of a realisation and of a ray, by the bodies of the pilot."""
    nodes = int(np.prod(getattr(scene.surface, "shape", (1, 1))))
    reports = [literal_eval(one) for one in pilot.attrs["contaminants"]]
    bodies = sum(one.get("number", 0) for one in reports)
    ray_time = WET_RAY_TIME if scene.contaminants else RAY_TIME
    return nodes * NODE_TIME + bodies * BODY_TIME, ray_time


def _squares(pilot: xr.Dataset) -> tuple[float, float]:
    """Mean and largest square of the relative error over the bins that count."""
    bins = ("theta_s", "dphi")
    light = pilot.brdf_total.isel(stokes_out=0, stokes_in=0)
    error = pilot.brdf_total_stderr.isel(stokes_out=0, stokes_in=0)
    bright = light > BRIGHT * light.max(bins)
    squares = ((error / light) ** 2).where(bright)
    if not bright.any():
        return 0.0, 0.0
    return float(squares.mean()), float(squares.max())

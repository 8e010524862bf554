"""Trace one surface sample, by the exact walk or by Embree."""

import numpy as np

from pbrdf.kernels import transport
from pbrdf.tracer.embree import EmbreeField, trace_direction
from pbrdf.tracer.field import Field
from pbrdf.tracer.plan import Plan, Tally


def trace_sample(
    target: Field | EmbreeField, plan: Plan, seed: np.random.SeedSequence
) -> Tally:
    """Trace every incident direction of the plan over one surface.

    Releases the interpreter lock. The streams belong to the sample and the entry points to
    the stream, so that neither the number of threads nor the intersector changes the rays.
    """
    tally = Tally.empty(plan)
    shifts = np.random.default_rng(seed).random((len(plan.theta_i), 3))
    for index in range(len(plan.theta_i)):
        if isinstance(target, EmbreeField):
            trace_direction(target, plan, index, shifts[index], tally)
        else:
            walk_direction(target, plan, index, shifts[index], tally)
    return tally


def walk_direction(
    field: Field, plan: Plan, index: int, shifts: np.ndarray, tally: Tally
) -> None:
    """Trace one incident direction by the walk over the height field, and add to the tally."""
    theta = plan.theta_i[index]
    launch = field.entry_rectangle(theta, plan.phi_i)
    # On a periodic field one pass along each line of entry points finds all first facets
    trace = transport.sweep_batch if field.periodic else transport.trace_batch
    trace(
        field.heights, field.maxima, field.levels, field.z_top, field.periodic, *field.pitch,
        launch, field.entry_lines(launch, plan.n_rays),
        np.sin(theta), np.cos(theta), plan.phi_i or 0.0, plan.phi_i is None,
        plan.n_rays, shifts, plan.max_bounces,
        plan.n, plan.kappa, plan.n_stokes,
        tally.flux[index], tally.energy[index], tally.counts[index],
    )  # fmt: skip

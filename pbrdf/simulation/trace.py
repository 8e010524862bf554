"""Trace one surface sample: clean, by the exact walk or by Embree, or contaminated."""

from dataclasses import replace
from typing import Any

import numpy as np

from pbrdf.kernels.bins.binning import bin_edges
from pbrdf.kernels.bodies.beams import N_STATE, Room
from pbrdf.kernels.bodies.transparent import trace_among_bodies, trace_on_mesh
from pbrdf.kernels.bodies.world import N_HIT
from pbrdf.kernels.paths import shading
from pbrdf.kernels.paths.first_bounce import N_MIRRORED, LineRoom
from pbrdf.kernels.paths.mesh_lines import N_MET, MeshLine
from pbrdf.kernels.paths.spectra import close_sums
from pbrdf.kernels.paths.transport import (
    N_WAITING,
    sweep_batch,
    trace_batch,
    trace_mesh_batch,
)
from pbrdf.kernels.terrain.entry import Source
from pbrdf.kernels.terrain.horizon import NO_HORIZON
from pbrdf.kernels.terrain.sweep import N_FIRST
from pbrdf.simulation.plan import Plan, Tally
from pbrdf.surface.heightmap import HeightMap
from pbrdf.surface.mesh import MeshSurface
from pbrdf.tracer.embree import EmbreeField
from pbrdf.tracer.field import Field
from pbrdf.tracer.mesh_field import MeshField
from pbrdf.tracer.wet_field import WetField
from pbrdf.tracer.wet_mesh import WetMesh

# What is traced: a height map, one by way of Embree, one with what lies on it, a mesh, or
# one with solids that light goes through or with what lies on it
Target = Field | EmbreeField | WetField | MeshField | WetMesh

NO_MEETINGS = np.empty((0, N_FIRST))


def prepare(
    surface: HeightMap | MeshSurface, skips: frozenset[str]
) -> Field | EmbreeField | MeshField:
    """Make a surface ready for tracing with the skips allowed: the walk, or else Embree."""
    if isinstance(surface, MeshSurface):
        return MeshField.of(surface, skips)
    field = Field.of(surface)
    terrain = field.terrain
    if "steep" not in skips:
        terrain = terrain._replace(free_slope=np.inf)
    if "horizon" not in skips:
        terrain = terrain._replace(horizon=NO_HORIZON)
    field = replace(field, terrain=terrain)
    return field if "walk" in skips else EmbreeField.of(field)


def trace_sample(
    target: Target,
    plan: Plan,
    seed: np.random.SeedSequence,
    room: Tally | None = None,
    *,
    both_ways: bool = False,
) -> Tally:
    """Trace every incident direction of the plan over one surface.

    `room` is an empty tally to write into; without it one is made. `both_ways` lets half of
    the rays come from the opposite azimuth, over a field that is as likely as the same one
    turned by half a circle: it has two samples of further bounces for one. Releases the
    interpreter lock. The streams belong to the sample and the entry points to the stream,
    so that neither the number of threads nor the intersector changes the rays.
    """
    tally = Tally.empty(plan) if room is None else room
    if isinstance(target, WetField | WetMesh):
        tally = replace(tally, reports=target.reports, notes=target.notes)
    zenith, azimuth = bin_edges(plan.n_theta, plan.n_dphi)
    record = np.empty((plan.max_bounces + 1, 1, shading.N_RECORD))
    waiting = np.empty((plan.max_bounces, N_WAITING))
    rays = drawn(plan, seed)
    for index in range(len(plan.theta_i)):
        field = target if isinstance(target, Field | MeshField) else target.field
        source = source_of(field, plan, index, rays)
        bins = shading.Tally(
            zenith, azimuth, tally.flux[index], tally.lit[index], tally.energy[index],
            tally.counts[index], np.zeros((4, 4)),
        )  # fmt: skip
        light = tally.spectra[index] if tally.spectra else None
        if isinstance(target, WetMesh):
            trace_on_mesh(
                target.world(), source, target.field.top, plan.max_bounces, plan.n_stokes,
                _room(plan, NO_MEETINGS), bins,
            )  # fmt: skip
            continue
        if isinstance(field, MeshField):
            longest = -(-source.n_rays // source.n_lines)
            met, told = np.empty((longest, N_MET)), np.empty(longest, dtype=np.int64)
            trace_mesh_batch(
                field.facets(), source, MeshLine(met, told), record, waiting, light,
                plan.optics, bins,
            )  # fmt: skip
            if tally.spectra:
                close_sums(light, plan.n_stokes, bins.lit)
            continue
        # One pass along each line of entry points finds all first facets
        walks = not isinstance(target, EmbreeField)
        sweeps = walks and field.periodic and "sweep" in plan.skips
        if isinstance(target, WetField):
            line = _line_room([source] if sweeps else [])
            trace_among_bodies(
                target.world, source, field.terrain.z_top, plan.max_bounces,
                plan.n_stokes, _room(plan, line.meetings), bins,
            )  # fmt: skip
            continue
        sources = halves(field, source) if both_ways else [source]
        sink = (record, waiting, light, plan.optics, bins)
        _trace_field(target, field, sources, sink, sweeps=sweeps)
        if tally.spectra:
            close_sums(light, plan.n_stokes, bins.lit)
    return tally


def _trace_field(
    target: Target, field: Field, sources: list[Source], sink: tuple[Any, ...], *,
    sweeps: bool,
) -> None:  # fmt: skip
    """Trace the rays of sources over a clean height field."""
    line = _line_room(sources if sweeps else [])
    tree = target.tree() if isinstance(target, EmbreeField) else None
    for source in sources:
        if sweeps:
            sweep_batch(field.terrain, source, line, *sink)
        else:
            trace_batch(field.terrain, tree, source, *sink)


def _line_room(sources: list[Source]) -> LineRoom:
    """Room for the longest line of any source."""
    longest = max((-(-one.n_rays // one.n_lines) for one in sources), default=0)
    return LineRoom(
        np.empty((longest, N_FIRST)), np.empty((2, longest)), np.empty(longest * N_MIRRORED)
    )


def drawn(plan: Plan, seed: np.random.SeedSequence) -> tuple[np.ndarray, np.ndarray]:
    """Shifts of the entry points and stream of random numbers of each direction."""
    rng = np.random.default_rng(seed)
    number, own = plan.n_streams, plan.own
    shifts = rng.random((number, 3))
    streams = rng.integers(2**63, size=number, dtype=np.uint64)[own]
    if plan.half_angle > 0.0:
        # Drawn last, so that a narrow beam keeps its rays
        shifts = np.hstack([shifts, rng.random((number, 2))])
    return shifts[own], streams


def source_of(
    field: Field | MeshField,
    plan: Plan,
    index: int,
    rays: tuple[np.ndarray, np.ndarray],
) -> Source:
    """Rays of one direction of a plan over a surface; `rays` is what `drawn` gave."""
    theta, (shifts, streams) = plan.theta_i[index], rays
    launch = field.entry_rectangle(theta, plan.phi_i, plan.half_angle)
    return Source(
        np.sin(theta), np.cos(theta), plan.phi_i or 0.0, plan.phi_i is None,
        launch, field.entry_lines(launch, plan.n_rays, plan.half_angle), plan.n_rays,
        shifts[index], streams[index], np.sin(plan.half_angle),
    )  # fmt: skip


def halves(field: Field, source: Source) -> list[Source]:
    """Rays of a source at a known azimuth, half of them from the opposite one."""
    number = source.n_rays
    counts = [one for one in (number - number // 2, number // 2) if one > 0]
    return [
        source._replace(
            n_rays=count, n_lines=field.entry_lines(source.launch, count),
            phi=source.phi + k * np.pi,
        )
        for k, count in enumerate(counts)
    ]  # fmt: skip


def _room(plan: Plan, meetings: np.ndarray) -> Room:
    """Room for the parts of one ray; `meetings` are the first facets of a line."""
    return Room(np.empty((plan.max_bounces + 2, N_STATE)), np.zeros(N_HIT), meetings)

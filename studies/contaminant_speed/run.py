"""Speed of the engine among drops, each figure as a ratio of two timings of one run."""

import argparse
import os
import platform
import time

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

import pbrdf
from pbrdf.contaminants.bodies import place
from pbrdf.kernels import jit
from pbrdf.kernels.bins.binning import bin_edges
from pbrdf.kernels.bodies.beams import KX, KY, KZ, N_STATE, Room, X, Y, Z
from pbrdf.kernels.bodies.events import next_event
from pbrdf.kernels.bodies.transparent import follow_beam, launch_beam
from pbrdf.kernels.bodies.world import N_HIT
from pbrdf.kernels.paths import shading
from pbrdf.kernels.paths.random import Draw
from pbrdf.kernels.terrain.entry import Source, entry_point, rays_of_line
from pbrdf.kernels.terrain.sweep import N_FIRST
from pbrdf.simulation.plan import Plan
from pbrdf.simulation.skips import SKIPS
from pbrdf.simulation.trace import prepare, trace_sample
from pbrdf.tracer.media import media_of
from pbrdf.tracer.mesh import build_mesh
from pbrdf.tracer.wet_field import WetField

WATER, PAINT = pbrdf.Material(1.333), pbrdf.Material(1.5)
SURFACE = pbrdf.GaussianSurface(
    shape=(512, 512), spacing=4.0, corr_length=64.0, slope_rms=0.05
)
VOLUME, DENSITY = 1.0, 2e-5  # um, 1/um^2: 84 drops
SEED = np.random.SeedSequence(3)


@jit(allocates=False)
def record_segments(world, source, z_start, room, tally, segments):
    """Trace as the engine does and note where every segment of a path starts."""
    count = 0
    terrain, launch = world.terrain, source.launch
    for line in range(source.n_lines):
        beam, first, rays, points = rays_of_line(
            line, source, terrain.pitch_x, terrain.pitch_y
        )
        for ray in range(rays):
            x, y = entry_point(points, ray, rays, launch)
            x, y = x * terrain.pitch_x, y * terrain.pitch_y
            launch_beam(room.state, x, y, z_start, beam, 4)
            top = 0
            step = 0
            while top >= 0 and count < segments.shape[0]:
                for column in range(3):
                    segments[count, column] = room.state[top, X + column]
                    segments[count, 3 + column] = room.state[top, KX + column]
                count += 1
                kind = next_event(world, room.state, top, room.hit)
                draw = Draw(source.stream, first + ray, 2 * step)
                top = follow_beam(world, 0, top, kind, draw, beam, 1024, 4, room, tally)
                step += 1
    return count


def segments_of(wet, theta, n_rays):
    """Return starts and directions of all segments, in the order of the engine."""
    zenith, azimuth = bin_edges(45, 90)
    flux = np.zeros((1, 3, 45, 90, 4, 4))
    counts = np.zeros(shading.N_COUNTS, dtype=np.int64)
    lit = np.zeros(flux.shape[1:4], dtype=bool)
    tally = shading.Tally(
        zenith, azimuth, flux, lit, np.zeros((1, 4)), counts, np.zeros((4, 4))
    )
    launch = wet.field.entry_rectangle(theta, None)
    source = Source(
        np.sin(theta), np.cos(theta), 0.0, True, launch,
        wet.field.entry_lines(launch, n_rays), n_rays, np.array([0.2, 0.5, 0.7]),
        np.uint64(5),
    )  # fmt: skip
    room = Room(np.empty((1026, N_STATE)), np.zeros(N_HIT), np.empty((0, N_FIRST)))
    segments = np.empty((20 * n_rays, 6))
    top = wet.field.terrain.z_top
    count = record_segments(wet.world, source, top, room, tally, segments)
    assert (X, Y, Z, KX, KY, KZ) == (0, 1, 2, 3, 4, 5)
    return segments[:count]


def turned(shape, rings=40, sides=48):
    """Triangles of a body of revolution about its reference height."""
    s = np.linspace(shape.bottom, shape.height, rings + 1)
    squares = np.zeros_like(s)
    for low, high, a, b, c in shape.slabs:
        here = (s >= low) & (s <= high)
        squares[here] = np.maximum(a + s[here] * (b + c * s[here]), 0.0)
    phi = 2 * np.pi * np.arange(sides) / sides
    radius = np.sqrt(squares)[:, None]
    points = np.stack(
        np.broadcast_arrays(radius * np.cos(phi), radius * np.sin(phi), s[:, None]), axis=-1
    )
    number = np.arange(points[..., 0].size).reshape(rings + 1, sides)
    right = np.roll(number, -1, axis=1)
    low = np.stack([number[:-1], right[:-1], right[1:]], axis=-1)
    high = np.stack([number[:-1], right[1:], number[1:]], axis=-1)
    return points.reshape(-1, 3), np.concatenate([low, high]).reshape(-1, 3)


def embree_scene(field, bodies):
    """Make the same scene of triangles."""
    mesh = build_mesh(field)
    frame = mesh.frame
    origin = np.array([frame.center_x, frame.center_y, 0.0]) * np.array([*field.pitch, 1.0])
    origin[2] = frame.center_z
    scene = EmbreeScene()
    TriangleMesh(scene, mesh.vertices, mesh.faces)
    for k in range(len(bodies)):
        points, faces = turned(bodies.shape(k))
        place_of = np.array([bodies.x[k], bodies.y[k], bodies.z[k]])
        vertices = (points + place_of - origin) * frame.scale_z
        TriangleMesh(scene, vertices.astype(np.float32), faces.astype(np.int32))
    return scene, origin, frame.scale_z


def seconds(work, repeats=3):
    """CPU time of the fastest of some runs after a first."""
    work()
    best = np.inf
    for _ in range(repeats):
        start = time.process_time()
        work()
        best = min(best, time.process_time() - start)
    return best


def plan_for(media, theta, n_rays):
    """One angle, all 16 elements."""
    return Plan(
        theta_i=np.array([theta]), phi_i=None, n_rays=n_rays, max_bounces=1024,
        n=np.array([[1.5]]), kappa=np.zeros((1, 1)), base=np.empty((1, 0)), n_stokes=4,
        n_theta=45, n_dphi=90, skips=frozenset(SKIPS), media=media,
    )  # fmt: skip


def against_embree(n_rays):
    """Segments a second in dew, and through Embree on the same rays in the same order."""
    surface = SURFACE.sample(1)
    field = prepare(surface, frozenset(SKIPS))
    media = media_of([PAINT], [WATER], None)
    for contact in (15.0, 90.0, 179.0):
        drops = pbrdf.Drops(
            contact_angle=np.deg2rad(contact), volume_per_area=VOLUME,
            number_density=DENSITY, material=WATER,
        )  # fmt: skip
        wet = WetField.of(field, surface, [drops], media, SEED)
        bodies = place([drops], surface, SEED).bodies
        scene, origin, scale = embree_scene(field, bodies)
        for degrees in (30, 60):
            theta = np.deg2rad(degrees)
            segments = segments_of(wet, theta, n_rays)
            plan = plan_for(media, theta, n_rays)
            tally = trace_sample(wet, plan, SEED)
            counted = int(tally.counts[0, shading.N_SEGMENTS])
            engine = seconds(lambda plan=plan, wet=wet: trace_sample(wet, plan, SEED))
            starts = ((segments[:, :3] - origin) * scale).astype(np.float32)
            directions = segments[:, 3:].astype(np.float32)
            chunks = [slice(k, k + 32768) for k in range(0, len(starts), 32768)]

            def replay(scene=scene, starts=starts, directions=directions, chunks=chunks):
                for chunk in chunks:
                    scene.run(starts[chunk].copy(), directions[chunk].copy(), output=True)

            raw = seconds(replay)
            rate, embree = counted / engine / 1e6, len(segments) / raw / 1e6
            print(
                f"  contact {contact:5.0f} deg, incidence {degrees} deg: "
                f"{rate:5.2f} M segments a core-second, Embree {embree:5.2f}, "
                f"ratio {rate / embree:4.2f} (goal 0.5)"
            )


def clean_scene(n_rays):
    """Time rays that meet no water, in a wet scene and on the clean surface."""
    surface = SURFACE.sample(1)
    field = prepare(surface, frozenset(SKIPS))
    media = media_of([PAINT], [WATER], None)
    # One grain of a micrometre: hardly a ray meets it
    grain = pbrdf.Spheres.at([[20.0, 20.0]], radius=1.0, material=WATER)
    wet = WetField.of(field, surface, [grain], media, SEED)
    theta = np.deg2rad(30.0)
    slow = seconds(lambda: trace_sample(wet, plan_for(media, theta, n_rays), SEED))
    fast = seconds(lambda: trace_sample(field, plan_for(None, theta, n_rays), SEED))
    print(f"  rays that meet no water cost {slow / fast:.2f} times those of a clean scene")


def dew_study():
    """Three contact angles to 1 % of the hemispherical reflectance, placement included."""
    start = time.perf_counter()
    for contact in (15.0, 90.0, 179.0):
        drops = pbrdf.Drops(
            contact_angle=np.deg2rad(contact), volume_per_area=VOLUME,
            number_density=DENSITY, material=WATER,
        )  # fmt: skip
        result = pbrdf.simulate(
            pbrdf.Scene(SURFACE, PAINT, drops), np.deg2rad(30.0), n_rays=50_000,
            realizations=16, phi_i="uniform",
        )  # fmt: skip
        albedo = float(result.albedo.sum())
        # Classes of bounces share their rays; the sum of their errors bounds the error
        error = float(result.albedo_stderr.sum()) / albedo
        print(f"  contact {contact:3.0f} deg: albedo {albedo:.5f} to {100 * error:.2f} %")
    print(f"  three contact angles took {time.perf_counter() - start:.1f} s (goal 180)")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rays", type=int, default=300_000)
    n_rays = parser.parse_args().rays
    print(f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores")
    print(f"pbrdf {pbrdf.__version__}, {n_rays} rays, seed {SEED.entropy}")
    print("Among drops, against Embree on the same segments:")
    against_embree(n_rays)
    print("What wet scenes cost where they are dry:")
    clean_scene(n_rays)
    print("A dew study:")
    dew_study()


if __name__ == "__main__":
    main()

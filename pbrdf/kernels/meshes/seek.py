"""The next facet of a mesh that a ray meets.

The place of a ray is kept in float64, on its facet; Embree gets a float32 copy of it lifted
off the facet, and names a facet, on whose plane the place then follows in float64. A facet
met from behind, the facet just left or a fall through the ground tell that rounding has
misled Embree, as do no other outcomes; then `pbrdf.kernels.meshes.search` decides.

Images of a periodic mesh are instances of one tree. A ray that leaves the box in which all
images are at hand goes on from the same place some periods back.
"""

import math

from pbrdf.kernels import jit
from pbrdf.kernels.meshes.facets import (
    BODIES,
    GROUND,
    facet_normal,
    image_of,
    place_on_facet,
    plane_time,
)
from pbrdf.kernels.meshes.memory import call_embree
from pbrdf.kernels.meshes.search import (
    Q_BACK,
    Q_FACE,
    Q_IMAGE,
    Q_TIME,
    pose_query,
)
from pbrdf.kernels.optics.vectors import Vec, axes_across
from pbrdf.kernels.terrain.embree import (
    ALL,
    DIRECTION,
    FACE,
    FARTHEST,
    FLAGS,
    GEOMETRY,
    ID,
    INSTANCE,
    MASK,
    NEAREST,
    NOTHING,
    ORIGIN,
    TIME,
)
from pbrdf.kernels.terrain.heightfield import ESCAPED, HIT, LOST, SIDE

# Fates of a ray on a mesh besides those of a walk: it passed out below; it met a facet from
# behind
BELOW, WRONG = 6, 7
MAX_PERIODS = 100_000
# Start of an exact search behind its ray, and beside it, in lifts
BEHIND, BESIDE = 4.0, 2.0
# How far back along a ray from its hit another facet makes the place delicate, in lifts: so
# far, and so many times what a lift of its start moves a hit on a slanting facet
BEFORE, SLANTING, LEAST_SLANT = 4.0, 2.0, 1e-3
# And how far beside its next start
ASIDE = 8.0
# Tolerance of places in the second try, in lifts: the rounding of float32
WIDER = 4.0


@jit(forceinline=True)
def write_ray(mesh, x, y, z, k_x, k_y, k_z, nearest, farthest):
    """Write a ray from a place [um] along the unit vector k for Embree, in float32."""
    frame, ray, words = mesh.frame, mesh.ray, mesh.words
    ray[ORIGIN] = (x - frame.center_x) * frame.scale
    ray[ORIGIN + 1] = (y - frame.center_y) * frame.scale
    ray[ORIGIN + 2] = (z - frame.center_z) * frame.scale
    ray[NEAREST] = nearest * frame.scale
    ray[DIRECTION] = k_x
    ray[DIRECTION + 1] = k_y
    ray[DIRECTION + 2] = k_z
    ray[TIME] = 0.0
    ray[FARTHEST] = farthest * frame.scale
    words[MASK] = ALL
    words[ID] = 0
    words[FLAGS] = 0
    words[GEOMETRY] = NOTHING
    words[INSTANCE] = NOTHING


@jit(forceinline=True)
def shoot(mesh, x, y, z, k_x, k_y, k_z, nearest, farthest, arguments):
    """Let Embree follow a ray to the first facet, or call back for all of them."""
    write_ray(mesh, x, y, z, k_x, k_y, k_z, nearest, farthest)
    call_embree(mesh.intersect, mesh.scene, mesh.place, arguments)


@jit(forceinline=True)
def is_blocked(mesh, x, y, z, d_x, d_y, d_z):
    """Whether anything lies on the way from a place to another at (d_x, d_y, d_z). [um]"""
    length = math.sqrt(d_x * d_x + d_y * d_y + d_z * d_z)
    write_ray(mesh, x, y, z, d_x / length, d_y / length, d_z / length, 0.0, length)
    call_embree(mesh.occluded, mesh.scene, mesh.place, 0)
    # Embree marks a ray that something stops
    return mesh.ray[FARTHEST] < 0.0


@jit(allocates=False)
def is_delicate(mesh, face, x, y, z, k_x, k_y, k_z, before):
    """Whether another facet is so near a place that a ray has met that float32 may err.

    Where parts cut into each other, what lies inside of one may stop a ray that has strayed
    into it, so that it would not be noticed. Asked for is whether anything lies between
    the ray a little before it met the facet and its next start, lifted off the facet, or
    beside that start.
    """
    lift = mesh.frame.lift
    n_x, n_y, n_z = facet_normal(mesh, face)
    if is_blocked(
        mesh, x - before * k_x, y - before * k_y, z - before * k_z,
        before * k_x + lift * n_x, before * k_y + lift * n_y, before * k_z + lift * n_z,
    ):  # fmt: skip
        return True
    (a_x, a_y, a_z), (b_x, b_y, b_z) = axes_across(Vec(n_x, n_y, n_z))
    x += lift * n_x
    y += lift * n_y
    z += lift * n_z
    reach = ASIDE * lift
    if is_blocked(
        mesh, x - reach * a_x, y - reach * a_y, z - reach * a_z,
        2.0 * reach * a_x, 2.0 * reach * a_y, 2.0 * reach * a_z,
    ):  # fmt: skip
        return True
    return is_blocked(
        mesh, x - reach * b_x, y - reach * b_y, z - reach * b_z,
        2.0 * reach * b_x, 2.0 * reach * b_y, 2.0 * reach * b_z,
    )  # fmt: skip


@jit(allocates=False)
def search(mesh, face, x, y, z, k_x, k_y, k_z, t_end, delicate):
    """Find the next facet exactly: (fate, facet, image, time); ESCAPED if there is none.

    From a delicate place at once with the tolerance that is else that of a second try.
    """
    query, lift = mesh.query, mesh.frame.lift
    mesh.searches[0] += 1
    (a_x, a_y, a_z), (b_x, b_y, b_z) = axes_across(Vec(k_x, k_y, k_z))
    back = BEHIND * lift
    for attempt in range(delicate, 2):
        # Where two facets cross, float32 may have taken the one behind the other: the ray
        # then starts a hair inside the solid, and what it should have met is behind it
        near = mesh.frame.tolerance if attempt == 0 else WIDER * lift
        pose_query(mesh, face, x, y, z, k_x, k_y, k_z, near)
        for side in range(5):
            # The line itself and four lines around it: one of them meets what is near
            a = BESIDE * lift * (1.0 if side == 1 else -1.0 if side == 2 else 0.0)
            b = BESIDE * lift * (1.0 if side == 3 else -1.0 if side == 4 else 0.0)
            shoot(
                mesh, x - back * k_x + a * a_x + b * b_x,
                y - back * k_y + a * a_y + b * b_y,
                z - back * k_z + a * a_z + b * b_z, k_x, k_y, k_z, 0.0, t_end + 2.0 * back,
                mesh.arguments,
            )  # fmt: skip
        if query[Q_TIME] <= query[Q_BACK] + near and query[Q_FACE] >= 0.0:
            return HIT, int(query[Q_FACE]), int(query[Q_IMAGE]), query[Q_TIME]
    if query[Q_BACK] < math.inf:
        return WRONG, -1, 0, query[Q_BACK]
    return ESCAPED, -1, 0, t_end


@jit(forceinline=True)
def time_to_side(x, k_x, low, high):
    """Time at which a coordinate leaves its range."""
    if k_x > 0.0:
        return (high - x) / k_x
    if k_x < 0.0:
        return (low - x) / k_x
    return math.inf


@jit(forceinline=True)
def ask_embree(mesh, face, x, y, z, k_x, k_y, k_z, t_end, delicate):
    """Find the next facet, as `search`, which it leaves what may mislead float32."""
    if delicate:
        return search(mesh, face, x, y, z, k_x, k_y, k_z, t_end, 1)
    lift_x = lift_y = lift_z = 0.0
    if face >= 0:
        n_x, n_y, n_z = facet_normal(mesh, face)
        lift_x, lift_y, lift_z = (
            mesh.frame.lift * n_x, mesh.frame.lift * n_y, mesh.frame.lift * n_z,
        )  # fmt: skip
    shoot(mesh, x + lift_x, y + lift_y, z + lift_z, k_x, k_y, k_z, 0.0, t_end, 0)
    words = mesh.words
    if words[GEOMETRY] == NOTHING:
        return ESCAPED, -1, 0, t_end
    found, image = int(words[FACE]), image_of(words[INSTANCE])
    time, rate = plane_time(
        mesh, found, mesh.images[image, 0], mesh.images[image, 1], x, y, z, k_x, k_y, k_z
    )
    if rate < 0.0 and time >= 0.0 and found != face:
        return HIT, found, image, time
    return search(mesh, face, x, y, z, k_x, k_y, k_z, t_end, 0)


@jit(forceinline=True)
def end_of_way(mesh, face, image, x, y, z):
    """Bring a place on an image of a facet onto the facet itself."""
    return place_on_facet(
        mesh, face, x - mesh.images[image, 0], y - mesh.images[image, 1], z
    )


@jit(allocates=False)
def seek_facet(mesh, face, delicate, x, y, z, k_x, k_y, k_z):
    """Follow a ray along the unit vector k: (fate, facet, delicate, x, y, z) at its end.

    It starts on a facet, or in free space where that is -1. `delicate` is 1 at a place on a
    facet near which another crosses it, else 0.
    """
    frame = mesh.frame
    free = frame.free_slope
    if face >= 0 and k_z > 0.0 and k_z * k_z >= free * free * (k_x * k_x + k_y * k_y):
        return ESCAPED, -1, 0, x, y, z
    for _ in range(MAX_PERIODS):
        t_x = time_to_side(x, k_x, frame.low_x, frame.high_x)
        t_y = time_to_side(y, k_y, frame.low_y, frame.high_y)
        t_z = time_to_side(z, k_z, frame.z_bottom, frame.z_top)
        t_end = max(min(t_x, t_y, t_z), 0.0)
        fate, found, image, time = ask_embree(
            mesh, face, x, y, z, k_x, k_y, k_z, t_end + frame.lift, delicate
        )
        if fate == ESCAPED and t_z <= t_end and k_z < 0.0 and frame.kind != BODIES:
            # Through the ground, if at an edge or a vertex that Embree missed
            fate, found, image, time = search(
                mesh, face, x, y, z, k_x, k_y, k_z, t_end + frame.lift, delicate
            )
        if fate == HIT:
            end_x, end_y, end_z = end_of_way(
                mesh, found, image, x + time * k_x, y + time * k_y, z + time * k_z
            )
            close = 0
            if frame.crossing:
                n_x, n_y, n_z = facet_normal(mesh, found)
                slant = max(-(k_x * n_x + k_y * n_y + k_z * n_z), LEAST_SLANT)
                before = frame.lift * (BEFORE + SLANTING / slant)
                # So is the end of a way so short that its start is as near
                if time < before or is_delicate(
                    mesh, found, end_x, end_y, end_z, k_x, k_y, k_z, before
                ):
                    close = 1
            if close:
                # Which of the facets there comes first, float64 has to say
                fate, other, image, time = search(
                    mesh, face, x, y, z, k_x, k_y, k_z, time + before, delicate
                )
                if fate == HIT:
                    found = other
                    end_x, end_y, end_z = end_of_way(
                        mesh, found, image, x + time * k_x, y + time * k_y, z + time * k_z
                    )
            return HIT, found, close, end_x, end_y, end_z
        if fate == WRONG:
            return WRONG, -1, 0, x, y, z
        x += t_end * k_x
        y += t_end * k_y
        z += t_end * k_z
        if t_z <= t_end:
            if k_z > 0.0:
                return ESCAPED, -1, 0, x, y, z
            if frame.kind == GROUND:
                return LOST, -1, 0, x, y, z
            return BELOW if frame.kind == BODIES else SIDE, -1, 0, x, y, z
        if not frame.periodic:
            if frame.kind == BODIES:
                # Nothing lies beyond the box of the bodies
                return ESCAPED if k_z > 0.0 else BELOW, -1, 0, x, y, z
            return SIDE, -1, 0, x, y, z
        # The same place, as many periods back as bring it into the middle image
        x -= frame.period_x * math.floor((x - frame.cell_x) / frame.period_x)
        y -= frame.period_y * math.floor((y - frame.cell_y) / frame.period_y)
        face = -1
        delicate = 0
    return LOST, -1, 0, x, y, z

"""A ray sent to Embree, and the exact search where float32 may have misled it."""

import math

from pbrdf.kernels import jit
from pbrdf.kernels.meshes.facets import facet_normal, image_of, plane_time
from pbrdf.kernels.meshes.memory import call_embree
from pbrdf.kernels.meshes.packets import MISSES, UNTOLD, face_and_image, told_hit
from pbrdf.kernels.meshes.search import (
    Q_BACK,
    Q_FACE,
    Q_IMAGE,
    Q_TIME,
    pose_query,
)
from pbrdf.kernels.optics.vectors import Vec, axes_across
from pbrdf.kernels.terrain.embree import (
    FACE,
    FARTHEST,
    GEOMETRY,
    INSTANCE,
    NOTHING,
    write_ray,
)
from pbrdf.kernels.terrain.heightfield import ESCAPED, HIT

# Fates of a ray on a mesh besides those of a walk: it passed out below; it met a facet from
# behind
BELOW, WRONG = 6, 7
# Start of an exact search behind its ray, and beside it, in lifts
BEHIND, BESIDE = 4.0, 2.0
# How far beside the next start of a ray another facet makes a place delicate, in lifts
ASIDE = 8.0
# Tolerance of places in the second try, in lifts: the rounding of float32
WIDER = 4.0


@jit(forceinline=True)
def aim(mesh, x, y, z, k_x, k_y, k_z, nearest, farthest):
    """Write a ray from a place [um] along the unit vector k for Embree, in float32."""
    frame = mesh.frame
    origin = Vec(
        (x - frame.center_x) * frame.scale,
        (y - frame.center_y) * frame.scale,
        (z - frame.center_z) * frame.scale,
    )
    write_ray(
        mesh.ray, mesh.words, 0, 1, origin, Vec(k_x, k_y, k_z), nearest * frame.scale,
        farthest * frame.scale,
    )  # fmt: skip


@jit(forceinline=True)
def shoot(mesh, x, y, z, k_x, k_y, k_z, nearest, farthest, arguments):
    """Let Embree follow a ray to the first facet, or call back for all of them."""
    aim(mesh, x, y, z, k_x, k_y, k_z, nearest, farthest)
    call_embree(mesh.intersect, mesh.scene, mesh.place, arguments)


@jit(forceinline=True)
def is_blocked(mesh, x, y, z, d_x, d_y, d_z):
    """Whether anything lies on the way from a place to another at (d_x, d_y, d_z). [um]"""
    length = math.sqrt(d_x * d_x + d_y * d_y + d_z * d_z)
    aim(mesh, x, y, z, d_x / length, d_y / length, d_z / length, 0.0, length)
    call_embree(mesh.occluded, mesh.scene, mesh.place, 0)
    # Embree marks a ray that something stops
    return mesh.ray[FARTHEST] < 0.0


@jit(part=True, allocates=False)
def is_delicate(mesh, n_x, n_y, n_z, x, y, z, k_x, k_y, k_z, before):
    """Whether another facet is so near a place that a ray has met that float32 may err.

    Where parts cut into each other, what lies inside of one may stop a ray that has strayed
    into it, so that it would not be noticed. Asked for is whether anything lies between
    the ray a little before it met the facet and its next start, lifted off the facet along
    the normal, or beside that start.
    """
    lift = mesh.frame.lift
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
def lifted(mesh, face, x, y, z):
    """Lift a place on a facet off it, and leave one in free space where it is."""
    if face >= 0:
        n_x, n_y, n_z = facet_normal(mesh, face)
        lift = mesh.frame.lift
        return x + lift * n_x, y + lift * n_y, z + lift * n_z
    return x, y, z


@jit(forceinline=True)
def told_by_shot(mesh, face, x, y, z, k_x, k_y, k_z, t_end):
    """Shoot one ray: what it meets, as `pbrdf.kernels.meshes.packets` tells it."""
    x, y, z = lifted(mesh, face, x, y, z)
    shoot(mesh, x, y, z, k_x, k_y, k_z, 0.0, t_end, 0)
    words = mesh.words
    if words[GEOMETRY] == NOTHING:
        return MISSES
    return told_hit(mesh, int(words[FACE]), image_of(words[INSTANCE]))


@jit(forceinline=True)
def ask_embree(mesh, face, x, y, z, k_x, k_y, k_z, t_end, delicate, told):
    """Find the next facet, as `search`, which it leaves what may mislead float32.

    `told` is what a packet has told of the ray, or UNTOLD.
    """
    if delicate:
        return search(mesh, face, x, y, z, k_x, k_y, k_z, t_end, 1)
    if told == UNTOLD:
        told = told_by_shot(mesh, face, x, y, z, k_x, k_y, k_z, t_end)
    if told == MISSES:
        return ESCAPED, -1, 0, t_end
    found, image = face_and_image(mesh, told)
    time, rate = plane_time(
        mesh, found, mesh.images[image, 0], mesh.images[image, 1], x, y, z, k_x, k_y, k_z
    )
    if rate < 0.0 and time >= 0.0 and found != face:
        return HIT, found, image, time
    return search(mesh, face, x, y, z, k_x, k_y, k_z, t_end, 0)

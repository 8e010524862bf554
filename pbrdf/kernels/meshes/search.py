"""Exact search for the next facet: Embree names candidates, float64 judges each of them.

Embree works in float32. Where a ray starts within its rounding of another facet, or passes
through an edge or a vertex, what it finds first may be the wrong side of a facet, the facet
just left, or nothing. Such a ray is asked for again: from a little behind its start and a
little beside its line, with a call back for every facet near the line, which is judged with
the true ray and the true corners. No candidate is accepted, so none hides another.

A facet is met from the front; from behind only as the way out of a solid that light goes
through and the ray is inside of. Any other back tells that the ray has strayed.
"""

import math

from pbrdf.kernels import jit
from pbrdf.kernels.meshes.facets import image_of
from pbrdf.kernels.meshes.memory import (
    read_float64,
    read_int64,
    read_uint32,
    write_float64,
    write_int32,
)

# Columns of a query: true start and direction of the ray; facet it leaves (or -1) and the
# middle of that; tolerance of places, from planes and across edges, and that of float64;
# then what was found: time, facet and image of the nearest facet that may be met, and time
# of the nearest back that may not
Q_X, Q_Y, Q_Z, Q_KX, Q_KY, Q_KZ, Q_FROM, Q_MX, Q_MY, Q_MZ = 0, 1, 2, 3, 4, 5, 6, 7, 8, 9
Q_NEAR, Q_TIGHT, Q_TIME, Q_FACE, Q_IMAGE, Q_BACK, N_QUERY = 10, 11, 12, 13, 14, 15, 16
# Bytes from the context of a query to these columns, and from them to the addresses of
# corners, faces, normals, images, solids (0: none) and the counts of solids
AT_QUERY, AT_ADDRESSES, N_ADDRESSES = 64, 64 + 8 * N_QUERY, 6
# Bytes of Embree's C structs: of RTCFilterFunctionNArguments and of RTCHit
VALID, CONTEXT, HIT = 0, 16, 32
HIT_FACE, HIT_INSTANCE = 20, 28


def judge(given):
    """Judge a candidate of Embree for the true ray; `given` is the address of its facts."""
    write_int32(read_int64(given + VALID), 0)
    hit = read_int64(given + HIT)
    face = int(read_uint32(hit + HIT_FACE))
    image = image_of(read_uint32(hit + HIT_INSTANCE))
    context = read_int64(given + CONTEXT)
    query = context + AT_QUERY
    if face == int(read_float64(query + 8 * Q_FROM)):
        return
    corners = read_int64(context + AT_ADDRESSES)
    faces = read_int64(context + AT_ADDRESSES + 8)
    normal = read_int64(context + AT_ADDRESSES + 16) + 24 * face
    moved = read_int64(context + AT_ADDRESSES + 24) + 16 * image
    n_x, n_y, n_z = (
        read_float64(normal),
        read_float64(normal + 8),
        read_float64(normal + 16),
    )
    k_x = read_float64(query + 8 * Q_KX)
    k_y = read_float64(query + 8 * Q_KY)
    k_z = read_float64(query + 8 * Q_KZ)
    rate = k_x * n_x + k_y * n_y + k_z * n_z
    if rate == 0.0:
        return
    # Everything from the first corner of the facet, where its image stands
    a = corners + 24 * int(read_uint32(faces + 12 * face))
    b = corners + 24 * int(read_uint32(faces + 12 * face + 4))
    c = corners + 24 * int(read_uint32(faces + 12 * face + 8))
    a_x, a_y, a_z = read_float64(a), read_float64(a + 8), read_float64(a + 16)
    base_x = a_x + read_float64(moved)
    base_y = a_y + read_float64(moved + 8)
    x = read_float64(query + 8 * Q_X) - base_x
    y = read_float64(query + 8 * Q_Y) - base_y
    z = read_float64(query + 8 * Q_Z) - a_z
    height = x * n_x + y * n_y + z * n_z
    near = read_float64(query + 8 * Q_NEAR)
    inside = is_inside(context, face)
    leaves = rate > 0.0 and inside
    if rate < 0.0:
        # Inside of the solid already, it has met what it is a hair behind of
        if height < -(read_float64(query + 8 * Q_TIGHT) if inside else near):
            return
    elif height > (near if leaves else -near):
        return
    left = int(read_float64(query + 8 * Q_FROM))
    starts_here = height <= near if rate < 0.0 else leaves and height >= -near
    if starts_here and left >= 0 and share_corner(faces, face, left):
        # The ray starts on this facet too: met only where the two form an edge that is
        # hollow on the side of the ray, as those of bodies that cut into each other always
        # do. On one side of a body only its fronts are met, on the other its backs
        front = height_of_middle(query, base_x, base_y, a_z, n_x, n_y, n_z)
        hollow = front < 0.0 if leaves else front > 0.0
        if goes_in(context, query, left) != leaves or not hollow:
            return
    time = max(-height / rate, 0.0)
    x += time * k_x
    y += time * k_y
    z += time * k_z
    u_x, u_y, u_z = (
        read_float64(b) - a_x,
        read_float64(b + 8) - a_y,
        read_float64(b + 16) - a_z,
    )
    v_x, v_y, v_z = (
        read_float64(c) - a_x,
        read_float64(c + 8) - a_y,
        read_float64(c + 16) - a_z,
    )
    # How far inside of each edge the place lies
    least = min(
        inside_edge(x, y, z, u_x, u_y, u_z, n_x, n_y, n_z),
        inside_edge(
            x - u_x, y - u_y, z - u_z, v_x - u_x, v_y - u_y, v_z - u_z, n_x, n_y, n_z
        ),
        inside_edge(x - v_x, y - v_y, z - v_z, -v_x, -v_y, -v_z, n_x, n_y, n_z),
    )
    # What may be met is met up to its edges; a back tells of a fault only well inside of
    # them, as a ray that grazes an edge may touch both. So does the front of a solid that
    # the ray is inside of, which is met only where the solid cuts into itself
    met = (rate < 0.0) != inside
    if least < (-near if met else near):
        return
    if rate > 0.0 and not leaves:
        if time < read_float64(query + 8 * Q_BACK):
            write_float64(query + 8 * Q_BACK, time)
    elif time < read_float64(query + 8 * Q_TIME):
        write_float64(query + 8 * Q_TIME, time)
        write_float64(query + 8 * Q_FACE, float(face))
        write_float64(query + 8 * Q_IMAGE, float(image))


@jit(forceinline=True)
def height_of_middle(query, x, y, z, n_x, n_y, n_z):
    """Height of the middle of the facet that a ray leaves above a plane through a place."""
    return (
        (read_float64(query + 8 * Q_MX) - x) * n_x
        + (read_float64(query + 8 * Q_MY) - y) * n_y
        + (read_float64(query + 8 * Q_MZ) - z) * n_z
    )


@jit(forceinline=True)
def is_inside(context, face):
    """Whether the ray of a query is inside of the solid that a facet bounds."""
    solids = read_int64(context + AT_ADDRESSES + 32)
    within = read_int64(context + AT_ADDRESSES + 40)
    solid = int(read_uint32(solids + 4 * face)) if solids != 0 else 0
    return read_int64(within + 8 * solid) > 0


@jit(forceinline=True)
def goes_in(context, query, left):
    """Whether the ray of a query starts to the inner side of the facet that it leaves."""
    if not is_inside(context, left):
        return False
    normal = read_int64(context + AT_ADDRESSES + 16) + 24 * left
    along = (
        read_float64(query + 8 * Q_KX) * read_float64(normal)
        + read_float64(query + 8 * Q_KY) * read_float64(normal + 8)
        + read_float64(query + 8 * Q_KZ) * read_float64(normal + 16)
    )
    return along < 0.0


@jit(forceinline=True)
def share_corner(faces, one, other):
    """Whether two facets have a corner in common; `faces` is the address of their table."""
    for a in range(3):
        corner = read_uint32(faces + 12 * one + 4 * a)
        for b in range(3):
            if corner == read_uint32(faces + 12 * other + 4 * b):
                return True
    return False


@jit(forceinline=True)
def inside_edge(x, y, z, e_x, e_y, e_z, n_x, n_y, n_z):
    """Distance of a place from an edge along the facet, positive on the facet's side."""
    across = (
        (n_y * e_z - n_z * e_y) * x
        + (n_z * e_x - n_x * e_z) * y
        + (n_x * e_y - n_y * e_x) * z
    )
    return across / math.sqrt(e_x * e_x + e_y * e_y + e_z * e_z)


@jit(forceinline=True)
def pose_query(mesh, face, x, y, z, k_x, k_y, k_z, near):
    """Write the true ray into the query, and forget what was found before.

    `near` is the tolerance of places, from planes and across edges.
    """
    query = mesh.query
    query[Q_X] = x
    query[Q_Y] = y
    query[Q_Z] = z
    query[Q_KX] = k_x
    query[Q_KY] = k_y
    query[Q_KZ] = k_z
    query[Q_FROM] = face
    if face >= 0:
        for axis in range(3):
            middle = 0.0
            for corner in range(3):
                middle += mesh.corners[mesh.faces[face, corner], axis]
            query[Q_MX + axis] = middle / 3.0
    query[Q_NEAR] = near
    query[Q_TIGHT] = mesh.frame.tolerance
    query[Q_TIME] = math.inf
    query[Q_FACE] = -1.0
    query[Q_IMAGE] = 0.0
    query[Q_BACK] = math.inf

"""A mesh as the kernels take it, and places on its facets in float64."""

import math
from collections import namedtuple

from pbrdf.kernels import jit

# What becomes of light that leaves the mesh downwards or beside it: the mesh is closed
# towards below, so it was lost (GROUND); bodies with nothing under them, so it passed
# (BODIES); an open sheet that goes on beyond its rim (SHEET)
GROUND, BODIES, SHEET = 0, 1, 2
NO_INSTANCE = 0xFFFFFFFF

# Extent and frame of a mesh: kind, whether its parts may cut into each other and whether it
# repeats, its periods, the corner of the middle image, the box in which all images are at
# hand, its free space below and above, its highest point, the slope from which on a rising
# ray is free at once (inf: not to be used), the centre and scale to the units of Embree,
# the lift of a ray off its facet and the tolerance of places [um]
MeshFrame = namedtuple(
    "MeshFrame",
    "kind crossing periodic period_x period_y cell_x cell_y low_x high_x low_y high_y "
    "z_bottom z_top z_high free_slope center_x center_y center_z scale lift tolerance",
)
# A mesh: corners (vertices, 3) [um], faces (faces, 3), unit normals (faces, 3), labels
# (faces,; of no size: all 0), the number of the transparent solid that each bounds (faces,;
# 0: none; of no size: all 0) and its frame; the medium of each solid (solids + 1,), 0 of
# none, and how often a ray is inside of each, of all together last (solids + 2,); then
# Embree: addresses of `rtcIntersect1`, of
# `rtcOccluded1`, of the scene, of a ray and of the arguments of an exact search; the ray as
# float32 and uint32, the periods that each image is moved by (images, 2), and what the
# search asks and finds (N_QUERY,), how often it ran (1,), and room for a
# `pbrdf.kernels.meshes.packets.Packet`
Facets = namedtuple(
    "Facets",
    "corners faces normals labels solids frame media within intersect occluded scene place "
    "arguments ray words images query searches packet",
)


@jit(forceinline=True)
def image_of(instance):
    """Turn the number of an instance into that of an image; a mesh alone has none."""
    number = int(instance)
    return 0 if number == NO_INSTANCE else number


@jit(forceinline=True)
def facet_normal(mesh, face):
    """Give the unit normal of a facet, on the side of the light."""
    normals = mesh.normals
    return normals[face, 0], normals[face, 1], normals[face, 2]


@jit(forceinline=True)
def facet_label(mesh, face):
    """Give the number of the material of a facet."""
    labels = mesh.labels
    return labels[face] if labels.size > 0 else 0


@jit(forceinline=True)
def facet_solid(mesh, face):
    """Give the number of the transparent solid that a facet bounds, or 0."""
    solids = mesh.solids
    return solids[face] if solids.size > 0 else 0


@jit(forceinline=True)
def plane_time(mesh, face, shift_x, shift_y, x, y, z, k_x, k_y, k_z):
    """Time at which a ray meets the plane of a facet, and its speed away from the plane.

    The facet stands where its image is moved to.
    """
    n_x, n_y, n_z = facet_normal(mesh, face)
    rate = k_x * n_x + k_y * n_y + k_z * n_z
    corners = mesh.corners
    first = mesh.faces[face, 0]
    clear = (
        (x - shift_x - corners[first, 0]) * n_x
        + (y - shift_y - corners[first, 1]) * n_y
        + (z - corners[first, 2]) * n_z
    )
    return -clear / rate if rate != 0.0 else math.inf, rate


@jit(forceinline=True)
def place_on_facet(mesh, face, x, y, z):
    """Bring a place that is on a facet but for rounding onto it."""
    corners, faces = mesh.corners, mesh.faces
    a, b, c = faces[face, 0], faces[face, 1], faces[face, 2]
    a_x, a_y, a_z = corners[a, 0], corners[a, 1], corners[a, 2]
    u_x, u_y, u_z = corners[b, 0] - a_x, corners[b, 1] - a_y, corners[b, 2] - a_z
    v_x, v_y, v_z = corners[c, 0] - a_x, corners[c, 1] - a_y, corners[c, 2] - a_z
    w_x, w_y, w_z = x - a_x, y - a_y, z - a_z
    uu = u_x * u_x + u_y * u_y + u_z * u_z
    uv = u_x * v_x + u_y * v_y + u_z * v_z
    vv = v_x * v_x + v_y * v_y + v_z * v_z
    wu = w_x * u_x + w_y * u_y + w_z * u_z
    wv = w_x * v_x + w_y * v_y + w_z * v_z
    scale = 1.0 / (uu * vv - uv * uv)
    u = max((vv * wu - uv * wv) * scale, 0.0)
    v = max((uu * wv - uv * wu) * scale, 0.0)
    if u + v > 1.0:
        total = 1.0 / (u + v)
        u *= total
        v *= total
    return a_x + u * u_x + v * v_x, a_y + u * u_y + v * v_y, a_z + u * u_z + v * v_z

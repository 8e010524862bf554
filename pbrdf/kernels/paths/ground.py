"""What a ray asks of an opaque surface, a height field or a mesh: the facet it meets next.

Of a terrain and a mesh one is None, which the compiler sees: it drops what is asked of it.
"""

from collections import namedtuple

from pbrdf.kernels import jit
from pbrdf.kernels.meshes.facets import facet_label, facet_normal
from pbrdf.kernels.meshes.packets import UNTOLD
from pbrdf.kernels.meshes.seek import seek_told
from pbrdf.kernels.optics.vectors import Vec
from pbrdf.kernels.paths.ray_bounce import normal_of_slopes
from pbrdf.kernels.terrain.embree import seek
from pbrdf.kernels.terrain.heightfield import LOST, facet_slopes, leave_facet, walk
from pbrdf.kernels.terrain.sweep import F_FACET, F_I, F_J, F_U, F_V, F_Z, N_FIRST

MAX_STEPS = 10_000_000

# Where a ray is: cell, facet and place (u, v) in the cell at a height z; on a mesh facet
# and place [um], i being 1 where the place is delicate, as `seek_told` says
Place = namedtuple("Place", "i j facet u v z")
# Tables of rays and hits begin with the columns of what `sweep_line` finds
N_PLACE = N_FIRST


@jit(forceinline=True)
def write_place(table, row, place):
    """Write a place into the first columns of a row."""
    table[row, F_I] = place.i
    table[row, F_J] = place.j
    table[row, F_FACET] = place.facet
    table[row, F_U] = place.u
    table[row, F_V] = place.v
    table[row, F_Z] = place.z


@jit(forceinline=True)
def read_place(table, row):
    """Read a place from the first columns of a row."""
    return Place(
        int(table[row, F_I]), int(table[row, F_J]), int(table[row, F_FACET]),
        table[row, F_U], table[row, F_V], table[row, F_Z],
    )  # fmt: skip


@jit(forceinline=True)
def next_on_terrain(terrain, tree, place, k, leave_rate):
    """Follow a ray from a facet to the next: by the walk, or with a tree by Embree."""
    i, j, facet, u, v, z = place
    if tree is None:
        return leave_facet(
            terrain, i, j, facet, u, v, z, k.x, k.y, k.z, leave_rate, MAX_STEPS
        )
    return seek(terrain, tree, i, j, facet, u, v, z, k.x, k.y, k.z)


@jit(forceinline=True)
def next_facet(terrain, tree, mesh, place, k, leave_rate, told=UNTOLD):
    """Follow a ray from a facet to the next: its fate, and its place there.

    On a mesh a packet may have told what it meets.
    """
    fate = LOST
    i, j, facet, u, v, z = place
    if mesh is not None:
        fate, facet, i, u, v, z = seek_told(mesh, told, facet, i, u, v, z, k.x, k.y, k.z)
    if terrain is not None:
        fate, i, j, facet, u, v, z = next_on_terrain(terrain, tree, place, k, leave_rate)
    return fate, Place(i, j, facet, u, v, z)


@jit(forceinline=True)
def first_facet(terrain, tree, i, j, u, v, k):
    """Follow a ray from the top plane over a cell to the first facet it meets."""
    if tree is None:
        fate, i, j, facet, u, v, z = walk(
            terrain, i, j, -1, u, v, terrain.z_top, k.x / terrain.pitch_x,
            k.y / terrain.pitch_y, k.z, 0.0, MAX_STEPS,
        )  # fmt: skip
    else:
        fate, i, j, facet, u, v, z = seek(
            terrain, tree, i, j, -1, u, v, terrain.z_top, k.x, k.y, k.z
        )
    return fate, Place(i, j, facet, u, v, z)


@jit(forceinline=True)
def first_on_mesh(mesh, x, y, before, k, told=UNTOLD):
    """Follow a ray to the first facet it meets, from `before` its entry point at (x, y)."""
    fate, facet, delicate, x, y, z = seek_told(
        mesh, told, -1, 0, x - before * k.x, y - before * k.y, mesh.frame.z_top,
        k.x, k.y, k.z,
    )  # fmt: skip
    return fate, Place(delicate, 0, facet, x, y, z)


@jit(forceinline=True)
def normal_of_face(mesh, face):
    """Give the unit normal of a facet of a mesh, on the side of the light."""
    n_x, n_y, n_z = facet_normal(mesh, face)
    return Vec(n_x, n_y, n_z)


@jit(forceinline=True)
def normal_of_facet(terrain, mesh, place):
    """Give the normal of a facet, and how much faster a ray rises than departs from it."""
    normal, steep = Vec(0.0, 0.0, 1.0), 1.0
    if mesh is not None:
        normal = normal_of_face(mesh, place.facet)
    if terrain is not None:
        slope_x, slope_y = facet_slopes(terrain, place.i, place.j, place.facet)
        normal, steep = normal_of_slopes(slope_x, slope_y)
    return normal, steep


@jit(forceinline=True)
def label_of_facet(terrain, mesh, place):
    """Give the number of the material of a facet."""
    label = 0
    if mesh is not None:
        label = facet_label(mesh, place.facet)
    if terrain is not None:
        labels = terrain.labels
        label = labels[place.i, place.j] if labels.size > 0 else 0
    return label

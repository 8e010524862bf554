"""What a ray that goes through solids meets next on a mesh, from either side of a facet.

How often it is inside of each solid is counted as it crosses facets, and no place is ever
tested. A back is met only as the way out of one of them; whatever else Embree
finds, and light that leaves the mesh while it is inside of a solid, `search` decides.
"""

from pbrdf.kernels import jit
from pbrdf.kernels.meshes.facets import (
    facet_normal,
    facet_solid,
    image_of,
    plane_time,
)
from pbrdf.kernels.meshes.shots import is_delicate, search, shoot
from pbrdf.kernels.terrain.embree import FACE, GEOMETRY, INSTANCE, NOTHING
from pbrdf.kernels.terrain.heightfield import ESCAPED, HIT


@jit(forceinline=True)
def is_caught(within):
    """Whether a ray is inside of a solid."""
    return within[within.shape[0] - 1] > 0


@jit(forceinline=True)
def ask_either(mesh, within, face, x, y, z, k_x, k_y, k_z, t_end, delicate):
    """`ask_embree` for facets met from either side."""
    if delicate:
        return search(mesh, face, x, y, z, k_x, k_y, k_z, t_end, 1)
    lift_x = lift_y = lift_z = 0.0
    if face >= 0:
        n_x, n_y, n_z = facet_normal(mesh, face)
        # Off the facet to the side to which the ray goes
        lift = mesh.frame.lift
        if k_x * n_x + k_y * n_y + k_z * n_z < 0.0:
            lift = -lift
        lift_x, lift_y, lift_z = lift * n_x, lift * n_y, lift * n_z
    shoot(mesh, x + lift_x, y + lift_y, z + lift_z, k_x, k_y, k_z, 0.0, t_end, 0)
    words = mesh.words
    if words[GEOMETRY] == NOTHING:
        return ESCAPED, -1, 0, t_end
    found, image = int(words[FACE]), image_of(words[INSTANCE])
    time, rate = plane_time(
        mesh, found, mesh.images[image, 0], mesh.images[image, 1], x, y, z, k_x, k_y, k_z
    )
    # A back leads out of a solid that the ray is inside of, a front into another one
    inside = within[facet_solid(mesh, found)] > 0
    if rate != 0.0 and inside == (rate > 0.0) and time >= 0.0 and found != face:
        return HIT, found, image, time
    return search(mesh, face, x, y, z, k_x, k_y, k_z, t_end, 0)


@jit(part=True, allocates=False)
def is_delicate_behind(mesh, n_x, n_y, n_z, x, y, z, k_x, k_y, k_z, before):
    """`is_delicate` where a ray arrives from either side, and may go on on both."""
    if k_x * n_x + k_y * n_y + k_z * n_z > 0.0:
        n_x, n_y, n_z = -n_x, -n_y, -n_z
    return is_delicate(mesh, n_x, n_y, n_z, x, y, z, k_x, k_y, k_z, before) or is_delicate(
        mesh, -n_x, -n_y, -n_z, x, y, z, -k_x, -k_y, -k_z, before
    )

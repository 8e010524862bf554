"""What a beam meets next on a mesh whose solids it may go through: geometry only."""

from pbrdf.kernels import jit
from pbrdf.kernels.bodies.beams import (
    CELL_I,
    FACET,
    FIRST_SOLID,
    INSIDE,
    KX,
    KY,
    KZ,
    N_INSIDE,
    ON_GROUND,
    START,
    X,
    Y,
    Z,
    number_of_solid,
    solid_of_number,
)
from pbrdf.kernels.bodies.bodies import HIT_T, HIT_X, HIT_Y
from pbrdf.kernels.bodies.world import (
    ASIDE,
    ASTRAY,
    GROUND,
    HIT_BODY,
    HIT_FACET,
    HIT_I,
    HIT_J,
    HIT_U,
    HIT_V,
    HIT_Z,
    OUT,
    PASSED,
    SOLID_IN,
    SOLID_OUT,
)
from pbrdf.kernels.meshes.facets import facet_normal, facet_solid
from pbrdf.kernels.meshes.packets import UNTOLD
from pbrdf.kernels.meshes.seek import follow_ray
from pbrdf.kernels.meshes.shots import BELOW
from pbrdf.kernels.terrain.heightfield import ESCAPED, HIT, SIDE


@jit(forceinline=True)
def count_solids(mesh, state, top, step):
    """Tell the search which solids the beam is inside of, or take it back."""
    within = mesh.within
    for slot in range(int(state[top, N_INSIDE])):
        number = state[top, INSIDE + 3 * slot]
        if number <= FIRST_SOLID:
            within[solid_of_number(number)] += step
            within[within.shape[0] - 1] += step


@jit(part=True, allocates=False)
def next_on_mesh(mesh, state, top, kind, hit):
    """Find whether the beam meets a facet before the event of this kind in `hit`."""
    x, y, z = state[top, X], state[top, Y], state[top, Z]
    k_x, k_y, k_z = state[top, KX], state[top, KY], state[top, KZ]
    face, delicate, ahead = -1, 0, 0.0
    if state[top, START] == ON_GROUND:
        face, delicate = int(state[top, FACET]), int(state[top, CELL_I])
    elif k_z < 0.0 and z > mesh.frame.z_top:
        # From above all facets down to the highest of them
        ahead = (mesh.frame.z_top - z) / k_z
        x += ahead * k_x
        y += ahead * k_y
        z = mesh.frame.z_top
    count_solids(mesh, state, top, 1)
    fate, face, delicate, x, y, z, way = follow_ray(
        mesh, mesh.within, UNTOLD, face, delicate, x, y, z, k_x, k_y, k_z
    )
    count_solids(mesh, state, top, -1)
    way += ahead
    if fate == HIT and way < hit[HIT_T]:
        hit[HIT_T] = way
        hit[HIT_X] = hit[HIT_Y] = 0.0
        hit[HIT_I], hit[HIT_J], hit[HIT_FACET] = delicate, 0.0, face
        hit[HIT_U], hit[HIT_V], hit[HIT_Z] = x, y, z
        solid = facet_solid(mesh, face)
        hit[HIT_BODY] = number_of_solid(solid)
        if solid == 0:
            return GROUND
        n_x, n_y, n_z = facet_normal(mesh, face)
        return SOLID_OUT if k_x * n_x + k_y * n_y + k_z * n_z > 0.0 else SOLID_IN
    if kind != OUT:
        return kind
    if fate == SIDE:
        return ASIDE
    if state[top, N_INSIDE] > 0:
        return ASTRAY
    if fate == BELOW:
        return PASSED
    return OUT if fate == ESCAPED else ASTRAY

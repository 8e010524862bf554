"""The rays of a line over a mesh, which Embree follows together up to their second facets.

Successive rays of a line meet facets side by side, and most of their mirrored rays stay
together too.
"""

from collections import namedtuple

from pbrdf.kernels import jit
from pbrdf.kernels.meshes.packets import APART, TOGETHER, UNTOLD, send_packet
from pbrdf.kernels.meshes.seek import foresee, rises_off
from pbrdf.kernels.paths.ground import (
    N_PLACE,
    first_on_mesh,
    normal_of_face,
    write_place,
)
from pbrdf.kernels.paths.ray_bounce import mirror_at
from pbrdf.kernels.terrain.entry import entry_point
from pbrdf.kernels.terrain.heightfield import HIT
from pbrdf.kernels.terrain.sweep import F_FACET, F_I, F_U, F_V, F_Z

# Columns of a first facet: its place, then the fate of the ray there
FATE, N_MET = N_PLACE, N_PLACE + 1
# Room for the longest line: first facets (rays, N_MET), and what packets tell (rays,)
MeshLine = namedtuple("MeshLine", "met told")


@jit(forceinline=True)
def meet_first(mesh, points, launch, rays, k, before, dense, line):
    """Find the first facets of the rays of a line, `before` their entry points.

    Where rays are `dense`, those side by side meet the same few facets.
    """
    met, told = line
    mesh.packet.flags[0] = TOGETHER if dense else APART
    for ray in range(rays):
        x, y = entry_point(points, ray, rays, launch)
        foresee(
            mesh, ray, -1, x - before * k.x, y - before * k.y, mesh.frame.z_top,
            k.x, k.y, k.z, told,
        )  # fmt: skip
    send_packet(mesh, told)
    for ray in range(rays):
        x, y = entry_point(points, ray, rays, launch)
        fate, place = first_on_mesh(mesh, x, y, before, k, told[ray])
        write_place(met, ray, place)
        met[ray, FATE] = fate


@jit(forceinline=True)
def foresee_second(mesh, rays, k, line):
    """Let packets tell what the rays of a line meet that their first facets mirror.

    Nothing is told of those that are free at once, and of those from delicate places.
    """
    met, told = line
    mesh.packet.flags[0] = APART
    for ray in range(rays):
        told[ray] = UNTOLD
        if met[ray, FATE] != HIT or met[ray, F_I] == 1.0:
            continue
        face = int(met[ray, F_FACET])
        r, _, _ = mirror_at(k, normal_of_face(mesh, face))
        if not rises_off(mesh.frame, face, r.x, r.y, r.z):
            foresee(
                mesh, ray, face, met[ray, F_U], met[ray, F_V], met[ray, F_Z],
                r.x, r.y, r.z, told,
            )  # fmt: skip
    send_packet(mesh, told)

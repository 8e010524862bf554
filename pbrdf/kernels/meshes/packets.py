"""Rays of a line sent to Embree eight at a time: what each of them meets first.

Rays that lie side by side cost Embree a third to a half of what they cost one by one. What
is told here is what `shoot` would find for the same ray; `pbrdf.kernels.meshes.seek` takes
it instead, and makes of it what it always does.
"""

from collections import namedtuple

from pbrdf.kernels import jit
from pbrdf.kernels.meshes.facets import image_of
from pbrdf.kernels.meshes.memory import call_embree_packet
from pbrdf.kernels.optics.vectors import Vec
from pbrdf.kernels.terrain.embree import FACE, GEOMETRY, INSTANCE, NOTHING, write_ray

LANES = 8
# Flags of a packet: rays that take the same way through Embree's tree, and any others
TOGETHER, APART = 1 << 16, 0
# What is told of a ray: nothing yet; that it meets nothing; else the facet and its image
# in one number, `told_hit`
UNTOLD, MISSES = -2, -1

# Room for a packet: addresses of `rtcIntersect8`, of which rays there are, of the rays and
# of the arguments, whose flags (1,) tell whether rays share their way; the rays as float32
# and uint32, which there are (LANES,) int32, their numbers in the line (LANES,), and how
# many there are (1,)
Packet = namedtuple(
    "Packet", "intersect validity place arguments flags ray words valid members filled"
)


@jit(forceinline=True)
def told_hit(mesh, face, image):
    """Give facet and image as one number."""
    return image * mesh.faces.shape[0] + face


@jit(forceinline=True)
def face_and_image(mesh, told):
    """Give the facet and its image that were told."""
    count = mesh.faces.shape[0]
    return told % count, told // count


@jit(forceinline=True)
def put_ray(mesh, member, x, y, z, k_x, k_y, k_z, farthest, told):
    """Add a ray of a line [um] to the packet, which is sent when it is full."""
    frame, packet = mesh.frame, mesh.packet
    words, lane = packet.words, packet.filled[0]
    origin = Vec(
        (x - frame.center_x) * frame.scale,
        (y - frame.center_y) * frame.scale,
        (z - frame.center_z) * frame.scale,
    )
    write_ray(
        packet.ray, words, lane, LANES, origin, Vec(k_x, k_y, k_z), 0.0,
        farthest * frame.scale,
    )  # fmt: skip
    packet.valid[lane] = -1
    packet.members[lane] = member
    packet.filled[0] = lane + 1
    if lane + 1 == LANES:
        send_packet(mesh, told)


@jit(allocates=False)
def send_packet(mesh, told):
    """Ask Embree for the rays in the packet, tell what each meets, and empty it."""
    packet = mesh.packet
    words = packet.words
    call_embree_packet(
        packet.intersect, packet.validity, mesh.scene, packet.place, packet.arguments
    )
    for lane in range(packet.filled[0]):
        answer = MISSES
        if words[GEOMETRY * LANES + lane] != NOTHING:
            image = image_of(words[INSTANCE * LANES + lane])
            answer = told_hit(mesh, int(words[FACE * LANES + lane]), image)
        told[packet.members[lane]] = answer
        packet.valid[lane] = 0
    packet.filled[0] = 0

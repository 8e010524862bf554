"""Rays of a line sent to Embree eight at a time: what each of them meets first.

Rays that lie side by side cost Embree a third to a half of what they cost one by one. What
is told here is what `shoot` would find for the same ray; `pbrdf.kernels.meshes.seek` takes
it instead, and makes of it what it always does.
"""

from collections import namedtuple

from pbrdf.kernels import jit
from pbrdf.kernels.meshes.memory import call_embree_packet
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
    ray, words = packet.ray, packet.words
    lane = packet.filled[0]
    ray[ORIGIN * LANES + lane] = (x - frame.center_x) * frame.scale
    ray[(ORIGIN + 1) * LANES + lane] = (y - frame.center_y) * frame.scale
    ray[(ORIGIN + 2) * LANES + lane] = (z - frame.center_z) * frame.scale
    ray[NEAREST * LANES + lane] = 0.0
    ray[DIRECTION * LANES + lane] = k_x
    ray[(DIRECTION + 1) * LANES + lane] = k_y
    ray[(DIRECTION + 2) * LANES + lane] = k_z
    ray[TIME * LANES + lane] = 0.0
    ray[FARTHEST * LANES + lane] = farthest * frame.scale
    words[MASK * LANES + lane] = ALL
    words[ID * LANES + lane] = 0
    words[FLAGS * LANES + lane] = 0
    words[GEOMETRY * LANES + lane] = NOTHING
    words[INSTANCE * LANES + lane] = NOTHING
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
            instance = words[INSTANCE * LANES + lane]
            image = 0 if instance == NOTHING else int(instance)
            answer = told_hit(mesh, int(words[FACE * LANES + lane]), image)
        told[packet.members[lane]] = answer
        packet.valid[lane] = 0
    packet.filled[0] = 0

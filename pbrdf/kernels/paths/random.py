"""Random numbers from counters: a stream, a ray and an event name their numbers.

No state is carried along, so neither the order of the rays nor the number of threads
matters.
"""

from collections import namedtuple

import numpy as np

from pbrdf.kernels import jit

GOLDEN = np.uint64(0x9E3779B97F4A7C15)
MIX_A = np.uint64(0xBF58476D1CE4E5B9)
MIX_B = np.uint64(0x94D049BB133111EB)
UNIT = 2.0**-53
# What names a pair of random numbers: a stream, a ray of it and an event on its path
Draw = namedtuple("Draw", "stream number event")


@jit(inline="always")
def mix(x):
    """Finaliser of SplitMix64 (Steele, Lea and Flood 2014): all bits depend on all bits."""
    x = (x ^ (x >> np.uint64(30))) * MIX_A
    x = (x ^ (x >> np.uint64(27))) * MIX_B
    return x ^ (x >> np.uint64(31))


@jit(part=True)
def uniform_pair(stream, ray, event):
    """Two uniform numbers in [0, 1) of an event on the path of a ray."""
    name = mix(np.uint64(stream) + GOLDEN * np.uint64(ray))
    first = mix(name + GOLDEN * np.uint64(2 * event + 1))
    second = mix(name + GOLDEN * np.uint64(2 * event + 2))
    return UNIT * (first >> np.uint64(11)), UNIT * (second >> np.uint64(11))


@jit(forceinline=True)
def pair_of(draw):
    """`uniform_pair` of a `Draw`."""
    return uniform_pair(draw.stream, draw.number, draw.event)

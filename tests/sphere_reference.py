"""Light on a sphere that may absorb, straight down, by order, for the tracers' tests."""

import math

import numpy as np

from tests.slab_reference import amplitudes, normal


def orders_of_a_sphere(index, radius, wavelength, impacts=4001):
    """Shares of the light on a sphere, straight down, by what has become of it.

    Out again upwards by order: reflected outside, passed once, passed more often; and what
    has met the surface twice and is still inside or on its way down.
    """
    upwards, cut = np.zeros(3), 0.0
    for square in (np.arange(impacts) + 0.5) / impacts:
        k = math.sqrt(square)
        q = normal(k, index)
        # Phase goes along (k, Re q); amplitude falls along the normal of the entry
        cosine = q.real / math.hypot(k, q.real)
        decay = 4 * math.pi / wavelength * q.imag * cosine
        left = math.exp(-decay * 2 * radius * cosine)
        turn_in, turn_out = math.asin(k), math.acos(cosine)
        (r_s, r_p), _ = amplitudes(k, 1.0, index)
        for share in (abs(r_s) ** 2, abs(r_p) ** 2):
            upwards[0] += 0.5 * share * (math.cos(2 * turn_in) > 0)
            for order in range(1, 60):
                turn = 2 * (turn_in - turn_out) + (order - 1) * (math.pi - 2 * turn_out)
                power = (1 - share) ** 2 * share ** (order - 1) * left**order
                down = math.cos(turn) > 0
                upwards[min(order, 2)] += 0.5 * power * (not down)
                cut += 0.5 * power * (down and order == 1)
            cut += 0.5 * (1 - share) * share * left**2
    return upwards / impacts, cut / impacts

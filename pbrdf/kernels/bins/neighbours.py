"""Bins share their noise with their neighbours where only noise tells them apart.

The spread over samples of a bin that few paths reached is as uncertain as their number, and
falls and rises with the mean: a bin that was missed by the rare strong paths looks dark and
certain. Its neighbours tell how often such paths come.
"""

import math
from collections import namedtuple

from pbrdf.kernels import jit

# Neighbours on either side, in zenith and in azimuth
REACH = 2
# With so many paths a bin knows its noise as well as its neighbours do
MANY = 60.0
TINY = 1e-300
# Sums beside those of the elements' noise: light, its square by area, and area
LIGHT, SQUARE, AREA, N_BESIDE = 0, 1, 2, 3

# To work in: sums (n_theta, n_dphi, elements + N_BESIDE), the same memory flat (n_theta,
# n_dphi (elements + N_BESIDE)), rows as flat, and unseen (elements,)
Room = namedtuple("Room", "sums flat rows unseen")


@jit(forceinline=True)
def sum_around(values, rows, n_columns):
    """Sum over each bin and its neighbours, round the azimuth but not over the pole.

    values      by bin (n_theta, n_dphi n_columns), replaced by the sums
    rows        room of the same shape
    """
    n_theta, width = values.shape
    reach = min(REACH, (width // n_columns - 1) // 2)
    for i in range(n_theta):
        for x in range(width):
            rows[i, x] = values[i, x]
        # One long loop for each neighbour: the compiler makes vector code of it
        for step in range(1, reach + 1):
            for shift in (step * n_columns, width - step * n_columns):
                for x in range(width - shift):
                    rows[i, x] += values[i, x + shift]
                for x in range(width - shift, width):
                    rows[i, x] += values[i, x + shift - width]
    for i in range(n_theta):
        for x in range(width):
            values[i, x] = rows[i, x]
        for other in range(max(i - REACH, 0), min(i + REACH + 1, n_theta)):
            if other != i:
                for x in range(width):
                    values[i, x] += rows[other, x]


@jit(part=True, allocates=False)
def share_noise(mean, variance, weight, one, room):
    """Take the variances of the flux of a bin and of like neighbours together.

    With V the mean variance around a bin and S² the scatter of the means there, noise
    alone explains V / S² of the scatter, at most all of it: the light of neighbours is
    like that of the bin to this degree. With N paths in a bin (mean squared over V) its
    variance becomes (1 - B) own + B V, B = MANY / (MANY + N) min(1, V / S²); an empirical
    Bayes estimate (Efron and Morris, J. Am. Stat. Assoc. 68, 117, 1973; Smyth, Stat. Appl.
    Genet. Mol. Biol. 3, 3, 2004). V allows for one more path around the bin than were seen.

    M00 decides for all elements. A bin with no light around it keeps its variance, and an
    element without noise in all bins has none.

    mean, variance  of the flux of the bins (n_theta, n_dphi, elements), M00 first; the
                    variances are written
    weight          projected solid angle of the bins (n_theta, n_dphi) [sr], to which the
                    variance of few paths is proportional
    one             flux of one path of mean strength
    room            `Room`
    """
    n_theta, n_dphi, n_elements = mean.shape
    sums, unseen = room.sums, room.unseen
    for i in range(n_theta):
        for j in range(n_dphi):
            area, light = weight[i, j], mean[i, j, 0]
            per_area = 1.0 / area if light != 0.0 else 0.0
            for e in range(n_elements):
                sums[i, j, e] = variance[i, j, e] * per_area
            sums[i, j, n_elements + LIGHT] = light
            sums[i, j, n_elements + SQUARE] = light * light / area
            sums[i, j, n_elements + AREA] = area
    # An element has its share of the path not seen, as it has of the noise of M00
    for e in range(n_elements):
        unseen[e] = 0.0
    for i in range(n_theta):
        for j in range(n_dphi):
            for e in range(n_elements):
                unseen[e] += sums[i, j, e] * weight[i, j]
    per_path = one * one / max(unseen[0], TINY)
    for e in range(n_elements):
        unseen[e] *= per_path

    sum_around(room.flat, room.rows, sums.shape[2])
    columns = 2 * min(REACH, (n_dphi - 1) // 2) + 1
    for i in range(n_theta):
        number = columns * (min(i + REACH + 1, n_theta) - max(i - REACH, 0))
        for j in range(n_dphi):
            if sums[i, j, 0] <= 0.0:
                continue
            area = weight[i, j]
            noise = max((sums[i, j, 0] + unseen[0] / area) / number, TINY)
            # Each bin's density M00 / area counts by its area
            light = sums[i, j, n_elements + LIGHT] ** 2 / sums[i, j, n_elements + AREA]
            scatter = max(sums[i, j, n_elements + SQUARE] - light, 0.0) / max(number - 1, 1)
            paths = light / number / noise
            share = MANY / (MANY + paths) * noise / max(scatter, noise)
            rest, around, missed = 1.0 - share, share * area / number, share / number
            for e in range(n_elements):
                variance[i, j, e] = (
                    rest * variance[i, j, e] + around * sums[i, j, e] + missed * unseen[e]
                )


@jit(allocates=False)
def estimate(mean, scatter, samples, one, weight, plane, room):
    """Turn the moments of the flux of bins into radiance and its standard error, in place.

    The spread over samples says nothing of a bin that no path reached. A count of none,
    seen without prior knowledge, has variance 1: there the error is one path of the mean
    strength `one`. Bins that differ from their neighbours by noise alone share it.

    mean, scatter   flux and its squares summed about it (n_theta, n_dphi, elements)
    plane           elements that vanish in the plane of incidence (elements,)
    room            `Room`
    """
    n_theta, n_dphi, n_elements = mean.shape
    if samples < 2:
        scatter[:] = math.nan
    else:
        per_sample = 1.0 / (samples - 1.0) / samples
        for i in range(n_theta):
            for j in range(n_dphi):
                lit = mean[i, j, 0] != 0.0
                for e in range(n_elements):
                    scatter[i, j, e] = scatter[i, j, e] * per_sample if lit else one * one
        share_noise(mean, scatter, weight, one, room)
    for i in range(n_theta):
        for j in range(n_dphi):
            per_weight = 1.0 / weight[i, j]
            in_plane = 2 * j == n_dphi or j == 0
            for e in range(n_elements):
                mean[i, j, e] *= per_weight
                scatter[i, j, e] = math.sqrt(scatter[i, j, e]) * per_weight
                if in_plane and plane[e]:
                    scatter[i, j, e] = 0.0

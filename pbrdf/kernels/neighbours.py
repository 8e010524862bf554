"""Bins share their noise with their neighbours where only noise tells them apart.

The spread over samples of a bin that few paths reached is as uncertain as their number, and
falls and rises with the mean: a bin that was missed by the rare strong paths looks dark and
certain. Its neighbours tell how often such paths come.
"""

import math

from pbrdf.kernels import jit

# Neighbours on either side, in zenith and in azimuth
REACH = 2
# With so many paths a bin knows its noise as well as its neighbours do
MANY = 60.0
TINY = 1e-300
# Sums beside those of the elements' noise: light, its square by area, and area
LIGHT, SQUARE, AREA, N_BESIDE = 0, 1, 2, 3


@jit(forceinline=True)
def sum_around(values, rows):
    """Sum over each bin and its neighbours, round the azimuth but not over the pole.

    values      by bin (n_theta, n_dphi, columns), replaced by the sums
    rows        room of the same shape
    """
    n_theta, n_dphi, n_columns = values.shape
    reach = min(REACH, (n_dphi - 1) // 2)
    for i in range(n_theta):
        for j in range(n_dphi):
            for c in range(n_columns):
                rows[i, j, c] = 0.0
            for step in range(-reach, reach + 1):
                other = (j + step) % n_dphi
                for c in range(n_columns):
                    rows[i, j, c] += values[i, other, c]
    for i in range(n_theta):
        low, high = max(i - REACH, 0), min(i + REACH + 1, n_theta)
        for j in range(n_dphi):
            for c in range(n_columns):
                values[i, j, c] = 0.0
            for other in range(low, high):
                for c in range(n_columns):
                    values[i, j, c] += rows[other, j, c]


@jit(allocates=False)
def share_noise(mean, variance, weight, one, sums, rows, unseen):
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
    sums, rows      room (n_theta, n_dphi, elements + N_BESIDE)
    unseen          room (elements,)
    """
    n_theta, n_dphi, n_elements = mean.shape
    for i in range(n_theta):
        for j in range(n_dphi):
            area, light = weight[i, j], mean[i, j, 0]
            for e in range(n_elements):
                sums[i, j, e] = variance[i, j, e] / area if light != 0.0 else 0.0
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

    sum_around(sums, rows)
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
            for e in range(n_elements):
                around = (sums[i, j, e] + unseen[e] / area) / number
                variance[i, j, e] += share * (around * area - variance[i, j, e])


@jit(allocates=False)
def estimate(mean, scatter, samples, one, weight, plane, room):
    """Turn the moments of the flux of bins into radiance and its standard error, in place.

    The spread over samples says nothing of a bin that no path reached. A count of none,
    seen without prior knowledge, has variance 1: there the error is one path of the mean
    strength `one`. Bins that differ from their neighbours by noise alone share it.

    mean, scatter   flux and its squares summed about it (n_theta, n_dphi, elements)
    plane           elements that vanish in the plane of incidence (elements,)
    room            (sums, rows, unseen) of `share_noise`
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
        share_noise(mean, scatter, weight, one, room[0], room[1], room[2])
    for i in range(n_theta):
        for j in range(n_dphi):
            per_weight = 1.0 / weight[i, j]
            in_plane = 2 * j == n_dphi or j == 0
            for e in range(n_elements):
                mean[i, j, e] *= per_weight
                scatter[i, j, e] = math.sqrt(scatter[i, j, e]) * per_weight
                if in_plane and plane[e]:
                    scatter[i, j, e] = 0.0

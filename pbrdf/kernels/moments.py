"""Running mean and scatter of tallies over independent samples of the surface."""

from pbrdf.kernels import jit


@jit(allocates=False)
def add_sample(
    flux, scale, count, room, mean, scatter, mean_total, scatter_total, albedo
):  # fmt: skip
    """Add the `count`-th sample to the running moments (Welford) and clear its tally.

    flux            tally of the sample (wavelengths, bounces, bins, elements), M00 first
    room            to work in (elements,)
    mean, scatter   as flux; mean_total, scatter_total (wavelengths, bins, elements) of all
    bounces together
    albedo          M00 of the sample over all bins (wavelengths, bounces), written
    """
    share = 1.0 / count
    albedo[:] = 0.0
    for w in range(flux.shape[0]):
        for cell in range(flux.shape[2]):
            lit = False
            for e in range(flux.shape[3]):
                room[e] = 0.0
            for b in range(flux.shape[1]):
                # Where no light ever came all moments stay 0
                if flux[w, b, cell, 0] == 0.0 == mean[w, b, cell, 0]:
                    continue
                lit = True
                albedo[w, b] += flux[w, b, cell, 0]
                for e in range(flux.shape[3]):
                    value = flux[w, b, cell, e] * scale
                    flux[w, b, cell, e] = 0.0
                    room[e] += value
                    change = value - mean[w, b, cell, e]
                    mean[w, b, cell, e] += change * share
                    scatter[w, b, cell, e] += change * (value - mean[w, b, cell, e])
            if not lit:
                continue
            for e in range(flux.shape[3]):
                change = room[e] - mean_total[w, cell, e]
                mean_total[w, cell, e] += change * share
                scatter_total[w, cell, e] += change * (room[e] - mean_total[w, cell, e])
    for w in range(flux.shape[0]):
        for b in range(flux.shape[1]):
            albedo[w, b] *= scale


@jit(allocates=False)
def fold_mirror(flux):
    """Average a tally with its mirror image in the plane of incidence.

    There dphi changes its sign, and so do the elements that couple (I, Q) and (U, V). The
    tally is (wavelengths, bounces, n_theta, n_dphi, stokes, stokes).
    """
    n_dphi = flux.shape[3]
    for w in range(flux.shape[0]):
        for b in range(flux.shape[1]):
            for i in range(flux.shape[2]):
                for j in range(n_dphi // 2 + 1):
                    other = (n_dphi - j) % n_dphi
                    for row in range(flux.shape[4]):
                        for column in range(flux.shape[5]):
                            sign = 1.0 if (row < 2) == (column < 2) else -1.0
                            here = flux[w, b, i, j, row, column]
                            there = flux[w, b, i, other, row, column]
                            here = 0.5 * (here + sign * there)
                            flux[w, b, i, j, row, column] = here
                            flux[w, b, i, other, row, column] = sign * here

"""Running mean and scatter of tallies over independent samples of the surface."""

from collections import namedtuple

from pbrdf.kernels import jit

# With the sample that is added: scale, from its flux to that of one ray; count, its
# number; ever_lit, whether a path of it or one before came there (bounces, bins), as
# elsewhere all moments stay 0; mean and scatter (wavelengths, bounces, bins, elements), M00
# first; scatter_total (wavelengths, bins, elements) of all bounces together; and written,
# the sample's M00 over all bins, albedo (wavelengths, bounces)
Running = namedtuple("Running", "scale count ever_lit mean scatter scatter_total albedo")


@jit(forceinline=True)
def add_wavelength(flux, slot, w, room, running):
    """Add slot `slot` of the flux to the moments of wavelength w (Welford) and clear it.

    flux            (slots, bounces, bins, elements)
    room            to work in (elements,)
    """
    mean, scatter, albedo = running.mean, running.scatter, running.albedo
    scatter_total, ever_lit, scale = running.scatter_total, running.ever_lit, running.scale
    share = 1.0 / running.count
    rest = 1.0 - share
    n_bounces, n_cells, n_elements = flux.shape[1:]
    for b in range(n_bounces):
        albedo[w, b] = 0.0
    for cell in range(n_cells):
        lit = False
        for b in range(n_bounces):
            if not ever_lit[b, cell]:
                continue
            if not lit:
                lit = True
                for e in range(n_elements):
                    room[e] = 0.0
            albedo[w, b] += flux[slot, b, cell, 0] * scale
            for e in range(n_elements):
                change = flux[slot, b, cell, e] * scale - mean[w, b, cell, e]
                flux[slot, b, cell, e] = 0.0
                room[e] += change
                mean[w, b, cell, e] += change * share
                scatter[w, b, cell, e] += change * change * rest
        if lit:
            for e in range(n_elements):
                scatter_total[w, cell, e] += room[e] * room[e] * rest


@jit(allocates=False)
def add_sample(flux, room, running):
    """Add a tally (wavelengths, bounces, bins, elements) and clear it."""
    for w in range(flux.shape[0]):
        add_wavelength(flux, w, w, room, running)


@jit(allocates=False)
def fold_lit(lit):
    """Say of the mirror images (bounces, n_theta, n_dphi) of lit bins that they are lit."""
    n_dphi = lit.shape[2]
    for b in range(lit.shape[0]):
        for i in range(lit.shape[1]):
            for j in range(n_dphi // 2 + 1):
                other = (n_dphi - j) % n_dphi
                lit[b, i, j] = lit[b, i, other] = lit[b, i, j] or lit[b, i, other]


@jit(forceinline=True)
def fold_wavelength(flux, slot, lit):
    """Average slot `slot` of a tally with its mirror image in the plane of incidence.

    There dphi changes its sign, and so do the elements that couple (I, Q) and (U, V). The
    tally is (slots, bounces, n_theta, n_dphi, stokes, stokes), `lit` as from `fold_lit`.
    """
    n_dphi = flux.shape[3]
    for b in range(flux.shape[1]):
        for i in range(flux.shape[2]):
            for j in range(n_dphi // 2 + 1):
                if not lit[b, i, j]:
                    continue
                other = (n_dphi - j) % n_dphi
                for row in range(flux.shape[4]):
                    for column in range(flux.shape[5]):
                        sign = 1.0 if (row < 2) == (column < 2) else -1.0
                        here = flux[slot, b, i, j, row, column]
                        there = flux[slot, b, i, other, row, column]
                        here = 0.5 * (here + sign * there)
                        flux[slot, b, i, j, row, column] = here
                        flux[slot, b, i, other, row, column] = sign * here


@jit(allocates=False)
def fold_sample(flux, lit):
    """Average a tally of all wavelengths with its mirror image."""
    for w in range(flux.shape[0]):
        fold_wavelength(flux, w, lit)

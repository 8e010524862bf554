"""Light of many wavelengths from one set of paths: sums by bin, shaded afterwards.

The Mueller matrix of a path with one bounce is R(out) F(beta) R(in), paper eq. (16). Its
elements are products of the turns, which the geometry gives, with A, B, C or D, which the
wavelength gives as smooth functions of x = cos(beta); and all light that one bounce sends
from the source into a bin has nearly the same x. So a bin keeps the sums of the turns and
of their products, times the powers of (x - mid) / half, and every wavelength follows from
them with the polynomials that go through its A, B, C and D at the Chebyshev points of the
bin. `pbrdf.kernels.bin_fits` finds how many powers each bin needs; a bin for which its
MAX_ORDER do not suffice gets none, and its paths are shaded one by one.

Paths of several bounces wait in a buffer and are shaded together, wavelength by wavelength,
so that the tally of one stays in the cache.
"""

from collections import namedtuple

from pbrdf.kernels import jit
from pbrdf.kernels.binning import bin_of_direction
from pbrdf.kernels.fresnel_table import table_elements
from pbrdf.kernels.shading import (
    ABSORBED,
    COS_IN,
    COS_OUT,
    LABEL,
    N_ESCAPED,
    N_ORDERS,
    N_RECORD,
    N_SIDE,
    SPECULAR,
    TURN_C,
    TURN_S,
    add_light,
    begin_columns,
    lost_energy,
    reflect_column,
    reflect_often,
    reflect_twice,
    turn_columns,
)

N_SUMS = 9  # 1, c_in, s_in, c_out, s_out, and the four products of an in and an out
# Columns of a bin: first of its sums, powers kept, middle and inverse half range of x
BIN_START, BIN_ORDER, BIN_MID, BIN_SCALE, N_BIN = 0, 1, 2, 3, 4
# First row of a path in the buffer, before its records: fate, bounces, bin
P_END, P_BOUNCES, P_THETA, P_DPHI = 0, 1, 2, 3

# bins (n_theta, n_dphi, N_BIN); sums (materials, size), of no size where every path is
# shaded at once; paths, a buffer, and fill (1,), how much of it is in use; the
# `FresnelTable`; points and powers: Chebyshev points (MAX_ORDER + 1, MAX_ORDER) and the
# matrices from values there to the factors of the powers; room for elements at the
# points
Spectra = namedtuple("Spectra", "bins sums paths fill table points powers factors")


@jit(forceinline=True)
def add_bounce(record, ray, i_theta, i_dphi, n_stokes, spectra):
    """Add the turns of a path with one bounce to the sums of its bin."""
    bins, sums = spectra.bins, spectra.sums
    m = int(record[0, ray, LABEL])
    at = int(bins[i_theta, i_dphi, BIN_START])
    t = (record[0, ray, COS_IN] - bins[i_theta, i_dphi, BIN_MID]) * bins[
        i_theta, i_dphi, BIN_SCALE
    ]
    order = int(bins[i_theta, i_dphi, BIN_ORDER])
    power = 1.0
    if n_stokes == 1:
        for k in range(order):
            sums[m, at + k] += power
            power *= t
        return
    c_in = record[0, ray, TURN_C]
    s_in = record[0, ray, TURN_S]
    c_out = record[1, ray, TURN_C]
    s_out = record[1, ray, TURN_S]
    cc = c_in * c_out
    cs = c_in * s_out
    sc = s_in * c_out
    ss = s_in * s_out
    for _ in range(order):
        sums[m, at] += power
        sums[m, at + 1] += power * c_in
        sums[m, at + 2] += power * s_in
        sums[m, at + 3] += power * c_out
        sums[m, at + 4] += power * s_out
        sums[m, at + 5] += power * cc
        sums[m, at + 6] += power * cs
        sums[m, at + 7] += power * sc
        sums[m, at + 8] += power * ss
        at += N_SUMS
        power *= t


@jit(forceinline=True)
def keep_path(end, record, ray, bounces, i_theta, i_dphi, spectra, optics, tally):
    """Put a path into the buffer; make room first if it is full."""
    paths, fill = spectra.paths, spectra.fill
    if fill[0] + bounces + 2 > paths.shape[0]:
        shade_paths(spectra, optics, tally)
    row = fill[0]
    paths[row, 0, P_END] = end
    paths[row, 0, P_BOUNCES] = bounces
    paths[row, 0, P_THETA] = i_theta
    paths[row, 0, P_DPHI] = i_dphi
    for bounce in range(bounces + 1):
        row += 1
        for column in range(N_RECORD):
            paths[row, 0, column] = record[bounce, ray, column]
    fill[0] = row + 1


@jit(forceinline=True)
def gather_path(
    end, record, ray, bounces, k_x, k_y, k_z, cos_phi_i, sin_phi_i, spectra, optics, tally
):  # fmt: skip
    """Count a path and keep what all wavelengths need of it; see `shading.tally_path`."""
    tally.counts[end] += 1
    if end != N_ESCAPED:
        if end != N_SIDE or optics.base.shape[1] > 0:
            keep_path(end, record, ray, bounces, 0, 0, spectra, optics, tally)
        return
    i_theta, i_dphi = bin_of_direction(
        k_x, k_y, k_z, cos_phi_i, sin_phi_i, tally.zenith, tally.azimuth
    )
    tally.counts[N_ORDERS + min(bounces, tally.flux.shape[1]) - 1] += 1
    once = bounces == 1 and record[0, ray, COS_OUT] == SPECULAR
    if once and spectra.bins[i_theta, i_dphi, BIN_ORDER] > 0.0:
        add_bounce(record, ray, i_theta, i_dphi, optics.n_stokes, spectra)
    else:
        keep_path(end, record, ray, bounces, i_theta, i_dphi, spectra, optics, tally)


@jit(forceinline=True)
def mirror_path(paths, row, bounces, w, table, n_stokes, mueller):
    """Mueller matrix of a path of mirror reflections alone, with tabulated elements.

    Returns False where the path left from a diffuse base; its matrix is then not computed.
    """
    for bounce in range(bounces):
        if paths[row + bounce, 0, COS_OUT] != SPECULAR:
            return False
    if bounces == 2:
        a, b, c, d = table_elements(
            table, w, int(paths[row, 0, LABEL]), paths[row, 0, COS_IN]
        )
        a2, b2, c2, d2 = table_elements(
            table, w, int(paths[row + 1, 0, LABEL]), paths[row + 1, 0, COS_IN]
        )
        reflect_twice(
            a, b, c, d, a2, b2, c2, d2,
            paths[row, 0, TURN_C], paths[row, 0, TURN_S],
            paths[row + 1, 0, TURN_C], paths[row + 1, 0, TURN_S],
            paths[row + 2, 0, TURN_C], paths[row + 2, 0, TURN_S], n_stokes, mueller,
        )  # fmt: skip
        return True
    begin_columns(n_stokes, mueller)
    for bounce in range(bounces):
        here = row + bounce
        turn_columns(paths[here, 0, TURN_C], paths[here, 0, TURN_S], n_stokes, mueller)
        a, b, c, d = table_elements(
            table, w, int(paths[here, 0, LABEL]), paths[here, 0, COS_IN]
        )
        for column in range(n_stokes):
            reflect_column(a, b, c, d, column, mueller)
    here = row + bounces
    turn_columns(paths[here, 0, TURN_C], paths[here, 0, TURN_S], n_stokes, mueller)
    return True


@jit(allocates=False)
def shade_paths(spectra, optics, tally):
    """Shade the paths of the buffer, wavelength by wavelength, and empty it."""
    paths, table = spectra.paths, spectra.table
    flux, energy, mueller = tally.flux, tally.energy, tally.mueller
    for w in range(energy.shape[0]):
        row = 0
        while row < spectra.fill[0]:
            end = int(paths[row, 0, P_END])
            bounces = int(paths[row, 0, P_BOUNCES])
            n_stokes = optics.n_stokes if end == N_ESCAPED else 1
            if not mirror_path(paths, row + 1, bounces, w, table, n_stokes, mueller):
                reflect_often(paths[row + 1 :], 0, bounces, w, optics, n_stokes, mueller)
            energy[w, ABSORBED] -= mueller[0, 0]
            if end != N_ESCAPED:
                energy[w, lost_energy(end)] += mueller[0, 0]
            else:
                i_theta = int(paths[row, 0, P_THETA])
                i_dphi = int(paths[row, 0, P_DPHI])
                order = min(bounces, flux.shape[1]) - 1
                add_light(mueller, n_stokes, flux, w, order, i_theta, i_dphi)
            row += bounces + 2
    spectra.fill[0] = 0


@jit(forceinline=True)
def sums_at_points(sums, m, at, order, n_sums, powers, room):
    """Turn the sums over powers of a bin into the weights of its Chebyshev points.

    The light of a wavelength is then the sum of its elements there times these weights.
    """
    for q in range(n_sums):
        for p in range(order):
            room[0, p] = 0.0
            for k in range(order):
                room[0, p] += powers[order, k, p] * sums[m, at + k * n_sums + q]
        for p in range(order):
            sums[m, at + p * n_sums + q] = room[0, p]


@jit(forceinline=True)
def is_lit(sums, m, at, order, n_sums):
    """Whether a path reached a bin: the weights of its points add up to their number."""
    paths = 0.0
    for p in range(order):
        paths += sums[m, at + p * n_sums]
    return paths > 0.5


@jit(forceinline=True)
def elements_at_points(mid, half, order, w, m, table, points, elements):
    """Elements A, B, C, D of one wavelength at the Chebyshev points of a bin."""
    for p in range(order):
        x = min(max(mid + half * points[order, p], 0.0), 1.0)
        elements[0, p], elements[1, p], elements[2, p], elements[3, p] = table_elements(
            table, w, m, x
        )


@jit(forceinline=True)
def shade_bin(w, m, i_theta, i_dphi, spectra, n_stokes, tally):
    """Add the light that one bounce on one material sends into a bin."""
    bins, sums, factors, flux = spectra.bins, spectra.sums, spectra.factors, tally.flux
    at = int(bins[i_theta, i_dphi, BIN_START])
    order = int(bins[i_theta, i_dphi, BIN_ORDER])
    m00 = 0.0
    if n_stokes == 1:
        for k in range(order):
            m00 += factors[0, k] * sums[m, at + k]
        flux[w, 0, i_theta, i_dphi, 0, 0] += m00
        tally.energy[w, ABSORBED] -= m00
        return
    m01 = m02 = m10 = m11 = m12 = m20 = m21 = m22 = 0.0
    m13 = m23 = m31 = m32 = m33 = 0.0
    for k in range(order):
        a, b, c, d = factors[0, k], factors[1, k], factors[2, k], factors[3, k]
        one, c_in, s_in = sums[m, at], sums[m, at + 1], sums[m, at + 2]
        c_out, s_out = sums[m, at + 3], sums[m, at + 4]
        cc, cs, sc, ss = (
            sums[m, at + 5], sums[m, at + 6], sums[m, at + 7], sums[m, at + 8],
        )  # fmt: skip
        # The sums of `shading.reflect_once`
        m00 += a * one
        m01 += b * c_in
        m02 += b * s_in
        m10 += b * c_out
        m11 += a * cc - c * ss
        m12 += a * sc + c * cs
        m20 -= b * s_out
        m21 -= a * cs + c * sc
        m22 += c * cc - a * ss
        m13 -= d * s_out
        m23 -= d * c_out
        m31 -= d * s_in
        m32 += d * c_in
        m33 += c * one
        at += N_SUMS
    flux[w, 0, i_theta, i_dphi, 0, 0] += m00
    flux[w, 0, i_theta, i_dphi, 0, 1] += m01
    flux[w, 0, i_theta, i_dphi, 0, 2] += m02
    flux[w, 0, i_theta, i_dphi, 1, 0] += m10
    flux[w, 0, i_theta, i_dphi, 1, 1] += m11
    flux[w, 0, i_theta, i_dphi, 1, 2] += m12
    flux[w, 0, i_theta, i_dphi, 2, 0] += m20
    flux[w, 0, i_theta, i_dphi, 2, 1] += m21
    flux[w, 0, i_theta, i_dphi, 2, 2] += m22
    if n_stokes == 4:
        flux[w, 0, i_theta, i_dphi, 1, 3] += m13
        flux[w, 0, i_theta, i_dphi, 2, 3] += m23
        flux[w, 0, i_theta, i_dphi, 3, 1] += m31
        flux[w, 0, i_theta, i_dphi, 3, 2] += m32
        flux[w, 0, i_theta, i_dphi, 3, 3] += m33
    tally.energy[w, ABSORBED] -= m00


@jit(allocates=False)
def shade_sums(spectra, optics, tally):
    """Shade what one bounce sent into each bin, for all wavelengths."""
    bins, sums = spectra.bins, spectra.sums
    n_theta, n_dphi = bins.shape[:2]
    n_sums = 1 if optics.n_stokes == 1 else N_SUMS
    for m in range(sums.shape[0]):
        for i in range(n_theta):
            for j in range(n_dphi):
                at = int(bins[i, j, BIN_START])
                order = int(bins[i, j, BIN_ORDER])
                if order > 0 and sums[m, at] > 0.0:
                    sums_at_points(
                        sums, m, at, order, n_sums, spectra.powers, spectra.factors
                    )
    for w in range(tally.energy.shape[0]):
        for m in range(sums.shape[0]):
            for i in range(n_theta):
                for j in range(n_dphi // 2 + 1):
                    # The bin on the other side of the plane of incidence has the same x
                    other = (n_dphi - j) % n_dphi
                    order = int(bins[i, j, BIN_ORDER])
                    here = is_lit(sums, m, int(bins[i, j, BIN_START]), order, n_sums)
                    there = is_lit(sums, m, int(bins[i, other, BIN_START]), order, n_sums)
                    if here or there:
                        elements_at_points(
                            bins[i, j, BIN_MID], 1.0 / bins[i, j, BIN_SCALE],
                            order, w, m, spectra.table, spectra.points,
                            spectra.factors,
                        )  # fmt: skip
                    if here:
                        shade_bin(w, m, i, j, spectra, optics.n_stokes, tally)
                    if there and other != j:
                        shade_bin(w, m, i, other, spectra, optics.n_stokes, tally)


@jit(allocates=False)
def shade_gathered(n_rays, spectra, optics, tally):
    """Shade all that was gathered of `n_rays` rays, and clear the sums.

    Each ray brings one unit of unpolarised light to every wavelength; without a diffuse
    base one that left sideways takes it back.
    """
    shade_paths(spectra, optics, tally)
    shade_sums(spectra, optics, tally)
    spectra.sums[:] = 0.0
    aside = tally.counts[N_SIDE] if optics.base.shape[1] == 0 else 0
    for w in range(tally.energy.shape[0]):
        tally.energy[w, ABSORBED] += n_rays - aside

"""Light of many wavelengths from one set of paths: sums by bin, shaded afterwards.

The Mueller matrix of a path with one bounce is R(out) F(beta) R(in), paper eq. (16). Its
elements are products of the turns, which the geometry gives, with A, B, C or D, which the
wavelength gives as smooth functions of x = cos(beta); and all light that one bounce sends
from the source into a bin has nearly the same x. So a bin keeps the sums of the turns and
of their products, times the powers of (x - mid) / half, and every wavelength follows from
them with the polynomials that go through its A, B, C and D at the Chebyshev points of the
bin. `pbrdf.kernels.bins.bin_fits` finds how many powers each bin needs; a bin for which its
MAX_ORDER do not suffice gets none, and its paths are shaded one by one.

Paths of several bounces wait in a buffer. When a sample has been traced its light is shaded
and added to the moments wavelength by wavelength, so that one tally, of one wavelength and
in the cache, serves all. A buffer that overflows is shaded into a tally of all of them.
"""

from collections import namedtuple

from pbrdf.kernels import jit
from pbrdf.kernels.bins.moments import add_wavelength, fold_wavelength
from pbrdf.kernels.optics.fresnel_table import table_elements
from pbrdf.kernels.paths.path_buffer import (
    OVERFLOWED,
    WITHOUT_SINGLE,
    keep_path,
    shade_paths,
)
from pbrdf.kernels.paths.shading import (
    ABSORBED,
    COS_IN,
    COS_OUT,
    LABEL,
    N_ESCAPED,
    N_ORDERS,
    N_SIDE,
    SPECULAR,
    TURN_C,
    TURN_S,
    tally_path,
)

N_SUMS = 9  # 1, c_in, s_in, c_out, s_out, and the four products of an in and an out
# Columns of a bin: first of its sums, powers kept, middle and inverse half range of x
BIN_START, BIN_ORDER, BIN_MID, BIN_SCALE, N_BIN = 0, 1, 2, 3, 4
# To shade in: flux (1 or wavelengths, bounces, n_theta, n_dphi, stokes, stokes), empty but
# for what has overflowed, and the same memory `by_bin` as `pbrdf.kernels.bins.moments`
# takes it; a matrix (4, 4), its elements (stokes ** 2,) and elements at points (4,
# MAX_ORDER)
Room = namedtuple("Room", "flux by_bin mueller matrix factors")
# bins (n_theta, n_dphi, N_BIN); sums (materials, size); paths and state (N_STATES,), the
# buffer of `pbrdf.kernels.paths.path_buffer`; the `FresnelTable`; points and powers:
# Chebyshev points (MAX_ORDER + 1, MAX_ORDER) and the matrices from values there to the
# factors of the powers; room for elements at the points
Spectra = namedtuple("Spectra", "bins sums paths state table points powers factors")


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
def gather_path(end, record, ray, bounces, i_theta, i_dphi, spectra, optics, tally):
    """Count a path and keep what all wavelengths need of it; see `shading.tally_path`."""
    tally.counts[end] += 1
    if end != N_ESCAPED:
        if end != N_SIDE or optics.base.shape[1] > 0:
            keep_path(end, record, ray, bounces, 0, 0, spectra, optics, tally)
        return
    order = min(bounces, tally.flux.shape[1]) - 1
    tally.counts[N_ORDERS + order] += 1
    tally.lit[order, i_theta, i_dphi] = True
    once = bounces == 1 and record[0, ray, COS_OUT] == SPECULAR
    if once and spectra.state[WITHOUT_SINGLE]:
        return
    if once and spectra.bins[i_theta, i_dphi, BIN_ORDER] > 0.0:
        add_bounce(record, ray, i_theta, i_dphi, optics.n_stokes, spectra)
    else:
        keep_path(end, record, ray, bounces, i_theta, i_dphi, spectra, optics, tally)


@jit(forceinline=True)
def begin_light(spectra, tally):
    """Add the unit of light of a ray that enters, to be taken from as it leaves."""
    if spectra is None:
        for w in range(tally.energy.shape[0]):
            tally.energy[w, ABSORBED] += 1.0


@jit(forceinline=True)
def end_light(spectra, end, record, ray, bounces, i_theta, i_dphi, optics, tally):
    """Tally a path at once, or with `Spectra` gather it to be shaded afterwards."""
    if spectra is None:
        tally_path(end, record, ray, bounces, i_theta, i_dphi, optics, tally)
    else:
        gather_path(end, record, ray, bounces, i_theta, i_dphi, spectra, optics, tally)


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


@jit(allocates=False)
def close_sums(spectra, n_stokes, lit):
    """Make the sums of a whole sample ready for shading."""
    bins, sums = spectra.bins, spectra.sums
    n_sums = 1 if n_stokes == 1 else N_SUMS
    for m in range(sums.shape[0]):
        for i in range(bins.shape[0]):
            for j in range(bins.shape[1]):
                order = int(bins[i, j, BIN_ORDER])
                if order > 0 and lit[0, i, j]:
                    sums_at_points(
                        sums, m, int(bins[i, j, BIN_START]), order, n_sums,
                        spectra.powers, spectra.factors,
                    )  # fmt: skip


@jit(forceinline=True)
def elements_at_points(mid, half, order, w, m, table, points, elements):
    """Elements A, B, C, D of one wavelength at the Chebyshev points of a bin."""
    for p in range(order):
        x = min(max(mid + half * points[order, p], 0.0), 1.0)
        elements[0, p], elements[1, p], elements[2, p], elements[3, p] = table_elements(
            table, w, m, x
        )


@jit(forceinline=True)
def shade_bin(slot, m, i_theta, i_dphi, spectra, factors, n_stokes, flux):
    """Add the light that one bounce on one material sends into a bin; return its M00."""
    bins, sums = spectra.bins, spectra.sums
    at = int(bins[i_theta, i_dphi, BIN_START])
    order = int(bins[i_theta, i_dphi, BIN_ORDER])
    m00 = 0.0
    if n_stokes == 1:
        for k in range(order):
            m00 += factors[0, k] * sums[m, at + k]
        flux[slot, 0, i_theta, i_dphi, 0, 0] += m00
        return m00
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
    flux[slot, 0, i_theta, i_dphi, 0, 0] += m00
    flux[slot, 0, i_theta, i_dphi, 0, 1] += m01
    flux[slot, 0, i_theta, i_dphi, 0, 2] += m02
    flux[slot, 0, i_theta, i_dphi, 1, 0] += m10
    flux[slot, 0, i_theta, i_dphi, 1, 1] += m11
    flux[slot, 0, i_theta, i_dphi, 1, 2] += m12
    flux[slot, 0, i_theta, i_dphi, 2, 0] += m20
    flux[slot, 0, i_theta, i_dphi, 2, 1] += m21
    flux[slot, 0, i_theta, i_dphi, 2, 2] += m22
    if n_stokes == 4:
        flux[slot, 0, i_theta, i_dphi, 1, 3] += m13
        flux[slot, 0, i_theta, i_dphi, 2, 3] += m23
        flux[slot, 0, i_theta, i_dphi, 3, 1] += m31
        flux[slot, 0, i_theta, i_dphi, 3, 2] += m32
        flux[slot, 0, i_theta, i_dphi, 3, 3] += m33
    return m00


@jit(forceinline=True)
def shade_sums(w, spectra, n_stokes, lit, flux, slot, factors):
    """Add the light that one bounce sent into each bin at wavelength w; return its M00."""
    bins = spectra.bins
    n_theta, n_dphi = bins.shape[:2]
    m00 = 0.0
    for m in range(spectra.sums.shape[0]):
        for i in range(n_theta):
            for j in range(n_dphi // 2 + 1):
                # The bin on the other side of the plane of incidence has the same x
                other = (n_dphi - j) % n_dphi
                if not (lit[0, i, j] or lit[0, i, other]):
                    continue
                elements_at_points(
                    bins[i, j, BIN_MID], 1.0 / bins[i, j, BIN_SCALE],
                    int(bins[i, j, BIN_ORDER]), w, m, spectra.table, spectra.points,
                    factors,
                )  # fmt: skip
                if lit[0, i, j]:
                    m00 += shade_bin(slot, m, i, j, spectra, factors, n_stokes, flux)
                if lit[0, i, other] and other != j:
                    m00 += shade_bin(slot, m, i, other, spectra, factors, n_stokes, flux)
    return m00


@jit(allocates=False)
def add_spectrum(first, last, n_units, spectra, optics, fold, lit, energy, room, running):
    """Shade a sample at wavelengths [first, last) and add it to their running moments.

    n_units         rays that brought one unit of unpolarised light to every wavelength
    lit             whether paths of the sample came to a bin (bounces, n_theta, n_dphi)
    energy          of the sample (wavelengths, N_ENERGIES), completed
    room            `Room`
    running         `pbrdf.kernels.bins.moments.Running`
    """
    for w in range(first, last):
        slot = w if spectra.state[OVERFLOWED] else 0
        shade_paths(w, spectra, optics, room.flux, slot, energy, room.mueller)
        single = shade_sums(w, spectra, optics.n_stokes, lit, room.flux, slot, room.factors)
        energy[w, ABSORBED] += n_units - single
        if fold:
            fold_wavelength(room.flux, slot, lit)
        add_wavelength(room.by_bin, slot, w, room.matrix, running)


@jit(allocates=False)
def shade_kept(w, slot, spectra, optics, energy, room):
    """Shade the paths of a sample that wait, at one wavelength, into a slot of the flux.

    energy          of the sample (wavelengths, N_ENERGIES), completed but for what comes of
                    single bounces
    """
    shade_paths(w, spectra, optics, room.flux, slot, energy, room.mueller)

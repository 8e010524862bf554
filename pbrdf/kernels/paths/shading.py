"""Mueller matrix of a recorded path, and its place in the tally.

A path is recorded bounce by bounce: the turn of the frame into the plane of incidence, the
cosine of incidence, for a scattering by the base under the interface the cosine of exit,
and the label of the material; the last record holds the turn into the frame of the exit
direction. Wavelengths share one record. Records of many rays lie in one array (bounces + 1,
rays, columns); `ray` is the one at hand. (Elements are read one by one: a slice would cost
more than the arithmetic on it.)
"""

from collections import namedtuple

from pbrdf.kernels import jit
from pbrdf.kernels.optics.fresnel import reflection_elements, transmission_elements
from pbrdf.kernels.optics.light import reflected, returned, turned
from pbrdf.kernels.optics.volume import internal_reflectance

# The substrate: index and `base_strength` by (wavelength, material), base of no width where
# nothing is diffuse; n_stokes is 4 for (I, Q, U, V), 3 without V, 1 for I alone
Optics = namedtuple("Optics", "n kappa base n_stokes")
# The tally: `bin_edges`; flux by bin (wavelengths, bounces, n_theta, n_dphi, stokes,
# stokes); lit, whether a path came there (bounces, n_theta, n_dphi); energy (wavelengths,
# N_ENERGIES); counts (N_COUNTS,); room for one matrix (4, 4); cones that take the place of
# the bins, a `pbrdf.kernels.bodies.detectors.Cones` or None
Tally = namedtuple(
    "Tally", "zenith azimuth flux lit energy counts mueller cones", defaults=(None,)
)

# Columns of a record
TURN_C, TURN_S, COS_IN, COS_OUT, LABEL, N_RECORD = 0, 1, 2, 3, 4, 5
SPECULAR = -1.0  # in COS_OUT: mirror reflection
# In the last record of a path over a diffuse base, as for how many like it the path stands
WEIGHT = COS_IN

# What became of the rays of a sample, the path segments they took, and the hits of a facet
# just left (impossible but for rounding inside the intersector)
N_ESCAPED, N_TRUNCATED, N_LEAKED, N_SIDE, N_SEGMENTS, N_SELF = 0, 1, 2, 3, 4, 5
N_ORDERS = 6  # then the escaped paths by class of bounces
# Beams that were inside of a body without having entered it
N_MISMATCH = 9
# On meshes: paths that left below bodies, and exact searches for a facet
N_BELOW, N_EXACT, N_COUNTS = 10, 11, 12
# Energies of unpolarised light
ABSORBED, TRUNCATED, LEAKED, SIDEWAYS, TRANSMITTED, N_ENERGIES = 0, 1, 2, 3, 4, 5


@jit
def base_strength(albedo, n, kappa):
    """Factor albedo / (n² (1 - albedo F_i)) of the two transmittances of a diffuse base.

    A Lambertian base spreads its light over n² times the solid angle outside and gets back
    the share F_i that the interface throws back; times cos(exit) / pi it is the BRDF.
    """
    if albedo == 0.0:
        return 0.0
    return albedo / (n * n * (1.0 - albedo * internal_reflectance(n, kappa)))


@jit(forceinline=True)
def reflect_once(elements, turn_in, turn_out, n_stokes, mueller):
    """Mueller matrix R(out) F(beta) R(in) of a path with one bounce, paper eq. (16)."""
    a, b, c, d = elements
    c_in, s_in = turn_in
    c_out, s_out = turn_out
    mueller[0, 0] = a
    if n_stokes == 1:
        return
    mueller[0, 1] = b * c_in
    mueller[0, 2] = b * s_in
    mueller[1, 0] = c_out * b
    mueller[1, 1] = c_out * a * c_in - s_out * c * s_in
    mueller[1, 2] = c_out * a * s_in + s_out * c * c_in
    mueller[2, 0] = -s_out * b
    mueller[2, 1] = -s_out * a * c_in - c_out * c * s_in
    mueller[2, 2] = -s_out * a * s_in + c_out * c * c_in
    if n_stokes == 4:
        mueller[0, 3] = 0.0
        mueller[1, 3] = -s_out * d
        mueller[2, 3] = -c_out * d
        mueller[3, 0] = 0.0
        mueller[3, 1] = -d * s_in
        mueller[3, 2] = d * c_in
        mueller[3, 3] = c


@jit(forceinline=True)
def reflect_twice(first, second, turn_1, turn_2, turn_3, n_stokes, mueller):
    """Mueller matrix R(3) F(beta_2) R(2) F(beta_1) R(1) of a path with two bounces."""
    a1, b1, c1, d1 = first
    a2, b2, c2, d2 = second
    cos1, sin1 = turn_1
    cos2, sin2 = turn_2
    cos3, sin3 = turn_3
    # Into the second facet's frame, and reflected by it
    ca, cb = cos2 * a1, cos2 * b1
    mueller[0, 0] = a2 * a1 + b2 * cb
    if n_stokes == 1:
        return
    sa, sb, cc, cd = sin2 * a1, sin2 * b1, cos2 * c1, cos2 * d1
    sc, sd = sin2 * c1, sin2 * d1
    y01, y02 = a2 * b1 + b2 * ca, b2 * sc
    y10, y11, y12 = b2 * a1 + a2 * cb, b2 * b1 + a2 * ca, a2 * sc
    y20, y21, y22 = -c2 * sb, -c2 * sa, c2 * cc - d2 * d1
    # Out of the second frame into the exit frame, into the first from the source's
    z10, z20 = cos3 * y10 + sin3 * y20, cos3 * y20 - sin3 * y10
    z11, z21 = cos3 * y11 + sin3 * y21, cos3 * y21 - sin3 * y11
    z12, z22 = cos3 * y12 + sin3 * y22, cos3 * y22 - sin3 * y12
    mueller[0, 1] = cos1 * y01 - sin1 * y02
    mueller[0, 2] = sin1 * y01 + cos1 * y02
    mueller[1, 0] = z10
    mueller[1, 1] = cos1 * z11 - sin1 * z12
    mueller[1, 2] = sin1 * z11 + cos1 * z12
    mueller[2, 0] = z20
    mueller[2, 1] = cos1 * z21 - sin1 * z22
    mueller[2, 2] = sin1 * z21 + cos1 * z22
    if n_stokes == 4:
        y13, y23 = -a2 * sd, -c2 * cd - d2 * c1
        y31, y32 = -d2 * sa, d2 * cc + c2 * d1
        mueller[0, 3] = -b2 * sd
        mueller[1, 3] = cos3 * y13 + sin3 * y23
        mueller[2, 3] = cos3 * y23 - sin3 * y13
        mueller[3, 0] = -d2 * sb
        mueller[3, 1] = cos1 * y31 - sin1 * y32
        mueller[3, 2] = sin1 * y31 + cos1 * y32
        mueller[3, 3] = c2 * c1 - d2 * cd


@jit(forceinline=True)
def reflect_columns(elements, n_stokes, mueller):
    """Reflect all columns of a matrix."""
    for column in range(n_stokes):
        (
            mueller[0, column], mueller[1, column], mueller[2, column], mueller[3, column],
        ) = reflected(
            elements, mueller[0, column], mueller[1, column], mueller[2, column],
            mueller[3, column],
        )  # fmt: skip


@jit(forceinline=True)
def scatter_columns(strength, a_in, b_in, a_out, b_out, n_stokes, mueller):
    """Send all columns of a matrix through the base and back."""
    for column in range(n_stokes):
        mueller[0, column], mueller[1, column] = returned(
            strength, a_in, b_in, a_out, b_out, mueller[0, column], mueller[1, column]
        )
        mueller[2, column] = 0.0
        mueller[3, column] = 0.0


@jit(forceinline=True)
def turn_columns(turn, n_stokes, mueller):
    """Turn the frame of all columns of a matrix."""
    c2, s2 = turn
    for column in range(n_stokes):
        mueller[1, column], mueller[2, column] = turned(
            c2, s2, mueller[1, column], mueller[2, column]
        )


@jit(forceinline=True)
def turn_at(record, bounce, ray):
    """Cosine and sine of the turn before a bounce."""
    return record[bounce, ray, TURN_C], record[bounce, ray, TURN_S]


@jit(forceinline=True)
def begin_columns(n_stokes, mueller):
    """Begin with the unit matrix: light as it comes from the source."""
    for row in range(4):
        for column in range(n_stokes):
            mueller[row, column] = 1.0 if row == column else 0.0


@jit(part=True, allocates=False)
def reflect_often(record, ray, bounces, w, optics, n_stokes, mueller):
    """Mueller matrix of a path of any length, all its columns side by side."""
    n, kappa, base = optics.n, optics.kappa, optics.base
    begin_columns(n_stokes, mueller)
    for bounce in range(bounces + 1):
        # Into the frame of the facet, or after the last bounce of the exit direction
        turn_columns(turn_at(record, bounce, ray), n_stokes, mueller)
        if bounce == bounces:
            break
        cos_in = record[bounce, ray, COS_IN]
        cos_out = record[bounce, ray, COS_OUT]
        m = int(record[bounce, ray, LABEL])
        if cos_out == SPECULAR:
            elements = reflection_elements(cos_in, n[w, m], kappa[w, m])
            reflect_columns(elements, n_stokes, mueller)
        else:
            a_in, b_in, _, _ = transmission_elements(cos_in, n[w, m], kappa[w, m])
            a_out, b_out, _, _ = transmission_elements(cos_out, n[w, m], kappa[w, m])
            scatter_columns(base[w, m], a_in, b_in, a_out, b_out, n_stokes, mueller)


@jit(forceinline=True)
def elements_at(record, bounce, ray, w, optics):
    """Elements of the mirror reflection of a bounce."""
    m = int(record[bounce, ray, LABEL])
    return reflection_elements(
        record[bounce, ray, COS_IN], optics.n[w, m], optics.kappa[w, m]
    )


@jit(forceinline=True)
def path_mueller(record, ray, bounces, w, optics, n_stokes, mueller):
    """Mueller matrix of a path, by the closed form where it has one mirror reflection."""
    if bounces == 1 and record[0, ray, COS_OUT] == SPECULAR:
        reflect_once(
            elements_at(record, 0, ray, w, optics),
            turn_at(record, 0, ray), turn_at(record, 1, ray), n_stokes, mueller,
        )  # fmt: skip
    elif bounces == 2 and record[0, ray, COS_OUT] == SPECULAR == record[1, ray, COS_OUT]:
        reflect_twice(
            elements_at(record, 0, ray, w, optics), elements_at(record, 1, ray, w, optics),
            turn_at(record, 0, ray), turn_at(record, 1, ray), turn_at(record, 2, ray),
            n_stokes, mueller,
        )  # fmt: skip
    else:
        reflect_often(record, ray, bounces, w, optics, n_stokes, mueller)


@jit(forceinline=True)
def weigh(weight, optics, n_stokes, mueller):
    """Multiply a matrix by the weight of its path, which only a diffuse base gives it."""
    if optics.base.shape[1] > 0 and weight != 1.0:
        for row in range(n_stokes):
            for column in range(n_stokes):
                mueller[row, column] *= weight


@jit(forceinline=True)
def lost_energy(end):
    """Column of the energy of a path that did not escape."""
    if end == N_TRUNCATED:
        return TRUNCATED
    if end == N_BELOW:
        return TRANSMITTED
    return SIDEWAYS if end == N_SIDE else LEAKED


@jit(forceinline=True)
def add_light(mueller, n_stokes, flux, w, order, i_theta, i_dphi):
    """Add a Mueller matrix to its bin."""
    # Loops of known length: the compiler unrolls them
    if n_stokes == 4:
        for row in range(4):
            for column in range(4):
                flux[w, order, i_theta, i_dphi, row, column] += mueller[row, column]
    elif n_stokes == 3:
        for row in range(3):
            for column in range(3):
                flux[w, order, i_theta, i_dphi, row, column] += mueller[row, column]
    else:
        flux[w, order, i_theta, i_dphi, 0, 0] += mueller[0, 0]


@jit(forceinline=True)
def tally_path(end, record, ray, bounces, i_theta, i_dphi, optics, tally):
    """Count a path and add its light to its bin, or to what was lost.

    `end` is one of the N_ constants; only with N_ESCAPED is the bin looked at. ABSORBED
    falls by what the path still carries: one unit for each ray that enters is added
    elsewhere. Without a diffuse base a ray is one path, and one that leaves a finite map
    sideways takes its unit back: it belongs to neither part of the fraction.
    """
    flux, energy, mueller = tally.flux, tally.energy, tally.mueller
    n_stokes = optics.n_stokes
    tally.counts[end] += 1
    if end == N_SIDE and optics.base.shape[1] == 0:
        for w in range(energy.shape[0]):
            energy[w, ABSORBED] -= 1.0
        return
    if end != N_ESCAPED:
        lost = lost_energy(end)
        for w in range(energy.shape[0]):
            path_mueller(record, ray, bounces, w, optics, 1, mueller)
            weigh(record[bounces, ray, WEIGHT], optics, 1, mueller)
            energy[w, ABSORBED] -= mueller[0, 0]
            energy[w, lost] += mueller[0, 0]
        return
    order = min(bounces, flux.shape[1]) - 1
    tally.counts[N_ORDERS + order] += 1
    tally.lit[order, i_theta, i_dphi] = True
    for w in range(energy.shape[0]):
        path_mueller(record, ray, bounces, w, optics, n_stokes, mueller)
        weigh(record[bounces, ray, WEIGHT], optics, n_stokes, mueller)
        energy[w, ABSORBED] -= mueller[0, 0]
        add_light(mueller, n_stokes, flux, w, order, i_theta, i_dphi)

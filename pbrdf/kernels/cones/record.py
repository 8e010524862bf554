"""Mueller matrix of a path between two cones, in the frames of the instrument.

Records are those of `pbrdf.kernels.paths.shading`; the last turn is into the frame of the
polariser at the target.
"""

from collections import namedtuple

from pbrdf.kernels import jit
from pbrdf.kernels.cones.lens import carried_axis
from pbrdf.kernels.optics.frames import turn_frame
from pbrdf.kernels.optics.fresnel import reflection_elements, transmission_elements
from pbrdf.kernels.paths.shading import (
    COS_IN,
    COS_OUT,
    LABEL,
    LEAKED,
    N_BELOW,
    N_SIDE,
    N_TRUNCATED,
    SIDEWAYS,
    SPECULAR,
    TRANSMITTED,
    TRUNCATED,
    TURN_C,
    TURN_S,
    reflect_column,
    scatter_column,
)

# What is caught: flux (3, targets, bounces, wavelengths, stokes, stokes) of all paths, of
# glints, and the variance of glints that near misses foretell; paths caught (2, targets,
# bounces), all and glints; energy (wavelengths, N_ENERGIES), counts (N_COUNTS,) and room
# (4, 4)
Catch = namedtuple("Catch", "flux caught energy counts mueller")
ALL, GLINTS, FORETOLD = 0, 1, 2
# Columns of a target's axes over one line of bundles: direction, horizontal s axis
A_X, A_Y, A_Z, A_SX, A_SY, N_AXES = 0, 1, 2, 3, 4, 5


@jit(allocates=False)
def chain_mueller(record, bounces, w, optics, n_stokes, mueller):
    """Mueller matrix of a recorded path, all its columns side by side."""
    for row in range(4):
        for column in range(n_stokes):
            mueller[row, column] = 1.0 if row == column else 0.0
    for step in range(bounces + 1):
        # Into the frame of the facet, or after the last bounce of the instrument
        c2 = record[step, 0, TURN_C]
        s2 = record[step, 0, TURN_S]
        for column in range(n_stokes):
            q = mueller[1, column]
            u = mueller[2, column]
            mueller[1, column] = c2 * q + s2 * u
            mueller[2, column] = c2 * u - s2 * q
        if step == bounces:
            break
        cos_in = record[step, 0, COS_IN]
        cos_out = record[step, 0, COS_OUT]
        m = int(record[step, 0, LABEL])
        n = optics.n[w, m]
        kappa = optics.kappa[w, m]
        if cos_out == SPECULAR:
            a, b, c, d = reflection_elements(cos_in, n, kappa)
            for column in range(n_stokes):
                reflect_column(a, b, c, d, column, mueller)
        else:
            a_in, b_in, _, _ = transmission_elements(cos_in, n, kappa)
            a_out, b_out, _, _ = transmission_elements(cos_out, n, kappa)
            strength = optics.base[w, m]
            for column in range(n_stokes):
                scatter_column(strength, a_in, b_in, a_out, b_out, column, mueller)


@jit(inline="always")
def end_path(target, axes, record, bounces, k_x, k_y, k_z, s_x, s_y, s_z):
    """Turn the frame of a path that leaves along k to that of the polariser of a target."""
    t_x, t_y, t_z = carried_axis(
        axes[target, A_X], axes[target, A_Y], axes[target, A_Z],
        axes[target, A_SX], axes[target, A_SY], k_x, k_y, k_z,
    )  # fmt: skip
    record[bounces, 0, TURN_C], record[bounces, 0, TURN_S] = turn_frame(
        k_x, k_y, k_z, s_x, s_y, s_z, t_x, t_y, t_z
    )


@jit(allocates=False)
def catch_path(
    weight, target, axes, record, bounces, k_x, k_y, k_z, s_x, s_y, s_z, optics, catch
):  # fmt: skip
    """Add a path that leaves along k, in the frame of the polariser of a target."""
    end_path(target, axes, record, bounces, k_x, k_y, k_z, s_x, s_y, s_z)
    order = min(bounces, catch.flux.shape[2]) - 1
    catch.caught[ALL, target, order] += 1
    for w in range(catch.flux.shape[3]):
        chain_mueller(record, bounces, w, optics, optics.n_stokes, catch.mueller)
        for row in range(optics.n_stokes):
            for column in range(optics.n_stokes):
                catch.flux[ALL, target, order, w, row, column] += (
                    weight * catch.mueller[row, column]
                )


@jit(allocates=False)
def catch_glint(
    weight, share, chance, target, axes, record, bounces, k_x, k_y, k_z, s_x, s_y, s_z,
    optics, catch,
):  # fmt: skip
    """Add a path that may have met the target by luck, and what others like it might add.

    share       part of the path's weight that the target gets
    chance      mean of its square over all places where the path might have passed as near
    """
    end_path(target, axes, record, bounces, k_x, k_y, k_z, s_x, s_y, s_z)
    order = min(bounces, catch.flux.shape[2]) - 1
    if share > 0.0:
        catch.caught[ALL, target, order] += 1
        catch.caught[GLINTS, target, order] += 1
    for w in range(catch.flux.shape[3]):
        chain_mueller(record, bounces, w, optics, optics.n_stokes, catch.mueller)
        for row in range(optics.n_stokes):
            for column in range(optics.n_stokes):
                light = weight * catch.mueller[row, column]
                catch.flux[FORETOLD, target, order, w, row, column] += (
                    chance * light * light
                )
                light *= share
                catch.flux[ALL, target, order, w, row, column] += light
                catch.flux[GLINTS, target, order, w, row, column] += light


@jit(allocates=False)
def lose_path(weight, end, record, bounces, optics, catch):
    """Count a path that is not followed to its end, and the unpolarised light on it."""
    catch.counts[end] += 1
    lost = LEAKED
    if end == N_TRUNCATED:
        lost = TRUNCATED
    elif end == N_SIDE:
        lost = SIDEWAYS
    elif end == N_BELOW:
        lost = TRANSMITTED
    for w in range(catch.energy.shape[0]):
        record[bounces, 0, TURN_C] = 1.0
        record[bounces, 0, TURN_S] = 0.0
        chain_mueller(record, bounces, w, optics, 1, catch.mueller)
        catch.energy[w, lost] += weight * catch.mueller[0, 0]

"""Mueller matrix of a path between two cones, in the frames of the instrument.

Records are those of `pbrdf.kernels.paths.shading`; the last turn is into the frame of the
polariser at the target.
"""

from collections import namedtuple

from pbrdf.kernels import jit
from pbrdf.kernels.optics.frames import carried_axis, turn_frame
from pbrdf.kernels.optics.vectors import Vec
from pbrdf.kernels.paths.shading import TURN_C, TURN_S, lost_energy, reflect_often

# What is caught: flux (3, targets, bounces, wavelengths, stokes, stokes) of all paths, of
# glints, and the variance of glints that near misses foretell; paths caught (2, targets,
# bounces), all and glints; energy (wavelengths, N_ENERGIES), counts (N_COUNTS,) and room
# (4, 4)
Catch = namedtuple("Catch", "flux caught energy counts mueller")
ALL, GLINTS, FORETOLD = 0, 1, 2
# Columns of a target: sine and cosine of zenith, of azimuth from the bundle, of half-angle,
# cosine of the angle within which a path was near, and the mean square of what it adds then
T_SIN, T_COS, T_COS_PHI, T_SIN_PHI, T_COS_HALF, T_SIN_HALF = 0, 1, 2, 3, 4, 5
T_COS_NEAR, T_CHANCE, N_TARGET = 6, 7, 8
# Columns of a target's axes over one line of bundles: direction, horizontal s axis
A_X, A_Y, A_Z, A_SX, A_SY, N_AXES = 0, 1, 2, 3, 4, 5
# What bundles look for: targets (n, N_TARGET) and axes (n, N_AXES); record (bounces + 1, 1,
# N_RECORD) and hits (bounces, N_HIT), room to work in; optics, the `Rule`, and the `Catch`
Scan = namedtuple("Scan", "targets axes record hits optics rule catch")


@jit(forceinline=True)
def axis_of_target(scan, target):
    """Direction of a target and its horizontal s axis."""
    axes = scan.axes
    return (
        Vec(axes[target, A_X], axes[target, A_Y], axes[target, A_Z]),
        Vec(axes[target, A_SX], axes[target, A_SY], 0.0),
    )


@jit(forceinline=True)
def end_path(scan, target, bounces, k, s):
    """Turn the frame of a path that leaves along k to that of the polariser of a target."""
    axis, axis_s = axis_of_target(scan, target)
    record = scan.record
    record[bounces, 0, TURN_C], record[bounces, 0, TURN_S] = turn_frame(
        k, s, carried_axis(axis, axis_s, k)
    )


@jit(part=True, allocates=False)
def catch_path(weight, target, bounces, k, s, scan):
    """Add a path that leaves along k, in the frame of the polariser of a target."""
    end_path(scan, target, bounces, k, s)
    catch, optics = scan.catch, scan.optics
    flux, mueller = catch.flux, catch.mueller
    order = min(bounces, flux.shape[2]) - 1
    catch.caught[ALL, target, order] += 1
    for w in range(flux.shape[3]):
        reflect_often(scan.record, 0, bounces, w, optics, optics.n_stokes, mueller)
        for row in range(optics.n_stokes):
            for column in range(optics.n_stokes):
                flux[ALL, target, order, w, row, column] += weight * mueller[row, column]


@jit(part=True, allocates=False)
def catch_glint(weight, share, target, bounces, k, s, scan):
    """Add a path that may have met the target by luck, and what others like it might add.

    share       part of the path's weight that the target gets
    """
    end_path(scan, target, bounces, k, s)
    catch, optics = scan.catch, scan.optics
    flux, mueller = catch.flux, catch.mueller
    order = min(bounces, flux.shape[2]) - 1
    # Mean of its square over all places where the path might have passed as near
    chance = scan.targets[target, T_CHANCE]
    if share > 0.0:
        catch.caught[ALL, target, order] += 1
        catch.caught[GLINTS, target, order] += 1
    for w in range(flux.shape[3]):
        reflect_often(scan.record, 0, bounces, w, optics, optics.n_stokes, mueller)
        for row in range(optics.n_stokes):
            for column in range(optics.n_stokes):
                light = weight * mueller[row, column]
                flux[FORETOLD, target, order, w, row, column] += chance * light * light
                light *= share
                flux[ALL, target, order, w, row, column] += light
                flux[GLINTS, target, order, w, row, column] += light


@jit(part=True, allocates=False)
def lose_path(weight, end, bounces, scan):
    """Count a path that is not followed to its end, and the unpolarised light on it."""
    record, catch = scan.record, scan.catch
    catch.counts[end] += 1
    lost = lost_energy(end)
    for w in range(catch.energy.shape[0]):
        record[bounces, 0, TURN_C] = 1.0
        record[bounces, 0, TURN_S] = 0.0
        reflect_often(record, 0, bounces, w, scan.optics, 1, catch.mueller)
        catch.energy[w, lost] += weight * catch.mueller[0, 0]

"""Where a beam goes that has left the scene: a bin of the hemisphere, or some cones."""

from collections import namedtuple

from pbrdf.kernels import jit
from pbrdf.kernels.bins.binning import bin_of_direction
from pbrdf.kernels.bodies.beams import MUELLER
from pbrdf.kernels.bodies.interfaces import (
    axis_of_beam,
    set_axis,
    turn_columns,
    way_of_beam,
)
from pbrdf.kernels.cones.record import (
    A_SX,
    A_SY,
    A_X,
    A_Y,
    A_Z,
    T_CHANCE,
    T_COS_HALF,
    T_COS_NEAR,
)
from pbrdf.kernels.cones.targets import place_axes
from pbrdf.kernels.optics.frames import carried_axis, exit_turn, turn_frame
from pbrdf.kernels.optics.vectors import Vec, dot

# Cones of detectors: targets and axes as of `pbrdf.kernels.cones.record`; flux (2, targets,
# bounces, wavelengths, stokes, stokes) that is caught, and its variance as paths near the
# cone foretell it; paths caught (targets, bounces)
Cones = namedtuple("Cones", "targets axes flux caught")
CAUGHT, FORETOLD = 0, 1


@jit(forceinline=True)
def turn_cones(cones, beam):
    """Bring the cones, if there are any, round to the azimuth of the light of a line."""
    if cones is not None:
        place_axes(cones.targets, beam.cos_phi, beam.sin_phi, cones.axes)


@jit(forceinline=True)
def put_in_bin(state, top, columns, w, order, beam, tally):
    """Add the matrix of a beam to its bin, in the meridian frame of its direction."""
    k = way_of_beam(state, top)
    c2, s2 = exit_turn(k, axis_of_beam(state, top), beam.cos_phi, beam.sin_phi)
    turn_columns(state, top, columns, c2, s2)
    i_theta, i_dphi = bin_of_direction(
        k.x, k.y, k.z, beam.cos_phi, beam.sin_phi, tally.zenith, tally.azimuth
    )
    tally.lit[order, i_theta, i_dphi] = True
    for row in range(columns):
        for column in range(columns):
            tally.flux[w, order, i_theta, i_dphi, row, column] += state[
                top, MUELLER + 4 * row + column
            ]


@jit(forceinline=True)
def put_in_cones(state, top, columns, w, order, cones):
    """Add the matrix of a beam to the cones that it meets, in the frames of their axes."""
    targets, axes, flux, caught = cones
    k = way_of_beam(state, top)
    for target in range(targets.shape[0]):
        axis = Vec(axes[target, A_X], axes[target, A_Y], axes[target, A_Z])
        along = dot(k, axis)
        if along < targets[target, T_COS_NEAR]:
            continue
        s = carried_axis(axis, Vec(axes[target, A_SX], axes[target, A_SY], 0.0), k)
        c2, s2 = turn_frame(k, axis_of_beam(state, top), s)
        turn_columns(state, top, columns, c2, s2)
        set_axis(state, top, s)
        met = along >= targets[target, T_COS_HALF]
        if met and w == 0:
            caught[target, order] += 1
        for row in range(columns):
            for column in range(columns):
                light = state[top, MUELLER + 4 * row + column]
                flux[FORETOLD, target, order, w, row, column] += (
                    targets[target, T_CHANCE] * light * light
                )
                if met:
                    flux[CAUGHT, target, order, w, row, column] += light


@jit(forceinline=True)
def detect(state, top, columns, w, order, beam, tally, cones):
    """Add a beam to the cones, or where there are none to its bin; the compiler sees it."""
    if cones is None:
        put_in_bin(state, top, columns, w, order, beam, tally)
    if cones is not None:
        put_in_cones(state, top, columns, w, order, cones)

"""Paths of several bounces on their way to being shaded for many wavelengths.

They wait in the buffer of a `pbrdf.kernels.paths.spectra.Spectra`, which one that overflows
gives to the tally of all wavelengths.
"""

from pbrdf.kernels import jit
from pbrdf.kernels.optics.fresnel_table import table_elements
from pbrdf.kernels.paths.shading import (
    ABSORBED,
    COS_IN,
    COS_OUT,
    LABEL,
    N_ESCAPED,
    N_RECORD,
    SPECULAR,
    WEIGHT,
    add_light,
    begin_columns,
    lost_energy,
    reflect_columns,
    reflect_often,
    reflect_twice,
    turn_at,
    turn_columns,
    weigh,
)

# First row of a path in the buffer, before its records: fate, bounces, bin
P_END, P_BOUNCES, P_THETA, P_DPHI = 0, 1, 2, 3
# State of the buffer: rows in use, whether it has overflowed, and whether single bounces
# do not come from paths
FILL, OVERFLOWED, WITHOUT_SINGLE, N_STATES = 0, 1, 2, 3


@jit(forceinline=True)
def keep_path(end, record, ray, bounces, i_theta, i_dphi, spectra, optics, tally):
    """Put a path into the buffer; make room first if it is full."""
    paths, state = spectra.paths, spectra.state
    if state[FILL] + bounces + 2 > paths.shape[0]:
        empty_buffer(spectra, optics, tally)
    row = state[FILL]
    paths[row, 0, P_END] = end
    paths[row, 0, P_BOUNCES] = bounces
    paths[row, 0, P_THETA] = i_theta
    paths[row, 0, P_DPHI] = i_dphi
    for bounce in range(bounces + 1):
        row += 1
        for column in range(N_RECORD):
            paths[row, 0, column] = record[bounce, ray, column]
    state[FILL] = row + 1


@jit(forceinline=True)
def tabulated(paths, row, w, table):
    """Elements of the mirror reflection of a row."""
    return table_elements(table, w, int(paths[row, 0, LABEL]), paths[row, 0, COS_IN])


@jit(forceinline=True)
def mirror_path(paths, row, bounces, w, table, n_stokes, mueller):
    """Mueller matrix of a path of mirror reflections alone, with tabulated elements.

    Returns False where the path left from a diffuse base; its matrix is then not computed.
    """
    for bounce in range(bounces):
        if paths[row + bounce, 0, COS_OUT] != SPECULAR:
            return False
    if bounces == 2:
        reflect_twice(
            tabulated(paths, row, w, table), tabulated(paths, row + 1, w, table),
            turn_at(paths, row, 0), turn_at(paths, row + 1, 0), turn_at(paths, row + 2, 0),
            n_stokes, mueller,
        )  # fmt: skip
        return True
    begin_columns(n_stokes, mueller)
    for here in range(row, row + bounces):
        turn_columns(turn_at(paths, here, 0), n_stokes, mueller)
        reflect_columns(tabulated(paths, here, w, table), n_stokes, mueller)
    turn_columns(turn_at(paths, row + bounces, 0), n_stokes, mueller)
    return True


@jit(forceinline=True)
def shade_paths(w, spectra, optics, flux, slot, energy, mueller):
    """Shade the paths of the buffer for wavelength w, which is `slot` of the flux."""
    paths, table = spectra.paths, spectra.table
    row = 0
    while row < spectra.state[FILL]:
        end = int(paths[row, 0, P_END])
        bounces = int(paths[row, 0, P_BOUNCES])
        n_stokes = optics.n_stokes if end == N_ESCAPED else 1
        if not mirror_path(paths, row + 1, bounces, w, table, n_stokes, mueller):
            reflect_often(paths[row + 1 :], 0, bounces, w, optics, n_stokes, mueller)
        weigh(paths[row + 1 + bounces, 0, WEIGHT], optics, n_stokes, mueller)
        energy[w, ABSORBED] -= mueller[0, 0]
        if end != N_ESCAPED:
            energy[w, lost_energy(end)] += mueller[0, 0]
        else:
            i_theta = int(paths[row, 0, P_THETA])
            i_dphi = int(paths[row, 0, P_DPHI])
            order = min(bounces, flux.shape[1]) - 1
            add_light(mueller, n_stokes, flux, slot, order, i_theta, i_dphi)
        row += bounces + 2


@jit(part=True, allocates=False)
def empty_buffer(spectra, optics, tally):
    """Shade the paths of the buffer into the tally of all wavelengths."""
    if not spectra.state[OVERFLOWED]:
        tally.flux[:] = 0.0
        spectra.state[OVERFLOWED] = 1
    for w in range(tally.energy.shape[0]):
        shade_paths(w, spectra, optics, tally.flux, w, tally.energy, tally.mueller)
    spectra.state[FILL] = 0

"""A beam of light among transparent bodies, as one row of numbers.

A beam splits where it meets an interface; the parts that wait lie below the one at hand in
a stack of such rows.
"""

from collections import namedtuple

from pbrdf.kernels import jit

# Place, direction and s axis of the beam
X, Y, Z, KX, KY, KZ, SX, SY, SZ = 0, 1, 2, 3, 4, 5, 6, 7, 8
# Where it starts, and if on a facet: which, where in its cell and how fast it leaves
START, FACET, CELL_I, CELL_J, CELL_U, CELL_V, RATE = 9, 10, 11, 12, 13, 14, 15
# Events so far; the body just met, with its axis; the bodies it is inside of, likewise
EVENTS, LEFT, N_INSIDE, INSIDE = 16, 17, 20, 21
MAX_INSIDE = 8
# The real index along its path: that of the medium, and a little more in one that absorbs
INDEX = INSIDE + 3 * MAX_INSIDE
MUELLER = INDEX + 1  # its matrix, row after row
N_STATE = MUELLER + 16

FREE, ON_GROUND, ON_FILM, ON_BODY = 0, 1, 2, 3
NOTHING = -1.0
# Numbers among the bodies a beam is inside of: the film, and solids of a mesh from -17 down
FILM, FIRST_SOLID = -5.0, -16.0

# Room to work in: the stack (events + 2, N_STATE), what the next event is, and the first
# facets of the rays of a line as `sweep_line` finds them, of no size where every ray is
# followed from its start. Every event leaves at most one part behind, so a stack of two
# rows more than events is never full.
Room = namedtuple("Room", "state hit meetings")


@jit(forceinline=True)
def number_of_solid(solid):
    """Give the number of a solid of a mesh among what a beam is inside of."""
    return FIRST_SOLID - solid


@jit(forceinline=True)
def solid_of_number(number):
    """Give the solid of a mesh that has this number."""
    return int(FIRST_SOLID - number)


@jit(forceinline=True)
def copy_beam(state, source, target):
    """Copy one row of the stack over another."""
    for column in range(N_STATE):
        state[target, column] = state[source, column]


@jit(forceinline=True)
def inside_slot(state, top, number, axis_x, axis_y):
    """Slot that holds a body, by its number and the nearest axis; -1 if none does."""
    found = -1
    nearest = 1e300
    for slot in range(int(state[top, N_INSIDE])):
        column = INSIDE + 3 * slot
        if state[top, column] == number:
            off_x = state[top, column + 1] - axis_x
            off_y = state[top, column + 2] - axis_y
            distance = off_x * off_x + off_y * off_y
            if distance < nearest:
                nearest = distance
                found = slot
    return found


@jit(forceinline=True)
def enter_body(state, top, number, axis_x, axis_y):
    """Add a body to those the beam is inside of; False if there is no room."""
    slot = int(state[top, N_INSIDE])
    if slot == MAX_INSIDE:
        return False
    column = INSIDE + 3 * slot
    state[top, column] = number
    state[top, column + 1] = axis_x
    state[top, column + 2] = axis_y
    state[top, N_INSIDE] = slot + 1
    return True


@jit(forceinline=True)
def leave_body(state, top, slot):
    """Remove one of the bodies the beam is inside of; the last takes its place."""
    last = int(state[top, N_INSIDE]) - 1
    for k in range(3):
        state[top, INSIDE + 3 * slot + k] = state[top, INSIDE + 3 * last + k]
    state[top, N_INSIDE] = last


@jit(forceinline=True)
def move_axes(state, top, shift_x, shift_y):
    """Follow a wrap round the period: all axes that the beam knows move along."""
    state[top, LEFT + 1] += shift_x
    state[top, LEFT + 2] += shift_y
    for slot in range(int(state[top, N_INSIDE])):
        state[top, INSIDE + 3 * slot + 1] += shift_x
        state[top, INSIDE + 3 * slot + 2] += shift_y

"""What a beam among bodies is in, what lies behind a surface, and what either does to it.

Where bodies or a film overlap, the one named first in the scene rules.
"""

import math

from pbrdf.kernels import jit
from pbrdf.kernels.bodies.beams import (
    CELL_I,
    CELL_J,
    FACET,
    FIRST_SOLID,
    INDEX,
    INSIDE,
    KX,
    KY,
    KZ,
    N_INSIDE,
    X,
    Y,
    Z,
    inside_slot,
    solid_of_number,
)
from pbrdf.kernels.bodies.bodies import HIT_X, HIT_Y, body_interval
from pbrdf.kernels.bodies.events import number_of
from pbrdf.kernels.bodies.world import (
    BODY_IN,
    BODY_OUT,
    FILM_DOWN,
    FILM_UP,
    GROUND,
    HIT_BODY,
    LEVEL,
    NO_FILM,
    SOLID_IN,
    SOLID_OUT,
)
from pbrdf.kernels.meshes.facets import facet_label
from pbrdf.kernels.optics.absorbing import interface_elements, normal_wave
from pbrdf.kernels.optics.fresnel import reflection_elements, transmission_elements
from pbrdf.kernels.optics.light import GRAZING, cosine_law

# Optical depth of which less is left than the rounding of a double, exp(-36.9) = 1e-16
DEEP = 36.9


@jit(forceinline=True)
def medium_named(world, mesh, number):
    """Medium of a body, a film or a solid of the mesh, by its number."""
    medium = world.film.medium
    if number >= 0.0:
        medium = world.bodies.medium[int(number)]
    if mesh is not None and number <= FIRST_SOLID:
        medium = mesh.media[solid_of_number(number)]
    return medium


@jit(forceinline=True)
def medium_of(world, state, top):
    """Medium the beam is in: of all that holds it, the one named first in the scene."""
    medium = 0
    for slot in range(int(state[top, N_INSIDE])):
        other = medium_named(world, world.mesh, state[top, INSIDE + 3 * slot])
        if medium == 0 or other < medium:
            medium = other
    return medium


@jit(forceinline=True)
def medium_behind(world, state, top, kind, hit):
    """Medium on the far side of the surface of a body, solid or film just met."""
    number = number_of(kind, hit)
    if kind in (BODY_IN, SOLID_IN, FILM_DOWN):
        before = medium_of(world, state, top)
        new = medium_named(world, world.mesh, number)
        return new if before == 0 or new < before else before
    left = inside_slot(state, top, number, hit[HIT_X], hit[HIT_Y])
    medium = 0
    for slot in range(int(state[top, N_INSIDE])):
        if slot == left:
            continue
        other = medium_named(world, world.mesh, state[top, INSIDE + 3 * slot])
        if medium == 0 or other < medium:
            medium = other
    return medium


@jit(forceinline=True)
def free_way(terrain, mesh, z, k_z):
    """Distance below which a ray from a height z meets no facet; < 0 if none is known."""
    way = math.inf
    if terrain is not None and k_z < 0.0:
        way = (terrain.z_top - z) / k_z
    if mesh is not None and (k_z < 0.0 or z < mesh.frame.z_high):
        way = (mesh.frame.z_high - z) / -abs(k_z)
    return way


@jit(forceinline=True)
def steepest_of(terrain):
    """Slope of the steepest facet, under a film."""
    steepest = math.inf
    if terrain is not None:
        steepest = terrain.steepest
    return steepest


@jit(forceinline=True)
def least_way(world, state, top, kind, hit):
    """Distance below which a beam refracted where it is meets nothing. [um]

    0 where none is known without a search. For the skip of what is too deep to come out.
    """
    film, bodies = world.film, world.bodies
    k_x, k_y, k_z = state[top, KX], state[top, KY], state[top, KZ]
    if kind == BODY_IN:
        if state[top, N_INSIDE] > 0.0 or bodies.overlap or film.kind != NO_FILM:
            return 0.0
        k = int(hit[HIT_BODY])
        _, way = body_interval(
            bodies, k, state[top, X] - hit[HIT_X], state[top, Y] - hit[HIT_Y],
            state[top, Z] - bodies.z[k], k_x, k_y, k_z,
        )  # fmt: skip
        return max(min(way, free_way(world.terrain, world.mesh, state[top, Z], k_z)), 0.0)
    if kind != FILM_DOWN or bodies.medium.size > 0:
        return 0.0
    if film.kind == LEVEL:
        way = free_way(world.terrain, world.mesh, film.height, k_z)
        return max(way, 0.0) if k_z < 0.0 else 0.0
    # Between two copies of a surface, unless the beam may come out of the upper again
    steepest = steepest_of(world.terrain)
    if -k_z <= steepest * math.sqrt(k_x * k_x + k_y * k_y):
        return 0.0
    return film.height / math.sqrt(1.0 + steepest * steepest)


@jit(forceinline=True)
def index_along(media, w, medium, state, top):
    """Real index of a beam in the medium that it is in."""
    return media.n[w, medium] if media.kappa[w, medium] == 0.0 else state[top, INDEX]


@jit(forceinline=True)
def absorption_along(media, w, medium, index):
    """Absorption along the path of a beam of this index in a medium. [1/um]"""
    return media.absorption[w, medium] * media.n[w, medium] / index


@jit(forceinline=True)
def same_index(media, w, before, after):
    """Whether light does not notice the change of medium."""
    return before == after or (
        media.n[w, before] == media.n[w, after]
        and media.kappa[w, before] == media.kappa[w, after]
    )


@jit(forceinline=True)
def both_elements(media, w, before, after, index, cos_in):
    """Elements of what is reflected and of what crosses, and the ratio of indices or 0."""
    n_1, n_2 = media.n[w, before], media.n[w, after]
    kappa_1, kappa_2 = media.kappa[w, before], media.kappa[w, after]
    if kappa_1 > 0.0 or kappa_2 > 0.0:
        a, b, c, d, a_t, b_t, c_t, d_t, ratio = interface_elements(
            cos_in, index, n_1, kappa_1, n_2, kappa_2
        )
        return (a, b, c, d), (a_t, b_t, c_t, d_t), ratio
    ratio = n_2 / n_1
    back = reflection_elements(cos_in, ratio, 0.0)
    if (ratio - 1.0) * (ratio + 1.0) + cos_in * cos_in <= 0.0:
        return back, (0.0, 0.0, 0.0, 0.0), 0.0
    return back, transmission_elements(cos_in, ratio, 0.0), ratio


@jit(forceinline=True)
def label_of_ground(terrain, mesh, state, top):
    """Give the number of the material of the facet that the beam is on."""
    label = 0
    if terrain is not None:
        labels = terrain.labels
        if labels.size > 0:
            label = int(labels[int(state[top, CELL_I]), int(state[top, CELL_J])])
    if mesh is not None:
        label = int(facet_label(mesh, int(state[top, FACET])))
    return label


@jit(forceinline=True)
def solid_at(world, w, state, top, kind, hit):
    """Solid that has just been met; -1 at the surface of what light goes through."""
    if kind == GROUND:
        return label_of_ground(world.terrain, world.mesh, state, top)
    if kind in (BODY_OUT, SOLID_OUT, FILM_UP) and state[top, N_INSIDE] < 2.0:
        return -1
    after = medium_behind(world, state, top, kind, hit)
    solid = world.media.solid[w, after]
    if solid >= 0 and after == medium_of(world, state, top):
        return -1
    return solid


@jit(forceinline=True)
def solid_elements(media, w, solid, medium, index, cos_in):
    """Elements of what a solid reflects, and half sum and difference of what enters it."""
    if media.kappa[w, medium] > 0.0:
        a, b, c, d, a_in, b_in, _, _, _ = interface_elements(
            cos_in, index, media.n[w, medium], media.kappa[w, medium],
            media.solid_n[w, solid], media.solid_kappa[w, solid],
        )  # fmt: skip
        return (a, b, c, d), (a_in, b_in)
    n = media.solid_n[w, solid] / media.n[w, medium]
    kappa = media.solid_kappa[w, solid] / media.n[w, medium]
    back = reflection_elements(cos_in, n, kappa)
    a_in, b_in = 0.0, 0.0
    if media.base[w, solid, medium] > 0.0:
        a_in, b_in, _, _ = transmission_elements(cos_in, n, kappa)
    return back, (a_in, b_in)


@jit(forceinline=True)
def leave_base(media, w, solid, medium, draw):
    """Index, sine and cosine of a beam that a diffuse base sends into a medium, and weight.

    The base is even in the square of the wave vector along the interface. A medium that
    absorbs takes in more than one that does not: what the latter reflects totally.
    """
    n = media.n[w, medium]
    if media.kappa[w, medium] == 0.0:
        sine, cosine = cosine_law(draw)
        return n, sine, cosine, 1.0
    top2 = media.solid_n[w, solid] * media.solid_n[w, solid]
    open2 = min(n * n, top2)
    tail = media.tail[w, solid, medium]
    if draw < tail:
        span = top2 - open2
        along2 = open2 + span * (draw / tail)
        weight = span / tail
    else:
        along2 = open2 * ((draw - tail) / (1.0 - tail))
        weight = open2 / (1.0 - tail)
    q = normal_wave(along2, n, media.kappa[w, medium])
    index = math.sqrt(along2 + q.real * q.real)
    return index, math.sqrt(along2) / index, max(q.real / index, GRAZING), weight

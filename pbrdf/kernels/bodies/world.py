"""A scene with bodies, a film or solids that light goes through, as the kernels take it."""

from collections import namedtuple

NO_FILM, CONFORMAL, LEVEL = 0, 1, 2
# What comes next: a facet of the ground or of the film, from above or from below; the
# surface of a body, or a facet of a solid of the mesh, from outside or inside; or the end
# of the path: away, beyond the rim, lost, or out below
(
    GROUND, FILM_DOWN, FILM_UP, BODY_IN, BODY_OUT, SOLID_IN, SOLID_OUT,
    OUT, ASIDE, ASTRAY, PASSED,
) = range(11)  # fmt: skip
# What the next event is, after the columns of `pbrdf.kernels.bodies.bodies`: the body, or
# the solid by its number; and the facet, by cell and place in it, on a mesh by HIT_I, 1
# where it is delicate, and its place
HIT_BODY, HIT_I, HIT_J, HIT_FACET, HIT_U, HIT_V, HIT_Z, N_HIT = 3, 4, 5, 6, 7, 8, 9, 10

# A film: its kind, its thickness or level [um], its medium, and the ground upside down
Film = namedtuple("Film", "kind height medium flipped")
# Media that light goes through, 0 the air: index and absorption [1/um] (wavelengths,
# media), and the solid that a medium is instead, or -1. Solids, first the materials of the
# ground: index (wavelengths, solids), which are black, and the diffuse base under each
# medium (wavelengths, solids, media): its strength, and the share of samples of what a
# medium takes in only because it absorbs
Media = namedtuple("Media", "n kappa absorption solid solid_n solid_kappa black base tail")
# Of terrain and mesh one is None, which the compiler sees: it drops what is asked of it.
# `deep` is the optical depth from which on light is not followed, or inf
World = namedtuple("World", "terrain mesh film bodies media deep")

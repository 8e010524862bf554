"""Single reflections of one surface sample: facets asked if they join the cones."""

from collections.abc import Callable
from functools import partial

import numpy as np

from pbrdf.conventions import direction
from pbrdf.kernels.cones import facets as observe_facets
from pbrdf.kernels.cones.matrix import Cones, mean_mueller
from pbrdf.kernels.cones.mesh_facets import show_mesh_facets
from pbrdf.kernels.optics.vectors import Vec
from pbrdf.observation.expected import Expected
from pbrdf.observation.look import Look, Sums, forward
from pbrdf.tracer.field import GUARD_HEIGHTS, GUARD_SHARE, Field
from pbrdf.tracer.mesh_field import MeshField

# Source azimuths a sample at which the facets of an isotropic surface are asked: as many as
# bring every facet of the right tilt into sight, within these bounds
FEWEST_AZIMUTHS, MOST_AZIMUTHS = 8, 64
# Points a geometry and sample are about as many as its bundles, but not fewer than this
LEAST_POINTS = 2000
# Facets a cell of the table of slopes, on average, and the most cells an axis
FACETS_PER_CELL = 8
MOST_CELLS = 2048
# The seven-point rule for the mean over a disc, exact to degree five (Abramowitz and
# Stegun, eq. 25.4.61): coordinates in the unit disc and weights
_ANGLES = np.arange(6) * (np.pi / 3.0)
DISC_RULE = np.array(
    [(0.0, 0.0, 0.25)]
    + [(np.sqrt(2 / 3) * np.cos(a), np.sqrt(2 / 3) * np.sin(a), 0.125) for a in _ANGLES]
)


def ask_facets(
    surface: Field | MeshField,
    sample: Sums,
    rng: np.random.Generator,
    expected: Expected | None,
) -> None:
    """Add the single mirror reflections of every geometry to the sample.

    Where it is known what facets show on average, what these show too much if none hides
    another is taken off, by the share that is in sight.
    """
    look = sample.look
    if isinstance(surface, MeshField):
        facets, largest, show = _mesh_facets(surface)
    else:
        facets, largest, show = _map_facets(surface)
    paths = look.estimator == "paths"
    means = np.empty(0) if paths and expected is None else mean_matrices(look)
    room = np.empty((4, 4))
    omega_i, omega_s = look.solid_angles()
    for g in range(look.size):
        azimuths = _azimuths(look, g, rng.random())
        streams = rng.integers(2**63, size=len(azimuths), dtype=np.uint64)
        points = max(1, -(-look.n_rays // (facets * len(azimuths))))
        most = max(look.n_rays, LEAST_POINTS) / len(azimuths)
        shown = np.zeros((look.n.shape[1], observe_facets.N_SHOWN))
        matrices = np.zeros((len(look.n) if paths else 0, look.n_stokes, look.n_stokes))
        counts = np.zeros(observe_facets.N_FACET_COUNTS, dtype=np.int64)
        sums = observe_facets.Sums(shown, matrices, counts, room)
        for a, phi_i in enumerate(azimuths):
            show(_cones(look, g, phi_i), points, most, streams[a], look.optics, sums)
        # Points of unknown visibility are taken to be as bright as the others
        known = 1.0
        if counts[observe_facets.N_ASIDE] > 0:
            tried = counts[observe_facets.N_POINTS]
            known = max(1.0 - counts[observe_facets.N_ASIDE] / tried, 1.0 / tried)
        scale = 1.0 / (len(azimuths) * omega_i[g] * omega_s[g] * known)
        if expected is not None:
            tried = scale * float(shown[:, observe_facets.TRIED_FLUX].sum())
            amiss = expected.seen[g] * (tried - expected.light[g])
            sample.brdf[g, 0] -= amiss * means[g][:, 0]
        sample.tried[g] += counts[observe_facets.N_POINTS]
        if paths:
            sample.brdf[g, 0] += scale * forward(matrices)
            strength = 1.0
        else:
            light = scale * shown[:, observe_facets.FLUX]
            sample.brdf[g, 0] += np.einsum("m,wmij->wij", light, means[g])
            strength = float(means[g][..., 0, 0].max())
        sample.caught[g, 0] += counts[observe_facets.N_SEEN]
        smaller = min(
            omega_i[g] / np.cos(look.theta_i[g]), omega_s[g] / np.cos(look.theta_s[g])
        )
        one = scale * smaller * strength * largest / points
        sample.one[g, 0] = max(sample.one[g, 0], one)
        sample.facet_counts += counts


def _map_facets(surface: Field) -> tuple[int, float, Callable[..., None]]:
    """Facets of a height map: their number, the largest share of one, how to ask them."""
    inside = _interior(surface)
    facets = int(2 * (inside[1] - inside[0]) * (inside[3] - inside[2]))
    size = int(np.clip(np.sqrt(facets / FACETS_PER_CELL), 1, MOST_CELLS))
    bounds = observe_facets.slope_range(surface.terrain, inside)
    table = observe_facets.sort_facets(surface.terrain, inside, size, *bounds)
    show = partial(observe_facets.show_facets, surface.terrain, table, size, inside)
    return facets, 1.0 / facets, show


def _mesh_facets(surface: MeshField) -> tuple[int, float, Callable[..., None]]:
    """Tell the same of a mesh; of a sheet without a guard rim."""
    mesh = surface.surface
    chosen = np.arange(len(mesh.faces))
    area = float(np.prod(mesh.size))
    if mesh.period is None:
        low, high = mesh.bounds
        guard = np.minimum(
            GUARD_HEIGHTS * (high[2] - low[2]), GUARD_SHARE * np.asarray(mesh.size)
        )
        middle = mesh.vertices[mesh.faces].mean(axis=1)[:, :2]
        inner = (middle >= low[:2] + guard) & (middle <= high[:2] - guard)
        chosen = np.flatnonzero(inner.all(axis=1))
        # What looks down covers what looks up once more
        area = float((mesh.areas * mesh.normals[:, 2])[chosen].sum())
    shares = mesh.areas[chosen] / area
    show = partial(show_mesh_facets, surface.facets(), chosen, shares)
    return len(chosen), float(shares.max()), show


def _interior(surface: Field) -> np.ndarray:
    """Cells (from, to, from, to) along x and y that are asked; less a rim if finite."""
    nodes = np.array(surface.terrain.heights.shape)
    if surface.periodic:
        return np.array([0, nodes[0], 0, nodes[1]])
    sides = nodes - 1
    guard = np.minimum(
        GUARD_HEIGHTS * surface.height_range / np.asarray(surface.pitch),
        GUARD_SHARE * sides,
    )
    low = np.ceil(guard).astype(np.int64)
    low = np.minimum(low, (sides - 1) // 2)
    return np.array([low[0], sides[0] - low[0], low[1], sides[1] - low[1]])


def _azimuths(look: Look, g: int, shift: float) -> np.ndarray:
    """Azimuths of the source at which to ask the facets for one geometry. [rad]

    On the circle of slopes of the right steepness a direction covers about the mean of the
    two half-angles to each side.
    """
    if look.phi_i is not None:
        return np.array([look.phi_i])
    theta_i, theta_s, dphi = look.theta_i[g], look.theta_s[g], look.dphi[g]
    across = np.hypot(
        np.sin(theta_i) + np.sin(theta_s) * np.cos(dphi), np.sin(theta_s) * np.sin(dphi)
    )
    slope = across / (np.cos(theta_i) + np.cos(theta_s))
    wanted = np.ceil(2.0 * np.pi * slope / (look.source + look.detector))
    count = int(np.clip(wanted, FEWEST_AZIMUTHS, MOST_AZIMUTHS))
    return (np.arange(count) + shift) * (2.0 * np.pi / count)


def _cones(look: Look, g: int, phi_i: float) -> Cones:
    phi_s = phi_i + look.dphi[g]
    theta_i, theta_s = look.theta_i[g], look.theta_s[g]
    return Cones(
        Vec(*direction(theta_s, phi_s)), Vec(np.sin(phi_s), -np.cos(phi_s), 0.0),
        Vec(*direction(theta_i, phi_i)), Vec(-np.sin(phi_i), np.cos(phi_i), 0.0),
        look.detector, np.cos(look.detector), np.sin(look.detector),
        look.source, np.cos(look.source), np.sin(look.source),
    )  # fmt: skip


def mean_matrices(look: Look) -> np.ndarray:
    """F' of equation (16), averaged over both cones, for every geometry.

    Returns
    -------
    ndarray, shape (geometries, wavelengths, materials, stokes, stokes)
        Forward matrices. [1]
    """
    out = np.zeros((look.size, *look.n.shape, look.n_stokes, look.n_stokes))
    room = np.empty((4, 4))
    for g in range(look.size):
        mean_mueller(
            _cones(look, g, 0.0), DISC_RULE, look.optics, look.n_stokes, room, out[g]
        )
    return forward(out)

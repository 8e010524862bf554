"""Single mirror reflections, asked of the facets of a mesh; see `facets` of height maps."""

from pbrdf.kernels import jit
from pbrdf.kernels.cones.facets import (
    FLUX,
    N_ASIDE,
    N_FACETS,
    N_POINTS,
    N_SEEN,
    UNKNOWN_FLUX,
)
from pbrdf.kernels.cones.lens import leave, lens_direction, lens_flux
from pbrdf.kernels.cones.matrix import facet_mueller
from pbrdf.kernels.meshes.facets import facet_label, facet_normal
from pbrdf.kernels.paths.random import uniform_pair
from pbrdf.kernels.terrain.heightfield import ESCAPED, SIDE


@jit(forceinline=True)
def flux_of_facet(mesh, face, cones):
    """Flux through a facet per its area, and the source as the facet shows it."""
    n_x, n_y, n_z = facet_normal(mesh, face)
    to_d = n_x * cones.d_x + n_y * cones.d_y + n_z * cones.d_z
    to_i = n_x * cones.i_x + n_y * cones.i_y + n_z * cones.i_z
    m_x = 2.0 * to_i * n_x - cones.i_x
    m_y = 2.0 * to_i * n_y - cones.i_y
    m_z = 2.0 * to_i * n_z - cones.i_z
    between = m_x * cones.d_x + m_y * cones.d_y + m_z * cones.d_z
    near = cones.cos_d * cones.cos_i - cones.sin_d * cones.sin_i
    flux = 0.0
    if to_d > 0.0 and to_i > 0.0 and between > near:
        flux = lens_flux(
            between, to_d, to_i, cones.cos_d, cones.sin_d, cones.cos_i, cones.sin_i
        )
    return flux, m_x, m_y, m_z


@jit(forceinline=True)
def point_of_facet(mesh, face, u, v):
    """Point of a facet from two uniform numbers."""
    if u + v > 1.0:
        u, v = 1.0 - u, 1.0 - v
    corners, faces = mesh.corners, mesh.faces
    a, b, c = faces[face, 0], faces[face, 1], faces[face, 2]
    w = 1.0 - u - v
    return (
        w * corners[a, 0] + u * corners[b, 0] + v * corners[c, 0],
        w * corners[a, 1] + u * corners[b, 1] + v * corners[c, 1],
        w * corners[a, 2] + u * corners[b, 2] + v * corners[c, 2],
    )


@jit(allocates=False)
def show_mesh_facets(
    mesh, chosen, shares, cones, points, most, stream, optics, shown, matrices, counts,
    mueller,
):  # fmt: skip
    """Add up the facets of a mesh that join the two cones.

    chosen, shares  facets that are asked, and their areas in that of the mean surface

    The rest as `pbrdf.kernels.cones.facets.show_facets`.
    """
    # A point by chance is as good as never near a crossing, but nothing tells
    crossing = 0
    near = 0
    for number in range(chosen.shape[0]):
        if flux_of_facet(mesh, chosen[number], cones)[0] > 0.0:
            near += 1
    chance = min(1.0, most / max(near * points, 1))
    for number in range(chosen.shape[0]):
        face = chosen[number]
        flux, m_x, m_y, m_z = flux_of_facet(mesh, face, cones)
        flux *= shares[number] / points / chance
        draw, _ = uniform_pair(stream, 2 * number * points, 1)
        if flux <= 0.0 or draw >= chance:
            continue
        counts[N_FACETS] += 1
        n_x, n_y, n_z = facet_normal(mesh, face)
        m = facet_label(mesh, face)
        for point in range(points):
            name = number * points + point
            u, v = uniform_pair(stream, 2 * name, 0)
            x, y, z = point_of_facet(mesh, face, u, v)
            k_x, k_y, k_z = lens_direction(
                cones.d_x, cones.d_y, cones.d_z, m_x, m_y, m_z,
                cones.half_d, cones.half_i, n_x, n_y, n_z, stream, 2 * name + 1,
            )  # fmt: skip
            cosine = n_x * k_x + n_y * k_y + n_z * k_z
            counts[N_POINTS] += 1
            if cosine <= 0.0:
                continue
            # Seen from the detector, and through the mirror from the source?
            fate = leave(None, mesh, crossing, 0, face, x, y, z, k_x, k_y, k_z, cosine)[0]
            if fate == ESCAPED:
                fate = leave(
                    None, mesh, crossing, 0, face, x, y, z,
                    2.0 * cosine * n_x - k_x, 2.0 * cosine * n_y - k_y,
                    2.0 * cosine * n_z - k_z, cosine,
                )[0]  # fmt: skip
            if fate == SIDE:
                counts[N_ASIDE] += 1
                shown[m, UNKNOWN_FLUX] += flux
            elif fate == ESCAPED:
                counts[N_SEEN] += 1
                shown[m, FLUX] += flux
                for w in range(matrices.shape[0]):
                    n_stokes = matrices.shape[1]
                    facet_mueller(
                        cones, k_x, k_y, k_z, n_x, n_y, n_z, optics, w, m, n_stokes, mueller
                    )
                    for row in range(n_stokes):
                        for column in range(n_stokes):
                            matrices[w, row, column] += flux * mueller[row, column]

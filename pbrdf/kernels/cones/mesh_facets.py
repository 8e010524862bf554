"""Single mirror reflections, asked of the facets of a mesh; see `facets` of height maps."""

from pbrdf.kernels import jit
from pbrdf.kernels.cones.facets import N_FACETS, flux_of_facet, show_point
from pbrdf.kernels.meshes.facets import facet_label
from pbrdf.kernels.paths.ground import Place, normal_of_face
from pbrdf.kernels.paths.random import uniform_pair


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
def show_mesh_facets(mesh, chosen, shares, cones, points, most, stream, optics, sums):
    """Add up the facets of a mesh that join the two cones.

    chosen, shares  facets that are asked, and their areas in that of the mean surface

    The rest as `pbrdf.kernels.cones.facets.show_facets`.
    """
    # A point by chance is as good as never near a crossing, but nothing tells
    crossing = 0
    near = 0
    for number in range(chosen.shape[0]):
        if flux_of_facet(normal_of_face(mesh, chosen[number]), cones)[0] > 0.0:
            near += 1
    chance = min(1.0, most / max(near * points, 1))
    for number in range(chosen.shape[0]):
        face = chosen[number]
        normal = normal_of_face(mesh, face)
        flux, image = flux_of_facet(normal, cones)
        flux *= shares[number] / points / chance
        draw, _ = uniform_pair(stream, 2 * number * points, 1)
        if flux <= 0.0 or draw >= chance:
            continue
        sums.counts[N_FACETS] += 1
        m = facet_label(mesh, face)
        for point in range(points):
            name = number * points + point
            u, v = uniform_pair(stream, 2 * name, 0)
            x, y, z = point_of_facet(mesh, face, u, v)
            show_point(
                None, mesh, Place(crossing, 0, face, x, y, z), (normal, image, m, flux),
                cones, stream, 2 * name + 1, optics, sums,
            )  # fmt: skip

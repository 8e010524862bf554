"""The first bounce of all rays of a line at once, and the end of those that then are free.

The rays of a line share their direction and frame. What becomes of them at the facets that
`sweep_line` found is one loop without branches, of which the compiler makes vector code.
"""

from collections import namedtuple

from pbrdf.kernels import jit
from pbrdf.kernels.bins.binning import exact_bin, rough_place
from pbrdf.kernels.optics.frames import exit_turn
from pbrdf.kernels.paths.ray_bounce import bounce_at, normal_of_slopes
from pbrdf.kernels.paths.shading import (
    COS_IN,
    COS_OUT,
    LABEL,
    N_ESCAPED,
    N_SEGMENTS,
    SPECULAR,
    TURN_C,
    TURN_S,
)
from pbrdf.kernels.paths.spectra import begin_light, end_light
from pbrdf.kernels.terrain.entry import way_of
from pbrdf.kernels.terrain.heightfield import corner_heights, steps_of
from pbrdf.kernels.terrain.sweep import F_FACET, F_I, F_J

# Numbers of a mirrored ray: direction, cosine of incidence, turn of the frame into the
# plane of incidence and from there to the meridian of the exit, rough place in bins
M_X, M_Y, M_Z, M_COS, M_IN_C, M_IN_S, M_OUT_C, M_OUT_S = 0, 1, 2, 3, 4, 5, 6, 7
M_THETA, M_DPHI, N_MIRRORED = 8, 9, 10
# Room for the longest line: first facets (rays, N_FIRST) of `sweep_line`, their slopes (2,
# rays) and `mirrored` (rays * N_MIRRORED,)
LineRoom = namedtuple("LineRoom", "meetings slopes mirrored")


@jit(forceinline=True)
def slopes_of_line(terrain, meetings, rays, slopes):
    """Slopes of the facets that the rays of a line meet, (2, rays)."""
    per_x = 1.0 / terrain.pitch_x
    per_y = 1.0 / terrain.pitch_y
    for ray in range(rays):
        z00, z10, z01, z11 = corner_heights(
            terrain.heights, int(meetings[ray, F_I]), int(meetings[ray, F_J]), True
        )
        step_x, step_y = steps_of(z00, z10, z01, z11, int(meetings[ray, F_FACET]))
        slopes[0, ray] = step_x * per_x
        slopes[1, ray] = step_y * per_y


@jit(forceinline=True)
def mirror_line(beam, rays, slopes, n_theta, n_dphi, mirrored):
    """Reflect all rays of a line, into `mirrored` (rays * N_MIRRORED,).

    The array is flat so that the compiler sees that rays do not touch each other.
    """
    k = way_of(beam)
    for ray in range(rays):
        normal, _ = normal_of_slopes(slopes[0, ray], slopes[1, ray])
        r, w, cos_beta, (in_c, in_s) = bounce_at(k, beam.s, normal)
        out_c, out_s = exit_turn(r, w, beam.cos_phi, beam.sin_phi)
        at = ray * N_MIRRORED
        mirrored[at + M_X] = r.x
        mirrored[at + M_Y] = r.y
        mirrored[at + M_Z] = r.z
        mirrored[at + M_COS] = cos_beta
        mirrored[at + M_IN_C] = in_c
        mirrored[at + M_IN_S] = in_s
        mirrored[at + M_OUT_C] = out_c
        mirrored[at + M_OUT_S] = out_s
        mirrored[at + M_THETA], mirrored[at + M_DPHI] = rough_place(
            r.x, r.y, r.z, beam.cos_phi, beam.sin_phi, n_theta, n_dphi
        )


@jit(forceinline=True)
def end_after_one(mirrored, at, label, cos_phi, sin_phi, record, spectra, optics, tally):
    """Tally a path that one bounce has sent out, as `trace_ray` does."""
    record[0, 0, COS_IN] = mirrored[at + M_COS]
    record[0, 0, TURN_C] = mirrored[at + M_IN_C]
    record[0, 0, TURN_S] = mirrored[at + M_IN_S]
    record[0, 0, COS_OUT] = SPECULAR
    record[0, 0, LABEL] = label
    record[1, 0, TURN_C] = mirrored[at + M_OUT_C]
    record[1, 0, TURN_S] = mirrored[at + M_OUT_S]
    tally.counts[N_SEGMENTS] += 2
    i_theta, i_dphi = exact_bin(
        mirrored[at + M_THETA], mirrored[at + M_DPHI],
        mirrored[at + M_X], mirrored[at + M_Y], mirrored[at + M_Z],
        cos_phi, sin_phi, tally.zenith, tally.azimuth,
    )  # fmt: skip
    begin_light(spectra, tally)
    end_light(spectra, N_ESCAPED, record, 0, 1, i_theta, i_dphi, optics, tally)

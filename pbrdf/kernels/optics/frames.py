"""Frames of Stokes vectors along a path, from dot products and never from an arccos.

A beam along the unit vector k has the frame (e_s, e_p = k x e_s). Turning the frame
about k to a new s axis w needs the cosine and sine of twice the angle only; they
follow from the projections a, b of w on the old axes without its length: they are
(a² - b²)/(a² + b²) and 2 a b/(a² + b²).
"""

from pbrdf.kernels import jit
from pbrdf.kernels.optics.vectors import Vec, axes_across, cross, dot, moved, unit

# |w|² below this leaves the s axis undefined; the beam then meets its facet head-on and
# every s axis gives the same Mueller matrix
PARALLEL = 1e-28


@jit(forceinline=True)
def turn_frame(k, s, w):
    """Cosine and sine of twice the angle from axis s to axis w of a beam along k.

    Neither need be of unit length.
    """
    on_s = dot(w, s)
    on_p = dot(w, cross(k, s))
    square = on_s * on_s + on_p * on_p
    if square < PARALLEL * dot(s, s):
        return 1.0, 0.0
    scale = 1.0 / square
    return (on_s * on_s - on_p * on_p) * scale, 2.0 * on_s * on_p * scale


@jit(forceinline=True)
def exit_turn(k, s, cos_phi_i, sin_phi_i):
    """Turn of the frame to the meridian plane of the exit direction, e_s = z x k."""
    m_x = -k.y
    m_y = k.x
    if k.x * k.x + k.y * k.y < PARALLEL:
        # Straight up: the azimuth of the source stands for that of the detector
        m_x = -sin_phi_i
        m_y = cos_phi_i
    return turn_frame(k, s, Vec(m_x, m_y, 0.0))


@jit(forceinline=True)
def kept_axis(s, w):
    """Axis w of a facet, or the old s axis where the beam met the facet head-on."""
    if w.x * w.x + w.y * w.y + w.z * w.z > PARALLEL:
        return w
    return s


@jit(forceinline=True)
def axis_of_exit(k, normal):
    """Give the unit s axis, across the plane of exit, of a beam that leaves along k."""
    w = cross(k, normal)
    if dot(w, w) > PARALLEL:
        return unit(w)
    # Along the normal every axis across it serves
    first, _ = axes_across(normal)
    return first


@jit(forceinline=True)
def carried_axis(a, s, k):
    """Axis s of a beam along a, carried to the direction k on the shortest way.

    So the polarisers of an instrument serve every ray of its cone, also about the zenith,
    where the meridian frame spins. The same for the beams along -a and -k.
    """
    share = dot(s, k) / (1.0 + dot(a, k))
    return moved(s, -share, Vec(a.x + k.x, a.y + k.y, a.z + k.z))

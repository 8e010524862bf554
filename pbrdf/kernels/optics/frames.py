"""Frames of Stokes vectors along a path, from dot products and never from an arccos.

A beam along the unit vector k has the frame (e_s, e_p = k x e_s). Turning the frame
about k to a new s axis w needs the cosine and sine of twice the angle only; they
follow from the projections a, b of w on the old axes without its length: they are
(a² - b²)/(a² + b²) and 2 a b/(a² + b²).
"""

from pbrdf.kernels import jit

# |w|² below this leaves the s axis undefined; the beam then meets its facet head-on and
# every s axis gives the same Mueller matrix
PARALLEL = 1e-28


@jit(forceinline=True)
def turn_frame(k_x, k_y, k_z, s_x, s_y, s_z, w_x, w_y, w_z):
    """Cosine and sine of twice the angle from axis s to axis w of a beam along k.

    Neither need be of unit length.
    """
    # e_p = k x e_s
    p_x = k_y * s_z - k_z * s_y
    p_y = k_z * s_x - k_x * s_z
    p_z = k_x * s_y - k_y * s_x
    on_s = w_x * s_x + w_y * s_y + w_z * s_z
    on_p = w_x * p_x + w_y * p_y + w_z * p_z
    square = on_s * on_s + on_p * on_p
    if square < PARALLEL * (s_x * s_x + s_y * s_y + s_z * s_z):
        return 1.0, 0.0
    scale = 1.0 / square
    return (on_s * on_s - on_p * on_p) * scale, 2.0 * on_s * on_p * scale

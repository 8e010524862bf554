"""Mueller matrices of a turned Stokes frame."""

import numpy as np
import numpy.typing as npt


def rotation(cosine: npt.ArrayLike, sine: npt.ArrayLike) -> np.ndarray:
    """Return Mueller rotations into frames turned about the beam, shape (..., 4, 4).

    Parameters
    ----------
    cosine, sine : array_like, shape (...)
        e_s' . e_s and e_s' . e_p of the new axis e_s' in the old frame.

    Examples
    --------
    A quarter turn changes the sign of Q and U:

    >>> rotation(0.0, 1.0).diagonal()
    array([ 1., -1., -1.,  1.])
    """
    cosine, sine = np.broadcast_arrays(cosine, sine)
    twice_cosine, twice_sine = cosine**2 - sine**2, 2 * cosine * sine
    matrix = np.zeros((*cosine.shape, 4, 4))
    matrix[..., 0, 0] = matrix[..., 3, 3] = 1.0
    matrix[..., 1, 1] = matrix[..., 2, 2] = twice_cosine
    matrix[..., 1, 2], matrix[..., 2, 1] = twice_sine, -twice_sine
    return matrix

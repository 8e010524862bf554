"""What a Mueller matrix says: polarisation of the light, depolarisation, realisability."""

import numpy as np
import numpy.typing as npt

from pbrdf.errors import real_array

__all__ = [
    "aolp",
    "coherency_eigenvalues",
    "depol_index",
    "docp",
    "dolp",
    "is_physical",
]

# Pauli matrices in the order of the Stokes vector (I, Q, U, V)
PAULI = np.array(
    [
        [[1, 0], [0, 1]],
        [[1, 0], [0, -1]],
        [[0, 1], [1, 0]],
        [[0, 1j], [-1j, 0]],
    ]
)
# Products sigma_a x conj(sigma_b) of the coherency matrix, as a (4, 4, 4, 4) table
COHERENCY = np.einsum("aij,bkl->abikjl", PAULI, PAULI.conj()).reshape(4, 4, 4, 4) / 4


def _stokes(light: npt.ArrayLike) -> np.ndarray:
    """Stokes vector (..., 4), or the first column of Mueller matrices (..., 4, 4)."""
    array = real_array("light", light)
    if array.ndim >= 2 and array.shape[-2:] == (4, 4):
        return array[..., 0]
    if array.ndim >= 1 and array.shape[-1] == 4:
        return array
    msg = (
        "light must be Stokes vectors (..., 4) or Mueller matrices (..., 4, 4), "
        f"got shape {array.shape}."
    )
    raise ValueError(msg)


def _ratio(part: np.ndarray, whole: np.ndarray) -> np.ndarray:
    """Quotient that is NaN where there is no light."""
    return np.divide(part, whole, out=np.full(np.shape(part), np.nan), where=whole > 0)


def dolp(light: npt.ArrayLike) -> np.ndarray:
    """Degree of linear polarisation, sqrt(Q^2 + U^2)/I. [1]

    Parameters
    ----------
    light : array_like, shape (..., 4) or (..., 4, 4)
        Stokes vectors; of a Mueller matrix, the light it makes of unpolarised light. Four
        Stokes vectors in an array (4, 4) would be read as a matrix: reshape to (4, 1, 4).

    Returns
    -------
    ndarray, shape (...)
        NaN where I is not positive.

    Examples
    --------
    >>> dolp([2.0, 0.6, 0.8, 0.0])
    array(0.5)
    """
    stokes = _stokes(light)
    return _ratio(np.hypot(stokes[..., 1], stokes[..., 2]), stokes[..., 0])


def aolp(light: npt.ArrayLike) -> np.ndarray:
    """Angle of linear polarisation from e_s towards e_p, in (-pi/2, pi/2]. [rad]

    Arguments as in `dolp`.

    Examples
    --------
    >>> np.rad2deg(aolp([1.0, 0.0, 0.3, 0.0]))
    np.float64(45.0)
    """
    stokes = _stokes(light)
    return 0.5 * np.arctan2(stokes[..., 2], stokes[..., 1])


def docp(light: npt.ArrayLike) -> np.ndarray:
    """Degree of circular polarisation V/I, positive for right-circular. [1]

    Arguments as in `dolp`.
    """
    stokes = _stokes(light)
    return _ratio(stokes[..., 3], stokes[..., 0])


def depol_index(mueller: npt.ArrayLike) -> np.ndarray:
    """Depolarisation index of Gil and Bernabeu: 1 for a Jones matrix, 0 for a depolariser.

    Parameters
    ----------
    mueller : array_like, shape (..., 4, 4)

    Returns
    -------
    ndarray, shape (...)
        sqrt((tr(M^T M) - M00^2) / (3 M00^2)). [1]

    References
    ----------
    .. [1] J. Gil, E. Bernabeu, Optica Acta 33, 185 (1986).

    Examples
    --------
    >>> float(depol_index(np.diag([1.0, 0.5, 0.5, 0.5])))
    0.5
    """
    matrix = _matrices(mueller)
    first = matrix[..., 0, 0]
    excess = np.maximum((matrix**2).sum((-2, -1)) - first**2, 0.0)
    return _ratio(np.sqrt(excess / 3), first)


def coherency_eigenvalues(mueller: npt.ArrayLike) -> np.ndarray:
    """Eigenvalues of Cloude's coherency matrix, rising; they sum to M00.

    A Mueller matrix is a sum of Jones matrices, so physical, if and only if none is
    negative; it is a single Jones matrix if three vanish.

    Parameters
    ----------
    mueller : array_like, shape (..., 4, 4)

    Returns
    -------
    ndarray, shape (..., 4)
        In the units of the matrix.

    References
    ----------
    .. [1] S. Cloude, Optik 75, 26 (1986).

    Examples
    --------
    >>> coherency_eigenvalues(np.eye(4)).round(12) + 0.0
    array([0., 0., 0., 1.])
    """
    coherency = np.einsum("...ab,abij->...ij", _matrices(mueller), COHERENCY)
    return np.linalg.eigvalsh(coherency)


def is_physical(mueller: npt.ArrayLike, tolerance: float = 1e-12) -> np.ndarray:
    """Whether each matrix is realisable: no eigenvalue below -tolerance * M00.

    Examples
    --------
    >>> bool(is_physical(np.diag([1.0, 1.0, 1.0, -1.0])))
    False
    """
    matrix = _matrices(mueller)
    lowest = coherency_eigenvalues(matrix)[..., 0]
    return (matrix[..., 0, 0] >= 0) & (lowest >= -tolerance * matrix[..., 0, 0])


def _matrices(mueller: npt.ArrayLike) -> np.ndarray:
    """Check the shape (..., 4, 4)."""
    array = real_array("mueller", mueller)
    if array.ndim < 2 or array.shape[-2:] != (4, 4):
        msg = f"mueller must have shape (..., 4, 4), got {array.shape}."
        raise ValueError(msg)
    return array

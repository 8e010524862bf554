"""A scan to be observed over one surface sample, and what comes back."""

from dataclasses import dataclass, field

import numpy as np

from pbrdf.conventions import BOUNCES
from pbrdf.kernels.cones.facets import N_FACET_COUNTS
from pbrdf.kernels.paths import shading

# Exchange of source and detector: P M^T P with the signs of P (conventions, reciprocity)
RECIPROCAL = np.array([1.0, 1.0, -1.0, 1.0])


@dataclass(frozen=True, kw_only=True)
class Look:
    """Geometries, cones and materials of a run; the same for every sample.

    Attributes
    ----------
    theta_i, theta_s, dphi : ndarray, shape (geometries,)
        Axes of the cones of source and detector. [rad]
    phi_i : float or None
        Azimuth of the source; None spreads it evenly over the circle. [rad]
    source, detector : float
        Half-angles of the cones. [rad]
    n_rays, max_bounces : int
        Bundles a geometry and sample, and where their paths are cut.
    estimator : str
        One of `pbrdf.observation.run.ESTIMATORS`.
    counts : bool
        Whether paths of mirrors count if their ray meets the cone, or by what the cone that
        it stands for shares with it.
    from_source : bool
        Bundles start at the source and serve all detectors.
    hemisphere_samples, sample_decay : float
        Rays into the hemisphere above a diffuse point, times decay to the power of the
        bounces before it.
    n, kappa, base, n_stokes
        As in `pbrdf.simulation.plan.Plan`.
    """

    theta_i: np.ndarray
    theta_s: np.ndarray
    dphi: np.ndarray
    phi_i: float | None
    source: float
    detector: float
    n_rays: int
    max_bounces: int
    estimator: str
    counts: bool
    from_source: bool
    hemisphere_samples: float
    sample_decay: float
    n: np.ndarray
    kappa: np.ndarray
    base: np.ndarray
    n_stokes: int

    @property
    def size(self) -> int:
        """Number of geometries."""
        return len(self.theta_i)

    @property
    def optics(self) -> shading.Optics:
        """Substrate as the kernels take it."""
        return shading.Optics(self.n, self.kappa, self.base, self.n_stokes)

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape (geometries, bounces, wavelengths, stokes, stokes) of the matrices."""
        return self.size, len(BOUNCES), len(self.n), self.n_stokes, self.n_stokes

    def attributes(self) -> dict[str, object]:
        """Return what a result says of the way it was looked."""
        return {
            "max_bounces": self.max_bounces,
            "phi_i": "uniform" if self.phi_i is None else self.phi_i,
            "source_half_angle": self.source,
            "detector_half_angle": self.detector,
            "hemisphere_samples": self.hemisphere_samples,
            "sample_decay": self.sample_decay,
            "estimator": self.estimator,
            "further_bounces": "counted" if self.counts else "corner rays",
        }

    def solid_angles(self) -> tuple[np.ndarray, np.ndarray]:
        """Projected solid angles of the cones of source and detector. [sr]"""
        return (
            np.pi * np.sin(self.source) ** 2 * np.cos(self.theta_i),
            np.pi * np.sin(self.detector) ** 2 * np.cos(self.theta_s),
        )


@dataclass(frozen=True, kw_only=True)
class Sight:
    """What one sample showed.

    Attributes
    ----------
    brdf : ndarray, shape (geometries, bounces, wavelengths, stokes, stokes)
        Forward matrices, from source to detector. [1/sr]
    caught : ndarray of int, shape (geometries, bounces)
        Paths or facets that joined source and detector.
    tried : ndarray of int, shape (geometries,)
        Points tried on facets that may join source and detector.
    glints, glints_caught
        The part of brdf and caught that met by luck, with nothing that asked for it.
    foretold : ndarray, in the shape of brdf
        Variance of that part, foretold from the paths that passed near. [1/sr^2]
    one : ndarray, shape (geometries, bounces)
        Largest M00 that a single path of strength 1 can have added. [1/sr]
    energy : ndarray, shape (wavelengths, N_ENERGIES)
        Light of the bundles that was cut, lost or left a finite map, a bundle; NaN where
        the facets alone told all and no bundle was sent.
    counts : ndarray of int, shape (N_COUNTS,)
        Fates of the rays of the bundles, as in `pbrdf.kernels.paths.shading`.
    facet_counts : ndarray of int, shape (N_FACET_COUNTS,)
        Facets that joined the cones, points tried, seen, left aside.
    bundles : int
        Bundles sent.
    notes : tuple of str
        Warnings of what was laid on the surface.
    """

    brdf: np.ndarray
    caught: np.ndarray
    tried: np.ndarray
    glints: np.ndarray
    glints_caught: np.ndarray
    foretold: np.ndarray
    one: np.ndarray
    energy: np.ndarray
    counts: np.ndarray
    facet_counts: np.ndarray
    bundles: int
    notes: tuple[str, ...] = ()


@dataclass
class Sums:
    """Sums over one sample while it is looked at; as in `Sight`."""

    look: Look
    brdf: np.ndarray = field(init=False)
    caught: np.ndarray = field(init=False)
    tried: np.ndarray = field(init=False)
    glints: np.ndarray = field(init=False)
    glints_caught: np.ndarray = field(init=False)
    foretold: np.ndarray = field(init=False)
    one: np.ndarray = field(init=False)
    energy: np.ndarray = field(init=False)
    counts: np.ndarray = field(init=False)
    facet_counts: np.ndarray = field(init=False)
    bundles: int = 0
    valued: int = 0  # those of them whose energy is followed

    def __post_init__(self) -> None:
        shape = self.look.shape
        self.brdf = np.zeros(shape)
        self.caught = np.zeros(shape[:2], dtype=np.int64)
        self.tried = np.zeros(shape[0], dtype=np.int64)
        self.glints, self.foretold = np.zeros(shape), np.zeros(shape)
        self.glints_caught = np.zeros(shape[:2], dtype=np.int64)
        self.one = np.zeros(shape[:2])
        self.energy = np.zeros((shape[2], shading.N_ENERGIES))
        self.counts = np.zeros(shading.N_COUNTS, dtype=np.int64)
        self.facet_counts = np.zeros(N_FACET_COUNTS, dtype=np.int64)


def forward(backward: np.ndarray) -> np.ndarray:
    """Matrices from source to detector, from those of light sent the other way."""
    signs = RECIPROCAL[: backward.shape[-1]]
    swapped: np.ndarray = backward.swapaxes(-1, -2) * signs[:, None] * signs
    return swapped

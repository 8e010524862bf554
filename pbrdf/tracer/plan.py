"""What is traced over one surface sample, and the tally that comes back."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from pbrdf.conventions import BOUNCES, detector_bins
from pbrdf.kernels import shading
from pbrdf.kernels.events import Media
from pbrdf.kernels.moments import add_sample, fold_mirror
from pbrdf.kernels.neighbours import N_BESIDE, estimate
from pbrdf.kernels.spectra import N_SUMS
from pbrdf.tracer.spectra import WORTHWHILE, Spectrum


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Incident directions, materials and bins of a run; the same for every sample.

    Attributes
    ----------
    theta_i : ndarray, shape (angles,)
        Zenith angles of the source. [rad]
    phi_i : float or None
        Azimuth of the source; None spreads it evenly over the circle. [rad]
    n_rays, max_bounces : int
        Rays an incident direction and sample, and where their paths are cut.
    n, kappa : ndarray, shape (wavelengths, materials)
        Index of the substrate. [1]
    base : ndarray, shape (wavelengths, materials) or (wavelengths, 0)
        Strength of the diffuse base under the interface; of no width where there is none.
    n_stokes : int
        4 for (I, Q, U, V), 3 without V, 1 for I alone.
    n_theta, n_dphi : int
        Detector bins.
    skips : frozenset of str
        Names of the skips of `pbrdf.tracer.skips` that are allowed.
    media : Media or None
        Constants of what lies on the surface; None on a clean one.
    half_angle : float
        Half-angle of the source. [rad]
    fold : bool
        Whether each sample is averaged with its mirror image in the plane of incidence.
    """

    theta_i: np.ndarray
    phi_i: float | None
    n_rays: int
    max_bounces: int
    n: np.ndarray
    kappa: np.ndarray
    base: np.ndarray
    n_stokes: int
    n_theta: int
    n_dphi: int
    skips: frozenset[str] = frozenset()
    media: Media | None = None
    half_angle: float = 0.0
    fold: bool = False

    @property
    def splits(self) -> bool:
        """Whether a ray may come apart, so that only a part of it is lost sideways."""
        return self.base.shape[1] > 0 or self.media is not None

    @cached_property
    def spectrum(self) -> Spectrum | None:
        """What many wavelengths over one set of paths share; None for few."""
        if "spectra" not in self.skips or len(self.n) < WORTHWHILE:
            return None
        n_sums = 1 if self.n_stokes == 1 else N_SUMS
        return Spectrum.of(
            self.n, self.kappa, self.theta_i, (self.n_theta, self.n_dphi),
            half_angle=self.half_angle, n_sums=n_sums,
        )  # fmt: skip

    def at(self, phi_i: float | None) -> "Plan":
        """Return the plan of another azimuth; both share what does not depend on it."""
        other = replace(self, phi_i=phi_i)
        other.__dict__["spectrum"] = self.spectrum
        return other

    @property
    def tally_shape(self) -> tuple[int, ...]:
        """Shape (angles, wavelengths, bounces, n_theta, n_dphi, stokes, stokes)."""
        return (
            len(self.theta_i), len(self.n), len(BOUNCES),
            self.n_theta, self.n_dphi, self.n_stokes, self.n_stokes,
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Tally:
    """Flux, energy and counts of one sample, per incident direction.

    `flux` has the shape of the plan and is not normalised; `energy` (angles, wavelengths,
    4) is what was absorbed, truncated, leaked and lost sideways; `counts` (angles,
    N_COUNTS) as in `pbrdf.kernels.shading`; `reports` and `notes` tell of contaminants.
    """

    flux: np.ndarray
    energy: np.ndarray
    counts: np.ndarray
    reports: tuple[Mapping[str, Any], ...] = ()
    notes: tuple[str, ...] = ()

    @classmethod
    def empty(cls, plan: Plan) -> "Tally":
        """Nothing traced yet."""
        angles, wavelengths = plan.tally_shape[:2]
        return cls(
            flux=np.zeros(plan.tally_shape),
            energy=np.zeros((angles, wavelengths, shading.N_ENERGIES)),
            counts=np.zeros((angles, shading.N_COUNTS), dtype=np.int64),
        )

    def emptied(self) -> "Tally":
        """Give the same arrays for another sample; `Moments.add` has cleared the flux."""
        self.energy.fill(0.0)
        self.counts.fill(0)
        return replace(self, reports=(), notes=())


class Moments:
    """Mean and standard error over samples, added in a fixed order."""

    def __init__(self, plan: Plan) -> None:
        shape = plan.tally_shape
        self.plan = plan
        self.samples = 0
        self.reports: tuple[Mapping[str, Any], ...] = ()
        self.notes: dict[str, None] = {}
        self.counts = np.zeros((shape[0], shading.N_COUNTS), dtype=np.int64)
        self._mean = np.zeros(shape)
        self._scatter = np.zeros(shape)
        self._mean_total = np.zeros(shape[:2] + shape[3:])
        self._scatter_total = np.zeros(shape[:2] + shape[3:])
        self._room = np.empty(plan.n_stokes**2)
        self._albedo: list[np.ndarray] = []
        self._energy: list[np.ndarray] = []

    def add(self, tally: Tally) -> None:
        """Add one sample and clear its flux."""
        self.samples += 1
        self.counts += tally.counts
        self.reports = self.reports or tally.reports
        self.notes |= dict.fromkeys(tally.notes)
        angles, wavelengths, orders, _, _, elements, _ = tally.flux.shape
        # Rays that left a finite map sideways count in neither part of the fraction; where
        # rays split, only a part of each may leave so and has its own account
        aside = 0 if self.plan.splits else tally.counts[:, shading.N_SIDE]
        counted = np.broadcast_to(self.plan.n_rays - aside, (angles,))
        if not counted.all():
            worst = int(np.flatnonzero(counted == 0)[0])
            msg = (
                "n_rays must leave some rays on the finite map, got "
                f"{self.plan.n_rays} a batch, all of which left it sideways at theta_i "
                f"{self.plan.theta_i[worst]:.4g} rad. Take more rays, a larger map or "
                "HeightMap.mirrored()."
            )
            raise ValueError(msg)
        scale = 1.0 / counted
        by_bin = (wavelengths, orders, -1, elements * elements)
        of_all = (wavelengths, -1, elements * elements)
        albedo = np.empty((angles, wavelengths, orders))
        for a in range(angles):
            if self.plan.fold:
                fold_mirror(tally.flux[a])
            add_sample(
                tally.flux[a].reshape(by_bin), scale[a], self.samples, self._room,
                self._mean[a].reshape(by_bin), self._scatter[a].reshape(by_bin),
                self._mean_total[a].reshape(of_all),
                self._scatter_total[a].reshape(of_all), albedo[a],
            )  # fmt: skip
        self._albedo.append(albedo)
        self._energy.append(tally.energy * scale[:, None, None])

    def _one_path(self) -> np.ndarray:
        """Mean flux of one escaped path (angles, wavelengths, bounces) in the mean flux."""
        counts = self.counts[:, None, shading.N_ORDERS : shading.N_MISMATCH]
        albedo = np.mean(self._albedo, axis=0)
        return np.where(counts > 0, albedo / np.maximum(counts, 1), 0.0)

    def _one_of_all(self) -> np.ndarray:
        """Return the same for all bounces together (angles, wavelengths)."""
        one: np.ndarray = np.sqrt((self._one_path() ** 2).sum(axis=2))
        return one

    def _estimate(self, mean: np.ndarray, scatter: np.ndarray, one: np.ndarray) -> None:
        """Turn moments (..., n_theta, n_dphi, stokes, stokes) into BRDF and error in place.

        `one` (...) is the flux of one path of mean strength.
        """
        _, _, weight = detector_bins(self.plan.n_theta, self.plan.n_dphi)
        n_stokes = mean.shape[-1]
        shape = *weight.shape, n_stokes**2
        of_qu = np.arange(n_stokes) < 2
        # Odd in dphi, so nothing in the plane of incidence, whatever the noise around
        odd = (of_qu[:, None] != of_qu).ravel() & self.plan.fold
        room = (
            *np.empty((2, *weight.shape, n_stokes**2 + N_BESIDE)), np.empty(n_stokes**2),
        )  # fmt: skip
        for place in np.ndindex(mean.shape[:-4]):
            estimate(
                mean[place].reshape(shape), scatter[place].reshape(shape), self.samples,
                one[place], weight, odd, room,
            )  # fmt: skip

    def finish(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """BRDF by bounces and its standard error, and of all bounces together. [1/sr]

        Their arrays are those of the moments, which are used up.
        """
        self._estimate(self._mean, self._scatter, self._one_path())
        self._estimate(self._mean_total, self._scatter_total, self._one_of_all())
        return self._mean, self._scatter, self._mean_total, self._scatter_total

    def albedo(self) -> tuple[np.ndarray, np.ndarray]:
        """Albedo (angles, wavelengths, bounces) and its standard error."""
        values = np.array(self._albedo)
        if self.samples < 2:
            return values.mean(axis=0), np.full(values.shape[1:], np.nan)
        return values.mean(axis=0), values.std(axis=0, ddof=1) / np.sqrt(self.samples)

    def energy(self) -> np.ndarray:
        """Mean energy by fate (angles, wavelengths, 4)."""
        return np.mean(self._energy, axis=0)

    def rel_error(self) -> float:
        """Largest standard error over M00 of the bins above a tenth of the peak.

        Infinite where nothing was seen but might have been.
        """
        m00 = (..., slice(1), slice(1))
        mean, scatter = self._mean_total[m00].copy(), self._scatter_total[m00].copy()
        self._estimate(mean, scatter, self._one_of_all())
        bright = mean > 0.1 * mean.max(axis=(2, 3), keepdims=True)
        if not bright.any():
            return np.inf if scatter.any() else 0.0
        return float(np.max(scatter[bright] / mean[bright]))

"""What is traced over one surface sample, and the tally that comes back."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from pbrdf.conventions import BOUNCES
from pbrdf.kernels.bodies.world import Media
from pbrdf.kernels.paths import shading
from pbrdf.kernels.paths.path_buffer import WITHOUT_SINGLE
from pbrdf.kernels.paths.spectra import N_SUMS, Spectra
from pbrdf.simulation.spectra import WORTHWHILE, Spectrum


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
        Names of the skips of `pbrdf.simulation.skips` that are allowed.
    media : Media or None
        Constants of what light goes through; None on a clean opaque surface.
    half_angle : float
        Half-angle of the source. [rad]
    fold : bool
        Whether each sample is averaged with its mirror image in the plane of incidence.
    first : int
        Place of the first direction among all.
    among : int or None
        How many directions there are in all, if these are a part of them.
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
    first: int = 0
    among: int | None = None

    @property
    def n_streams(self) -> int:
        """How many directions draw numbers, those of other parts included."""
        return len(self.theta_i) if self.among is None else self.among

    @property
    def own(self) -> slice:
        """Which of them are of this part."""
        return slice(self.first, self.first + len(self.theta_i))

    @property
    def optics(self) -> shading.Optics:
        """Constants of the substrate, for the kernels."""
        return shading.Optics(self.n, self.kappa, self.base, self.n_stokes)

    @property
    def splits(self) -> bool:
        """Whether a ray may come apart, so that only a part of it is lost sideways."""
        return self.base.shape[1] > 0 or self.media is not None

    @property
    def walks(self) -> int:
        """How often a ray is followed: for each wavelength where light is refracted."""
        return 1 if self.media is None else len(self.n)

    @cached_property
    def spectrum(self) -> Spectrum | None:
        """What many wavelengths over one set of paths share; None for few."""
        few = len(self.n) < WORTHWHILE
        if few or "spectra" not in self.skips or self.media is not None:
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

    def part(self, first: int, last: int) -> "Plan":
        """Return the plan of some directions, which keep the rays they have among all."""
        other = replace(
            self, theta_i=self.theta_i[first:last], first=first, among=len(self.theta_i)
        )
        shared = self.spectrum
        other.__dict__["spectrum"] = shared and shared.part(first, last)
        return other

    def of_waves(self, first: int, last: int) -> "Plan":
        """Return the plan of some wavelengths, which share what all of them share."""
        own = slice(first, last)
        media = self.media
        if media is not None:
            parts = {name: part[own] for name, part in media._asdict().items()}
            media = Media(**(parts | {"black": media.black}))
        other = replace(
            self, n=self.n[own], kappa=self.kappa[own], base=self.base[own], media=media
        )
        shared = self.spectrum
        other.__dict__["spectrum"] = shared and shared.of_waves(first, last)
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

    `flux` has the shape of the plan and is not normalised; `lit` (angles, bounces, n_theta,
    n_dphi) tells which bins paths came to; `energy` (angles, wavelengths, 4) is what was
    absorbed, truncated, leaked and lost sideways; `counts` (angles, N_COUNTS) as in
    `pbrdf.kernels.paths.shading`; `reports` and `notes` tell of contaminants. Where the
    plan has a spectrum, `spectra` holds the light of each direction before it is shaded,
    and the flux means nothing but where one has overflowed into it. `single` (angles,
    n_theta, n_dphi) is the flux of single bounces if facets reflected all, where it did not
    come from the rays; `seen` then tells what else there is to know of them, by direction.
    """

    flux: np.ndarray
    lit: np.ndarray
    energy: np.ndarray
    counts: np.ndarray
    single: np.ndarray
    spectra: tuple[Spectra, ...] = ()
    seen: list[np.ndarray] = field(default_factory=list)
    reports: tuple[Mapping[str, Any], ...] = ()
    notes: tuple[str, ...] = ()

    @classmethod
    def empty(cls, plan: Plan) -> "Tally":
        """Nothing traced yet."""
        angles, wavelengths, *by_bounces = plan.tally_shape[:5]
        shared = plan.spectrum
        spectra = tuple(
            shared.room(index, plan.max_bounces) for index in range(angles) if shared
        )
        return cls(
            # Memory that nobody writes to costs nothing
            flux=(np.empty if shared else np.zeros)(plan.tally_shape),
            spectra=spectra,
            lit=np.zeros((angles, *by_bounces), dtype=bool),
            energy=np.zeros((angles, wavelengths, shading.N_ENERGIES)),
            counts=np.zeros((angles, shading.N_COUNTS), dtype=np.int64),
            single=np.full((angles, *by_bounces[1:]), np.nan),
        )

    def leave_out(self, known: np.ndarray) -> None:
        """Leave single bounces of directions (angles,) out of what waits to be shaded."""
        for light, one in zip(self.spectra, known, strict=False):
            light.state[WITHOUT_SINGLE] = one

    def emptied(self) -> "Tally":
        """Give the same arrays for another sample; `Moments.add` has cleared the flux."""
        self.lit.fill(False)
        for light in self.spectra:
            light.sums.fill(0.0)
            light.state.fill(0)
        self.energy.fill(0.0)
        self.counts.fill(0)
        return replace(self, reports=(), notes=())

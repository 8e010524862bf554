"""Bundles of rays over one surface sample, from one end of the scan to the other."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from pbrdf.kernels.cones import paths as observe_paths
from pbrdf.kernels.cones.lens import cap_flux, lens_flux
from pbrdf.kernels.cones.paths import FAR_END, Bundle, Rule
from pbrdf.kernels.cones.record import ALL, FORETOLD, GLINTS, N_AXES, Catch
from pbrdf.kernels.paths import shading
from pbrdf.observation.look import Look, Sums, forward
from pbrdf.tracer.field import Field
from pbrdf.tracer.mesh_field import MeshField

# Largest cone that stands for one sample of the hemisphere [rad]
WIDEST_SAMPLE = 0.2
# A path was near a cone within so many times the angle at which it would just add to it,
# at most this angle [rad] unless that is smaller
NEAR = 4.0
FARTHEST_NEAR = 0.35


def send_bundles(
    surface: Field | MeshField, sample: Sums, rng: np.random.Generator, kind: int,
    first: int, *, from_source: bool,
) -> None:  # fmt: skip
    """Send bundles from each distinct direction of one end to all cones of the other."""
    look = sample.look
    trip = _Trip.of(look, from_source=from_source)
    phi = np.zeros(look.size)
    if look.phi_i is not None:
        phi = look.phi_i + (np.zeros(look.size) if from_source else look.dphi)
    starts, member = np.unique(
        np.round(np.stack([trip.here, phi], axis=1), 12), axis=0, return_inverse=True
    )
    member = member.reshape(-1)

    cos_spread = max(1.0 - 1.0 / look.hemisphere_samples, np.cos(WIDEST_SAMPLE))
    rule = Rule(
        kind, first, look.counts, float(look.hemisphere_samples), float(look.sample_decay),
        cos_spread, np.sqrt(1.0 - cos_spread**2),
    )  # fmt: skip
    reach, chance = near_misses(trip.half_here, trip.half_there, counting=look.counts)
    record = np.empty((look.max_bounces + 1, 1, shading.N_RECORD))
    hits = np.empty((look.max_bounces, observe_paths.N_HIT))
    shape = look.shape[1:]
    for start, (theta, azimuth) in enumerate(starts):
        group = np.flatnonzero(member == start)
        targets = trip.targets(group, reach, chance)
        launch = surface.entry_rectangle(
            theta, None if look.phi_i is None else azimuth, trip.half_here
        )
        bundle = Bundle(
            np.sin(theta), np.cos(theta), azimuth, look.phi_i is None,
            np.cos(trip.half_here), np.sin(trip.half_here), launch,
            surface.entry_lines(launch, look.n_rays), look.n_rays, rng.random(5),
            rng.integers(2**63, dtype=np.uint64),
        )  # fmt: skip
        catch = Catch(
            np.zeros((3, len(group), *shape)),
            np.zeros((2, len(group), shape[0]), dtype=np.int64),
            np.zeros((shape[1], shading.N_ENERGIES)),
            np.zeros(shading.N_COUNTS, dtype=np.int64), np.zeros((4, 4)),
        )  # fmt: skip
        axes = np.empty((len(group), N_AXES))
        terrain, mesh = on_what(surface)
        observe_paths.trace_bundles(
            terrain, mesh, bundle, targets, axes, record, hits, look.optics, rule, catch
        )
        aside = 0 if look.base.shape[1] > 0 else int(catch.counts[shading.N_SIDE])
        if aside >= look.n_rays:
            msg = (
                f"n_rays must leave some rays on the finite map, got {look.n_rays} a "
                f"sample, all of which left it sideways at {theta:.4g} rad. Take more "
                "rays, a larger map or HeightMap.mirrored()."
            )
            raise ValueError(msg)
        trip.add(catch, group, look.n_rays - aside, sample)
        if kind != FAR_END:
            # The far end follows only some paths; the others hold all the energy
            sample.energy += catch.energy
            sample.valued += look.n_rays
        sample.counts += catch.counts
        sample.bundles += look.n_rays


@dataclass(frozen=True)
class _Trip:
    """Zeniths and half-angles of the ends where bundles start and arrive [rad].

    `turn` is the azimuth of the far end from the near one, `omega_there` the projected
    solid angle of the far end. [sr]
    """

    here: np.ndarray
    there: np.ndarray
    half_here: float
    half_there: float
    turn: np.ndarray
    omega_there: np.ndarray
    from_source: bool

    @classmethod
    def of(cls, look: Look, *, from_source: bool) -> "_Trip":
        """Return the way from the detector to the source, or the other."""
        omega_i, omega_s = look.solid_angles()
        source, detector = (look.theta_i, look.source), (look.theta_s, look.detector)
        near, far = (source, detector) if from_source else (detector, source)
        return cls(
            here=near[0], there=far[0], half_here=near[1], half_there=far[1],
            turn=look.dphi if from_source else -look.dphi,
            omega_there=omega_s if from_source else omega_i, from_source=from_source,
        )  # fmt: skip

    def targets(self, group: np.ndarray, reach: float, chance: float) -> np.ndarray:
        """Return the cones at the far end, (targets, N_TARGET)."""
        there, turn = self.there[group], self.turn[group]
        same = [np.cos(self.half_there), np.sin(self.half_there), np.cos(reach), chance]
        return np.column_stack(
            [
                np.sin(there), np.cos(there), np.cos(turn), np.sin(turn),
                np.tile(same, (len(group), 1)),
            ]
        )  # fmt: skip

    def add(self, catch: Catch, group: np.ndarray, rays: int, sample: Sums) -> None:
        """Add what so many rays of a group have caught to the sample, as BRDF."""
        scale = 1.0 / (rays * self.omega_there[group])
        flux = catch.flux * scale[:, None, None, None, None]
        foretold = flux[FORETOLD] * scale[:, None, None, None, None]
        backward = not self.from_source
        sample.brdf[group] += forward(flux[ALL]) if backward else flux[ALL]
        sample.glints[group] += forward(flux[GLINTS]) if backward else flux[GLINTS]
        sample.foretold[group] += foretold.swapaxes(-1, -2) if backward else foretold
        sample.caught[group] += catch.caught[ALL]
        sample.glints_caught[group] += catch.caught[GLINTS]
        # A bundle weighs at most as the smaller of the two cones
        weight = np.minimum(1.0, (np.sin(self.half_there) / np.sin(self.half_here)) ** 2)
        sample.one[group] = np.maximum(sample.one[group], (weight * scale)[:, None])


def on_what(surface: Field | MeshField) -> tuple[Any, Any]:
    """Terrain and mesh for the kernels, of which one is None."""
    if isinstance(surface, MeshField):
        return None, surface.facets()
    return surface.terrain, None


def near_misses(
    half_here: float, half_there: float, *, counting: bool
) -> tuple[float, float]:
    """Angle within which a path was near a cone, and the mean square of its share there.

    A path that left anywhere as near would have been as likely: from the strength of those
    that did follows the variance of what a cone gets by luck, before it gets any.
    """
    touching = half_there if counting else half_here + half_there
    reach = max(touching, min(NEAR * touching, FARTHEST_NEAR))
    edges = np.linspace(0.0, touching, 201)
    middle = 0.5 * (edges[1:] + edges[:-1])
    share = np.ones_like(middle)
    if not counting:
        here, there = ((np.cos(half), np.sin(half)) for half in (half_here, half_there))
        share = np.array([lens_flux(c, 1.0, c, *here, *there) for c in np.cos(middle)])
        share = share / cap_flux(1.0, here[1])
    ring = -np.diff(np.cos(edges)) / (1.0 - np.cos(reach))
    return reach, float(np.sum(share**2 * ring))

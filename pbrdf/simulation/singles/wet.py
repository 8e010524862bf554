"""Single bounces beside drops and spheres on a Gaussian surface, by the clean surface.

Most light that leaves a wet scene after one bounce comes from facets that no body hides,
and most of its noise is that of their slopes. Each realisation tells this noise: the same
rays over the surface without bodies, less what the law of the slopes lets expect, are zero
in the mean; and so is what bodies on a plane hide of them, less what they would hide of
the same facets elsewhere. Both are taken off the tally, whose mean stays what it is.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pbrdf.contaminants import Drops, Film
from pbrdf.contaminants.bodies import place
from pbrdf.conventions import detector_bins
from pbrdf.kernels.bins.binning import bin_edges
from pbrdf.kernels.bodies.beams import N_STATE
from pbrdf.kernels.bodies.bodies import Bodies
from pbrdf.kernels.bodies.world import N_HIT
from pbrdf.kernels.paths.shading import ABSORBED
from pbrdf.kernels.sights.beside import Counts, SightRoom, count_seen, share_seen
from pbrdf.kernels.terrain.entry import Source
from pbrdf.kernels.terrain.sweep import N_FIRST
from pbrdf.scene.scene import Scene
from pbrdf.simulation.plan import Plan, Tally
from pbrdf.simulation.singles.single_bounce import NARROWEST, SingleBounce
from pbrdf.simulation.trace import drawn, source_of
from pbrdf.surface.gaussian import GaussianSurface
from pbrdf.surface.heightmap import HeightMap
from pbrdf.tracer.wet_field import WetField, register

# Bins that are corrected: as bright on the clean surface, relative to the brightest, and
# with as many of its rays in all samples, so that no bin turns negative by chance
DARKEST, FEWEST_RAYS = 1e-3, 30.0
# It pays where the noise of the slopes rules: where bins above this part of the peak of the
# clean surface have so many rays a sample, and bodies leave so much of them
BRIGHT, LEAST_RAYS, LEAST_SHARE = 0.1, 30.0, 0.5
# Reflectance from which on too little is absorbed to take what the correction adds or takes
MOST_REFLECTED = 0.98
# Looks at facets and what they cost are a small part here: noise of bodies is left anyway
FEWER_LOOKS = 4
# Places elsewhere, for each ray
ELSEWHERE = 2
# Places at which it is tried how much of the plane bodies hide, for all bins together
PLACES = 4000


def beside_bodies(
    scene: Scene, plans: Sequence[Plan], samples: int, *, wanted: bool
) -> "list[BesideBodies] | None":
    """Correct single bounces beside bodies, of plans over a scene, where it can be done."""
    surface, plan = scene.surface, plans[0]
    if (
        not wanted
        or not isinstance(surface, GaussianSurface)
        or not scene.contaminants
        or plan.half_angle > 0.0
        or min(surface.facet_slope_rms) < NARROWEST
        or any(_spreads(one) for one in scene.contaminants)
    ):
        return None
    found = [BesideBodies.of(scene, surface, one, samples) for one in plans]
    bodies = found[0].on_plane(np.random.SeedSequence(0))
    found = [
        one.where_it_pays(bodies, each) for one, each in zip(found, plans, strict=True)
    ]
    if not any(one.wanted.any() for one in found):
        return None
    return found if max(one.reflected for one in found) < MOST_REFLECTED else None


def _spreads(contaminant: object) -> bool:
    """Whether it is a film, or may become one on a rough surface."""
    if isinstance(contaminant, Drops):
        return contaminant.contact_angle == 0.0 or contaminant.roughness == "wenzel"
    return isinstance(contaminant, Film)


@dataclass(frozen=True, kw_only=True)
class BesideBodies:
    """What is known of the single bounces of the clean surface, by the directions.

    Attributes
    ----------
    contaminants : tuple
        Those of the scene.
    single : SingleBounce
        Those of the clean surface.
    plane : HeightMap
        The plane that bodies are laid on, of the shape of the surface.
    unit : ndarray, shape (angles, n_theta, n_dphi)
        Share of the rays that leave the clean surface towards a bin after one bounce. [1]
    light : ndarray, shape (angles, wavelengths, n_theta, n_dphi, stokes, stokes)
        Mueller matrix of such a ray, in the mean; 0 where nothing is corrected. [1]
    wanted : ndarray of bool, shape (angles, n_theta, n_dphi)
        Bins that are corrected.
    """

    contaminants: tuple[Any, ...]
    single: SingleBounce
    plane: HeightMap
    unit: np.ndarray
    light: np.ndarray
    wanted: np.ndarray

    @classmethod
    def of(
        cls, scene: Scene, surface: GaussianSurface, plan: Plan, samples: int
    ) -> "BesideBodies":
        """Integrate over the slope law for every direction and wavelength of a plan."""
        fewer = max(plan.n_rays // FEWER_LOOKS, 1)
        single = SingleBounce.of(surface, replace(plan, n_rays=fewer)).with_light(plan)
        unit = single.known()
        wanted = unit > DARKEST * unit.max(axis=(1, 2), keepdims=True)
        wanted &= unit * plan.n_rays * samples > FEWEST_RAYS
        light = np.array(
            [
                [single.by_bin(one) for one in direction.light]
                for direction in single.directions
            ]
        )
        light *= np.divide(1.0, unit, out=np.zeros_like(unit), where=wanted)[
            :, None, ..., None
        ]
        n_stokes = plan.n_stokes
        return cls(
            contaminants=scene.contaminants, single=single,
            plane=HeightMap(np.zeros(surface.shape), surface.spacing, periodic=True),
            unit=unit, light=light.reshape(*light.shape[:-1], n_stokes, n_stokes),
            wanted=wanted,
        )  # fmt: skip

    @property
    def reflected(self) -> float:
        """Mean share of the light of a ray that a bounce sends out, at most."""
        unit = np.where(self.wanted, self.unit, 0.0)
        whole = np.maximum(unit.sum(axis=(1, 2)), 1e-300)[:, None]
        sent = (self.light[..., 0, 0] * unit[:, None]).sum(axis=(2, 3))
        return float((sent / whole).max())

    def where_it_pays(self, bodies: Bodies | None, plan: Plan) -> "BesideBodies":
        """Return the same for directions only where more is gained than it costs.

        `bodies` are any that may lie on the plane.
        """
        wanted = self.wanted.copy()
        for a, unit in enumerate(self.unit):
            bright = unit > BRIGHT * unit.max()
            if bodies is None or unit[bright].mean() * plan.n_rays < LEAST_RAYS:
                wanted[a] = False
                continue
            # No rays are sent
            source = Source(
                np.sin(plan.theta_i[a]), np.cos(plan.theta_i[a]), plan.phi_i or 0.0,
                plan.phi_i is None, np.zeros(4), 1, 1, np.zeros(3), np.uint64(0),
                np.sin(plan.half_angle),
            )  # fmt: skip
            share = _share(bodies, source, np.array([0.5, 0.5]), bright, _room(1))
            wanted[a] &= (share * unit)[bright].sum() > LEAST_SHARE * unit[bright].sum()
        return replace(self, wanted=wanted)

    def part(self, first: int, last: int) -> "BesideBodies":
        """Return those of some directions."""
        here = slice(first, last)
        return replace(
            self, single=self.single.part(first, last), unit=self.unit[here],
            light=self.light[here], wanted=self.wanted[here],
        )  # fmt: skip

    def of_waves(self, first: int, last: int) -> "BesideBodies":
        """Return those of some wavelengths; facets are seen alike at all."""
        return replace(
            self, single=self.single.of_waves(first, last), light=self.light[:, first:last]
        )

    def explanation(self) -> list[str]:
        """Say what is known beforehand of single bounces."""
        return [
            "Single bounces beside bodies: the noise of the slopes is taken off. The same "
            "rays over the clean surface tell it, whose mean the law of the slopes gives; "
            f"in {self.wanted.sum(axis=(1, 2)).mean():.0f} bins a direction."
        ]

    def on_plane(self, seed: np.random.SeedSequence) -> Bodies | None:
        """Lay the bodies of a sample on the plane, None if there is no room for them."""
        try:
            laid = place(self.contaminants, self.plane, seed)
        except ValueError:
            return None
        size = np.array(self.plane.size)
        return register(laid.bodies, size=size, periodic=True, z_bottom=0.0)

    def add(
        self,
        target: WetField,
        bodies: Bodies | None,
        plan: Plan,
        seeds: tuple[np.random.SeedSequence, np.random.SeedSequence],
        tally: Tally,
    ) -> None:
        """Correct the single bounces of a sample.

        `bodies` are those on the plane; `seeds` are those of its rays and of the looks.
        """
        if bodies is None:
            return
        rays, looks = seeds
        rng = np.random.default_rng(looks)
        streams = rng.integers(2**63, size=plan.n_streams, dtype=np.uint64)[plan.own]
        starts = rng.random((plan.n_streams, 2, 2))[plan.own]
        light = drawn(plan, rays)
        terrain = target.world.terrain
        for a in np.flatnonzero(self.wanted.any(axis=(1, 2))).tolist():
            expected = self.single.seen_by_bin(terrain, plan, a, streams[a])
            source = source_of(target.field, plan, a, light)
            change = self._change(
                target, bodies, source, starts[a], self.wanted[a], expected
            )
            added = change[..., None, None] * self.light[a]
            tally.flux[a, :, 0] += added
            tally.energy[a, :, ABSORBED] -= added[..., 0, 0].sum(axis=(1, 2))
            tally.lit[a, 0] |= self.wanted[a]

    def _change(
        self,
        target: WetField,
        bodies: Bodies,
        source: Source,
        starts: np.ndarray,
        wanted: np.ndarray,
        expected: np.ndarray,
    ) -> np.ndarray:
        """Rays to add to each bin (n_theta, n_dphi), zero in the mean."""
        room = _room(-(-source.n_rays // source.n_lines))
        counts = Counts(*np.zeros((3, *wanted.shape)))
        count_seen(
            target.world.terrain, bodies, source, target.field.terrain.z_top, starts[0],
            ELSEWHERE, bin_edges(*wanted.shape), wanted, room, counts,
        )  # fmt: skip
        # Of the bodies on the plane alone, so that it goes with no noise of the slopes
        share = _share(bodies, source, starts[1], wanted, room)
        excess = np.where(wanted, counts.clean - source.n_rays * expected, 0.0)
        change: np.ndarray = counts.elsewhere / ELSEWHERE - counts.here - share * excess
        return change


def _room(longest: int) -> SightRoom:
    """Room to work in, for lines of so many rays."""
    return SightRoom(np.empty((longest, N_FIRST)), np.empty((1, N_STATE)), np.empty(N_HIT))


def _share(
    bodies: Bodies, source: Source, start: np.ndarray, wanted: np.ndarray, room: SightRoom
) -> np.ndarray:
    """Share of the plane that is seen from the source and from each bin."""
    share = np.zeros(wanted.shape)
    theta_s, dphi, _ = detector_bins(*wanted.shape)
    places = max(PLACES // max(int(wanted.sum()), 1), 8)
    share_seen(bodies, source, start, places, wanted, (theta_s, dphi), room, share)
    return share

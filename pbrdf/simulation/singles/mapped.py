"""Single bounces of one height map by its facets instead of by rays.

The rays of a batch meet facets of the map by chance, yet where each facet sends how much
light is known. So the light of one bounce is a sum over all facets by what a few points of
each tell, the same in all batches; what is wrong with that, as some facets are seen in part
only, is sampled by looks at random points of the map, nearly all of which agree.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from pbrdf.kernels.bins.binning import bin_edges
from pbrdf.kernels.paths.shading import N_ESCAPED, N_ORDERS
from pbrdf.kernels.sights.mapped import (
    L_DPHI,
    L_FLUX,
    L_THETA,
    N_LOOK,
    FacetSums,
    add_facets,
    look_at_map,
    shade_looks,
)
from pbrdf.kernels.terrain.entry import Source
from pbrdf.kernels.terrain.heightfield import Terrain
from pbrdf.simulation.plan import Plan, Tally
from pbrdf.simulation.trace import prepare, source_of
from pbrdf.surface import HeightMap
from pbrdf.tracer.embree import EmbreeField
from pbrdf.tracer.field import Field

# Facets of a map for each ray of all batches, at most: beyond, their sum costs too much
FACETS_PER_RAY = 40
# Largest variance of whether a point of a facet is seen
MOST_AMISS = 0.25


def map_of_facets(
    surface: object, plans: Sequence[Plan], samples: int, *, wanted: bool
) -> Field | EmbreeField | None:
    """Make a map ready whose facets give the single bounces of plans, where it is worth it.

    Not of directions from which much light leaves a finite map sideways: what rays leave
    out then is not what looks at facets do.
    """
    plan = plans[0]
    if (
        not wanted
        or not isinstance(surface, HeightMap)
        or surface.missing > 0.0
        or plan.media is not None
        or plan.base.shape[1] > 0
        or plan.half_angle > 0.0
        or any(one.phi_i is None for one in plans)
        or 2 * surface.heights.size > FACETS_PER_RAY * plan.n_rays * samples
    ):
        return None
    target = prepare(surface, plan.skips)
    assert isinstance(target, Field | EmbreeField)
    field = target if isinstance(target, Field) else target.field
    ways = product(plan.theta_i.tolist(), [one.phi_i for one in plans])
    return target if any(field.is_guarded(*way) for way in ways) else None


@dataclass(frozen=True, kw_only=True)
class MappedSingle:
    """Single bounces of the directions of a plan over one map.

    Attributes
    ----------
    target : Field or EmbreeField
        The map, ready for tracing.
    light : ndarray, shape (angles, wavelengths, n_theta, n_dphi, stokes, stokes)
        Flux from facets by what their points tell, of one unit that comes in. [1]
    points : ndarray of uint8, shape (angles, cells along x, cells along y, 2)
        Points of each facet that are seen.
    whole, seen, partly : ndarray, shape (angles, n_theta, n_dphi)
        Flux of facets that reflect all: if none hides another, of what their points say is
        seen, and of those with points seen and points hidden. [1]
    places : ndarray, shape (angles, n_theta, n_dphi)
        Looks of a batch at facets of a bin, in the mean.
    served, sure : tuple of bool
        For each direction, whether facets serve it, and whether nothing is hidden for
        certain.
    one_of_many : bool
        Whether they are of one direction among several.
    """

    target: Field | EmbreeField
    light: np.ndarray
    points: np.ndarray
    whole: np.ndarray
    seen: np.ndarray
    partly: np.ndarray
    places: np.ndarray
    served: tuple[bool, ...]
    sure: tuple[bool, ...]
    one_of_many: bool

    @classmethod
    def of(cls, target: Field | EmbreeField, plan: Plan) -> "MappedSingle":
        """Sum over the facets for every direction and wavelength of a plan."""
        field = target if isinstance(target, Field) else target.field
        angles, waves, _, *bins = plan.tally_shape
        light = np.zeros((angles, waves, 1, *bins))
        sums = np.zeros((4, angles, *bins[:2]))
        cells = np.array(field.terrain.heights.shape) - (0 if field.periodic else 1)
        points = np.empty((angles, *cells, 2), dtype=np.uint8)
        edges = bin_edges(*bins[:2])
        served = tuple(field.is_guarded(one, plan.phi_i) for one in plan.theta_i.tolist())
        sure = tuple(
            served[a]
            and add_facets(
                field.terrain, _source(field, plan, a), edges, plan.optics, points[a],
                np.empty((1, N_LOOK)), light[a], np.empty((4, 4)), FacetSums(*sums[:, a]),
            )
            for a in range(angles)
        )  # fmt: skip
        whole, seen, partly, number = sums
        facets = points[0].size
        return cls(
            target=target, light=light[:, :, 0], points=points, whole=whole, seen=seen,
            partly=partly, places=number * (plan.n_rays / facets), served=served,
            sure=sure, one_of_many=plan.n_streams > angles == 1,
        )  # fmt: skip

    @property
    def everything(self) -> bool:
        """Whether no facet hides another, so that no light is left for further bounces."""
        return all(self.sure)

    def certain(self) -> np.ndarray:
        """Say the same of each direction (angles,)."""
        return np.array(self.sure)

    def serves(self) -> np.ndarray:
        """Say of which directions facets give the single bounces (angles,)."""
        return np.array(self.served)

    def hidden(self) -> np.ndarray:
        """Return the share of a bin that is hidden (angles, n_theta, n_dphi)."""
        return _parts(self.whole - self.seen, self.whole)

    def doubtful(self) -> np.ndarray:
        """Return the mean square of what a look at a bin finds amiss, about (as `hidden`).

        It is no more for facets that are seen in part; the others are taken to agree.
        """
        return MOST_AMISS * _parts(self.partly, self.whole)

    def looks(self) -> np.ndarray:
        """Count the looks of a batch at a bin (as `hidden`)."""
        return np.rint(self.places).astype(np.int64)

    def part(self, first: int, last: int) -> "MappedSingle":
        """Return those of some directions."""
        own = {
            name: getattr(self, name)[first:last]
            for name in (
                "light",
                "points",
                "whole",
                "seen",
                "partly",
                "places",
                "served",
                "sure",
            )
        }
        alone = len(self.sure) > last - first == 1
        return replace(self, **own, one_of_many=self.one_of_many or alone)

    def of_waves(self, first: int, last: int) -> "MappedSingle":
        """Return those of some wavelengths; facets are seen alike at all."""
        return replace(self, light=self.light[:, first:last])

    def explanation(self) -> list[str]:
        """Say what the single bounces do without."""
        if self.everything:
            return [
                "Rays: none. No facet hides another, and single bounces are a sum over the "
                "facets of the map."
            ]
        return [
            "Single bounces: not from rays but the sum over all facets of the map by what "
            "four points of each see, and what looks at as many random points as there are "
            "rays find amiss."
        ]

    def add(
        self,
        terrain: Terrain | None,
        plan: Plan,
        seed: np.random.SeedSequence,
        tally: Tally,
    ) -> None:
        """Put single bounces in the place of those of the rays of a batch.

        `terrain` is None where nothing hides anything and no ray was traced.
        """
        starts = np.random.default_rng(seed).random((plan.n_streams, 2))[plan.own]
        field = self.target if isinstance(self.target, Field) else self.target.field
        edges = bin_edges(plan.n_theta, plan.n_dphi)
        rows = np.empty((0 if terrain is None else plan.n_rays, N_LOOK))
        for a in range(len(plan.theta_i)):
            found = 0
            if not self.served[a]:
                tally.seen[a:] = [rows[:0]]
                continue
            if terrain is None:
                tally.counts[a, [N_ESCAPED, N_ORDERS]] = plan.n_rays
            elif not self.sure[a]:
                found = look_at_map(
                    terrain, _source(field, plan, a), edges, self.points[a], starts[a],
                    plan.n_rays, rows,
                )  # fmt: skip
            tally.seen[a:] = [rows[:found].copy()]
            for w in range(0 if tally.spectra else len(plan.n)):
                tally.flux[a, w, 0] = self.bounce(plan, tally, a, w)
            tally.lit[a, 0] = self.whole[a] > 0.0
            amiss = np.zeros(self.seen[a].shape)
            bins = (rows[:found, column].astype(int) for column in (L_THETA, L_DPHI))
            np.add.at(amiss, tuple(bins), rows[:found, L_FLUX])
            tally.lit[a, 0] |= amiss != 0.0
            tally.single[a] = self.seen[a] + amiss

    def bounce(self, plan: Plan, tally: Tally, angle: int, wave: int) -> np.ndarray:
        """Return those of a batch (n_theta, n_dphi, stokes, stokes), in rays of light."""
        light = self.light[angle, wave][None, None].copy()
        shade_looks(tally.seen[angle], wave, 0, plan.optics, light, np.empty((4, 4)))
        return plan.n_rays * light[0, 0]


def _source(field: Field, plan: Plan, angle: int) -> Source:
    """Return a direction of a plan; no number of it is by chance."""
    nothing = np.zeros((len(plan.theta_i), 5)), np.zeros(len(plan.theta_i), dtype=np.uint64)
    return source_of(field, plan, angle, nothing)


def _parts(some: np.ndarray, whole: np.ndarray) -> np.ndarray:
    return np.divide(some, whole, out=np.zeros_like(whole), where=whole > 0.0)

"""Single bounces over a Gaussian surface, from facets of given slopes instead of rays.

The rays of one realisation meet the facets that happen to be in it; how often facets of
each slope occur is known exactly. So the light of one bounce is an integral over the known
slope law, under Smith's height-correlated rule of hiding, times the number of facets seen
in units of that rule. Only the second factor is sampled, on the realisations that the rays
of further bounces go through, by facets of fitting slopes put at random places.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, TypeGuard

import numpy as np

from pbrdf.kernels.paths.shading import N_ESCAPED, N_ORDERS
from pbrdf.kernels.sights.light import (
    ALL,
    N_CELL,
    RISE_DPHI,
    RISE_THETA,
    SEEN,
    SlopeLaw,
    fill_light,
)
from pbrdf.kernels.sights.looks import N_OF_LOOK, Ensemble, LookRoom, Looks, look
from pbrdf.kernels.sights.profiles import Profiles
from pbrdf.kernels.sights.rules import rules_from
from pbrdf.kernels.sights.walk import N_OF_RAY, Mesh, Rays
from pbrdf.kernels.terrain.heightfield import Terrain
from pbrdf.scene.scene import Scene
from pbrdf.simulation.plan import Plan, Tally
from pbrdf.simulation.singles.ensemble import facet_ensemble
from pbrdf.simulation.singles.profiles import NO_PROFILES, profiles_of
from pbrdf.simulation.spectra import WORTHWHILE
from pbrdf.surface import GaussianSurface, Surface

# Pairs of looks without a surface to each ray of a realisation, for each azimuth's cells,
# and places with a facet on it that correct them; places without such pairs
PAIRS_PER_RAY, PLACES_PER_RAY, PLACES_ALONE = 0.1, 0.005, 0.02
# Places for a column of cells in the mean, at least
FEWEST_PLACES = 0.25
# Cells of directions are no wider than these parts of a quarter and of a full circle
LEAST_THETA, LEAST_DPHI = 30, 60
# Flux below which hiding changes nothing
NOTHING = 1e-13
# Bins darker than this part of the brightest get fewer looks, and below this part none:
# there Smith's rule stands, with an error as large as what it hides
DARK, DARKEST = 0.1, 1e-5
# Slope rms below which rays do: all their light falls into a bin or two, and the panels of
# the integral are as many as one over its square
NARROWEST = 1e-3
# Azimuths of a circle over which a spread source is averaged: from so many, doubled up to
# so many
FEW_AZIMUTHS, MANY_AZIMUTHS = 8, 256


def without_rays(
    scene: Scene, plans: Sequence[Plan], *, wanted: bool
) -> "list[SingleBounce] | None":
    """Single bounces of plans over a scene, where wanted and to be had without rays."""
    surface = scene.surface
    if not wanted or not can_do_without(surface, plans[0]):
        return None
    return [SingleBounce.of(surface, one) for one in plans]


def can_do_without(surface: Surface, plan: Plan) -> TypeGuard[GaussianSurface]:
    """Whether single bounces of a plan over a surface are to be had without rays."""
    return (
        isinstance(surface, GaussianSurface)
        and plan.media is None
        and plan.base.shape[1] == 0
        and plan.half_angle == 0.0
        and min(surface.facet_slope_rms) >= NARROWEST
    )


@dataclass(frozen=True, kw_only=True)
class Direction:
    """Single bounces of one incident direction.

    Attributes
    ----------
    light : ndarray, shape (wavelengths, cells, cells, elements)
        Flux into cells of directions under Smith's rule, of one unit that comes in; of no
        wavelengths where these are many and not yet needed. [1]
    cells : ndarray, shape (cells, cells, N_CELL)
        Flux of facets that reflect all, with and without hiding; see the kernel.
    wanted : ndarray of bool, shape (cells, cells)
        Whether a cell is looked at.
    places : ndarray, shape (cells,)
        Places a realisation for the cells of each dphi, in the mean.
    pairs : ndarray of int, shape (cells,)
        Pairs of looks a realisation without a surface, likewise.
    change : ndarray, shape (cells,)
        Logarithmic change of the flux of such cells across dphi.
    profiles : Profiles
        Lines of the looks without a surface.
    """

    light: np.ndarray
    cells: np.ndarray
    wanted: np.ndarray
    places: np.ndarray
    pairs: np.ndarray
    change: np.ndarray
    profiles: Profiles

    @property
    def looks(self) -> np.ndarray:
        """Looks at the cells of each dphi (cells,)."""
        return np.where(self.pairs > 0, 2.0 * self.pairs, self.places)


@dataclass(frozen=True, kw_only=True)
class SingleBounce:
    """Single bounces of the directions of a plan.

    Attributes
    ----------
    ensemble : Ensemble
        The random surface, for the kernel.
    along_x, along_y : ndarray
        Its autocorrelation at lags -1, 0, ... of the grid.
    parts : (int, int)
        Cells of a bin along theta_s and dphi.
    directions : tuple of Direction
    among : SingleBounce, optional
        Those of all directions, if these are a part of them.
    """

    ensemble: Ensemble
    along_x: np.ndarray
    along_y: np.ndarray
    parts: tuple[int, int]
    directions: tuple[Direction, ...]
    among: "SingleBounce | None" = None

    def part(self, first: int, last: int) -> "SingleBounce":
        """Return those of some directions."""
        return replace(self, directions=self.directions[first:last], among=self)

    def with_light(self, plan: Plan) -> "SingleBounce":
        """Return those of a plan of the same directions with the light of wavelengths."""
        if all(len(one.light) == len(plan.n) for one in self.directions):
            return self
        directions = tuple(
            # Too large to be kept for other runs
            replace(one, light=_averaged.__wrapped__(*_what(theta, law, plan, plan.n))[0])
            for law in [self.ensemble.law]
            for theta, one in zip(plan.theta_i, self.directions, strict=True)
        )
        return replace(self, directions=directions, among=self.among or self)

    def of_waves(self, first: int, last: int) -> "SingleBounce":
        """Return those of some wavelengths; facets are seen alike at all."""
        directions = tuple(
            replace(one, light=one.light[first:last]) for one in self.directions
        )
        return replace(self, directions=directions)

    @classmethod
    def of(cls, surface: GaussianSurface, plan: Plan) -> "SingleBounce":
        """Integrate over the slope law for every direction and wavelength of a plan."""
        ensemble = facet_ensemble(surface)
        parts = cell_parts(plan)
        along_x, along_y = (
            np.concatenate([c[1:2], c, c[:1]])
            for c in (surface.correlation(0), surface.correlation(1))
        )
        directions = tuple(
            _direction(theta, surface, ensemble, (along_x, along_y), plan)
            for theta in plan.theta_i
        )
        return cls(
            ensemble=ensemble, along_x=along_x, along_y=along_y, parts=parts,
            directions=directions,
        )  # fmt: skip

    @property
    def everything(self) -> bool:
        """Whether no facet hides another, so that no light is left for further bounces."""
        directions = (self if self.among is None else self.among).directions
        seen = [one.cells[..., SEEN].sum() for one in directions]
        return bool(np.abs(1.0 - np.array(seen)).max() < 10 * NOTHING)

    @property
    def one_of_many(self) -> bool:
        """Whether they are of one direction among several."""
        whole = self.among
        return whole is not None and len(whole.directions) > len(self.directions) == 1

    def certain(self) -> np.ndarray:
        """Say of each direction whether nothing is hidden in any (angles,)."""
        return np.full(len(self.directions), self.everything)

    def serves(self) -> np.ndarray:
        """Say that they are known of all directions (angles,)."""
        return np.full(len(self.directions), fill_value=True)

    def doubtful(self) -> np.ndarray:
        """Return the probability that a look tells of a hidden facet (as `hidden`)."""
        return self.hidden()

    def hidden(self) -> np.ndarray:
        """Return the share of a bin that Smith's rule hides (angles, n_theta, n_dphi)."""
        cells = np.array([self.by_bin(one.cells) for one in self.directions])
        whole = cells[..., ALL]
        return np.divide(
            whole - cells[..., SEEN], whole, out=np.zeros_like(whole), where=whole > 0.0
        )

    def looks(self) -> np.ndarray:
        """Count the places that see a bin in a realisation (angles, n_theta, n_dphi)."""
        places = []
        for one in self.directions:
            # Cells of one azimuth share their places: a bin sees as many as one row of it
            seen = np.where(one.wanted, one.looks, 0)
            rows = seen.reshape(-1, self.parts[0], seen.shape[1]).max(axis=1)
            places.append(rows.reshape(len(rows), -1, self.parts[1]).sum(axis=2))
        return np.array(places)

    def explanation(self) -> list[str]:
        """Say what the single bounces do without."""
        if self.everything:
            return [
                "Rays and realisations: none. No facet hides another, and single bounces "
                "are an integral."
            ]
        looks = np.mean([(one.wanted * one.looks).sum() for one in self.directions])
        return [
            "Single bounces: not from rays but from the law of the slopes, times the share "
            "of the facets that is seen in units of Smith's rule, from "
            f"{looks:.0f} looks a realisation and direction."
        ]

    def known(self) -> np.ndarray:
        """Return the share of rays into a bin by Smith's rule (angles, n_theta, n_dphi)."""
        return np.array([self.by_bin(one.cells)[..., SEEN] for one in self.directions])

    def seen_by_bin(
        self, terrain: Terrain, plan: Plan, angle: int, stream: np.uint64
    ) -> np.ndarray:
        """Return the same share in a realisation, by looks (n_theta, n_dphi)."""
        unit = self.directions[angle].cells[..., SEEN]
        if not self.everything:
            unit = unit * self._look(terrain, plan, angle, stream)
        return self.by_bin(unit[..., None])[..., 0]

    def by_bin(self, values: np.ndarray) -> np.ndarray:
        """Sum cells (cells, cells, ...) over those of each bin."""
        a, b = self.parts
        n_theta, n_dphi = values.shape[0] // a, values.shape[1] // b
        return values.reshape(n_theta, a, n_dphi, b, *values.shape[2:]).sum(axis=(1, 3))

    def add(
        self,
        terrain: Terrain | None,
        plan: Plan,
        seed: np.random.SeedSequence,
        tally: Tally,
    ) -> None:
        """Put single bounces in the place of those of the rays of a sample.

        `terrain` is that of the realisation, None where nothing hides anything.
        """
        streams = np.random.default_rng(seed).integers(
            2**63, size=plan.n_streams, dtype=np.uint64
        )[plan.own]
        for a, one in enumerate(self.directions):
            if terrain is None:
                tally.counts[a, [N_ESCAPED, N_ORDERS]] = plan.n_rays
                seen = np.ones(one.wanted.shape)
            else:
                seen = self._look(terrain, plan, a, streams[a])
            tally.seen[a:] = [seen]
            for w in range(0 if tally.spectra else len(one.light)):
                tally.flux[a, w, 0] = self.bounce(plan, tally, a, w)
            unit = one.cells[..., SEEN]
            tally.lit[a, 0] = self.by_bin(unit[..., None])[..., 0] > 0.0
            tally.single[a] = self.by_bin((unit * seen)[..., None])[..., 0]

    def bounce(self, plan: Plan, tally: Tally, angle: int, wave: int) -> np.ndarray:
        """Return those of a sample (n_theta, n_dphi, stokes, stokes), in rays of light."""
        light = self.directions[angle].light[wave] * tally.seen[angle][..., None]
        return plan.n_rays * self.by_bin(light).reshape(tally.flux.shape[3:])

    def _look(
        self, terrain: Terrain, plan: Plan, angle: int, stream: np.uint64
    ) -> np.ndarray:
        one = self.directions[angle]
        seen = np.ones(one.wanted.shape)
        if one.wanted.any():
            nodes, rows = one.profiles.nodes.shape[1], len(one.wanted)
            normals = np.random.default_rng(int(stream)).standard_normal(
                (one.pairs.sum(), nodes)
            )
            looks = Looks(
                plan.theta_i[angle], plan.phi_i or 0.0, plan.phi_i is None,
                -np.pi / plan.n_dphi, one.cells, one.wanted, one.places, one.pairs,
                one.change, stream, normals,
            )  # fmt: skip
            mesh = Mesh(terrain, self.along_x, self.along_y)
            room = LookRoom(
                Rays(*np.empty((N_OF_RAY, rows))), np.empty((N_OF_LOOK, rows)),
                (np.empty(nodes), np.empty(rows)),
            )  # fmt: skip
            look(mesh, self.ensemble, looks, one.profiles, room, seen)
        return seen


def _direction(
    theta: float,
    surface: GaussianSurface,
    ensemble: Ensemble,
    along: tuple[np.ndarray, np.ndarray],
    plan: Plan,
) -> Direction:
    few = len(plan.n) < WORTHWHILE
    what = _what(theta, ensemble.law, plan, plan.n if few else plan.n[:0])
    light, cells = _averaged(*what)
    wanted, shares = _shares(cells, cell_parts(plan))
    flux = np.where(wanted, cells[..., SEEN], 0.0)
    change = (flux * cells[..., RISE_DPHI]).sum(axis=0) / np.maximum(
        flux.sum(axis=0), 1e-300
    )
    looked = wanted.any(axis=0)
    alone = np.rint(shares * plan.n_rays * PLACES_ALONE)
    places = np.where(looked, np.maximum(alone, 1.0), 0.0)
    pairs, profiles = np.zeros(len(shares), dtype=np.int64), NO_PROFILES
    if plan.phi_i is not None and looked.any():
        number = np.rint(shares * plan.n_rays * PAIRS_PER_RAY).astype(np.int64)
        pairs = np.where(looked, np.maximum(number, 1), 0)
        fewer = np.maximum(shares * plan.n_rays * PLACES_PER_RAY, FEWEST_PLACES)
        places = np.where(looked, fewer, 0.0)
        profiles = profiles_of(
            surface, ensemble, along, (float(theta), plan.phi_i), cells, wanted, change,
            -np.pi / plan.n_dphi,
        )  # fmt: skip
    return Direction(
        light=light, cells=cells, wanted=wanted, places=places, pairs=pairs, change=change,
        profiles=profiles,
    )  # fmt: skip


def cell_parts(plan: Plan) -> tuple[int, int]:
    """Count the cells of a bin along theta_s and dphi."""
    return -(-LEAST_THETA // plan.n_theta), -(-LEAST_DPHI // plan.n_dphi)


def _what(theta: float, law: SlopeLaw, plan: Plan, n: np.ndarray) -> tuple[Any, ...]:
    """Say what is integrated, at the wavelengths of n: arguments of `_averaged`."""
    kappa = plan.kappa[: len(n), 0].tolist()
    bins, parts = (plan.n_theta, plan.n_dphi), cell_parts(plan)
    return (
        float(theta), plan.phi_i, law, bins, (bins[0] * parts[0], bins[1] * parts[1]),
        (tuple(zip(n[:, 0].tolist(), kappa, strict=True)), plan.n_stokes),
    )  # fmt: skip


# Runs that differ in their seeds or rays share their integrals
@lru_cache(maxsize=32)
def _averaged(
    theta: float,
    phi_i: float | None,
    law: SlopeLaw,
    bins: tuple[int, int],
    shape: tuple[int, int],
    index: tuple[tuple[tuple[float, float], ...], int],
) -> tuple[np.ndarray, np.ndarray]:
    """Light and cells of one zenith angle, averaged over azimuths if they are spread."""
    (n, kappa), n_stokes = np.array(index[0]).reshape(-1, 2).T.copy(), index[1]
    left = -np.pi / bins[1]

    def at(phi: Sequence[float] | np.ndarray, cells: np.ndarray) -> np.ndarray:
        light = np.empty((*shape, len(n), n_stokes**2))
        fill_light(
            theta, np.asarray(phi), law, rules_from(left), n, kappa, n_stokes,
            light, cells,
        )  # fmt: skip
        return np.ascontiguousarray(np.moveaxis(light, 2, 0))

    cells = np.empty((*shape, N_CELL))
    if phi_i is not None:
        light = at([phi_i], cells)
    else:
        # Half a circle of azimuths: the law is the same for a slope and its negative, and
        # so is the light of a surface that is turned by half
        number = FEW_AZIMUTHS // 2
        light = at(np.arange(number) * (np.pi / number), cells)
        change = np.inf
        while change > 1e-10 * cells[..., ALL].max() and 2 * number < MANY_AZIMUTHS:
            # Points between those that are there make a rule of twice as many
            between = np.empty_like(cells)
            more = at((np.arange(number) + 0.5) * (np.pi / number), between)
            change = np.abs(between[..., ALL] - cells[..., ALL]).max()
            light, number = 0.5 * (light + more), 2 * number
            cells[..., :RISE_THETA] += between[..., :RISE_THETA]
            cells[..., :RISE_THETA] *= 0.5
    for array in (light, cells):
        array.setflags(write=False)
    return light, cells


def _shares(cells: np.ndarray, parts: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Cells to look at, and shares of looks by column for like errors of bright bins."""
    whole, seen = cells[..., ALL], cells[..., SEEN]
    share = np.divide(seen, whole, out=np.ones_like(seen), where=whole > 0.0)
    variance = (1.0 - share) / np.maximum(share, 1e-300)
    a, b = parts
    n_theta, n_dphi = whole.shape[0] // a, whole.shape[1] // b
    of_bin = seen.reshape(n_theta, a, n_dphi, b).sum(axis=(1, 3))
    area = np.sin(np.pi * (np.arange(n_theta) + 0.5) / n_theta)[:, None]
    bright = of_bin / area
    dim = np.minimum(1.0, bright / (DARK * max(bright.max(), 1e-300)))
    per_bin = np.divide(np.sqrt(dim), of_bin, out=np.zeros_like(of_bin), where=of_bin > 0.0)
    part = seen * np.repeat(np.repeat(per_bin, a, axis=0), b, axis=1)
    wanted = whole - seen >= NOTHING / whole.size
    dark = bright < DARKEST * bright.max()
    wanted &= ~np.repeat(np.repeat(dark, a, axis=0), b, axis=1)
    weight = np.sqrt((part**2 * variance * wanted).sum(axis=0))
    return wanted, weight / max(weight.sum(), 1e-300)

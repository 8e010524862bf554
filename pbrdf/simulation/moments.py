"""Mean and standard error over the tallies of many samples."""

from collections.abc import Callable, Iterable, Mapping
from copy import copy
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from pbrdf.conventions import detector_bins
from pbrdf.kernels.bins import neighbours
from pbrdf.kernels.bins.bin_fits import MAX_ORDER
from pbrdf.kernels.bins.moments import Running, add_sample, fold_lit, fold_sample
from pbrdf.kernels.paths import shading
from pbrdf.kernels.paths.path_buffer import OVERFLOWED
from pbrdf.kernels.paths.spectra import Room, add_spectrum, shade_kept
from pbrdf.simulation.plan import Plan, Tally
from pbrdf.simulation.singles.balance import Balance
from pbrdf.simulation.singles.clean import Clean

# Wavelengths that one thread adds at a time, and parts of the spectrum at most
PER_PART, MOST_PARTS = 4, 16


class Moments:
    """Mean and standard error over samples, added in a fixed order.

    With single bounces that do not come from the rays, `single` tells of them.
    """

    def __init__(self, plan: Plan, single: Clean | None = None) -> None:
        shape = plan.tally_shape
        self.plan = plan
        self.balance = None if single is None else Balance(single, shape)
        self.samples = 0
        self.reports: tuple[Mapping[str, Any], ...] = ()
        self.notes: dict[str, None] = {}
        self.counts = np.zeros((shape[0], shading.N_COUNTS), dtype=np.int64)
        self._mean = np.zeros(shape)
        self._scatter = np.zeros(shape)
        self._scatter_total = np.zeros(shape[:2] + shape[3:])
        self._lit = np.zeros((shape[0], *shape[2:5]), dtype=bool)
        self._matrix = np.empty(plan.n_stokes**2)
        most = max(len(plan.n) // PER_PART, 1)
        parts = min(MOST_PARTS, most) if plan.spectrum else 0
        self._parts = [_Part.of(plan, *ends) for ends in _cut(len(plan.n), parts)]
        self._albedo: list[np.ndarray] = []
        self._energy: list[np.ndarray] = []

    def add(self, tally: Tally, run: Callable[..., Iterable[Any]] = map) -> None:
        """Add one sample and clear its flux; `run` maps over the parts of a spectrum."""
        self.samples += 1
        self.counts += tally.counts
        self.reports = self.reports or tally.reports
        self.notes |= dict.fromkeys(tally.notes)
        angles, wavelengths, orders = tally.flux.shape[:3]
        aside = 0 if self.plan.splits else tally.counts[:, shading.N_SIDE]
        counted = np.broadcast_to(self.plan.n_rays - aside, (angles,))
        self._check(counted)
        albedo = np.empty((angles, wavelengths, orders))
        for a in range(angles):
            if self.plan.fold:
                fold_lit(tally.lit[a])
            self._lit[a] |= tally.lit[a]
            running = Running(
                1.0 / counted[a], self.samples, self._lit[a].reshape(orders, -1),
                _by_bin(self._mean[a]), _by_bin(self._scatter[a]),
                _by_bin(self._scatter_total[a]), albedo[a],
            )  # fmt: skip
            if self.balance is not None:
                self.balance.begin(a, tally, self.plan.n_rays, float(counted[a]))
            if tally.spectra:
                known = self.balance is not None and self.balance.serves[a]
                add = partial(
                    _add_part, self.plan, tally, a, int(counted[a]), running,
                    self.balance if known else None,
                )  # fmt: skip
                # Each part is waited for, and its error raised
                list(run(add, self._parts))
                continue
            if self.plan.fold:
                fold_sample(tally.flux[a], tally.lit[a])
            if self.balance is not None:
                change = tally.flux[a, ..., 0, 0] * running.scale
                self.balance.add(a, slice(None), change - self._mean[a, ..., 0, 0])
            add_sample(_by_bin(tally.flux[a]), self._matrix, running)
        self._albedo.append(albedo)
        self._energy.append(tally.energy / counted[:, None, None])

    def of_waves(self, first: int, last: int, plan: Plan) -> "Moments":
        """Return those of some wavelengths, of the plan of these alone.

        Both look at the same numbers: finish only one of them.
        """
        part = copy(self)
        part.plan, own = plan, np.s_[:, first:last]
        part.balance = self.balance and self.balance.of_waves(own)
        for name in ("_mean", "_scatter", "_scatter_total"):
            setattr(part, name, getattr(self, name)[own])
        part._albedo = [one[own] for one in self._albedo]
        part._energy = [one[own] for one in self._energy]
        return part

    def _check(self, counted: np.ndarray) -> None:
        """Raise if all rays of a direction left a finite map sideways.

        Such rays count in neither part of the fraction; where rays split, only a part of
        each may leave so and has its own account.
        """
        if not counted.all():
            worst = int(np.flatnonzero(counted == 0)[0])
            msg = (
                "n_rays must leave some rays on the finite map, got "
                f"{self.plan.n_rays} a batch, all of which left it sideways at theta_i "
                f"{self.plan.theta_i[worst]:.4g} rad. Take more rays, a larger map or "
                "HeightMap.mirrored()."
            )
            raise ValueError(msg)

    def _one_path(self) -> np.ndarray:
        """Mean flux of one escaped path (angles, wavelengths, bounces) in the mean flux.

        A class of bounces that no path reached has that of the nearest class that some did,
        first of fewer bounces, which weaken light less; without any, that of a whole ray.
        """
        counts = self._by_class()
        albedo = np.mean(self._albedo, axis=0)
        one = np.where(counts > 0, albedo / np.where(counts > 0, counts, 1.0), np.nan)
        for order in range(1, one.shape[2]):
            one[..., order] = _or_else(one[..., order], one[..., order - 1])
        for order in reversed(range(one.shape[2] - 1)):
            one[..., order] = _or_else(one[..., order], one[..., order + 1])
        one = _or_else(one, 1.0 / (self.plan.n_rays * self.samples))
        if self.balance is not None:
            # What comes without rays is known where no ray came, too
            for of_angle, known in zip(one, self.balance.known, strict=True):
                of_angle[:, :known] = 0.0
        return one

    def _by_class(self) -> np.ndarray:
        """Count escaped paths of a wavelength (angles, 1, bounces)."""
        counts = self.counts[:, None, shading.N_ORDERS : shading.N_MISMATCH]
        return counts / self.plan.walks

    def _one_of_all(self) -> np.ndarray:
        """Return the same for all bounces together (angles, wavelengths)."""
        one = self._one_path()
        # Of the classes that paths reached; of all, which are alike, if none did
        squares = np.where(self._by_class() > 0, one**2, 0.0).sum(axis=2)
        total: np.ndarray = np.sqrt(np.where(squares > 0.0, squares, one[..., 0] ** 2))
        return total

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
        room = neighbour_room(weight.shape, n_stokes**2)
        for place in np.ndindex(mean.shape[:-4]):
            neighbours.estimate(
                mean[place].reshape(shape), scatter[place].reshape(shape), self.samples,
                one[place], weight, odd, room,
            )  # fmt: skip

    def finish(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """BRDF by bounces and its standard error, and of all bounces together. [1/sr]

        Their arrays are those of the moments, which are used up.
        """
        if self.balance is not None:
            # One wavelength after another: copies of the moments are made on the way
            for w in range(self._mean.shape[1]):
                own = slice(None), slice(w, w + 1)
                self.balance.of_waves(own).settle(
                    self._mean[own], self._scatter[own], self._scatter_total[own]
                )
        total = self._mean.sum(axis=2)
        self._estimate(self._mean, self._scatter, self._one_path())
        self._estimate(total, self._scatter_total, self._one_of_all())
        return self._mean, self._scatter, total, self._scatter_total

    def albedo(self) -> tuple[np.ndarray, np.ndarray]:
        """Albedo (angles, wavelengths, bounces) and its standard error.

        Where no path came there is no spread, but the error of one path.
        """
        values = np.array(self._albedo)
        if self.balance is not None:
            values = self.balance.albedo(values)
        if self.samples < 2:
            return values.mean(axis=0), np.full(values.shape[1:], np.nan)
        spread = values.std(axis=0, ddof=1) / np.sqrt(self.samples)
        return values.mean(axis=0), np.where(self._by_class() > 0, spread, self._one_path())

    def energy(self) -> np.ndarray:
        """Mean energy by fate (angles, wavelengths, 4)."""
        energy: np.ndarray = np.mean(self._energy, axis=0)
        if self.balance is not None:
            energy = self.balance.energy(energy, self.albedo()[0])
        return energy

    def rel_error(self) -> float:
        """Largest standard error over M00 of the bins above a tenth of the peak.

        Infinite where nothing was seen but might have been.
        """
        m00 = (..., slice(1), slice(1))
        mean, scatter = self._mean[m00], self._scatter_total[m00].copy()
        if self.balance is not None and self.samples > 1:
            mean = mean.copy()
            self.balance.settle(mean, self._scatter[m00].copy(), scatter)
        mean = mean.sum(axis=2)
        self._estimate(mean, scatter, self._one_of_all())
        bright = mean > 0.1 * mean.max(axis=(2, 3), keepdims=True)
        if not bright.any():
            return np.inf if scatter.any() else 0.0
        return float(np.max(scatter[bright] / mean[bright]))


@dataclass(frozen=True, kw_only=True)
class _Part:
    """Some wavelengths of a spectrum, and where one of them at a time is shaded."""

    first: int
    last: int
    room: Room

    @classmethod
    def of(cls, plan: Plan, first: int, last: int) -> "_Part":
        flux = np.zeros((1, *plan.tally_shape[2:]))
        room = Room(
            flux, _by_bin(flux), np.empty((4, 4)), np.empty(plan.n_stokes**2),
            np.empty((4, MAX_ORDER)),
        )  # fmt: skip
        return cls(first=first, last=last, room=room)


def _or_else(values: np.ndarray, other: np.ndarray | float) -> np.ndarray:
    """Return the values, and the others where they are missing."""
    return np.where(np.isnan(values), other, values)


def neighbour_room(bins: tuple[int, ...], elements: int) -> neighbours.Room:
    """Room for `pbrdf.kernels.bins.neighbours` to work in."""
    sums, rows = np.empty((2, *bins, elements + neighbours.N_BESIDE))
    flat = bins[0], -1
    return neighbours.Room(sums, sums.reshape(flat), rows.reshape(flat), np.empty(elements))


def _cut(count: int, parts: int) -> list[tuple[int, int]]:
    """Cut [0, count) into parts of about the same length."""
    ends = np.linspace(0, count, parts + 1).astype(int).tolist()
    return list(pairwise(ends)) if parts else []


def _by_bin(flux: np.ndarray) -> np.ndarray:
    """View of an array (..., n_theta, n_dphi, stokes, stokes) as (..., bins, elements)."""
    return flux.reshape(*flux.shape[:-4], -1, flux.shape[-1] ** 2)


def _add_part(
    plan: Plan, tally: Tally, angle: int, counted: int, running: Running,
    balance: Balance | None, part: _Part,
) -> None:  # fmt: skip
    """Shade and add some wavelengths of one direction of a sample, of `counted` rays."""
    light, room = tally.spectra[angle], part.room
    if light.state[OVERFLOWED]:
        flux = tally.flux[angle]
        room = room._replace(flux=flux, by_bin=_by_bin(flux))
    if balance is not None:
        for w in range(part.first, part.last):
            _add_wave(plan, tally, angle, running, balance, room, w)
        return
    add_spectrum(
        part.first, part.last, counted, light, plan.optics, plan.fold, tally.lit[angle],
        tally.energy[angle], room, running,
    )  # fmt: skip


def _add_wave(
    plan: Plan, tally: Tally, angle: int, running: Running, balance: Balance, room: Room,
    w: int,
) -> None:  # fmt: skip
    """Do so with one wavelength where single bounces do not come from the paths."""
    light, here = tally.spectra[angle], slice(w, w + 1)
    slot = w if light.state[OVERFLOWED] else 0
    shade_kept(w, slot, light, plan.optics, tally.energy[angle], room)
    flux = room.flux[slot : slot + 1]
    flux[0, 0] = balance.single.bounce(plan, tally, angle, w)
    if plan.fold:
        fold_sample(flux, tally.lit[angle])
    own = {
        name: getattr(running, name)[here]
        for name in ("mean", "scatter", "scatter_total", "albedo")
    }
    change = flux[..., 0, 0] * running.scale
    balance.add(angle, here, change - own["mean"][..., 0].reshape(change.shape))
    add_sample(_by_bin(flux), room.matrix, running._replace(**own))

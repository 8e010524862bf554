"""Further bounces brought into balance with single bounces that do not come from rays."""

from collections.abc import Callable, Sequence
from copy import copy

import numpy as np

from pbrdf.kernels.paths.shading import ABSORBED, LEAKED, N_ORDERS, TRUNCATED
from pbrdf.simulation.plan import Tally
from pbrdf.simulation.singles.clean import Clean


class Balance:
    """One azimuth: how much light leaves after one bounce, from looks and from rays.

    All light leaves after one bounce or goes on. Of the first share N₁ there are two
    estimates, by looks and by rays; with X the excess of the second, N₁ = rays - c X, where
    c makes the variance least. Further bounces are multiplied by (1 - N₁)/(1 - rays), and
    single bounces take what is left in proportion to what is hidden of them, so that no
    light is lost. These are ratio estimators with their usual linearised errors (Cochran,
    Sampling Techniques, 3rd ed., chapter 6): as if each realisation added its own part of
    X, spread over bins as the mean light is.
    """

    def __init__(self, single: Clean, shape: tuple[int, ...]) -> None:
        self.single = single
        # Classes of bounces of which no ray need tell: where nothing is hidden, of all
        self.serves = single.serves()
        self.known = np.where(single.certain(), shape[2], 1) * self.serves
        self._hidden, self._looks = single.hidden(), single.looks()
        self._doubtful = single.doubtful()
        self._one_of_many = single.one_of_many
        # By sample: share of the rays that went on, and excess of the rays' single bounces
        self._beyond: list[np.ndarray] = []
        self._excess: list[np.ndarray] = []
        self._unit = np.zeros((shape[0], *shape[3:5]))
        # Covariance sums of the M00 of bins with X, by bounces and of all together
        self._cross = np.zeros(shape[:-2])
        self._cross_total = np.zeros(shape[:2] + shape[3:5])
        # Single bounces for a unit of X, all bins together (angles, wavelengths)
        self._taken = np.zeros(shape[:2])

    def of_waves(self, own: tuple[slice, slice]) -> "Balance":
        """Return that of the wavelengths at a place of arrays (angles, wavelengths).

        What it settles is noted in its parent, too.
        """
        part = copy(self)
        for name in ("_cross", "_cross_total", "_taken"):
            setattr(part, name, getattr(self, name)[own])
        return part

    def begin(self, angle: int, tally: Tally, n_rays: int, counted: float) -> None:
        """Take the shares of incident direction `angle` of a sample.

        `counted` of its `n_rays` did not leave a finite map sideways.
        """
        if angle == 0:
            self._beyond.append(np.zeros(len(tally.single)))
            self._excess.append(np.zeros(len(tally.single)))
        alone = tally.counts[angle, N_ORDERS] / counted
        self._beyond[-1][angle] = 1.0 - alone
        if not self.serves[angle]:
            return
        unit = tally.single[angle] * (n_rays / counted)
        self._excess[-1][angle] = alone - unit.sum()
        self._unit[angle] += unit

    def add(self, angle: int, waves: slice, change: np.ndarray) -> None:
        """Add wavelengths of the sample whose shares were taken last.

        `change` (wavelengths, bounces, n_theta, n_dphi) is its M00 less the mean before it.
        """
        if len(self._excess) > 1:
            rest = self._excess[-1][angle] - np.mean([one[angle] for one in self._excess])
            self._cross[angle, waves] += change * rest
            self._cross_total[angle, waves] += change.sum(axis=1) * rest

    def _over_samples(
        self, reduce: Callable[..., np.ndarray], values: Sequence[np.ndarray] | np.ndarray
    ) -> np.ndarray:
        """Reduce values (samples, angles); one angle of many as if it stood among them.

        NumPy adds up a single column in another order, so with other last digits.
        """
        held = np.asarray(values)
        if self._one_of_many:
            return reduce(np.repeat(held, 2, axis=1), axis=0)[:1]
        return reduce(held, axis=0)

    def _parts(self) -> tuple[np.ndarray, np.ndarray]:
        """Parts of X that go to further and to single bounces, as factors of their light.

        Further (angles,) and single bounces (angles, n_theta, n_dphi).
        """
        beyond, excess = np.array(self._beyond), np.array(self._excess)
        spread = self._over_samples(np.var, excess)
        change = excess - self._over_samples(np.mean, excess)
        shared = self._over_samples(np.mean, change * -beyond)
        part = np.divide(shared, spread, out=np.ones_like(spread), where=spread > 0.0)
        part = np.clip(part, 0.0, 1.0)
        # Where no ray went on all light is in single bounces
        mean = self._over_samples(np.mean, beyond)
        part[mean == 0.0] = 0.0
        further = part / np.where(mean > 0.0, mean, 1.0)
        flux = (self._hidden * self._unit).sum(axis=(1, 2)) / len(excess)
        single = ((1.0 - part) / np.maximum(flux, 1e-300))[:, None, None] * self._hidden
        return further, single

    def settle(self, mean: np.ndarray, scatter: np.ndarray, total: np.ndarray) -> None:
        """Bring the moments (angles, wavelengths, bounces, ...) into balance, in place."""
        further, single = self._parts()
        light = mean[..., 0, 0]
        slope = light * further[:, None, None, None, None]
        slope[:, :, 0] = light[:, :, 0] * single[:, None]
        self._taken[:] = slope[:, :, 0].sum(axis=(2, 3))
        if len(self._excess) > 1:
            spread = self._over_samples(np.var, self._excess) * len(self._excess)
            _adjust(scatter, mean, slope, self._cross, spread)
            _adjust(total, mean.sum(axis=2), slope.sum(axis=2), self._cross_total, spread)
            floor = self._floor(mean)
            scatter[:, :, 0] += floor
            total += floor
        excess = self._over_samples(np.mean, self._excess)
        factor = 1.0 + excess[:, None, None] * single
        mean[:, :, 0] *= factor[:, None, :, :, None, None]
        mean[:, :, 1:] *= (1.0 + excess * further).reshape(-1, *(1,) * (mean.ndim - 1))

    def _floor(self, mean: np.ndarray) -> np.ndarray:
        """Squares that stand for one hidden facet more than was seen, as scatter sums.

        Smith's rule gives the probability h of a facet to be hidden, or the points of the
        facets of a map that of a look to find something amiss; what N looks say of it is
        that of one more, 1 / (N + 1/h), at most h.
        """
        samples = len(self._excess)
        looks = np.maximum(self._looks * samples, 1)
        more = 1.0 / (looks + 1.0 / np.maximum(self._doubtful, 1e-300)) / looks
        more *= samples * (samples - 1) / np.maximum(1.0 - self._hidden, 1e-3) ** 2
        squares: np.ndarray = mean[:, :, 0] ** 2 * more[:, None, :, :, None, None]
        return squares

    def albedo(self, values: np.ndarray) -> np.ndarray:
        """Albedos (samples, angles, wavelengths, bounces) in balance, after `settle`."""
        excess = np.array(self._excess)[:, :, None]
        further, _ = self._parts()
        values = values.copy()
        values[..., 1:] += (excess * further[:, None])[..., None] * values[..., 1:].mean(
            axis=0
        )
        values[..., 0] += excess * self._taken
        return values

    def energy(self, energy: np.ndarray, albedo: np.ndarray) -> np.ndarray:
        """Energies (angles, wavelengths, fates) in balance with all that is reflected."""
        before, energy = energy, energy.copy()
        further, _ = self._parts()
        scale = 1.0 + self._over_samples(np.mean, self._excess) * further
        for fate in (TRUNCATED, LEAKED):
            energy[..., fate] *= scale[:, None]
        rest = 1.0 - albedo.sum(axis=-1) - energy[..., TRUNCATED] - energy[..., LEAKED]
        # What a mirror absorbs is nothing but rounding
        energy[..., ABSORBED] = np.where(np.abs(rest) < 1e-14, 0.0, rest)
        return np.where(self.serves[:, None, None], energy, before)


def _adjust(
    scatter: np.ndarray,
    mean: np.ndarray,
    slope: np.ndarray,
    cross: np.ndarray,
    spread: np.ndarray,
) -> None:
    """Change sums of squares by those of slope times X: M00 exactly.

    The other elements take their part of the noise of M00 in proportion to the light.
    """
    each = spread.reshape(-1, *(1,) * (slope.ndim - 1))
    before = scatter[..., 0, 0]
    after = np.maximum(before + slope * (2.0 * cross + slope * each), 0.0)
    kept = np.divide(after, before, out=np.ones_like(after), where=before > 0.0)
    light = mean[..., :1, :1]
    part = np.divide(mean, light, out=np.zeros_like(mean), where=light != 0.0) ** 2
    least = np.minimum(kept, 1.0)[..., None, None] * scatter
    scatter[:] = np.maximum(scatter + part * (after - before)[..., None, None], least)

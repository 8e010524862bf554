"""How far the readings lie from the fitted curve, and what that is called.

An intensity is off by a factor, so its deviation is the logarithm of measured over fitted;
any other element by a part of M00, a ratio by its difference. A reading that noise hides,
measured and fitted below three standard errors, has no deviation that means anything.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import stats

from fitting.readings.observations import LINEAR, NORMALISED
from fitting.result.runs import running_together

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

__all__ = ["RULE", "VERDICTS", "Misfit", "Reading", "misfit_of"]

VERDICTS = ("good", "fair", "poor")
# Largest deviation of half of the readings, and of 19 in 20 and of the brightest
_LIMITS = {"good": (0.05, 0.25), "fair": (0.20, 1.0)}
# Deviations that run together shift the parameters as far: less of them is good
_RUNNING = (0.01, 0.05)
_CHANCE = 0.001
# Beyond so many stated errors rms no interval of a parameter is worth its name
_BEYOND = 3.0
RULE = (
    "good: the errors given explain the misfit (p >= 0.001), or none were given and half "
    "of the readings lie within 5 % of the curve, 19 in 20 and the brightest within 25 % "
    "(1 % and 5 % where neighbours deviate together); fair: half within 20 %, 19 in 20 "
    "and the brightest within a factor of 2, and within 3 of the errors given rms; "
    "poor: else, or where scans of one side fit far better on the other"
)
_HIDDEN = 3.0
# Scans and wavelengths that a summary lists
_SHOWN = 6
_COLUMNS = (
    "observable", "scan", "wavelength", "theta_i", "theta_s", "dphi", "measured", "model",
    "stderr",
)  # fmt: skip
# Where the model is darker than anything, and a deviation whose factor is still a number
_DARKEST, _MOST = 1e-200, 500.0
# Observables that cannot be negative, whose deviation is a factor
_INTENSITIES = ("M00", "I_s", "I_p", "f_ss", "f_sp", "f_ps", "f_pp")


@dataclass(frozen=True, kw_only=True)
class Reading:
    """One reading beside the curve.

    Parameters
    ----------
    observable, scan : str
        What was read, and in which scan.
    wavelength : float
        nan where unknown. [um]
    theta_i, theta_s, dphi : float
        Where. [rad]
    measured, model : float
        Measured and fitted.
    stderr : float
        Standard error of the reading.
    deviation : float
        Logarithm of their ratio, or difference in parts of M00. [1]
    """

    observable: str
    scan: str
    wavelength: float
    theta_i: float
    theta_s: float
    dphi: float
    measured: float
    model: float
    stderr: float
    deviation: float

    @property
    def place(self) -> str:
        """Observable and geometry in words, in degrees."""
        theta_i, theta_s = np.rad2deg([self.theta_i, self.theta_s])
        across = abs(np.sin(self.dphi)) * np.sin(self.theta_s) > 1e-6
        where = f"theta_s {theta_s:.4g}, dphi {np.rad2deg(self.dphi):.4g} deg"
        if not across:
            where = f"view {-np.sign(np.cos(self.dphi)) * theta_s + 0.0:.4g} deg"
        wave = f", {self.wavelength:.6g} um" if np.isfinite(self.wavelength) else ""
        scan = f"scan {self.scan}" if self.scan.isdigit() else self.scan
        return f"{self.observable} of {scan}{wave} at theta_i {theta_i:.4g}, {where}"

    @property
    def size(self) -> str:
        """The deviation in words.

        >>> parts = dict(observable="M00", scan="a", wavelength=np.nan, theta_i=0.5,
        ...              theta_s=0.5, dphi=3.1, model=1.0, stderr=0.1)
        >>> Reading(**parts, measured=3.0, deviation=np.log(3.0)).size
        'a factor of 3'
        >>> Reading(**parts, measured=1.04, deviation=np.log(1.04)).size
        '4 %'
        """
        size = abs(self.deviation)
        both = self.measured > 0.0 and self.model > 0.0
        if self.observable in _INTENSITIES and both and size > np.log(1.5):
            return f"a factor of {np.exp(size):.3g}"
        if self.observable in _INTENSITIES and both:
            return f"{100.0 * np.expm1(size):.2g} %"
        if self.observable in NORMALISED or self.observable == "DOLP":
            return f"{size:.2g}"
        return f"{100.0 * size:.2g} % of M00"


@dataclass(frozen=True, kw_only=True)
class Misfit:
    """Size of the misfit of some readings.

    Parameters
    ----------
    verdict : str
        A word of `VERDICTS`, by `RULE`; "no fit" where there is no minimum.
    median : float
        Deviation that half of the readings exceed. [1]
    worst : Reading
        The reading of the largest deviation.
    rms_stderr, worst_stderr : float
        Root mean square and largest deviation in standard errors. Where the noise was
        estimated the first is 1 by construction.
    count : int
        Readings.
    groups : tuple of (scan, wavelength, Misfit)
        The same of each scan and wavelength.
    """

    verdict: str
    median: float
    worst: Reading
    rms_stderr: float
    worst_stderr: float
    count: int
    groups: "tuple[tuple[str, float, Misfit], ...]" = ()

    def __str__(self) -> str:
        return f"{self.verdict}: {self.size}"

    @property
    def size(self) -> str:
        """How far the readings lie from the curve, in words, without the verdict."""
        return (
            f"half of the readings are off by more than "
            f"{100.0 * self.median:.2g} %, the worst by {self.worst.size} "
            f"({self.worst.place}: {self.worst.measured:.4g} measured, "
            f"{self.worst.model:.4g} fitted); {self.rms_stderr:.2g} standard errors rms, "
            f"{self.worst_stderr:.2g} at worst"
        )

    @property
    def lines(self) -> list[str]:
        """A line for each scan and wavelength where there are several, the worst first."""
        if len(self.groups) < 2:
            return []
        order = sorted(
            self.groups,
            key=lambda group: (VERDICTS.index(group[2].verdict), group[2].median),
            reverse=True,
        )
        found = [
            f"{scan}, {wave:.9g} um: {one}" if np.isfinite(wave) else f"{scan}: {one}"
            for scan, wave, one in order[:_SHOWN]
        ]
        rest = len(order) - len(found)
        return [*found, f"and {rest} more, none worse"] if rest else found

    def as_dict(self) -> dict[str, Any]:
        """Return the numbers for a JSON file."""
        worst = self.worst
        angles = {
            f"{name}_deg": _number(float(np.rad2deg(getattr(worst, name))))
            for name in ("theta_i", "theta_s", "dphi")
        }
        found: dict[str, Any] = {
            "verdict": self.verdict,
            "median_deviation": _number(self.median),
            "worst_deviation": _number(worst.deviation),
            "rms_in_stderr": _number(self.rms_stderr),
            "worst_in_stderr": _number(self.worst_stderr),
            "readings": self.count,
            "worst_at": {
                "observable": worst.observable,
                "scan": worst.scan,
                "wavelength_um": _number(worst.wavelength),
                **angles,
                "measured": _number(worst.measured),
                "model": _number(worst.model),
            },
        }
        if self.groups:
            found["rule"] = RULE
            found["by_scan_and_wavelength"] = [
                {"scan": scan, "wavelength_um": _number(wave), **one.as_dict()}
                for scan, wave, one in self.groups
            ]
        return found

    def to_frame(self) -> "pd.DataFrame":
        """Return a row for each scan and wavelength."""
        import pandas as pd

        rows = [
            {
                "scan": scan,
                "wavelength": wave,
                "verdict": one.verdict,
                "median_deviation": one.median,
                "worst_deviation": one.worst.deviation,
                "worst_at": one.worst.place,
                "rms_in_stderr": one.rms_stderr,
                "worst_in_stderr": one.worst_stderr,
                "readings": one.count,
            }
            for scan, wave, one in self.groups
        ]
        return pd.DataFrame(rows)


@np.errstate(over="ignore", invalid="ignore")
def misfit_of(
    readings: "xr.Dataset",
    m00: np.ndarray,
    *,
    share: float,
    stated: bool,
    hides: bool,
    converged: bool,
) -> Misfit:
    """Return the misfit of all readings, and of each scan and wavelength.

    Parameters
    ----------
    readings : Dataset
        `FitResult.readings`.
    m00 : ndarray, shape (m,)
        Fitted M00 at each reading.
    share : float
        Degrees of freedom a reading.
    stated : bool
        True if the standard errors were given and not estimated from the misfit.
    hides : bool
        True if the noise has a floor below which readings say nothing.
    converged : bool
        False where there is no minimum.
    """
    columns = {
        name: readings[name].values for name in (*readings.data_vars, *readings.coords)
    }
    deviation = _deviations(columns, m00)
    counts = np.ones(len(deviation), dtype=bool)
    if hides:
        size = np.maximum(np.abs(columns["measured"]), np.abs(columns["model"]))
        counts = size > _HIDDEN * columns["stderr"]
    waves = np.nan_to_num(columns["wavelength"].round(9), nan=-1.0)
    members = list(_members(columns["scan"], waves))
    judged = []
    for chosen in members:
        one = _judged(columns, deviation, counts, chosen)
        if stated:
            chi2 = float(np.square(columns["residual"][chosen]).sum())
            freedom = max(share * chosen.size, 1.0)
            # One of many groups is bound to look unlikely
            chance = float(stats.chi2.sf(chi2, freedom)) * len(members)
            one = replace(one, verdict=_beside_errors(one, chance, chi2 / freedom))
        judged.append(one)
    whole = _judged(columns, deviation, counts, np.arange(len(deviation)))
    verdict = max((one.verdict for one in judged), key=VERDICTS.index)
    if share <= 0.0:
        # As many parameters as readings can always be made to fit
        verdict = "poor"
    groups = tuple(
        (str(columns["scan"][chosen[0]]), float(columns["wavelength"][chosen[0]]), one)
        for chosen, one in zip(members, judged, strict=True)
    )
    return Misfit(
        verdict=verdict if converged else "no fit",
        median=whole.median,
        worst=whole.worst,
        rms_stderr=whole.rms_stderr,
        worst_stderr=whole.worst_stderr,
        count=whole.count,
        groups=groups,
    )


def _deviations(columns: dict[str, np.ndarray], m00: np.ndarray) -> np.ndarray:
    """Return the deviation of each reading, shape (m,)."""
    measured, model, name = (columns[key] for key in ("measured", "model", "observable"))
    is_element = np.isin(name, list(LINEAR))
    unit = np.where(is_element, np.maximum(np.abs(m00), _DARKEST), 1.0)
    deviation = (measured - model) / unit
    factor = np.isin(name, _INTENSITIES) & (measured > 0.0) & (model > 0.0)
    deviation[factor] = np.log(measured[factor]) - np.log(model[factor])
    return np.asarray(np.clip(deviation, -_MOST, _MOST))


def _members(scan: np.ndarray, waves: np.ndarray) -> Iterator[np.ndarray]:
    """Yield the readings of each scan and wavelength."""
    for label in dict.fromkeys(scan.tolist()):
        for wave in np.unique(waves[scan == label]):
            yield np.flatnonzero((scan == label) & (waves == wave))


def _judged(
    columns: dict[str, np.ndarray],
    deviation: np.ndarray,
    counts: np.ndarray,
    chosen: np.ndarray,
) -> Misfit:
    """Return the misfit of some readings, with the verdict on its size."""
    bright = chosen[np.isin(columns["observable"][chosen], _INTENSITIES)]
    peaks = [
        int(bright[np.argmax(columns[key][bright])])
        for key in ("measured", "model")
        if bright.size
    ]
    seen = chosen[counts[chosen]]
    seen = np.union1d(seen, peaks).astype(int) if peaks else seen
    seen = seen if seen.size else chosen
    size = np.abs(deviation[seen])
    median, most = float(np.median(size)), float(np.quantile(size, 0.95))
    brightest = max((abs(float(deviation[peak])) for peak in peaks), default=0.0)
    verdict = "poor"
    running = running_together({key: column[chosen] for key, column in columns.items()})
    for word in reversed(VERDICTS[:2]):
        half, rest = _RUNNING if word == "good" and running else _LIMITS[word]
        if median <= np.log1p(half) and max(most, brightest) <= np.log1p(rest):
            verdict = word
    at = int(seen[np.argmax(size)])
    residual = columns["residual"][chosen]
    return Misfit(
        verdict=verdict,
        median=float(np.expm1(median)),
        worst=Reading(
            deviation=float(deviation[at]),
            **{key: columns[key][at].item() for key in _COLUMNS},
        ),
        rms_stderr=float(np.sqrt(np.mean(residual**2))),
        worst_stderr=float(np.abs(residual).max()),
        count=len(chosen),
    )


def _beside_errors(one: Misfit, chance: float, ratio: float) -> str:
    """Return the verdict where errors were given: p and chi2 a degree of freedom."""
    if chance >= _CHANCE:
        return "good"
    if ratio > _BEYOND**2:
        return "poor"
    return max(one.verdict, "fair", key=VERDICTS.index)


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None

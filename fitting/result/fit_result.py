"""What a fit found, how well, and what it could not find."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import stats

from fitting.estimate import Estimate
from fitting.result.misfit import Misfit, misfit_of
from fitting.result.tables import held_values, parameter_frame
from pbrdf.notebook import table

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.figure import Figure

    from fitting.objective.parameters import Parameter
    from fitting.problem.problem import Problem
    from fitting.result.likelihood import LikelihoodProfile

__all__ = ["HARDLY_APART", "FitResult"]

# Correlation from which two parameters can hardly be told apart
HARDLY_APART = 0.95
# Correlation with one that a bound cuts off from which an interval is no longer symmetric
_TIED = 0.3


@dataclass(frozen=True, kw_only=True, eq=False)
class FitResult:
    """Parameters with their uncertainty, and the misfit that is left.

    Parameters
    ----------
    values, stderr : mapping of str to float
        Best values and standard errors by parameter name; a parameter that is separate for
        each scan appears as `name[scan]`. The standard error is inf where the data do not
        determine the parameter and nan where there is no minimum. Of a kappa at 0 it is the
        root of the standard error of its square, which is all that the data see.
    covariance, correlation : ndarray, shape (n, n)
        In the order of `values`, uncertainty of fixed parameters included.
    residuals : ndarray, shape (m,)
        (measured - model) / standard error; their squares sum to `chi2`.
    chi2 : float
        Sum of squared residuals. Where the noise is estimated it equals `dof` by
        construction and says nothing about the fit.
    dof : int
        Readings minus free parameters.
    solver, status : str
        Who stopped, and why.
    converged : bool
        True if `status` is a minimum.
    n_evaluations : int
        How often the cost was computed.
    warnings : tuple of str
        What a reader must know before using a number.
    model : object
        The model with the fitted values: where a parameter is separate, those of the first
        group.
    models : mapping of str to object
        The model of each scan.
    noise : str
        Where the standard errors of the readings come from.
    log_likelihood : float
        Gaussian, at the minimum.
    n_estimated : int
        Parameters of the noise that were estimated beside the free ones.
    stderr_parts : mapping of str to mapping
        Standard error of each parameter by source: "noise", "simulation" where there is
        one in the model, and each uncertain fixed parameter.
    anchored_stderr : mapping of str to float
        Where brightness is known only up to a factor: standard errors if the gain were
        known to be what `values` says. They are those of `ratios`.
    problem : Problem
        What was solved, to be solved again with changes.
    fits_the_other_side : bool
        The scans fit far better with forward and backward exchanged: the fit is poor.
    """

    values: Mapping[str, float]
    stderr: Mapping[str, float]
    covariance: np.ndarray
    correlation: np.ndarray
    residuals: np.ndarray
    chi2: float
    dof: int
    solver: str
    status: str
    converged: bool
    n_evaluations: int
    warnings: tuple[str, ...]
    model: Any
    models: Mapping[str, Any]
    noise: str
    log_likelihood: float
    n_estimated: int
    stderr_parts: Mapping[str, Mapping[str, float]]
    anchored_stderr: Mapping[str, float]
    problem: "Problem" = field(repr=False)
    fits_the_other_side: bool = False

    @cached_property
    def misfit(self) -> Misfit:
        """How far the readings lie from the curve, in all and by scan and wavelength."""
        x = np.array(list(self.values.values()))
        stated = self.n_estimated == 0
        found = misfit_of(
            self.readings,
            self.problem.m00().function(x).full().ravel(),
            share=max(self.dof, 1) / len(self.residuals),
            stated=stated,
            hides=stated or self.noise.endswith("absolute"),
            converged=self.converged,
        )
        return replace(found, verdict="poor") if self.fits_the_other_side else found

    @cached_property
    def held(self) -> dict[str, Any]:
        """Values of all that was not free, and the rules of the model.

        What differs from wavelength to wavelength is a mapping by wavelength. [um]
        """
        return held_values(self.problem, self.model)

    def to_frame(self) -> "pd.DataFrame":
        """Return a row for each parameter, and for each ratio that is known instead.

        Columns: the parameter without its group, scan and wavelength [um] of the group
        (empty and nan where it is shared), value, stderr, low, high and unit.
        """
        return parameter_frame(self.problem, {**self.estimates, **self.ratios})

    @cached_property
    def readings(self) -> "xr.Dataset":
        """Every reading beside its fitted value, stderr and geometry, dim `reading`."""
        import xarray as xr

        observations, objective = self.problem.observations, self.problem.objective
        geometry, at = observations.geometry, observations.at
        columns = {
            "measured": objective.data,
            "model": objective.predict(np.array(list(self.values.values()))),
            "stderr": objective.stderr,
            "residual": self.residuals,
        }
        coords = {
            "observable": observations.name,
            "scan": np.array(observations.labels)[observations.scan[at]],
            "theta_i": geometry.theta_i[at],
            "theta_s": geometry.theta_s[at],
            "dphi": geometry.dphi[at],
            "theta_view": geometry.theta_view[at],
            "wavelength": geometry.wavelength[at],
        }
        return xr.Dataset(
            {name: ("reading", value) for name, value in columns.items()},
            coords={name: ("reading", value) for name, value in coords.items()},
        )

    @property
    def names(self) -> tuple[str, ...]:
        """The free parameters, in the order of the matrices."""
        return tuple(self.values)

    @property
    def estimates(self) -> dict[str, Estimate]:
        """Each parameter as value, standard error and 95 % interval.

        The interval is symmetric, or where a bound is within reach that of `profiles`.
        """
        found = {}
        for name, value in self.values.items():
            stderr = self.stderr[name]
            half = self.quantile(0.95) * stderr
            low, high = value - half, value + half
            if name in self.profiles:
                low, high = self.profiles[name].low, self.profiles[name].high
            found[name] = Estimate(value, stderr, low, high)
        return found

    @cached_property
    def ratios(self) -> dict[str, Estimate]:
        """What is known of brightness that is known only up to a common factor.

        By name, as "diffuse_albedo / specular_gain"; empty where each is known by itself.
        """
        from fitting.result.likelihood import profile_likelihood

        found = {}
        for gauge in self.problem.gauges if self.converged else ():
            anchor = self.names[gauge.anchor]
            gain = self.values[anchor]
            for name in (self.names[i] for i in gauge.terms):
                value, stderr = self.values[name], self.anchored_stderr[name]
                half = self.quantile(0.95) * stderr
                low, high = value - half, value + half
                if low < 0.0:
                    profile = profile_likelihood(self, name)
                    low, high = profile.low, profile.high
                found[f"{name} / {anchor}"] = Estimate(
                    *(number / gain for number in (value, stderr, low, high))
                )
        return found

    @cached_property
    def profiles(self) -> "dict[str, LikelihoodProfile]":
        """Likelihood intervals of the parameters that a bound cuts off, by name.

        And of those that are correlated with one of them: the bound limits both.
        """
        from fitting.result.likelihood import profile_likelihood

        if not self.converged:
            return {}
        parameters = self.problem.objective.parameters
        cut = np.array([self._near_bound(parameter) for parameter in parameters])
        # nan, for undetermined ones, compares false
        tied = (np.abs(self.correlation[:, cut]) > _TIED).any(axis=1)
        return {
            name: profile_likelihood(self, name)
            for name, profiled in zip(self.names, cut | tied, strict=True)
            if profiled
        }

    def _near_bound(self, parameter: "Parameter") -> bool:
        """Tell whether an end of the symmetric interval would not be inside the bounds."""
        value, stderr = self.values[parameter.name], self.stderr[parameter.name]
        if not np.isfinite(stderr) or parameter.low == parameter.high:
            return False
        room = min(value - parameter.low, parameter.high - value)
        # What acts by its square is lopsided from further off
        return bool(
            room < (2.0 if parameter.squared else 1.0) * self.quantile(0.95) * stderr
        )

    def quantile(self, level: float) -> float:
        """Return the half width of a `level` interval in standard errors.

        Student's t where the noise was estimated, else the normal distribution.
        """
        tail = 0.5 + level / 2.0
        if self.n_estimated and self.dof > 0:
            return float(stats.t.ppf(tail, self.dof))
        return float(stats.norm.ppf(tail))

    @property
    def p_value(self) -> float:
        """Chance of a chi2 this high if the model is right; nan if it was made to fit."""
        if self.n_estimated or self.dof <= 0:
            return np.nan
        return float(stats.chi2.sf(self.chi2, self.dof))

    @property
    def aic(self) -> float:
        """Akaike's information criterion with the correction for few readings."""
        k, m = len(self.values) + self.n_estimated, len(self.residuals)
        correction = 2.0 * k * (k + 1) / (m - k - 1) if m > k + 1 else np.inf
        return 2.0 * k - 2.0 * self.log_likelihood + correction

    @property
    def bic(self) -> float:
        """Schwarz's information criterion."""
        k, m = len(self.values) + self.n_estimated, len(self.residuals)
        return k * np.log(m) - 2.0 * self.log_likelihood

    def _repr_html_(self) -> str:
        rows = [(name, str(e)) for name, e in {**self.estimates, **self.ratios}.items()]
        rows.append(("misfit", str(self.misfit)))
        if not self.n_estimated:
            rows.append(("chi2 / dof", f"{self.chi2:.4g} / {self.dof}"))
        rows += [("noise", self.noise), *(("warning", text) for text in self.warnings)]
        return table("Fit", rows, ("", "value ± standard error"))

    def plot(self) -> "Figure":
        """Draw the readings in the plane of incidence beside the fitted model.

        Raises
        ------
        ValueError
            If no reading lies in the plane, or no quantity drawn there was read.
        """
        from fitting.report.readings_drawn import fit_figure

        return fit_figure(self.readings)

    def __str__(self) -> str:
        return self.summary()

    def summary(self) -> str:
        """Return the result as a few lines of text."""
        width = max(len(name) for name in self.values)
        lines = [f"{self.status} ({self.solver}, {self.n_evaluations} evaluations)"]
        for name, value in self.values.items():
            text = _pair(value, self.stderr[name])
            if name in self.profiles:
                interval = self.profiles[name].interval
                text = f"{value:.4g} ± {self.stderr[name]:.2g} ({interval})"
            lines.append(f"  {name:<{width}} = {text}")
        width = max((len(name) for name in self.ratios), default=0)
        lines += [f"  {name:<{width}} = {e}" for name, e in self.ratios.items()]
        quality = "made to fit" if self.n_estimated else f"p = {self.p_value:.2g}"
        lines.append(f"  chi2 / dof = {self.chi2:.4g} / {self.dof} ({quality})")
        lines.append(f"  noise: {self.noise}")
        lines.append(f"  misfit: {self.misfit}")
        lines += [f"    {line}" for line in self.misfit.lines]
        lines += [f"  warning: {warning}" for warning in self.warnings]
        return "\n".join(lines)

    def as_dict(self) -> dict[str, Any]:
        """Return the numbers for a JSON file; nan and inf become null."""
        matrix = self.correlation.tolist()
        return {
            "status": self.status,
            "converged": self.converged,
            "solver": self.solver,
            "n_evaluations": self.n_evaluations,
            "parameters": {
                name: {
                    **{key: _number(v) for key, v in estimate.as_dict().items()},
                    "low_open": name in self.profiles and self.profiles[name].low_open,
                    "high_open": name in self.profiles and self.profiles[name].high_open,
                }
                for name, estimate in self.estimates.items()
            },
            "ratios": {
                name: {key: _number(v) for key, v in estimate.as_dict().items()}
                for name, estimate in self.ratios.items()
            },
            "stderr_parts": {
                name: {source: _number(part) for source, part in parts.items()}
                for name, parts in self.stderr_parts.items()
            },
            "correlation": [[_number(entry) for entry in row] for row in matrix],
            "chi2": _number(self.chi2),
            "dof": self.dof,
            "p_value": _number(self.p_value),
            "aic": _number(self.aic),
            "bic": _number(self.bic),
            "noise": self.noise,
            "misfit": self.misfit.as_dict(),
            "held": self.held,
            "warnings": list(self.warnings),
        }


def _pair(value: float, stderr: float) -> str:
    """Write value and standard error to two digits of the latter."""
    if np.isinf(stderr):
        return f"{value:.4g} (not determined)"
    if not np.isfinite(stderr) or stderr <= 0.0:
        return f"{value:.6g}"
    decimals = int(np.clip(1 - np.floor(np.log10(stderr)), 0, 12))
    return f"{value:.{decimals}f} ± {stderr:.{decimals}f}"


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None

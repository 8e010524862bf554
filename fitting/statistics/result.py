"""What surface statistics are: numbers with intervals, curves, warnings, tables."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fitting.estimate import Estimate
from fitting.statistics.axis.parts import Autocorrelation, AxisStatistics, PlainStatistics
from fitting.statistics.axis.spectrum import PowerSpectrum, SlopeBands, line_spectrum
from fitting.statistics.gaussianity import Gaussianity
from fitting.statistics.histogram import Histogram, make_histogram
from fitting.statistics.random_surface import gaussian_surface, measured_surface
from fitting.statistics.texture import Anisotropy
from pbrdf.notebook import table

if TYPE_CHECKING:
    import pandas as pd

    from pbrdf.surface.gaussian import GaussianSurface
    from pbrdf.surface.measured import MeasuredSurface

Array = np.ndarray


@dataclass(frozen=True, kw_only=True)
class SurfaceStatistics:
    """Statistics of the true surface, each with a 95 % interval.

    Parameters
    ----------
    height_rms : Estimate
        ISO Sq without noise and rounding, form removal made good. [um]
    corr_length : Estimate
        Lag where the autocorrelation is 1/e; of a map the geometric mean of x and y. [um]
    slope_rms : Estimate
        PER AXIS; of a map the root mean square of x and y. For a Gaussian autocorrelation
        that of all wavelengths; for a jagged one that of wavelengths above `cutoff`. [1]
    noise_rms : Estimate
        White noise of each height, rounding not included. [um]
    curvature_rms : Estimate
        Of the second derivative along an axis, in the same band as the slope. [1/um]
    gaussianity : Gaussianity
        Of the height distribution, with skewness and kurtosis.
    anisotropy : Anisotropy or None
        Of a map.
    axes : tuple of AxisStatistics
        One for a profile, x and y for a map.
    quantisation : float
        Step of the heights' lattice, 0 if there is none. [um]
    cutoff : float
        Shortest wavelength that spacing and noise let the data resolve. [um]
    correlation_lengths : float
        Length over corr_length; for a map area over product of both.
    plain : PlainStatistics
        Uncorrected values.
    warnings : tuple of str
        What a user must know before the numbers are used.
    reliable : bool
        False where the method fails on these data; warnings say why.
    """

    kind: str
    height_rms: Estimate
    corr_length: Estimate
    slope_rms: Estimate
    noise_rms: Estimate
    curvature_rms: Estimate
    gaussianity: Gaussianity
    anisotropy: Anisotropy | None
    axes: tuple[AxisStatistics, ...]
    quantisation: float
    cutoff: float
    correlation_lengths: float
    n_points: int
    form: str
    plain: PlainStatistics
    warnings: tuple[str, ...]
    reliable: bool
    residual: Array = field(repr=False)
    spacing: tuple[float, ...]

    @property
    def autocorrelation(self) -> Autocorrelation:
        """Form of the autocorrelation (of the steeper axis of a map)."""
        return max(self.axes, key=lambda a: a.slope_rms.value).autocorrelation

    @property
    def skewness(self) -> Estimate:
        """Skewness of the heights. [1]"""
        return self.gaussianity.skewness

    @property
    def kurtosis(self) -> Estimate:
        """Excess kurtosis of the heights, 0 for a Gaussian. [1]"""
        return self.gaussianity.kurtosis

    def slope_at(self, cutoff: float, *, axis: str = "x") -> Estimate:
        """Slope rms of wavelengths above `cutoff` [um] along an axis. [1]"""
        chosen = self._axis(axis)
        fit = chosen.fit

        def variance(parameters: Array) -> float:
            correlation = fit.correlation_at(parameters)
            return float(np.exp(parameters[0])) * correlation.band_variance(cutoff)

        value = variance(fit.parameters)
        if not np.isfinite(value):
            return Estimate.undetermined(np.inf)
        if value <= 0:
            return Estimate(0.0, 0.0, 0.0, 0.0)
        return Estimate.root_mean_square(float(np.sqrt(value)), fit.log_variance(variance))

    def slope_against_cutoff(
        self, cutoff: Sequence[float] | Array | None = None, *, axis: str = "x"
    ) -> SlopeBands:
        """Slope rms against the shortest wavelength that is counted.

        Parameters
        ----------
        cutoff : array_like, optional
            [um]; by default from the length of the sample to a tenth of what is measured.
        axis : str
            ``x`` or ``y``.
        """
        chosen = self._axis(axis)
        if cutoff is None:
            cutoff = np.geomspace(
                min(8 * chosen.corr_length.value, chosen.length), chosen.cutoff / 10, 13
            )
        wanted = np.asarray(cutoff, dtype=float)
        values = [self.slope_at(c, axis=axis) for c in wanted]
        return SlopeBands(wanted, values, wanted >= chosen.cutoff * (1 - 1e-9))

    def height_histogram(self) -> Histogram:
        """Histogram of residual heights with the Gaussian of `height_rms`. [um]"""
        tilted = self.form not in ("none", "mean")
        return make_histogram(
            self.residual,
            self.height_rms.value,
            lag=0.0,
            quantity="height",
            units="um",
            lattice=0.0 if tilted else self.quantisation,
        )

    def slope_histogram(self, axis: str = "x") -> Histogram:
        """Histogram of slopes along an axis with the Gaussian of its corrected slope rms.

        Slopes are differences over a lag long enough that noise and rounding hold less than
        a tenth of their variance, but at most a third of the correlation length.
        """
        chosen = self._axis(axis)
        steps = self._quiet_steps(chosen)
        lines = self.residual if self.residual.ndim == 1 or axis == "x" else self.residual.T
        rise = lines[steps:] - lines[:-steps]
        lag = steps * chosen.spacing
        return make_histogram(
            rise / lag, chosen.slope_rms.value, lag=lag, quantity="slope", units="1"
        )

    def histograms(self) -> list[Histogram]:
        """Histogram of the heights and of the slopes along each axis.

        Each Gaussian has the rms that the table of estimates names for it.
        """
        axes = [axis.axis for axis in self.axes]
        slopes = [self.slope_histogram(axis) for axis in axes]
        if len(axes) > 1:
            slopes = [
                replace(one, quantity=f"slope along {axis}")
                for one, axis in zip(slopes, axes, strict=True)
            ]
        return [self.height_histogram(), *slopes]

    def psd(self, axis: str = "x") -> PowerSpectrum:
        """One-sided power spectrum along an axis, measured and fitted."""
        chosen = self._axis(axis)
        lines = self.residual[None, :] if self.residual.ndim == 1 else self.residual
        if self.residual.ndim == 2 and axis == "x":
            lines = self.residual.T
        frequency, psd = line_spectrum(lines, chosen.spacing)
        fit = chosen.fit
        noise = 2 * chosen.spacing * (fit.noise + self.quantisation**2 / 12)
        kept, seen = fit.correlation.blurred(fit.blur)
        model = 2 * kept * fit.variance * seen.spectrum(frequency)
        return PowerSpectrum(frequency, psd, model + noise, noise)

    def to_surface(
        self,
        shape: tuple[int, int],
        spacing: float | tuple[float, float],
        *,
        kind: str = "gaussian",
    ) -> "GaussianSurface | MeasuredSurface":
        """Make a random surface with these statistics, to draw scenes from.

        Parameters
        ----------
        shape : (int, int)
            Grid nodes (nx, ny).
        spacing : float or (float, float)
            Grid step; a tenth of corr_length or less. [um]
        kind : str
            ``gaussian``: Gaussian heights and autocorrelation with the measured slope_rms
            and corr_length. ``measured``: the fitted form of the autocorrelation and the
            measured height distribution.

        Raises
        ------
        ValueError
            If the measurement failed (`reliable` is False) or `kind` is unknown.
        """
        if kind == "gaussian":
            return gaussian_surface(
                shape,
                spacing,
                corr_length=self._lengths(),
                slope_rms=self._known("slope_rms"),
            )
        if kind == "measured":
            # The form is that of the steeper axis; its length is measured along both
            steeper = max(self.axes, key=lambda axis: axis.slope_rms.value)
            return measured_surface(
                shape,
                spacing,
                corr_length=self._lengths(),
                height_rms=self._known("height_rms"),
                correlation=steeper.fit.correlation,
                heights=None if self.gaussianity.is_gaussian else self.residual,
            )
        msg = (
            f"kind must be one of gaussian, measured, got {kind!r}. For the measured "
            "heights themselves use the HeightMap."
        )
        raise ValueError(msg)

    def _lengths(self) -> float | tuple[float, float]:
        """Return one length, or those of x and y where they differ beyond chance.

        A profile is taken as a cut of an isotropic surface.
        """
        if len(self.axes) == 1:
            return self.corr_length.value
        x, y = (axis.corr_length for axis in self.axes)
        if max(x.low, y.low) < min(x.high, y.high):
            return self.corr_length.value
        return x.value, y.value

    def _known(self, name: str) -> float:
        """Return the value of an estimate, which a failed measurement does not have."""
        if self.reliable:
            return float(getattr(self, name).value)
        msg = f"{name} must be determined, got a failed measurement: {self.warnings[0]}"
        raise ValueError(msg)

    def to_frame(self) -> "pd.DataFrame":
        """Return a row for each estimate: value, stderr, low, high and unit."""
        import pandas as pd

        rows = {
            name: {**estimate.as_dict(), "unit": unit}
            for name, (estimate, unit) in self.estimates().items()
        }
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("quantity")

    def estimates(self) -> dict[str, tuple[Estimate, str]]:
        """Every estimate with its unit, by name."""
        found = {
            "height_rms": (self.height_rms, "um"),
            "corr_length": (self.corr_length, "um"),
            "slope_rms": (self.slope_rms, "1"),
            "noise_rms": (self.noise_rms, "um"),
            "curvature_rms": (self.curvature_rms, "1/um"),
            "skewness": (self.skewness, "1"),
            "kurtosis": (self.kurtosis, "1"),
        }
        if len(self.axes) > 1:
            for axis in self.axes:
                found[f"corr_length_{axis.axis}"] = (axis.corr_length, "um")
                found[f"slope_rms_{axis.axis}"] = (axis.slope_rms, "1")
        if self.anisotropy is not None:
            found["anisotropy"] = (self.anisotropy.ratio, "1")
            found["texture_direction"] = (self.anisotropy.direction, "rad")
        return found

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, strings, lists and dicts, as for a report or a TOML file."""
        numbers: dict[str, Any] = {
            name: {**estimate.as_dict(), "units": units}
            for name, (estimate, units) in self.estimates().items()
        }
        return numbers | {
            "kind": self.kind,
            "form_removed": self.form,
            "n_points": self.n_points,
            "spacing_um": list(self.spacing),
            "correlation_lengths": self.correlation_lengths,
            "quantisation_um": self.quantisation,
            "cutoff_um": self.cutoff,
            "autocorrelation": {
                axis.axis: {
                    "form": axis.autocorrelation.form,
                    "description": axis.autocorrelation.description,
                    **axis.autocorrelation.parameters,
                }
                for axis in self.axes
            },
            "heights_gaussian": {
                "is_gaussian": self.gaussianity.is_gaussian,
                "p_value": self.gaussianity.p_value,
                "effective_samples": self.gaussianity.effective_samples,
                "verdict": self.gaussianity.verdict,
            },
            "plain": vars(self.plain).copy(),
            "reliable": self.reliable,
            "warnings": list(self.warnings),
        }

    def table(self) -> list[tuple[str, str, str, str, str, str]]:
        """Rows (quantity, unit, value, standard error, low, high), formatted."""
        rows = []
        for name, (e, units) in self.estimates().items():
            numbers = (_format(v) for v in (e.value, e.stderr, e.low, e.high))
            rows.append((name, units, *numbers))
        return rows  # type: ignore[return-value]

    def _repr_html_(self) -> str:
        head = ("quantity", "unit", "value", "standard error", "95 % from", "to")
        notes = [
            ("autocorrelation", self.autocorrelation.description),
            ("heights", str(self.gaussianity.verdict)),
            *(("warning", text) for text in self.warnings),
        ]
        return table("Surface", self.table(), head) + table("Remarks", notes)

    def __str__(self) -> str:
        lines = [
            f"{name:>18}  {estimate} {'' if units == '1' else units}".rstrip()
            for name, (estimate, units) in self.estimates().items()
        ]
        lines.append(f"{'autocorrelation':>18}  {self.autocorrelation.description}")
        lines.append(f"{'heights':>18}  {self.gaussianity.verdict}")
        return "\n".join([*lines, *(f"warning: {text}" for text in self.warnings)])

    def _axis(self, name: str) -> AxisStatistics:
        for axis in self.axes:
            if axis.axis == name:
                return axis
        known = ", ".join(axis.axis for axis in self.axes)
        msg = f"axis must be one of {known}, got {name!r}. A profile has only x."
        raise ValueError(msg)

    def _quiet_steps(self, chosen: AxisStatistics) -> int:
        """Count the steps over which a difference is mostly surface."""
        fit = chosen.fit
        disturbance = 2 * (fit.noise + self.quantisation**2 / 12)
        n = self.residual.shape[0 if chosen.axis == "x" else -1]
        top = int(max(1, min(chosen.corr_length.value / 3 / chosen.spacing, n // 4)))
        steps = np.arange(1, top + 1)
        signal = 2 * fit.variance * (1 - fit.correlation.rho(steps * chosen.spacing))
        quiet = disturbance < 0.1 * signal
        return int(steps[np.argmax(quiet)]) if quiet.any() else top


def _format(value: float) -> str:
    return f"{value:.4g}" if np.isfinite(value) else "not determined"

"""Statistics along one axis from the fit of its structure function."""

from dataclasses import replace

import numpy as np
from scipy import special

from fitting.estimate import Estimate
from fitting.statistics.axis.deviance import POOR, admitted_ends
from fitting.statistics.axis.fit import AxisData, AxisFit, jacobian
from fitting.statistics.axis.parts import Autocorrelation, AxisStatistics
from fitting.statistics.axis.problem import fit_axis
from fitting.statistics.axis.scatter import increment_covariance, mean_power_of_correlation
from fitting.statistics.axis.spectrum import measured_cutoff
from fitting.statistics.axis.structure_function import Increments

Array = np.ndarray

# Forms whose slope depends on the shortest wavelength that is counted
JAGGED = ("matern", "multi-scale")


def axis_statistics(
    name: str, data: AxisData, across: float, losses: Array | None
) -> AxisStatistics:
    """Fit one axis and read its statistics off.

    Parameters
    ----------
    name : str
        ``x`` or ``y``.
    data : AxisData
        Structure function, rounding and removed form.
    across : float
        Inverse number of independent lines, 1 for a profile.
    losses : ndarray or None
        Shares of variance that the form takes across the axis, for a map.
    """
    fit = fit_axis(data, across=across, losses_across=losses)
    # Beyond chance, what the form does not describe widens the intervals
    spare = max(fit.increments.lags.size - fit.parameters.size, 1)
    inflation = max(1.0, fit.misfit / spare)
    # The intervals' own widths come from as few independent pieces as the values
    pieces = (
        1
        / fit.extent.across
        / mean_power_of_correlation(fit.correlation, fit.extent.length, 2)
    )
    freedom = max(pieces - data.n_terms, 3.0)
    student = (special.stdtrit(freedom, 0.975) / special.ndtri(0.975)) ** 2
    sampling = data.sampling
    disturbance = fit.noise + data.step**2 / 12
    kept, seen = fit.correlation.blurred(fit.blur)
    cutoff = measured_cutoff(
        lambda f: kept * fit.variance * seen.spectrum(f),
        disturbance,
        sampling.spacing,
        fit.correlation.corr_length,
    )
    # A smooth form has a slope of its own; a jagged one only down to a wavelength
    band = cutoff if fit.correlation.form in JAGGED else 0.0
    if fit.correlation.form == "gaussian":
        length = fit.correlation.corr_length
        length_variance = inflation * fit.log_variance(
            lambda t: fit.correlation_at(t).corr_length
        )
    else:
        length, length_variance = _measured_fall(fit, data)
    corr_length = _unbiased(length, student * length_variance)
    slope_rms = _derivative_rms(fit, band, 1, inflation * (1 + 1 / freedom))
    doubtful = slope_rms.stderr > POOR * slope_rms.value or fit.noise > 0.5 * fit.variance
    if doubtful and losses is None and data.step == 0:
        lengths, slopes = admitted_ends(fit, data)
        corr_length = corr_length.reaching(*lengths)
        slope_rms = slope_rms.reaching(*slopes)
    return AxisStatistics(
        axis=name,
        corr_length=corr_length,
        slope_rms=slope_rms,
        curvature_rms=_derivative_rms(fit, band, 2, inflation * (1 + 1 / freedom)),
        cutoff=cutoff,
        autocorrelation=_describe(fit, data),
        spacing=float(sampling.spacing),
        length=float(sampling.length),
        plain_corr_length=float(sampling.first_fall()),
        fit=fit,
    )


def _measured_fall(fit: AxisFit, data: AxisData) -> tuple[float, float]:
    """Lag where the measured autocorrelation is 1/e [um], and variance of its logarithm.

    Forms with parameters to spare for the short lags that decide the slope need not follow
    the curve at 1/e; the curve itself does.
    """
    white = fit.noise + data.step**2 / 12
    square = max(fit.mean_square - white, 1e-3 * fit.mean_square) / (1 - fit.loss)
    fitted = fit.correlation.corr_length
    found = data.sampling.increments(3 * fitted, 60)
    rho = 1 - _drops(fit, data, found) / square
    below = np.flatnonzero(rho < np.exp(-1))
    if below.size == 0 or below[0] == 0:
        return fitted, fit.log_variance(lambda t: fit.correlation_at(t).corr_length)
    i = int(below[0])
    share = (rho[i - 1] - np.exp(-1)) / (rho[i - 1] - rho[i])
    length = found.lags[i - 1] + share * (found.lags[i] - found.lags[i - 1])
    covariance = increment_covariance(
        np.array([length]), fit.correlation, (fit.variance, white), fit.extent
    )
    # rho = 1 - D / (2 h²): what D and h² scatter, over the fall of rho per ln r
    toward = np.array([1 - np.exp(-1), -0.5]) / square
    near = np.array([0.9, 1.1]) * fitted
    fall = np.diff(fit.correlation.rho(near))[0] / np.log(1.1 / 0.9)
    return float(length), float(toward @ covariance @ toward) / fall**2


def _drops(fit: AxisFit, data: AxisData, found: Increments) -> Array:
    """Half the mean square increments without noise and rounding, blur undone. [um²]

    Blur has no inverse at single lags; what the fitted form loses there is made good.
    """
    noise = fit.noise * data.noise_increments(found.lags) / 2
    kept, seen = fit.correlation.blurred(fit.blur)
    gain = (1 - fit.correlation.rho(found.lags)) / (kept * (1 - seen.rho(found.lags)))
    return gain * (found.mean_square / 2 - noise - data.step**2 / 12)


def _unbiased(length: float, log_variance: float) -> Estimate:
    """Length whose logarithm is estimated without bias; its mean is exp(v/2) larger."""
    estimate = Estimate.positive(length, log_variance)
    return replace(estimate, value=length * float(np.exp(-min(log_variance, 1.0) / 2)))


def _derivative_rms(
    fit: AxisFit, band: float, derivative: int, inflation: float
) -> Estimate:
    def variance(parameters: Array) -> float:
        correlation = fit.correlation_at(parameters)
        return float(np.exp(parameters[0])) * correlation.band_variance(band, derivative)

    value = variance(fit.parameters)
    return Estimate.root_mean_square(
        float(np.sqrt(value)), inflation * fit.log_variance(variance)
    )


def _describe(fit: AxisFit, data: AxisData) -> Autocorrelation:
    correlation = fit.correlation
    found = data.sampling.increments(3 * correlation.corr_length, 40)
    measured = 1 - _drops(fit, data, found) / fit.variance
    texts = {
        "gaussian": "Gaussian, exp(-r²/l²)",
        "periodic": "periodic over {period:.3g} um, in step for {coherence_length:.3g} um",
        "two-scale": "two Gaussian scales, {long_length:.3g} um and {short_length:.3g} um "
        "with {short_share:.2g} of the variance",
        "matern": "Matérn of smoothness {smoothness:.2g} (exponential: 0.5)",
        "multi-scale": "many Gaussian scales, {short_length:.3g} to {long_length:.3g} um",
    }
    return Autocorrelation(
        form=correlation.form,
        description=texts[correlation.form].format(**correlation.parameters),
        parameters=correlation.parameters,
        lag=np.concatenate([[0.0], found.lags]),
        measured=np.concatenate([[1.0], measured]),
        fitted=correlation.rho(np.concatenate([[0.0], found.lags])),
    )


def height_rms(fits: list[AxisFit], step: float) -> Estimate:
    """Root mean square of the true heights, from their mean square, not from the form.

    Of the two axes of a map the one that knows better what form removal took is used: along
    grooves it cannot be told from the heights.
    """
    found = []
    for fit in fits:
        left = fit.mean_square - fit.noise - step**2 / 12
        square = max(left, 1e-3 * fit.mean_square) / (1 - fit.loss)
        found.append((_height_log_variance(fit, square, fit.loss), square))
    variance, square = min(found)
    return Estimate.root_mean_square(float(np.sqrt(square)), variance)


def _height_log_variance(fit: AxisFit, square: float, loss: float) -> float:
    """Variance of ln height² through the mean square, the noise and the loss."""
    gradient = -fit.response[-1] * fit.mean_square / (square * (1 - loss))
    gradient[0] += 1 / (square * (1 - loss))
    # The form's part of the loss grows in proportion to the correlation length
    form = loss - (1 - fit.correlation.blurred(fit.blur)[0])

    def left(parameters: Array) -> Array:
        correlation = fit.correlation_at(parameters)
        kept = correlation.blurred(fit.blur)[0]
        return np.array([kept - form * np.log(correlation.corr_length)])

    by_parameter = jacobian(left, fit.parameters)[0]
    gradient = gradient - by_parameter / (1 - loss) @ fit.response
    # To correct for noise and loss never makes the mean square itself better known, nor
    # the heights alone better than their independent pieces allow
    plain = float(fit.covariance[0, 0]) / fit.mean_square**2
    pieces = mean_power_of_correlation(fit.correlation, fit.extent.length, 2)
    alone = 2 * pieces * fit.extent.across * (1 - fit.loss) ** 2
    least = max(plain, alone, 2.0 / fit.extent.n_points)
    return max(float(gradient @ fit.covariance @ gradient), least)

"""What a fit may vary: for each parameter its unit, range and natural size."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

__all__ = ["PARAMETERS", "Parameter", "bounded_parameter"]


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """One number the solver may vary.

    Parameters
    ----------
    name : str
        Name in the results.
    value : float
        Where the search starts.
    low, high : float
        Bounds, -inf and inf where there are none.
    scale : float
        A change that matters; the solvers work in units of it where `value` is 0.
    prior_value, prior_stderr : float
        Gaussian knowledge from elsewhere; `prior_stderr` is inf where there is none.
    squared : bool
        True if only its square acts, as kappa's in all elements but those that mix linear
        and circular light: at 0 the curve then is flat in the parameter, not in its square.

    Raises
    ------
    ValueError
        If the bounds cross, or the start lies outside them.
    """

    name: str
    value: float
    low: float = -np.inf
    high: float = np.inf
    scale: float = 1.0
    prior_value: float = 0.0
    prior_stderr: float = np.inf
    squared: bool = False

    def __post_init__(self) -> None:
        if not self.low <= self.high:
            msg = (
                f"bounds of {self.name} must have low <= high, got "
                f"({self.low:g}, {self.high:g}). Exchange them."
            )
            raise ValueError(msg)
        if not self.low <= self.value <= self.high:
            msg = (
                f"{self.name} must start inside its bounds [{self.low:g}, {self.high:g}], "
                f"got {self.value:g}. Widen the bounds or change the value in the model."
            )
            raise ValueError(msg)

    def fixed_at(self, value: float) -> "Parameter":
        """Return the parameter held at `value`."""
        return replace(self, value=value, low=value, high=value)

    def started_at(self, value: float) -> "Parameter":
        """Return the parameter with another start, moved inside the bounds."""
        return replace(self, value=float(np.clip(value, self.low, self.high)))


# name: (low, high, scale, unit, what it is)
PARAMETERS: Mapping[str, tuple[float, float, float, str, str]] = {
    "specular_gain": (0.0, np.inf, 1.0, "1", "factor on the facet reflection"),
    "diffuse_albedo": (0.0, 1.0, 0.1, "1", "albedo of the additive Lambertian term"),
    "volume_albedo": (0.0, 1.0, 0.1, "1", "albedo of the scatter under the interface"),
    "volume_depolarization": (0.0, 1.0, 1.0, "1", "1: that scatter is unpolarised"),
    "grazing_albedo": (0.0, np.inf, 0.1, "1", "strength of the term growing at grazing"),
    "n": (0.05, 10.0, 0.5, "1", "real part of the refractive index"),
    "kappa": (0.0, 20.0, 0.5, "1", "imaginary part of the index, >= 0 absorbs"),
    "height_rms": (1e-5, 1e3, 0.1, "um", "rms height, of a surface seen by waves"),
    "corr_length": (1e-3, 1e5, 1.0, "um", "1/e length of its autocorrelation"),
    "slope_rms": (1e-3, 3.0, 0.1, "1", "rms slope per axis"),
    "slope_rms_x": (1e-3, 3.0, 0.1, "1", "rms slope along x"),
    "slope_rms_y": (1e-3, 3.0, 0.1, "1", "rms slope along y"),
    "orientation": (-np.pi, np.pi, 0.1, "rad", "azimuth of the x axis of the slopes"),
    "shadow_omega": (1e-3, 10.0, 0.5, "rad", "Maxwell-Beard shadowing, tilt constant"),
    "shadow_tau": (1e-3, 10.0, 0.2, "rad", "Maxwell-Beard shadowing, angle constant"),
    "scale": (0.0, np.inf, 1.0, "1", "goniometer calibration factor on every element"),
    "background": (-np.inf, np.inf, 0.01, "1/sr", "goniometer offset, added to M00"),
}


def bounded_parameter(
    name: str,
    value: float,
    bounds: tuple[float | None, float | None] | None = None,
    *,
    label: str | None = None,
) -> Parameter:
    """Return the row of `PARAMETERS` called `name` with its start and, if given, bounds.

    Parameters
    ----------
    name : str
        A key of `PARAMETERS`; any other name is taken as unbounded with scale 1.
    value : float
        Start.
    bounds : (float or None, float or None), optional
        Low and high; None keeps the default end.
    label : str, optional
        Name in the results where it differs, as for a parameter separate for each scan.

    Examples
    --------
    >>> bounded_parameter("kappa", 0.1).high
    20.0
    """
    low, high, scale, *_ = PARAMETERS.get(name, (-np.inf, np.inf, 1.0, "", ""))
    if bounds is not None:
        low = low if bounds[0] is None else float(bounds[0])
        high = high if bounds[1] is None else float(bounds[1])
    return Parameter(
        name=label or name, value=float(value), low=low, high=high, scale=scale
    )

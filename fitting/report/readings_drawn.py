"""A fit as one figure: readings and fitted values against view angle, residuals below."""

from typing import TYPE_CHECKING

import numpy as np

from pbrdf.plots import COLOURS, new_figure
from pbrdf.plots.sheet import lay_out, small, width

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["fit_figure"]

_GROUP = ("scan", "theta_i", "wavelength")


def fit_figure(readings: "xr.Dataset", *, width_mm: float = 170.0) -> "Figure":
    """Draw every observable that was read in the plane of incidence.

    Circles are readings with their standard errors, lines the fitted values at them; below,
    the residuals in standard errors with a band of two. Each scan, incidence and wavelength
    has its colour.

    Parameters
    ----------
    readings : Dataset, dim reading
        As of a fit.
    width_mm : float
        Width that the figure is printed at. [mm]

    Raises
    ------
    ValueError
        If no reading lies in the plane of incidence.
    """
    from matplotlib import rc_context

    frame = readings.to_dataframe().reset_index()
    flat = np.abs(np.sin(frame.dphi) * np.sin(frame.theta_s)) < 1e-6
    frame = frame[flat].assign(wavelength=frame.wavelength.fillna(-1.0))
    if not len(frame):
        msg = "readings must lie in the plane of incidence to be drawn, got none there."
        raise ValueError(msg)
    names = list(dict.fromkeys(frame.observable))
    columns = min(len(names), 3 if width_mm > 115 else 1)
    rows = -(-len(names) // columns)
    inches = width(width_mm)
    with rc_context(small()):
        figure, axes = new_figure(
            2 * rows, columns, (inches, 2.6 * rows + 0.5), height_ratios=[1.6, 1.0] * rows
        )
        for number, name in enumerate(names):
            row, column = divmod(number, columns)
            upper, lower = axes[2 * row, column], axes[2 * row + 1, column]
            here = frame[frame.observable == name].sort_values("theta_view")
            for k, ((scan, theta_i, wave), one) in enumerate(here.groupby([*_GROUP])):
                colour = COLOURS[k % len(COLOURS)]
                view = np.rad2deg(one.theta_view)
                label = f"{scan}, " if frame.scan.nunique() > 1 else ""
                label += f"incidence {np.rad2deg(theta_i):.4g}°"
                label += f", {wave:.4g} µm" if wave > 0 else ""
                upper.errorbar(
                    view, one.measured, one.stderr, fmt="o", ms=2.4, mfc="white", mew=0.7,
                    elinewidth=0.6, color=colour, label=label,
                )  # fmt: skip
                upper.plot(view, one.model, color=colour, lw=1.0)
                lower.plot(view, one.residual, ".", ms=3, color=colour)
            lower.axhspan(-2, 2, color="0.5", alpha=0.18, lw=0)
            upper.set_title(f"{name} [{'1/sr' if name[0] in 'MIf' else '1'}]")
            upper.tick_params(labelbottom=False)
            lower.set(xlabel="view angle [deg], + forward", ylabel="standard errors")
        for axis in axes.flat:
            axis.set(xlim=(-90, 90), xticks=range(-90, 91, 45))
        for axis in axes[:, len(names) % columns :].flat if len(names) % columns else ():
            axis.set_visible(bool(axis.has_data()))
        handles, labels = axes[0, 0].get_legend_handles_labels()
        figure.legend(
            handles, labels, loc="outside upper center", ncols=3 if columns > 1 else 2,
            frameon=False,
        )  # fmt: skip
        lay_out(figure)
    return figure

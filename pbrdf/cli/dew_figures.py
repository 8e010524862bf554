"""Figures of dew: numbers against contact angle."""

from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from pbrdf.plots import COLOURS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["signature_figure"]


def signature_figure(result: xr.Dataset, quantity: str = "P") -> "Figure":
    """Draw one quantity of every region against the contact angle, dry as a line.

    Error bars are two standard errors.
    """
    from matplotlib.figure import Figure

    regions = list(result.region.values)
    figure = Figure(figsize=(3.4 * len(regions), 3.2), layout="constrained")
    axes = figure.subplots(1, len(regions), squeeze=False)[0]
    wet = result.isel(state=slice(1, None))
    degrees = np.rad2deg(wet.contact_angle.values)
    for axis, region in zip(axes, regions, strict=True):
        for number, theta_i in enumerate(result.theta_i.values):
            colour: Any = COLOURS[number % len(COLOURS)]
            one = wet.sel(region=region, quantity=quantity, theta_i=theta_i)
            axis.errorbar(
                degrees, one.signature, 2 * one.signature_stderr, marker="o", ms=3.5,
                capsize=2, color=colour, label=f"{np.rad2deg(theta_i):.3g} deg",
            )  # fmt: skip
            dry = result.signature.isel(state=0).sel(
                region=region, quantity=quantity, theta_i=theta_i
            )
            axis.axhline(float(dry), color=colour, linewidth=0.9, linestyle="--")
        axis.set(xlabel="contact angle [deg]", title=region)
        axis.spines[["top", "right"]].set_visible(False)
        axis.grid(alpha=0.25, linewidth=0.6)
    unit = "1" if quantity == "DOLP" else "1/sr"
    axes[0].set_ylabel(f"{quantity} [{unit}]")
    axes[0].legend(frameon=False, fontsize="small", title="incidence (dashed: dry)")
    return figure

"""Figures of dew: numbers against contact angle."""

from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from pbrdf.plots import COLOURS, new_figure
from pbrdf.plots.sheet import MM, WIDTHS, lay_out, scene_of, small

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["signature_figure"]

# What letters stand for that are no element
_MEANT = {"P": "P = √(M10² + M20² + M30²), the polarised part of M00"}


def signature_figure(result: xr.Dataset, quantity: str = "P") -> "Figure":
    """Draw one quantity of every region against the contact angle, dry as a line.

    Bars, and the bands of the dry surface, are two standard errors.
    """
    from matplotlib import rc_context

    regions = list(result.region.values)
    columns = min(2, len(regions))
    rows = -(-len(regions) // columns)
    unit = "1" if quantity == "DOLP" else "1/sr"
    wet = result.isel(state=slice(1, None))
    degrees = np.rad2deg(wet.contact_angle.values)
    with rc_context(small()):
        figure, axes = new_figure(rows, columns, (WIDTHS[1] * MM, 1.9 * rows + 0.9))
        for axis in axes.flat[len(regions) :]:
            axis.set_visible(False)
        for axis, region in zip(axes.flat, regions, strict=False):
            for number, theta_i in enumerate(result.theta_i.values):
                here = {"region": region, "quantity": quantity, "theta_i": theta_i}
                colour: Any = COLOURS[number % len(COLOURS)]
                axis.errorbar(
                    degrees, wet.signature.sel(here), 2 * wet.signature_stderr.sel(here),
                    marker="o", ms=3.5, capsize=2, color=colour,
                    label=f"incidence {np.rad2deg(theta_i):.3g}°",
                )  # fmt: skip
                dry = float(result.signature.isel(state=0).sel(here))
                error = 2 * float(result.signature_stderr.isel(state=0).sel(here))
                axis.axhline(dry, color=colour, linewidth=0.9, linestyle="--", label="dry")
                axis.axhspan(dry - error, dry + error, color=colour, alpha=0.18, lw=0)
            axis.set(xlabel="contact angle [deg]", ylabel=f"{quantity} [{unit}]")
            axis.set_title(f"mean over the {region}")
        handles, labels = axes.flat[0].get_legend_handles_labels()
        figure.legend(
            handles, labels, loc="outside lower center", frameon=False, ncols=4
        )  # fmt: skip
        wave = result.coords.get("wavelength")
        what = [
            scene_of(result),
            "" if wave is None or wave.ndim else f"{float(wave):.4g} µm",
        ]
        note = "bars and bands: 2 standard errors"
        lines = [", ".join(filter(None, what)), _MEANT.get(quantity, ""), note]
        figure.suptitle("\n".join(filter(None, lines)))
        lay_out(figure)
    return figure

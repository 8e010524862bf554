"""Figures of dew: the hemisphere in polar plots, and numbers against contact angle."""

from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["polar_figure", "signature_figure"]

ELEMENTS = {"M00": (0, 0), "M10": (1, 0), "M20": (2, 0)}
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
# Values are shown over so many decades below the largest
DECADES = 4.0


def polar_figure(result: xr.Dataset, theta_i: int = 0) -> "Figure":
    """Draw M00, M10 and M20 of every state over the hemisphere, logarithmic with sign.

    The source stands at azimuth 0, to the right; zenith angles run from the centre.
    Fainter than twice their standard error, bins are left grey.
    """
    from matplotlib.colors import SymLogNorm
    from matplotlib.figure import Figure

    here = result.isel(theta_i=theta_i)
    states = [str(state) for state in result.state.values]
    figure = Figure(figsize=(2.9 * len(states), 2.9 * len(ELEMENTS)), layout="constrained")
    axes = figure.subplots(
        len(ELEMENTS), len(states), squeeze=False, subplot_kw={"projection": "polar"}
    )
    half = np.pi / result.sizes["dphi"]
    azimuth = np.append(here.dphi.values - half, 2 * np.pi - half)
    zenith = np.linspace(0.0, 90.0, here.sizes["theta_s"] + 1)
    for row, (name, (out, into)) in zip(axes, ELEMENTS.items(), strict=True):
        element = here.brdf.isel(stokes_out=out, stokes_in=into)
        error = here.brdf_stderr.isel(stokes_out=out, stokes_in=into)
        top = float(np.abs(element).max())
        low = top / 10**DECADES
        norm = SymLogNorm(low, vmin=-top if out else 0.0, vmax=top)
        colours = "RdBu_r" if out else "viridis"
        for axis, state in zip(row, states, strict=True):
            values = element.sel(state=state).values
            sure = np.abs(values) > 2 * error.sel(state=state).values
            image = axis.pcolormesh(
                azimuth, zenith, np.where(sure, values, np.nan), norm=norm, cmap=colours,
                rasterized=True,
            )  # fmt: skip
            axis.set_facecolor("0.92")
            axis.set_rticks([30, 60, 90], labels=[])
            axis.set_xticks([0, np.pi / 2, np.pi, 1.5 * np.pi], labels=[])
            axis.grid(alpha=0.3, linewidth=0.5)
            if name == "M00":
                axis.set_title(state, fontsize="medium")
        row[0].set_ylabel(name, labelpad=14)
        bar = figure.colorbar(image, ax=list(row), shrink=0.75, label=f"{name} [1/sr]")
        decades = 10.0 ** np.arange(np.ceil(np.log10(low)) + 1, np.log10(top), 1.0)
        bar.set_ticks([*(-decades[::-1] if out else ()), 0.0, *decades])
        bar.minorticks_off()
    zenith_i = np.rad2deg(float(here.theta_i))
    figure.suptitle(f"incidence {zenith_i:.3g} deg; grey: below two standard errors")
    return figure


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

"""What a measured surface looks like, and what was found in it."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from data_io.micrograph.levels import load_grey
from fitting.statistics.slopes import slope_distribution
from pbrdf.plots import COLOURS, new_figure
from pbrdf.plots.sheet import halo, lay_out, log_ticks, small, width

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from data_io import EdgeProfile
    from fitting.statistics.result import SurfaceStatistics

__all__ = ["edge_figure", "surface_figure"]

_GOOD, _POOR = (0.1, 0.9, 0.2), (1.0, 0.1, 0.1)


def surface_figure(
    surface: Any, found: "SurfaceStatistics", *, width_mm: float = 170.0
) -> "Figure":
    """Draw a surface with its scale, what was mended, and its statistics.

    Six panels: the map (form taken off) with a scale bar, or the profile; what was mended,
    or the height distribution of a sound surface; autocorrelation with its fit; power
    spectrum with its model; slope distribution with error bars; slope against cut-off.

    Parameters
    ----------
    surface : Profile or HeightMap
        What was measured.
    found : SurfaceStatistics
        Of it.
    width_mm : float
        Width that the figure is printed at; below 115 mm panels stand in a column. [mm]
    """
    from matplotlib import rc_context

    mends = [one for one in getattr(surface, "mends", ()) if one.kind != "terraces"]
    inches = width(width_mm)
    # In a column the first panel, which may be a map, is higher
    heights, columns = ([1.95] * 2, 3) if inches > 4.5 else ([2.1, *([1.5] * 5)], 1)
    with rc_context(small()):
        figure, axes = new_figure(
            len(heights), columns, (inches, sum(heights)), height_ratios=heights
        )
        figure.set_layout_engine("constrained", w_pad=0.11)
        panels = iter(axes.flat)
        _draw_surface(next(panels), found)
        if mends:
            _draw_mends(next(panels), surface, mends)
        else:
            _draw_heights(next(panels), found)
        _draw_autocorrelation(next(panels), found)
        if found.height_rms.value > 0:
            _draw_spectrum(next(panels), found)
            _draw_slopes(next(panels), surface, found)
            _draw_bands(next(panels), found)
        for empty in panels:
            empty.set_visible(False)
        lay_out(figure)
    return figure


def edge_figure(
    picture: "str | Path", edge: "EdgeProfile", *, width_mm: float = 170.0
) -> "Figure":
    """Draw a micrograph with the edge that was read from it and a scale bar.

    Green where the edge is well seen, red where it is poor.
    """
    from matplotlib import rc_context

    grey, _ = load_grey(picture)
    with rc_context(small()):
        inches = width(width_mm)
        rows, columns = grey.shape
        figure, axes = new_figure(1, 1, (inches, max(1.2, 0.97 * inches * rows / columns)))
        axis = axes[0, 0]
        axis.imshow(grey, cmap="gray", vmin=0, vmax=1, interpolation="antialiased")
        sound = edge.quality[
            np.linspace(0, edge.size - 1, len(edge.pixels)).round().astype(int)
        ]
        axis.scatter(
            edge.pixels[:, 1], edge.pixels[:, 0], s=1.2, linewidths=0,
            c=np.where(sound[:, None] > 0.5, _GOOD, _POOR),
        )  # fmt: skip
        axis.axis("off")
        length = _round_length(columns * edge.um_per_pixel / 5)
        left, low = 0.04 * columns, 0.94 * rows
        axis.plot(
            [left, left + length / edge.um_per_pixel], [low, low], color="white",
            linewidth=3, path_effects=halo("black", 4.5),
        )  # fmt: skip
        axis.text(
            left, low - 0.025 * rows, f"{length:g} µm", color="white", va="bottom",
            path_effects=halo("black"),
        )  # fmt: skip
        lay_out(figure)
    return figure


def _draw_surface(axis: "Axes", found: "SurfaceStatistics") -> None:
    residual = found.residual
    if residual.ndim == 1:
        x = np.arange(residual.size) * found.spacing[0]
        axis.plot(x, residual, color=COLOURS[0], linewidth=0.8)
        axis.set(xlabel="x [um]", ylabel="height without form [um]", title="profile")
        return
    size = [n * d for n, d in zip(residual.shape, found.spacing, strict=True)]
    reach = 3 * max(float(np.nanstd(residual)), 1e-12)
    image = axis.imshow(
        residual.T, origin="lower", extent=(0, size[0], 0, size[1]), cmap="cividis",
        vmin=-reach, vmax=reach, interpolation="none",
    )  # fmt: skip
    axis.grid(False)
    title = "heights [um]" if found.form == "none" else f"heights without {found.form} [um]"
    axis.set(xlabel="x [um]", ylabel="y [um]", title=title)
    if axis.figure is not None:
        # Inside the axis, whose own place counts it in: what stands beside it ends there
        axis.figure.colorbar(image, cax=axis.inset_axes((1.04, 0.1, 0.05, 0.8)))
    length = _round_length(size[0] / 4)
    left, low = 0.05 * size[0], 0.06 * size[1]
    axis.plot([left, left + length], [low, low], color="white", linewidth=3)
    axis.text(
        left, low + 0.02 * size[1], f"{length:g} um", color="white", ha="left", va="bottom",
    )  # fmt: skip


def _round_length(length: float) -> float:
    """Return the nearest length of one digit, 1, 2 or 5, below."""
    power = 10 ** np.floor(np.log10(length))
    return float(power * max(step for step in (1, 2, 5) if step * power <= length))


def _draw_mends(axis: "Axes", surface: Any, mends: list[Any]) -> None:
    names = ", ".join(f"{one.kind} ({one.count})" for one in mends)
    done = "mended" if all(one.mended for one in mends) else "found"
    title = f"{done}: {names}"
    if not hasattr(surface, "heights"):
        _draw_left_out(axis, surface, mends, title)
        return
    where = np.zeros(surface.shape)
    for number, one in enumerate(mends, start=1):
        where[one.where] = number
    size = [n * d for n, d in zip(surface.shape, surface.spacing, strict=True)]
    axis.imshow(
        where.T, origin="lower", extent=(0, size[0], 0, size[1]), cmap="Greys",
        vmin=0, vmax=len(mends), interpolation="none",
    )  # fmt: skip
    axis.grid(False)
    axis.set(xlabel="x [um]", ylabel="y [um]", title=title)


def _draw_left_out(axis: "Axes", profile: Any, mends: list[Any], title: str) -> None:
    """Mark the faults of a profile on what was measured."""
    raw = profile.raw
    values = raw.z if raw.slope is None else raw.slope
    axis.plot(raw.x, values, color=COLOURS[0], linewidth=0.8)
    for colour, one in zip(COLOURS[1:], mends, strict=False):
        axis.plot(raw.x[one.where], values[one.where], "x", color=colour, label=one.kind)
    # A sentinel of 1e38 must not hide the rest
    low, high = np.quantile(values, [0.02, 0.98])
    axis.set_ylim(low - 2 * (high - low), high + 2 * (high - low))
    axis.set(xlabel="x [um]", ylabel="measured", title=title)
    axis.legend(frameon=False, fontsize="small")


def _draw_heights(axis: "Axes", found: "SurfaceStatistics") -> None:
    histogram = found.height_histogram()
    axis.stairs(histogram.density, histogram.edges, fill=True, color=COLOURS[5], alpha=0.55)
    x = np.linspace(histogram.edges[0], histogram.edges[-1], 300)
    axis.plot(x, histogram.gaussian(x), color=COLOURS[1])
    axis.set(
        xlabel="height [um]", ylabel="density [1/um]", title="heights; line: Gaussian"
    )  # fmt: skip


def _draw_autocorrelation(axis: "Axes", found: "SurfaceStatistics") -> None:
    curves = {one.axis: one.autocorrelation for one in found.axes}
    for colour, (name, curve) in zip(COLOURS, curves.items(), strict=False):
        axis.plot(curve.lag, curve.measured, ".", ms=3, color=colour, label=name)
        axis.plot(curve.lag, curve.fitted, color=colour)
    axis.axhline(np.exp(-1), color="grey", linewidth=0.8, linestyle=":")
    forms = ", ".join(dict.fromkeys(curve.form for curve in curves.values()))
    axis.set(
        xlabel="lag [um]", ylabel="autocorrelation [1]",
        title=f"autocorrelation, {forms}",
    )  # fmt: skip
    axis.legend(frameon=False, handlelength=1.0)


def _draw_spectrum(axis: "Axes", found: "SurfaceStatistics") -> None:
    for colour, one in zip(COLOURS, found.axes, strict=False):
        # A surface that does not vary along an axis has no spectrum there
        if one.slope_rms.value == 0:
            continue
        spectrum = found.psd(one.axis)
        axis.loglog(
            spectrum.frequency[1:], spectrum.psd_1d[1:], ".", ms=2.5, color=colour,
            label=one.axis,
        )  # fmt: skip
        axis.loglog(spectrum.frequency[1:], spectrum.model[1:], color=colour)
        axis.axvline(
            1 / one.cutoff, color=colour, linewidth=0.8, linestyle=":",
            label="resolved" if one is found.axes[-1] else None,
        )  # fmt: skip
    # The model of a smooth map falls by tens of decades beyond what was measured
    dots = [line.get_ydata() for line in axis.lines if line.get_linestyle() == "None"]
    seen = np.concatenate([np.asarray(one, dtype=float) for one in dots] or [np.array([])])
    seen = seen[np.isfinite(seen) & (seen > 0)]
    if seen.size:
        axis.set_ylim(seen.min() / 3, 3 * seen.max())
    axis.set(
        xlabel="spatial frequency [1/um]", ylabel="spectrum [um³]",
        title="one-sided spectrum",
    )  # fmt: skip
    log_ticks(axis.xaxis)
    axis.legend(frameon=False, handlelength=1.0)


def _draw_slopes(axis: "Axes", surface: Any, found: "SurfaceStatistics") -> None:
    # The table, and so the model, holds the rms without noise and rounding
    table = {one.axis: one.slope_rms.value for one in found.axes}
    slopes = slope_distribution(surface)
    middle = (slopes.edges[1:] + slopes.edges[:-1]) / 2
    for colour, (name, density) in zip(COLOURS, slopes.density.items(), strict=False):
        axis.errorbar(
            middle, density, slopes.stderr[name], color=colour, fmt=".", markersize=2.5,
            elinewidth=0.7, label=f"{name}, rms {slopes.rms[name]:.3g}",
        )  # fmt: skip
        rms = table.get(name, np.nan)
        if rms > 0:
            gauss = np.exp(-0.5 * (middle / rms) ** 2) / (np.sqrt(2 * np.pi) * rms)
            axis.plot(middle, gauss, "--", color=colour, label=f"model, rms {rms:.3g}")
    axis.set(xlabel="slope [1]", ylabel="density [1]", title="slopes, noise included")
    place = axis.get_subplotspec()
    alone = place is not None and place.get_gridspec().ncols == 1
    axis.set_ylim(0, (1.55 if alone else 1.75) * axis.get_ylim()[1])
    axis.legend(
        frameon=False, loc="upper right", ncols=2 if alone else 1, handlelength=1.4,
        columnspacing=1.0, labelspacing=0.3, borderaxespad=0.1,
    )  # fmt: skip


def _draw_bands(axis: "Axes", found: "SurfaceStatistics") -> None:
    for colour, one in zip(COLOURS, found.axes, strict=False):
        if one.slope_rms.value == 0:
            continue
        bands = found.slope_against_cutoff(axis=one.axis)
        values = np.array([estimate.value for estimate in bands.slope_rms])
        low = np.array([estimate.low for estimate in bands.slope_rms])
        high = np.array([estimate.high for estimate in bands.slope_rms])
        known = np.isfinite(values) & np.isfinite(high)
        axis.semilogx(bands.cutoff[known], values[known], color=colour, label=one.axis)
        axis.fill_between(
            bands.cutoff[known], low[known], high[known], color=colour, alpha=0.2
        )
    axis.set(
        xlabel="shortest wavelength [um]", ylabel="slope rms [1]",
        title="slope against cut-off",
    )  # fmt: skip
    log_ticks(axis.xaxis)
    axis.legend(frameon=False, handlelength=1.0)

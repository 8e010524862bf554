"""One hemisphere on the sheet: colours, hatching, marks, labels, and its colour bar."""

from typing import TYPE_CHECKING, Any

import numpy as np

from pbrdf.plots.panels import Panel
from pbrdf.plots.sheet import halo

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["colour_bar", "draw_disc"]

# Straight pieces that make a circle round
_ROUND = 72
# Width of a label of a bar [in], and length of a bar in that of its panels
_LABEL, _BAR = 0.42, 0.7
# End of the colours of AOLP [deg]
_AOLP_END = 90.0


def draw_disc(axis: Any, panel: Panel, look: Any, incidence: float) -> Any:
    """Draw one hemisphere, incidence in degrees; return what a colour bar explains."""
    name, title, values, error, _ = panel
    norm, colours, _ = look
    # Wide bins in pieces, so that rings are round
    pieces = -(-_ROUND // values.shape[1])
    values = np.repeat(values, pieces, axis=1)
    error = None if error is None else np.repeat(error, pieces, axis=1)
    n_theta, n_dphi = values.shape
    zenith = np.linspace(0.0, 90.0, n_theta + 1)
    # Bins are centred on dphi = 0, which is drawn to the left
    azimuth = (np.arange(n_dphi + 1) - pieces / 2) * 2 * np.pi / n_dphi + np.pi
    # The ends of the colours of AOLP are nearly the grey of the others
    axis.set_facecolor("0.6" if name == "AOLP" else "0.85")
    axis.grid(visible=False)
    image = axis.pcolormesh(
        azimuth, zenith, np.ma.masked_invalid(values), norm=norm, cmap=colours,
        rasterized=True,
    )  # fmt: skip
    if error is not None and name != "AOLP":
        unsure = np.isfinite(values) & ~(np.abs(values) >= 2 * error)
    elif error is not None:
        unsure = np.isfinite(values) & ~(error < 15.0)
    else:
        unsure = np.zeros(values.shape, bool)
    if unsure.any():
        _hatch(axis, azimuth, zenith, unsure)
    axis.set_ylim(0.0, 90.0)
    axis.set_yticks([30, 60, 90], labels=[])
    axis.set_xticks(np.deg2rad([0, 90, 180, 270]), labels=["180°", "270°", "0°", "90°"])
    axis.tick_params(axis="x", pad=-1.5)
    axis.grid(visible=True, color="white", linewidth=0.9, alpha=0.7)
    for ring in (30, 60):
        axis.plot(
            np.linspace(0, 2 * np.pi, 181), np.full(181, ring), color="black",
            linewidth=0.35, zorder=3,
        )  # fmt: skip
        axis.text(
            np.deg2rad(68), ring, f"{ring}°", ha="center", va="center", zorder=6,
            path_effects=halo(),
        )  # fmt: skip
    axis.plot(
        np.pi, incidence, "*", color="black", markersize=5.5, zorder=7,
        path_effects=halo(), clip_on=False,
    )  # fmt: skip
    axis.plot(
        0.0, incidence, "+", color="black", markersize=6, mew=1.1, zorder=7,
        path_effects=halo(), clip_on=False,
    )  # fmt: skip
    axis.set_title(title, pad=3)
    return image


def colour_bar(
    figure: "Figure", axes: list[Any], image: Any, look: Any, panels: int, room: float
) -> None:
    """Draw a bar below panels that share it, with the labels of so many, so wide [in]."""
    norm, _, options = look
    count = len(axes)
    bar = figure.colorbar(
        image, ax=axes, location="bottom", shrink=0.86 if count == 1 else 0.7,
        aspect=22 if count == 1 else 18 * count, pad=0.03, **options,
    )  # fmt: skip
    bar.outline.set_linewidth(0.4)
    _few_ticks(bar, norm, "ticks" in options and norm.vmax != _AOLP_END, panels, room)


def _hatch(axis: Any, azimuth: np.ndarray, zenith: np.ndarray, cells: np.ndarray) -> None:
    """Hatch some cells of the hemisphere, as one outline: hatching each takes minutes."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    outlines = []
    for ring, row in enumerate(cells):
        # Neighbours of a ring are one piece, from where they begin to where they end
        turns = np.flatnonzero(np.diff(row, prepend=False, append=False))
        for begin, end in turns.reshape(-1, 2):
            along = np.linspace(azimuth[begin], azimuth[end], end - begin + 1)
            inner = np.stack([along, np.full(along.size, zenith[ring])], axis=-1)
            outer = np.stack([along[::-1], np.full(along.size, zenith[ring + 1])], axis=-1)
            outlines.append(Path(np.concatenate([inner, outer, inner[:1]]), closed=True))
    # As an artist: add_patch would fit the limits of the axes to every piece
    axis.add_artist(
        PathPatch(
            Path.make_compound_path(*outlines), facecolor="none", edgecolor="0.35",
            linewidth=0, hatch="//////", zorder=2,
        )
    )  # fmt: skip


def _few_ticks(bar: Any, norm: Any, symmetric: bool, panels: int, room: float) -> None:
    """Keep as many ticks as there is room for below so many panels, so wide [in]."""
    from matplotlib.colors import LogNorm
    from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullLocator

    def power(value: float, _: object) -> str:
        if value == 0:
            return "0"
        exponent = int(np.round(np.log10(abs(value))))
        return f"${'-' if value < 0 else ''}10^{{{exponent}}}$"

    if symmetric:
        step = _LABEL / (_BAR * room)
        positive, last = [], np.inf
        for tick in sorted(bar.get_ticks(), reverse=True):
            place = float(norm(tick))
            if tick >= norm.linthresh and min(last - place, place - norm(0.0)) >= step:
                positive.append(tick)
                last = place
        positive = positive[:panels]
        kept = sorted({0.0, *positive, *([-t for t in positive] if norm.vmin < 0 else [])})
        bar.set_ticks(kept)
        bar.formatter = FuncFormatter(power)
        bar.update_ticks()
    elif isinstance(norm, LogNorm):
        bar.locator = LogLocator(numticks=2 * panels + 1)
        bar.formatter = FuncFormatter(power)
        bar.update_ticks()
    elif norm.vmax != _AOLP_END:
        bar.locator = MaxNLocator(2 * panels + 1)
        bar.update_ticks()
        bar.formatter.set_powerlimits((-3, 4))
    bar.ax.xaxis.set_minor_locator(NullLocator())

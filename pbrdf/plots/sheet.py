"""The sheet of a figure: its width, its letters, its colours, what stands in its title."""

from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from pbrdf.files.toml import tables_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = [
    "COLOURS",
    "MM",
    "WIDTHS",
    "beam_of",
    "halo",
    "in_lines",
    "lay_out",
    "log_ticks",
    "new_figure",
    "point_of",
    "scene_of",
    "small",
    "state_words",
    "title_of",
    "width",
]

# Colours that stay apart in print and for colour-blind eyes (Okabe and Ito)
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
# One and two columns of a journal [mm]
WIDTHS = (85.0, 170.0)
MM = 1 / 25.4
# So many letters of a title fit on a sheet [1/in]
_TITLE = 14.0
# Coordinates that have words of their own in a title, or are the picture's
_NAMED = (
    "theta_i", "phi_i", "wavelength", "state", "contact_angle", "theta_s", "dphi",
    "theta_view", "bounces", "stokes_out", "stokes_in",
)  # fmt: skip
# Letters at the size that is printed [pt]
SIZE = 7.5


def new_figure(
    rows: int, columns: int, size: tuple[float, float], **options: Any
) -> "tuple[Figure, Any]":
    """Return a figure that belongs to no window system, and its axes as a 2-D array."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, **options)
    for axis in axes.flat:
        axis.spines[["top", "right"]].set_visible(False)
        axis.grid(alpha=0.25, linewidth=0.6)
    return figure, axes


def log_ticks(axis: Any) -> None:
    """Label a logarithmic axis by decades, or by what lies between where these are few."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    low, high = axis.get_view_interval()
    if high < 100 * low:
        between = (1.0, 2.0, 5.0) if high < 30 * low else (1.0, 3.0)
        axis.set_major_locator(LogLocator(subs=between))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def lay_out(figure: "Figure", rounds: int = 2) -> None:
    """Give each part its place for good; at every saving it would take longer than drawing.

    Ticks are chosen for the place that an axis has, so that what is labelled by them needs
    two rounds. Call it under the settings that the figure is saved under, out of those of
    `small`.
    """
    engine = figure.get_layout_engine()
    assert engine is not None  # see `new_figure`
    for _ in range(rounds):
        engine.execute(figure)
    figure.set_layout_engine("none")


def width(width_mm: float) -> float:
    """Return the width of a figure [in].

    Raises
    ------
    ValueError
        If it is none that can be read or printed.
    """
    if not 60.0 <= width_mm <= 1000.0:
        msg = f"width_mm must lie in [60, 1000] mm, 85 and 170 are usual, got {width_mm:g}."
        raise ValueError(msg)
    return width_mm * MM


def small() -> Any:
    """Return settings of letters and lines for a figure printed at its own size."""
    return {
        "font.size": SIZE, "axes.titlesize": SIZE, "axes.labelsize": SIZE,
        "xtick.labelsize": SIZE - 0.5, "ytick.labelsize": SIZE - 0.5,
        "legend.fontsize": SIZE - 0.5, "figure.titlesize": SIZE + 0.5,
        "axes.linewidth": 0.6, "lines.linewidth": 1.0, "lines.markersize": 3.0,
        "hatch.linewidth": 0.35, "pdf.fonttype": 42, "svg.fonttype": "none",
    }  # fmt: skip


def halo(colour: str = "white", linewidth: float = 1.8) -> list[Any]:
    """Path effects that keep letters and marks readable on any colour."""
    from matplotlib import patheffects

    return [patheffects.withStroke(linewidth=linewidth, foreground=colour)]


def in_lines(words: list[str], inches: float) -> str:
    """Join the lines of a title, each broken at commas where it is wider than its sheet."""
    lines = []
    for line in filter(None, words):
        lines.append("")
        for part in line.split(", "):
            joined = f"{lines[-1]}, {part}" if lines[-1] else part
            if lines[-1] and len(joined) > _TITLE * inches:
                lines[-1] += ","
                lines.append(part)
            else:
                lines[-1] = joined
    return "\n".join(lines)


def title_of(result: xr.Dataset) -> str:
    """Name incidence, wavelength and azimuth of the source of one hemisphere."""
    parts = []
    if "theta_i" in result.coords and result.theta_i.ndim == 0:
        parts.append(f"incidence {np.rad2deg(float(result.theta_i)):.4g}°")
    if "wavelength" in result.coords and result.wavelength.ndim == 0:
        parts.append(f"{float(result.wavelength):.4g} µm")
    else:
        parts += [] if "wavelength" in result.dims else ["wavelength not given"]
    if "phi_i" in result.coords and result.phi_i.ndim == 0:
        parts.append(f"azimuth of the source {np.rad2deg(float(result.phi_i)):.4g}°")
    return ", ".join(parts)


def state_words(result: xr.Dataset) -> dict[str, str]:
    """Return what to call each state of a result: a number is a contact angle."""
    states = [str(one) for one in result.state.values]
    angles = result.get("contact_angle")
    if angles is None or angles.dims != ("state",):
        return dict(zip(states, states, strict=True))
    return {
        one: f"contact angle {np.rad2deg(angle):.4g} deg" if np.isfinite(angle) else one
        for one, angle in zip(states, angles.values, strict=True)
    }


def point_of(result: xr.Dataset) -> str:
    """Name the point of a sweep that a result is of, empty where it is of none."""
    told = str(result.attrs.get("interpolated_at", "")).replace("=", " = ")
    parts = [told] if told else []
    for name, one in result.coords.items():
        if one.ndim or name in _NAMED:
            continue
        value = one.values.item()
        text = f"{value:.6g}" if isinstance(value, float) else str(value)
        parts.append(f"{name} = {text}")
    along = result.attrs.get("interpolated_along", "")
    words = ", ".join(parts)
    if not along:
        return words
    bare = result.attrs.get("stderr_excludes_interpolation", False)
    return f"{words} (interpolated along {along}{', its error apart' if bare else ''})"


def beam_of(result: xr.Dataset) -> str:
    """Tell the specular beam that is no part of the BRDF, empty where there is none."""
    if "coherent" not in result:
        return ""
    beam = result.coherent.isel(stokes_out=0, stokes_in=0)
    low, high = float(beam.min()), float(beam.max())
    if high == 0.0:
        return ""
    size = f"{high:.3g}" if np.isclose(low, high) else f"{low:.3g} to {high:.3g}"
    return f"specular beam (dotted), not in the BRDF: reflectance {size}"


def scene_of(result: xr.Dataset) -> str:
    """Describe the scene of a result in a line, empty where it is not recorded."""
    scene = tables_of(str(result.attrs.get("scene", result.attrs.get("dry_scene", ""))))
    parts = []
    surface = scene.get("surface", {})
    if surface:
        kind = surface.get("type", "surface").replace("gaussian", "Gaussian")
        words = [f"{kind} surface"]
        if isinstance(surface.get("slope_rms"), float):
            words.append(f"slope {surface['slope_rms']:.3g}")
        parts.append(" ".join(words))
    substrate = scene.get("substrate", {})
    if isinstance(substrate, dict) and isinstance(substrate.get("n"), int | float):
        index = f"n {substrate['n']:.4g}"
        if substrate.get("kappa"):
            index += f" + {substrate['kappa']:.3g}i"
        name = substrate.get("name")
        parts.append(f"{name} ({index})" if name else index)
    for one in scene.get("contaminants", scene.get("contaminant", [])):
        if isinstance(one, dict):
            parts.append(str(one.get("type", "contaminant")))
    return ", ".join(parts)

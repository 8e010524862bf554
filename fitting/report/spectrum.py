"""Fitted parameters against wavelength: one table, one figure."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from fitting.objective.parameters import PARAMETERS
from pbrdf.plots import COLOURS, new_figure

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fitting.result.fit_result import FitResult

__all__ = ["draw_spectrum", "spectrum_figure", "spectrum_of", "spectrum_table"]


def spectrum_table(result: "FitResult") -> "pd.DataFrame":
    """Return what differs from wavelength to wavelength, a row for each.

    Parameters
    ----------
    result : FitResult
        A fit of scans at several wavelengths.

    Returns
    -------
    DataFrame
        Index `wavelength` [um] (and `scan`, where scans have values of their own); for each
        parameter, and each ratio that is known where the parameters are not, the columns
        `<name>`, `<name>_stderr`, `<name>_low` and `<name>_high`. Empty for one wavelength.
    """
    import pandas as pd

    frame = result.to_frame().reset_index()
    frame = frame[np.isfinite(frame["wavelength"])]
    if frame["wavelength"].nunique() < 2:
        return pd.DataFrame()
    keys = ["wavelength"] if not frame["scan"].any() else ["wavelength", "scan"]
    parts = []
    for name, rows in frame.groupby("parameter", sort=False):
        part = rows.set_index(keys)[["value", "stderr", "low", "high"]]
        part.columns = pd.Index(
            [str(name), *(f"{name}_{end}" for end in ("stderr", "low", "high"))]
        )
        parts.append(part)
    return pd.concat(parts, axis=1).sort_index()


def spectrum_of(fits: "Mapping[float, FitResult]") -> "pd.DataFrame":
    """Return the same table of fits of one wavelength each, by wavelength [um]."""
    import pandas as pd

    rows = {}
    for wave, fit in sorted(fits.items()):
        rows[wave] = row = dict[str, float]()
        for name, one in {**fit.estimates, **fit.ratios}.items():
            row[name] = one.value
            row |= {f"{name}_{end}": getattr(one, end) for end in ("stderr", "low", "high")}
    return pd.DataFrame.from_dict(rows, orient="index").rename_axis("wavelength")


def spectrum_figure(result: "FitResult") -> "Figure":
    """Draw each parameter against wavelength, with its 95 % interval.

    Raises
    ------
    ValueError
        If the fit holds no several wavelengths, or determines none of their parameters.
    """
    return draw_spectrum({"": spectrum_table(result)})


def draw_spectrum(tables: "Mapping[str, pd.DataFrame]") -> "Figure":
    """Draw tables of `spectrum_table` or `spectrum_of` over one another, by name.

    Raises
    ------
    ValueError
        If they determine no parameter.
    """
    names = dict.fromkeys(
        str(name)
        for table in tables.values()
        for name in table.columns
        if f"{name}_stderr" in table and np.isfinite(table[f"{name}_stderr"]).any()
    )
    if not names:
        msg = "result must determine parameters at several wavelengths, got none."
        raise ValueError(msg)
    columns = min(len(names), 3)
    rows = -(-len(names) // columns)
    figure, axes = new_figure(rows, columns, (4.3 * columns, 3.0 * rows))
    for axis in axes.flat[len(names) :]:
        axis.set_visible(False)
    for axis, name in zip(axes.flat, names, strict=False):
        for colour, (title, table) in zip(COLOURS, tables.items(), strict=False):
            if name in table:
                _draw(axis, table, name, title, colour)
        unit = PARAMETERS[name][3] if name in PARAMETERS else "1"
        axis.set_title(f"{name} [{unit}]", fontsize="medium")
        axis.set_xlabel("wavelength [um]")
    if len(tables) > 1:
        axes.flat[0].legend(fontsize="small")
    return figure


def _draw(axis: "Axes", table: "pd.DataFrame", name: str, title: str, colour: str) -> None:
    """Draw one parameter of one table where its error is known."""
    wave = table.index.get_level_values("wavelength").to_numpy(dtype=float)
    value = table[name].to_numpy(dtype=float)
    ends = [table[f"{name}_{end}"].to_numpy(dtype=float) for end in ("low", "high")]
    known = np.isfinite(table[f"{name}_stderr"].to_numpy(dtype=float))
    error = np.abs(np.stack([value - ends[0], ends[1] - value]))
    error = np.where(np.isfinite(error), error, 0.0)
    axis.errorbar(
        wave[known], value[known], error[:, known],
        fmt="o", markersize=4, elinewidth=0.9, capsize=2, color=colour, label=title,
    )  # fmt: skip

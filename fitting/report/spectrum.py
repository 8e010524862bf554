"""Fitted parameters against wavelength: one table, one figure."""

from typing import TYPE_CHECKING

import numpy as np

from fitting.objective.parameters import PARAMETERS
from pbrdf.plots import COLOURS, new_figure

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from fitting.result.fit_result import FitResult

__all__ = ["spectrum_figure", "spectrum_table"]


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


def spectrum_figure(result: "FitResult") -> "Figure":
    """Draw each parameter against wavelength, with its 95 % interval.

    Raises
    ------
    ValueError
        If the fit holds no several wavelengths, or determines none of their parameters.
    """
    table = spectrum_table(result)
    names = [
        name
        for name in table.columns
        if not str(name).endswith(("_stderr", "_low", "_high"))
        and np.isfinite(table[f"{name}_stderr"]).any()
    ]
    if not names:
        msg = "result must determine parameters at several wavelengths, got none."
        raise ValueError(msg)
    columns = min(len(names), 3)
    rows = -(-len(names) // columns)
    figure, axes = new_figure(rows, columns, (4.3 * columns, 3.0 * rows))
    wave = table.index.get_level_values("wavelength").to_numpy(dtype=float)
    for position, axis in enumerate(axes.flat):
        if position >= len(names):
            axis.set_visible(False)
            continue
        name = names[position]
        value = table[name].to_numpy(dtype=float)
        ends = [table[f"{name}_{end}"].to_numpy(dtype=float) for end in ("low", "high")]
        known = np.isfinite(table[f"{name}_stderr"].to_numpy(dtype=float))
        error = np.abs(np.stack([value - ends[0], ends[1] - value]))
        error = np.where(np.isfinite(error), error, 0.0)
        axis.errorbar(
            wave[known], value[known], error[:, known],
            fmt="o", markersize=4, elinewidth=0.9, capsize=2, color=COLOURS[0],
        )  # fmt: skip
        unit = PARAMETERS[str(name)][3] if str(name) in PARAMETERS else "1"
        axis.set_title(f"{name} [{unit}]", fontsize="medium")
        axis.set_xlabel("wavelength [um]")
    return figure

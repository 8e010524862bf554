"""What a page of the pipeline lets its reader take along."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from data_io.reflectance.model import model_text
from fitting.report import explorer, html

if TYPE_CHECKING:
    from fitting.pipeline import PipelineResult

__all__ = ["download_links"]


def download_links(result: "PipelineResult", notes: Mapping[str, Any]) -> Iterator[str]:
    """Yield links that hold simulation, curves, readings and model."""
    yield html.download(*explorer.cuts(result.simulation))
    for name, data, words in (
        ("curves.csv", result.curves, "Download both fitted curves (CSV)"),
        (
            "readings.csv",
            result.monte_carlo.readings,
            "Download readings, fitted values and residuals (CSV)",
        ),
    ):
        yield html.download(name, _table(data), words)
    yield html.download(
        "model.toml", model_text(result.model, notes), "Download model.toml"
    )


def _table(data: xr.Dataset) -> str:
    """Return a dataset as CSV, with the unit in the name of each angle and wavelength."""
    frame = data.to_dataframe().reset_index()
    for angle in [c for c in frame if c in ("theta_i", "theta_s", "dphi", "theta_view")]:
        frame[angle] = np.rad2deg(frame[angle])
        frame = frame.rename(columns={angle: f"{angle}_deg"})
    frame = frame.rename(columns={"wavelength": "wavelength_um"})
    return str(frame.to_csv(index=False, float_format="%.6g"))

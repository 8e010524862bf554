"""Writing of the project's own goniometer CSV: units in the names, nothing lost."""

from pathlib import Path

import numpy as np
import xarray as xr

from data_io.goniometer.remarks.words import polarisation_of, quantity_of
from data_io.goniometer.scan import CONVENTIONS, QUANTITIES, STDERR
from pbrdf.files import complete_file

__all__ = ["NOTES", "write_csv"]

# What is noted in every file, and readers need not keep
NOTES = (
    "Angles in degrees, dphi = phi_s - phi_i, specular at dphi = 180",
    *CONVENTIONS.split(". ")[1:],
)
_OPTIONAL = ("phi_i", "source_half_angle", "detector_half_angle")


def write_csv(dataset: xr.Dataset, path: str | Path) -> None:
    """Write a goniometer dataset; see `data_io.write_goniometer`."""
    columns = {
        f"{name}_deg": degrees(dataset[name]) for name in ("theta_i", "theta_s", "dphi")
    }
    shape = columns["dphi_deg"].shape
    for name in _OPTIONAL:
        if name in dataset.variables:
            columns[f"{name}_deg"] = np.broadcast_to(degrees(dataset[name]), shape)
    if "wavelength" in dataset.coords:
        columns["wavelength_um"] = np.broadcast_to(dataset["wavelength"].to_numpy(), shape)
    for name in (*QUANTITIES, *(f"{name}{STDERR}" for name in QUANTITIES)):
        if name in dataset:
            columns[name] = dataset[name].to_numpy()
    comments = [*_kept_comments(dataset), *NOTES]
    # Without it elements that have no M00 beside them might be ratios to it
    comments.append(f"quantity: {dataset.attrs.get('quantity', 'brdf')}")
    with complete_file(path) as temporary, temporary.open("w", encoding="utf-8") as stream:
        stream.writelines(f"# {text}\n" for text in comments)
        stream.write(",".join(columns) + "\n")
        for row in zip(*(values.tolist() for values in columns.values()), strict=True):
            # repr keeps every digit; an empty cell is what was not measured
            stream.write(",".join("" if x != x else repr(x) for x in row) + "\n")


def _kept_comments(dataset: xr.Dataset) -> list[str]:
    """Return the comments but for those that the numbers have been converted from.

    Those are a quantity, and a polarisation where the light was declared to have none.
    """
    plain = {name for name in dataset.data_vars if name in QUANTITIES} == {"M00"}
    return [
        text
        for text in str(dataset.attrs.get("comments", "")).splitlines()
        if quantity_of(text) is None and not (plain and polarisation_of(text))
    ]


def degrees(angle: xr.DataArray) -> np.ndarray:
    """Return an angle in degrees, without the last digits that radians put there.

    29.999999999999996 becomes 30: both are the same angle in radians, to rounding.

    Examples
    --------
    >>> degrees(xr.DataArray(np.radians([30.0, 41.4]))).tolist()
    [30.0, 41.4]
    """
    radians = angle.to_numpy()
    exact = np.degrees(radians)
    short = np.round(exact, 10)
    same = np.abs(np.radians(short) - radians) <= np.spacing(np.abs(radians))
    return np.where(same, short, exact)

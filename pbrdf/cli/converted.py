"""Goniometer rows in the signs, frames and azimuths of another program."""

from typing import TYPE_CHECKING

import numpy as np

from pbrdf.optics.exchange import CONVENTIONS, convert_brdf

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

__all__ = ["in_convention"]


def in_convention(rows: "xr.Dataset", convention: str) -> "pd.DataFrame":
    """Return all sixteen elements and their errors in a convention.

    The columns bear its name, so that nobody reads them as this package's. Errors of
    elements that a turned frame mixes are taken as independent.

    Parameters
    ----------
    rows : Dataset, dim geometry
        M00 ... M33 [1/sr], with or without `<name>_stderr`; theta_i, theta_s, dphi [rad].
    convention : str
        A key of `pbrdf.optics.exchange.CONVENTIONS`.

    Raises
    ------
    ValueError
        If an element is missing: a turned frame needs all of them.
    """
    import pandas as pd

    names = [f"M{i}{j}" for i in range(4) for j in range(4)]
    missing = [name for name in names if name not in rows]
    if missing:
        msg = (
            f"--convention {convention} needs all sixteen elements, got none of "
            f"{', '.join(missing)}. Simulate with --stokes full."
        )
        raise ValueError(msg)
    angles = [rows[name].values for name in ("theta_i", "theta_s", "dphi")]

    def turned(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return convert_brdf(matrix, *angles, target=convention)

    given = np.stack([rows[n].values for n in names], -1).reshape(-1, 4, 4)
    matrix, phi = turned(given)
    degrees = np.rad2deg(angles[0]), np.rad2deg(angles[1]), np.rad2deg(phi)
    columns = dict(zip(("theta_i_deg", "theta_s_deg", "phi_deg"), degrees, strict=True))
    if "wavelength" in rows.coords:
        columns["wavelength_um"] = rows.wavelength.values
    columns |= {f"{convention}_{n}": v for n, v in zip(names, _flat(matrix), strict=True)}
    if all(f"{name}_stderr" in rows for name in names):
        variance = np.zeros_like(matrix)
        for i, j in np.ndindex(4, 4):
            unit = np.zeros_like(given)
            unit[:, i, j] = 1.0
            error = rows[f"M{i}{j}_stderr"].values[:, None, None]
            share = turned(unit)[0]
            # An error that is not known has no part in elements it does not reach
            variance += np.where(share == 0.0, 0.0, (share * error) ** 2)
        for name, error in zip(names, _flat(np.sqrt(variance)), strict=True):
            columns[f"{convention}_{name}_stderr"] = error
    frame = pd.DataFrame(columns)
    frame.attrs["convention"] = CONVENTIONS[convention].source
    return frame


def _flat(matrix: np.ndarray) -> np.ndarray:
    return matrix.reshape(-1, 16).T

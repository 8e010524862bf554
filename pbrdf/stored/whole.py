"""The store of a sweep as a result: all points, or as many as fit, chosen evenly."""

import json
from pathlib import Path

import numpy as np
import xarray as xr

from pbrdf.files.stores import check_store

__all__ = ["is_sweep_store", "read_sweep"]

_BOUND = "pbrdf_sweep"
_OWN = ("bounces", "theta_i", "theta_s", "dphi", "stokes_out", "stokes_in")
_STATES = ("missing", "done", "failed")


def is_sweep_store(path: str | Path) -> bool:
    """Whether a path is a store that `pbrdf sweep` has made."""
    try:
        about = json.loads((Path(path) / "zarr.json").read_bytes())
        return _BOUND in about["attributes"]
    except (OSError, ValueError, KeyError, TypeError):
        return False


def read_sweep(path: str | Path, most_bytes: float = 2e8) -> xr.Dataset:
    """Read the store of a sweep into memory, finished or not.

    Parameters
    ----------
    path : str or Path
        The store, of a grid or a list of points.
    most_bytes : float
        If the points take more, fewer are read: along each axis evenly, both ends with
        them. The attribute `left_out` says of which axis how many.

    Returns
    -------
    xarray.Dataset
        As of `simulate`, with the dimensions of the sweep before; NaN at points that are
        not finished. The attribute `points` counts them by state. Points of a list are
        named by what varies.

    Raises
    ------
    ValueError
        If it is no store of a sweep, or zarr is not installed.
    """
    from pbrdf.sweeps.wanted import needed

    needed("zarr")
    if not is_sweep_store(path):
        msg = (
            f"path must be a store of pbrdf sweep, got {path}. Give its folder, NAME.zarr."
        )
        raise ValueError(msg)
    check_store(Path(path), sparse=True)
    stored = xr.open_zarr(path, chunks=None)
    state = stored.state.load()
    swept = [str(d) for d in state.dims]
    point = sum(v.nbytes for v in stored.data_vars.values()) / max(state.size, 1)
    counts = {d: state.sizes[d] for d in swept}
    while np.prod(list(counts.values())) * point > most_bytes and max(counts.values()) > 1:
        counts[max(counts, key=lambda d: counts[d])] -= 1
    chosen = {
        d: np.linspace(0, state.sizes[d] - 1, count).round().astype(int)
        for d, count in counts.items()
    }
    result = stored.isel(chosen).load().drop_vars("state")
    if "point" in swept:
        result = _named(result)
    # Texts of Zarr are of a kind that few functions know
    words = {n: c for n, c in result.coords.items() if c.dtype.kind not in "fiu"}
    result = result.assign_coords(
        {
            n: (c.dims, np.array(list(map(str, c.values))))
            for n, c in words.items()
            if c.ndim
        }
    )
    wave = [n for n in ("wavelength",) if n in result.data_vars]
    result = result.set_coords(wave)
    result.attrs["sweep"] = json.loads(result.attrs["sweep"])
    result.attrs["points"] = {
        name: int((state == number).sum()) for number, name in enumerate(_STATES)
    }
    result.attrs["left_out"] = {
        d: f"{counts[d]} of {state.sizes[d]}" for d in swept if counts[d] < state.sizes[d]
    }
    return result


def _named(result: xr.Dataset) -> xr.Dataset:
    """Name the points of a list by what varies."""
    # Without an index of their own, the axes of a list come back as variables
    held = {str(name): one.attrs for name, one in result.variables.items()}
    varied = [name for name, about in held.items() if "scale" in about]
    names = [
        ", ".join(f"{name} {_told(result[name].values[k])}" for name in varied)
        for k in range(result.sizes["point"])
    ]
    return result.drop_vars(varied).assign_coords(point=names)


def _told(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)

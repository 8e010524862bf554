"""What the page of a sweep says of it: what varied, what is missing, a table."""

from collections.abc import Iterator

import numpy as np
import xarray as xr

from pbrdf.derived.elements import mueller

__all__ = ["points", "what_was_swept"]

_OWN = {"bounces", "theta_i", "theta_s", "dphi", "stokes_out", "stokes_in", "run"}


def what_was_swept(result: xr.Dataset) -> Iterator[str]:
    """Say what a sweep varied, and how much of it is there."""
    if "design" not in result.attrs:
        return
    dims = [str(d) for d in mueller(result)[0].dims if d not in _OWN]
    axes = [f"{_ends(result[d])} of {d}" for d in dims if d != "point"]
    if "point" in dims:
        axes.append(f"{result.sizes['point']} points")
    yield f"A sweep over {' and '.join(axes)}."
    counts = result.attrs.get("points", {})
    lacking = [f"{counts[n]} {n}" for n in ("missing", "failed") if counts.get(n)]
    if lacking:
        done = f"{counts['done']} of {sum(counts.values())} points are computed"
        yield f"{done}, {' and '.join(lacking)}: the page is grey there."
    for name, share in (result.attrs.get("left_out") or {}).items():
        yield f"The page holds {share} values of {name}, chosen evenly."


def _ends(values: xr.DataArray) -> str:
    """Return how many values there are, and the first and the last."""
    ends = [values.values[0], values.values[-1]]
    words = [f"{one:.4g}" if values.dtype.kind == "f" else str(one) for one in ends]
    return f"{values.size} values ({words[0]} to {words[1]})"


def points(result: xr.Dataset) -> tuple[str, str, str]:
    """Return name, text and words of a table of a sweep, a row a point and incidence."""
    names = ["albedo", "albedo_stderr", "rel_error"]
    frame = result[[n for n in names if n in result]].to_dataframe().reset_index()
    if "theta_i" in frame:
        frame["theta_i"] = np.rad2deg(frame["theta_i"])
        frame = frame.rename(columns={"theta_i": "theta_i_deg"})
    text = frame.to_csv(index=False, float_format="%.6g")
    return "points.csv", text, "Download albedo and error of every point (CSV)"

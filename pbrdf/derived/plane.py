"""The cut of a result in the plane of incidence."""

import numpy as np
import xarray as xr

__all__ = ["in_plane"]


def in_plane(result: xr.Dataset) -> xr.Dataset:
    """Cut a result in the plane of incidence, against the signed view angle.

    Returns
    -------
    Dataset
        The dimension `theta_view` [rad], rising, positive on the forward side, in place of
        theta_s and dphi. Of readings (dimension `geometry`) those that lie in the plane.

    Raises
    ------
    ValueError
        If the result has no directions in the plane.
    """
    about = {"units": "rad", "long_name": "view zenith, positive forward"}
    if "geometry" in result.dims and "dphi" not in result.dims:
        flat = np.abs(np.sin(result.dphi) * np.sin(result.theta_s)) < 1e-6
        result = result.isel(geometry=np.flatnonzero(flat.values))
        view = -np.sign(np.cos(result.dphi)) * result.theta_s
        return result.assign_coords(theta_view=view.assign_attrs(about))
    known = result.dphi.values if "dphi" in result.dims else np.array([])
    sides = []
    for azimuth, sign in ((0.0, -1.0), (np.pi, 1.0)):
        here = np.flatnonzero(np.isclose(known, azimuth, atol=1e-9))
        if not here.size:
            msg = f"dphi must hold 0 and pi for a cut in the plane, got {known.tolist()}."
            raise ValueError(msg)
        side = result.isel(dphi=int(here[0])).drop_vars("dphi")
        side = side.drop_vars([v for v in side.data_vars if "theta_s" not in side[v].dims])
        side = side.assign_coords(theta_view=("theta_s", sign * side.theta_s.values))
        sides.append(side.swap_dims(theta_s="theta_view").drop_vars("theta_s"))
    cut = xr.concat(
        sides, "theta_view", data_vars="all", coords="minimal", compat="override"
    ).sortby("theta_view")
    cut.theta_view.attrs = about
    rest = result[[v for v in result.data_vars if "theta_s" not in result[v].dims]]
    rest = rest.drop_vars(("theta_s", "dphi"), errors="ignore")
    return cut.assign(rest.data_vars).assign_attrs(result.attrs)

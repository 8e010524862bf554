"""The plane of incidence of a goniometer dataset, and its signed view angle."""

import numpy as np
import xarray as xr

# Files round their angles; a tenth of a degree is far below any detector's aperture [rad]
_PLANE_TOLERANCE = np.radians(0.1)


def view_angle(dataset: xr.Dataset) -> xr.DataArray:
    """Return the signed view angle: positive forward, negative on the source side. [rad]

    NaN out of the plane of incidence. The normal itself is in every plane.

    Examples
    --------
    >>> scan = xr.Dataset(coords={"theta_s": ("geometry", [0.2, 0.2, 0.2]),
    ...                           "dphi": ("geometry", [np.pi, 0.0, 1.0])})
    >>> view_angle(scan).values
    array([ 0.2, -0.2,  nan])
    """
    theta_s, cosine = dataset["theta_s"], np.cos(dataset["dphi"])
    in_plane = (np.abs(cosine) > np.cos(_PLANE_TOLERANCE)) | (theta_s < 1e-9)
    side = xr.where(cosine > 0, -1.0, 1.0)
    view = (side * theta_s).where(in_plane)
    return view.rename("theta_view").assign_attrs(
        units="rad", long_name="signed view angle, positive on the forward side"
    )


def in_plane(dataset: xr.Dataset) -> xr.Dataset:
    """Return the rows in the plane of incidence, in rising order, with `theta_view`.

    Order: wavelength where present, theta_i, theta_view.
    """
    scan = dataset.assign_coords(theta_view=view_angle(dataset))
    scan = scan.isel(geometry=np.flatnonzero(np.isfinite(scan["theta_view"])))
    keys = [scan["theta_view"], scan["theta_i"]]
    if "wavelength" in scan.coords and scan["wavelength"].dims:
        keys.append(scan["wavelength"])
    return scan.isel(geometry=np.lexsort([key.to_numpy() for key in keys]))

"""Two estimators of the same matrices, compared in units of their stated errors."""

import numpy as np
import xarray as xr


def hold_together(
    reduced: xr.Dataset, plain: xr.Dataset, *, fewest: int, most_rms: float
) -> None:
    """Hold all elements of all bounces of independent runs against each other."""
    for name in ("brdf", "brdf_total", "albedo"):
        value, error = reduced[name].values, reduced[f"{name}_stderr"].values
        other, spread = plain[name].values, plain[f"{name}_stderr"].values
        light = other if name == "albedo" else other[..., :1, :1]
        known = spread if name == "albedo" else spread[..., :1, :1]
        lit = np.broadcast_to(light > 10 * known, value.shape) & (spread > 0)
        z = (value - other)[lit] / np.hypot(error, spread)[lit]
        assert np.abs(z).max() < 5
        if name != "albedo":
            assert z.size > fewest
            # Correlated bins: limits of a mean square of some hundred numbers
            assert 0.6 < np.sqrt(np.mean(z**2)) < most_rms

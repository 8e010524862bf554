"""The table [simulate] of a sweep: arguments of `pbrdf.simulate` in units of files."""

from collections.abc import Mapping
from typing import Any

import numpy as np

__all__ = ["RUN_KEYS", "TOGETHER", "arguments"]

# Key in the file: (argument of `simulate`, what a value in the file is in its unit)
_KEYS: dict[str, tuple[str, float | None]] = {
    "theta_i_deg": ("theta_i", np.pi / 180),
    "phi_i_deg": ("phi_i", np.pi / 180),
    "source_half_angle_deg": ("source_half_angle", np.pi / 180),
    "wavelength_um": ("wavelength", 1.0),
    "n_rays": ("n_rays", None),
    "realizations": ("realizations", None),
    "target_rel_error": ("target_rel_error", None),
    "max_bounces": ("max_bounces", None),
    "n_theta": ("n_theta", None),
    "n_dphi": ("n_dphi", None),
    "stokes": ("stokes", None),
    "seed": ("seed", None),
    "fold": ("fold", None),
    "wave": ("wave", None),
    "variance_reduction": ("variance_reduction", None),
}
RUN_KEYS = tuple(_KEYS)
# One trace serves all values of these: key in the file and dimension of the result
TOGETHER = {
    "theta_i_deg": "theta_i", "phi_i_deg": "phi_i", "wavelength_um": "wavelength",
}  # fmt: skip
# What decides shapes; and what a sweep has as a matter of course
FIXED = ("n_theta", "n_dphi", "stokes")
WHOLE = ("n_rays", "realizations", "max_bounces", "seed")
_DEFAULTS = {"theta_i_deg": 30.0, "phi_i_deg": "uniform", "seed": 0}
_PLAIN = {"n_rays": 100_000, "realizations": 16}


def arguments(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keyword arguments of `simulate`, in radians and micrometres.

    Without a target error there are 100 000 rays and 16 realisations, as of
    `pbrdf simulate`; the source stands at 30 degrees, averaged over its azimuth.

    Raises
    ------
    ValueError
        If a key is unknown, no number where one is needed, or an incidence is none.
    """
    unknown = [key for key in table if key not in _KEYS]
    if unknown:
        msg = f"[simulate]: unknown key {unknown[0]!r}. Known: {', '.join(_KEYS)}."
        raise ValueError(msg)
    given = _DEFAULTS | dict(table)
    if "target_rel_error" not in given or _PLAIN.keys() & given.keys():
        given = _PLAIN | given
    return {_KEYS[key][0]: _in_unit(key, value) for key, value in given.items()}


def _in_unit(key: str, value: Any) -> Any:
    unit = _KEYS[key][1]
    if unit is None or (key == "phi_i_deg" and isinstance(value, str)):
        return value
    try:
        numbers = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        msg = f"[simulate]: {key} must be numbers, got {value!r}."
        raise ValueError(msg) from error
    if key == "theta_i_deg" and not np.all((numbers >= 0) & (numbers < 90)):
        msg = f"[simulate]: {key} must lie in [0, 90), got {value!r}."
        raise ValueError(msg)
    return (numbers * unit).tolist()

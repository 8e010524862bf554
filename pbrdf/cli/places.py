"""Where a result is cut: NAME=VALUE of --at, in the units that the names say."""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["places_in", "written_places"]

# What the options are called that choose a dimension
_OPTIONS = {
    "theta_i": "--theta-i-deg",
    "wavelength": "--wavelength-um",
    "phi_i": "--at phi_i_deg=VALUE",
}
# Dimensions of the picture itself
_DRAWN = ("theta_s", "dphi", "stokes_out", "stokes_in")


def written_places(
    texts: list[str] | None, cure: str = "Give --theta-i-deg."
) -> dict[str, Any]:
    """Return the places of --at: numbers, or text where it is none; phi_i in radians.

    Parameters
    ----------
    texts : list of str, optional
        As NAME=VALUE.
    cure : str
        What to do instead of naming the incidence.

    Raises
    ------
    ValueError
        If a word is no NAME=VALUE, is there twice, or has an option of its own.
    """
    places: dict[str, Any] = {}
    for text in texts or ():
        name, equals, value = (part.strip() for part in text.partition("="))
        name = "wavelength" if name == "wavelength_um" else name
        if name in ("theta_i", "theta_i_deg"):
            msg = f"--at must not name the incidence, got {name} of value {value}. {cure}"
            raise ValueError(msg)
        if name == "phi_i":
            msg = f"--at must name the azimuth in degrees, phi_i_deg=VALUE, got {text!r}."
            raise ValueError(msg)
        if name.removesuffix("_deg") in _DRAWN:
            msg = f"--at must not name what the figure shows, got {text!r}. Leave it out."
            raise ValueError(msg)
        name = "phi_i" if name == "phi_i_deg" else name
        if not equals or not name or not value or name in places:
            msg = f"--at must be NAME=VALUE, once for each name, got {text!r}."
            raise ValueError(msg)
        try:
            places[name] = float(value)
        except ValueError:
            places[name] = value
        if name in ("phi_i", "wavelength"):
            if not isinstance(places[name], float):
                msg = f"--at must give a number for {name}, got {text!r}."
                raise ValueError(msg)
            places[name] = math.radians(places[name]) if name == "phi_i" else places[name]
    return places


def _in_radians(result: "xr.Dataset", at: Mapping[str, Any]) -> dict[str, Any]:
    """Return places by the names of the result, whose angles are radians."""
    places = {}
    for name, value in at.items():
        angle = name.removesuffix("_deg")
        if name not in result.coords and angle in result.coords and name != angle:
            places[angle] = math.radians(value)
            continue
        known = name in result.coords and result[name].attrs.get("units") == "rad"
        if known and name != "phi_i":
            msg = f"--at must name an angle in degrees, {name}_deg=VALUE, got {name!r}."
            raise ValueError(msg)
        places[name] = value
    return places


def places_in(
    result: "xr.Dataset",
    theta_i: float | None,
    wavelength: float | None,
    at: Mapping[str, Any],
    *,
    one: bool,
) -> dict[str, Any]:
    """Return where to cut a result; of one hemisphere each dimension needs a place.

    Parameters
    ----------
    theta_i, wavelength : float, optional
        As of --theta-i-deg and --wavelength-um. [deg], [um]
    at : mapping
        As of `written_places`.
    one : bool
        Whether all of one hemisphere must be chosen; the first incidence if none is given.

    Raises
    ------
    ValueError
        If a place is given twice, was not computed, or is lacking.
    """
    from pbrdf.derived.elements import mueller
    from pbrdf.derived.places import choose, in_words

    value, _ = mueller(result)
    places = _in_radians(result, at)
    if theta_i is not None:
        places["theta_i"] = math.radians(theta_i)
    if wavelength is not None:
        if "wavelength" in places:
            msg = "--wavelength-um must be given once, got it in --at too. Leave one out."
            raise ValueError(msg)
        if "wavelength" not in result.coords:
            msg = (
                "--wavelength-um must be left out, the result names no wavelength, got "
                f"{wavelength:g}."
            )
            raise ValueError(msg)
        places["wavelength"] = wavelength
    for name in places:
        if name not in result.coords:
            own = ("theta_i", "wavelength", *_DRAWN)
            held = [str(d) for d in value.dims if d not in own]
            held = ["phi_i_deg" if d == "phi_i" else d for d in held]
            msg = (
                f"--at must name a further dimension of the result, "
                f"{', '.join(held) or 'here none'}, got {name!r}."
            )
            raise ValueError(msg)
    here = choose(result, places)
    if not one:
        return places
    left = mueller(here)[0]
    lacking = [
        str(d)
        for d in left.dims
        if d not in ("theta_i", "state", *_DRAWN) and left.sizes[d] > 1
    ]
    if lacking:
        cures = "; ".join(
            f"{_OPTIONS.get(d, f'--at {d}=VALUE')}, one of "
            f"{', '.join(in_words(d, v) for v in result[d].values)}"
            for d in lacking
        )
        many = " and ".join(lacking)
        msg = f"the result has several values of {many}. Give {cures}."
        raise ValueError(msg)
    if "theta_i" in left.dims:
        places["theta_i"] = float(result.theta_i.values[0])
    return places

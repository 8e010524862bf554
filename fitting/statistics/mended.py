"""Surfaces that come as they were measured, mended before anything is made of them."""

from typing import TYPE_CHECKING, overload

if TYPE_CHECKING:
    from data_io import Profile
    from pbrdf import HeightMap


@overload
def mended_once(surface: "HeightMap") -> "HeightMap": ...


@overload
def mended_once(surface: "Profile") -> "Profile": ...


def mended_once(surface: "Profile | HeightMap") -> "Profile | HeightMap":
    """Return a profile or map with its faults mended, if nobody looked for them before.

    The readers of `data_io` have looked, and hold what was declined (``mend="none"``); a
    periodic map was made and not measured; the edge of a micrograph has faults of its own.

    Warns
    -----
    data_io.MendWarning
        For each kind of fault that was found.
    """
    from data_io import MendedMap, Profile, mend_map, mend_profile
    from pbrdf import HeightMap

    if isinstance(surface, HeightMap):
        known = isinstance(surface, MendedMap) or surface.periodic
        return surface if known else mend_map(surface)
    return mend_profile(surface) if type(surface) is Profile else surface

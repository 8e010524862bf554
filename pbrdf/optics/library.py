"""Published optical constants, each with its source and valid range."""

from functools import cache

from pbrdf.optics.dispersion import Sellmeier
from pbrdf.optics.materials import Material

__all__ = ["get", "names"]


@cache
def _library() -> dict[str, Material]:
    entries = [
        Material(
            Sellmeier(
                (0.6961663, 0.4079426, 0.8974794),
                (0.0684043**2, 0.1162414**2, 9.896161**2),
                (0.21, 3.71),
            ),
            name="fused-silica",
            source="I. H. Malitson, J. Opt. Soc. Am. 55, 1205 (1965)",
        ),
        Material(
            Sellmeier(
                (1.03961212, 0.231792344, 1.01046945),
                (0.00600069867, 0.0200179144, 103.560653),
                (0.31, 2.325),
            ),
            name="bk7",
            source="Schott data sheet N-BK7",
        ),
        Material.mirror(),
        Material.black(),
    ]
    return {str(entry.name): entry for entry in entries}


def names() -> tuple[str, ...]:
    """Names of the library, sorted."""
    return tuple(sorted(_library()))


def get(name: str) -> Material:
    """Material of the library.

    Raises
    ------
    ValueError
        If the name is unknown; the message lists the known ones.

    Examples
    --------
    >>> n, kappa = get("bk7").index(0.5876)
    >>> round(n, 4)
    1.5168
    """
    try:
        return _library()[name]
    except KeyError:
        known = ", ".join(names())
        msg = f"material must be one of {known}, got {name!r}. Or use Material(n, kappa)."
        raise ValueError(msg) from None

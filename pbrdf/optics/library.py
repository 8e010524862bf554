"""Published optical constants, each with its source and valid range.

Tables lie in the folder `tables`; bk7 and fused silica are dispersion formulas. Between
table rows n and kappa are interpolated linearly; nothing is extrapolated. PTFE is missing:
no table with a source was found, only its often quoted index of about 1.35.
"""

from functools import cache
from importlib.resources import files

from pbrdf.optics.dispersion import Sellmeier
from pbrdf.optics.materials import Material
from pbrdf.optics.published import read

__all__ = ["get", "names"]

SHORT_NAMES = {"pc": "polycarbonate", "ps": "polystyrene", "silica": "fused-silica"}


def _formulas() -> list[Material]:
    """Materials given by a formula, transparent over its range."""
    return [
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
                (0.3, 2.5),
            ),
            name="bk7",
            source="Schott catalogue of 2017, N-BK7",
        ),
        Material.mirror(),
        Material.black(),
    ]


@cache
def _library() -> dict[str, Material]:
    """Every material by name."""
    folder = files("pbrdf.optics") / "tables"
    tables = [entry for entry in folder.iterdir() if entry.name.endswith(".csv")]
    entries = _formulas() + [read(entry) for entry in tables]
    return {str(entry.name): entry for entry in entries}


def names() -> tuple[str, ...]:
    """Names of the library, sorted.

    Examples
    --------
    >>> "water" in names()
    True
    """
    return tuple(sorted(_library()))


def get(name: str) -> Material:
    """Material of the library; its `source` and `valid_range` say how far to trust it.

    Raises
    ------
    ValueError
        If the name is unknown; the message lists the known ones.

    Examples
    --------
    >>> get("bk7").index(0.5876)[0].__round__(4)
    1.5168
    >>> get("water").valid_range
    (0.2, 200.0)
    """
    try:
        return _library()[SHORT_NAMES.get(name, name)]
    except KeyError:
        known = ", ".join(names())
        msg = f"material must be one of {known}, got {name!r}. Or use Material(n, kappa)."
        raise ValueError(msg) from None

"""Which channel of an instrument's file holds the heights."""

import re
import warnings
from pathlib import Path
from typing import Any

from data_io.text.units import LENGTH_UNITS, normalise_unit
from pbrdf.errors import DataFileError


class ChannelWarning(UserWarning):
    """A file holds several channels in a length unit; one was taken."""


# Signals that some instruments state in metres though they are no heights
_NO_HEIGHT = re.compile(
    r"error|amplitude|phase|defl|deform|adhes|dissip|stiff|modulus|current|friction|"
    r"lateral|potential|intens|light|user|slope|lock|setpoint|deriv|mask|thumbnail",
    re.IGNORECASE,
)


def choose_channel(path: Path, channels: list[Any], wanted: int | str | None) -> Any:
    """Return the channel asked for, or else the first that can hold heights.

    A channel can if its unit is a length and its name is not that of another signal, such
    as an error signal, an amplitude or a deformation.

    Warns
    -----
    ChannelWarning
        If nothing was asked for and more than one channel is in a length unit.
    """
    if not channels:
        problem = "expected heights in a length unit, the file holds none"
        raise DataFileError(path, problem, "Export the height channel, with its unit.")
    if wanted is not None:
        return _asked_for(path, channels, wanted)
    lengths = [c for c in channels if _is_length(c.unit)]
    if not lengths and len(channels) > 1:
        problem = f"expected a channel in a length unit, got {_listed(channels)}"
        raise DataFileError(path, problem, "Name one by channel= and give unit=.")
    candidates = lengths or channels
    heights = [c for c in candidates if not _NO_HEIGHT.search(c.name or "")]
    chosen = (heights or candidates)[0]
    if len(candidates) > 1 or not heights:
        msg = (
            f"{path.name}: channel {_label(chosen)} is taken, of {_listed(candidates)}. "
            "Another is had by channel=."
        )
        warnings.warn(msg, ChannelWarning, stacklevel=6)
    return chosen


def _asked_for(path: Path, channels: list[Any], wanted: int | str) -> Any:
    """Return the channel of a number or, without regard to case, of a name."""
    name = str(wanted).strip().lower()
    named = [c for c in channels if (c.name or "").strip().lower() == name]
    found = named or [c for c in channels if str(c.index) == name]
    if not found:
        problem = f"expected a channel of the file, got {wanted!r}"
        raise DataFileError(path, problem, f"It has {_listed(channels)}.")
    return found[0]


def _is_length(unit: Any) -> bool:
    """Tell whether a channel is in a length unit; lateral and height units may differ."""
    return isinstance(unit, str) and normalise_unit(unit) in LENGTH_UNITS


def _label(channel: Any) -> str:
    return f"{channel.index} ({channel.name or 'unnamed'})"


def _listed(channels: list[Any]) -> str:
    """Return numbers and names of the first channels."""
    shown = ", ".join(map(_label, channels[:8]))
    return shown + (f" and {len(channels) - 8} more" if len(channels) > 8 else "")

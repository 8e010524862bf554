"""What a check says: how bad, what, what it suspects, and what would mend it."""

from dataclasses import dataclass

__all__ = ["Finding", "PhysicsError"]


class PhysicsError(ValueError):
    """A scan that contradicts physics as it was read."""


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One result of a check.

    Attributes
    ----------
    name : str
        The check, as `accept` names it.
    severity : {"error", "warning", "note"}
        Errors of physics stop a fit unless they are accepted.
    what : str
        What was found, with numbers and places.
    suspects : str
        What it comes from, most likely.
    cure : str
        The option or change that would mend it.
    """

    name: str
    severity: str
    what: str
    suspects: str = ""
    cure: str = ""

    def __str__(self) -> str:
        said = [
            f"{self.what}.",
            f"Suspected: {self.suspects}." if self.suspects else "",
            self.cure,
        ]
        return f"{self.severity}: [{self.name}] " + " ".join(part for part in said if part)

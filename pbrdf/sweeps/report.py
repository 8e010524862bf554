"""What a run of a sweep did."""

from collections import Counter
from dataclasses import dataclass, field

from pbrdf.sweeps.store import Mark

__all__ = ["RETRIES", "Report"]

# A group that the machine fails, or whose worker dies, is tried so often again
RETRIES = 2


@dataclass(kw_only=True)
class Report:
    """What a run of a sweep did.

    Attributes
    ----------
    computed : int
        Groups computed now.
    kept : int
        Groups that were finished before.
    errors : dict of str to str
        Points, or groups, that failed now, and why.
    warnings : Counter
        What `simulate` warned of, and at how many points.
    seconds : float
        Work of the groups computed, over all workers. [s]
    """

    computed: int = 0
    kept: int = 0
    errors: dict[str, str] = field(default_factory=dict)
    warnings: Counter[str] = field(default_factory=Counter)
    seconds: float = 0.0

    def add(self, mark: Mark) -> None:
        """Count a group that was computed."""
        self.computed += 1
        self.errors |= mark.errors
        self.warnings.update(mark.warnings)
        self.seconds += mark.seconds

"""Faults of a profile: numbers that stand for missing points, and points that jumped."""

from collections.abc import Iterable

import numpy as np

from data_io.mending.faults import Mend, wanted_kinds
from data_io.mending.sentinels import find_sentinels, find_spikes_along

Array = np.ndarray


def find_profile_faults(
    x: Array, values: Array, *, kinds: str | Iterable[str]
) -> tuple[Mend, ...]:
    """Find the faults of a profile, and say what they are.

    Parameters
    ----------
    x, values : ndarray, shape (n,)
        Rising positions, and heights or slopes.
    kinds : str or sequence of str
        What is to be left out, as in `data_io.mend_map`; a profile has sentinels and
        spikes.

    Returns
    -------
    tuple of Mend
        `mended` where points are to be left out.
    """
    wanted = wanted_kinds(kinds)
    clean = np.asarray(values, dtype=float)
    mends: list[Mend] = []
    sentinels, listed = find_sentinels(clean)
    clean = np.where(sentinels, np.nan, clean)
    spikes = np.zeros(clean.shape, dtype=bool)
    known = np.isfinite(clean)
    spikes[known] = find_spikes_along(x[known], clean[known])
    named = ", ".join(f"{value:g}" for value in listed)
    for kind, where, verbs, text in (
        ("sentinels", sentinels, ("is", "are"), f"{named}, far from the rest"),
        ("spikes", spikes, ("jumps", "jump"), "from both neighbours"),
    ):
        count = int(where.sum())
        if count:
            sentence = f"{count} of {clean.size} points {verbs[count > 1]} {text}"
            mends.append(Mend(kind, count, sentence, where, kind in wanted))
    return tuple(mends)

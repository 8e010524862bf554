"""What was typed after `pbrdf`, for the record of a result."""

from collections.abc import Sequence

__all__ = ["remember", "words_typed"]

# Where the result went and how much was said has no part in its numbers
_ALONE = {"--force", "--quiet", "-q", "--verbose", "-v"}
_WITH_VALUE = {"--output", "-o", "--workers"}

_words: list[str] = []


def remember(arguments: Sequence[str]) -> None:
    """Keep what was typed."""
    _words[:] = arguments


def words_typed(arguments: Sequence[str] | None = None) -> list[str]:
    """Return the words of the command that makes the numbers of this run again.

    Examples
    --------
    >>> words_typed(["-q", "fit", "my scan.csv", "-o", "there", "--n=1.5", "--force"])
    ['pbrdf', 'fit', 'my scan.csv', '--n=1.5']
    """
    kept, skip = ["pbrdf"], False
    for word in _words if arguments is None else arguments:
        if skip or word in _ALONE:
            skip = False
            continue
        skip = word in _WITH_VALUE
        if not skip and word.partition("=")[0] not in _WITH_VALUE:
            kept.append(word)
    return kept

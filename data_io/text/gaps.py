"""What programs write where nothing was measured: the one list of such marks."""

import re

__all__ = ["is_gap", "with_nan"]

_WORDS = {
    "", "-", ".", "?", "na", "n/a", "n.a.", "#n/a", "#na", "nd", "n.d.", "nan", "null",
    "none", "missing", "not measured", "#div/0!", "#num!", "#value!", "#ref!", "#null!",
}  # fmt: skip
# Told from numbers and words wherever they stand in a line
_MARK = re.compile(
    r"no[ _]?data|\*{2,}|-{2,}|-?1\.#\w+|-?nan\(\w+\)|#?\bn/a\b|\bbad\b", re.IGNORECASE
)


def is_gap(cell: str) -> bool:
    """Tell whether a cell says that nothing was measured.

    Examples
    --------
    >>> [is_gap(cell) for cell in ("", "NA", "n/a", "--", "-1.#IND", "#DIV/0!", "0", "inf")]
    [True, True, True, True, True, True, False, False]
    """
    text = cell.strip().lower()
    return text in _WORDS or bool(_MARK.fullmatch(text))


def with_nan(text: str, delimiter: str | None = None) -> str:
    """Return a line with nan for what marks a gap.

    Between white space only marks that are no words of a language are told from names.

    Examples
    --------
    >>> with_nan("0.5 No Data"), with_nan("0.5,NA,", ",")
    ('0.5 nan', '0.5,nan,nan')
    """
    text = _MARK.sub("nan", text)
    if delimiter is None:
        return text
    cells = (cell.strip() for cell in text.split(delimiter))
    return delimiter.join("nan" if is_gap(cell) else cell for cell in cells)

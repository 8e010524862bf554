"""Files out, complete or not at all; files in, regular and of a bounded size."""

from pbrdf.files.reading import (
    check_columns,
    companion,
    file_size,
    read_array,
    read_bounded,
)
from pbrdf.files.toml import read_toml
from pbrdf.files.writing import complete_file, complete_folder

__all__ = [
    "check_columns",
    "companion",
    "complete_file",
    "complete_folder",
    "file_size",
    "read_array",
    "read_bounded",
    "read_toml",
]

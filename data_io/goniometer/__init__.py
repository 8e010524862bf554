"""Goniometer files of every convention, into the project's own."""

from data_io.goniometer.files import read_goniometer, write_goniometer
from data_io.goniometer.scan import ConventionWarning
from data_io.goniometer.view import in_plane, view_angle

__all__ = [
    "ConventionWarning",
    "in_plane",
    "read_goniometer",
    "view_angle",
    "write_goniometer",
]

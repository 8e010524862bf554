"""Files in and out; units and conventions are converted here and nowhere else."""

from data_io.goniometer import in_plane, read_goniometer, view_angle, write_goniometer
from data_io.heightmap import read_height_map
from data_io.profile import MissingUnitWarning, Profile, read_profile

__all__ = [
    "MissingUnitWarning",
    "Profile",
    "in_plane",
    "read_goniometer",
    "read_height_map",
    "read_profile",
    "view_angle",
    "write_goniometer",
]

"""Files in and out; units and conventions are converted here and nowhere else."""

from data_io.heightmap import read_height_map
from data_io.profile import MissingUnitWarning, Profile, read_profile

__all__ = [
    "MissingUnitWarning",
    "Profile",
    "read_height_map",
    "read_profile",
]

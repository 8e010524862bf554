"""Files in and out; units and conventions are converted here and nowhere else."""

from data_io._files import NotAMapError
from data_io._units import MissingUnitWarning
from data_io.channels import ChannelWarning
from data_io.goniometer import in_plane, read_goniometer, view_angle, write_goniometer
from data_io.heightmap import read_height_map
from data_io.micrograph import (
    EdgeProfile,
    MicrographWarning,
    read_profile_image,
    read_profile_images,
    write_profile_overlay,
)
from data_io.mitsuba import export_mitsuba
from data_io.model import read_model, write_model
from data_io.profile import Profile, holds_profile, read_profile, write_profile
from data_io.results import read_result, write_result

__all__ = [
    "ChannelWarning",
    "EdgeProfile",
    "MicrographWarning",
    "MissingUnitWarning",
    "NotAMapError",
    "Profile",
    "export_mitsuba",
    "holds_profile",
    "in_plane",
    "read_goniometer",
    "read_height_map",
    "read_model",
    "read_profile",
    "read_profile_image",
    "read_profile_images",
    "read_result",
    "view_angle",
    "write_goniometer",
    "write_model",
    "write_profile",
    "write_profile_overlay",
    "write_result",
]

"""Files in and out; units and conventions are converted here and nowhere else."""

from data_io.goniometer import (
    ConventionWarning,
    in_plane,
    read_goniometer,
    view_angle,
    write_goniometer,
)
from data_io.mending.bands import Bands, find_bands
from data_io.mending.faults import Mend, MendedMap, MendWarning
from data_io.mending.faults import mend as mend_map
from data_io.mending.terraces import Deterraced, deterrace
from data_io.micrograph.read import (
    EdgeProfile,
    MicrographWarning,
    read_profile_image,
    read_profile_images,
    write_profile_overlay,
)
from data_io.reflectance.mitsuba import export_mitsuba
from data_io.reflectance.model import read_model, write_model
from data_io.reflectance.result_store import is_result_store
from data_io.reflectance.results import read_result, write_result
from data_io.reflectance.wave_file import read_wave_model, write_wave_model
from data_io.text.files import NotAMapError
from data_io.text.units import MissingUnitWarning
from data_io.topography.channels import ChannelWarning
from data_io.topography.height_map import read_height_map
from data_io.topography.height_text import CoordinatesWarning
from data_io.topography.mesh_map import OverhangWarning
from data_io.topography.plausible import ScaleWarning
from data_io.topography.profile import MendedProfile, Profile
from data_io.topography.profile_files import (
    holds_profile,
    mend_profile,
    read_profile,
    write_profile,
)

__all__ = [
    "Bands",
    "ChannelWarning",
    "ConventionWarning",
    "CoordinatesWarning",
    "Deterraced",
    "EdgeProfile",
    "Mend",
    "MendWarning",
    "MendedMap",
    "MendedProfile",
    "MicrographWarning",
    "MissingUnitWarning",
    "NotAMapError",
    "OverhangWarning",
    "Profile",
    "ScaleWarning",
    "deterrace",
    "export_mitsuba",
    "find_bands",
    "holds_profile",
    "in_plane",
    "is_result_store",
    "mend_map",
    "mend_profile",
    "read_goniometer",
    "read_height_map",
    "read_model",
    "read_profile",
    "read_profile_image",
    "read_profile_images",
    "read_result",
    "read_wave_model",
    "view_angle",
    "write_goniometer",
    "write_model",
    "write_profile",
    "write_profile_overlay",
    "write_result",
    "write_wave_model",
]


def __dir__() -> list[str]:
    return sorted(__all__)

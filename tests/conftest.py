"""What every test may use: measured data where present, no window, patient hypothesis."""

import os
from pathlib import Path

import matplotlib as mpl
import pytest
from hypothesis import settings

mpl.use("Agg")

# The first example of a property compiles the kernels under it
settings.register_profile("pbrdf", deadline=None, derandomize=True, max_examples=50)
settings.load_profile("pbrdf")


@pytest.fixture(scope="session")
def shared() -> Path:
    """Folder with the measured files and reference tables that are not in the project."""
    folder = os.environ.get("PBRDF_SHARED")
    if folder is None:
        pytest.skip("PBRDF_SHARED does not name the folder of measured data")
    return Path(folder)

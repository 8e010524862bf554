"""Maps in HDF5 may name other files as the place of their data; none is read."""

import h5py
import numpy as np
import pytest

from data_io import read_height_map
from pbrdf.errors import DataFileError

pytest.importorskip("SurfaceTopography")
HEIGHTS = np.random.default_rng(3).normal(size=(32, 32))


def external(file, folder):
    HEIGHTS.tofile(folder / "secret.bin")
    place = [(str(folder / "secret.bin"), 0, HEIGHTS.nbytes)]
    file.create_dataset("surface", HEIGHTS.shape, "f8", external=place)


def linked(file, folder):
    with h5py.File(folder / "other.h5", "w") as other:
        other["surface"] = HEIGHTS
    file["surface"] = h5py.ExternalLink(str(folder / "other.h5"), "surface")


def virtual(file, folder):
    with h5py.File(folder / "other.h5", "w") as other:
        other["surface"] = HEIGHTS
    layout = h5py.VirtualLayout(HEIGHTS.shape, "f8")
    layout[:] = h5py.VirtualSource(folder / "other.h5", "surface", HEIGHTS.shape)
    file.create_virtual_dataset("surface", layout)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (external, "data lie in another file"),
        (linked, "is a link to somewhere else"),
        (virtual, "put together from other files"),
    ],
)
def test_data_of_other_files_are_not_read(tmp_path, make, words):
    with h5py.File(tmp_path / "map.h5", "w") as file:
        make(file, tmp_path)
    with pytest.raises(DataFileError, match=words):
        read_height_map(tmp_path / "map.h5", spacing=1.0, unit="um")


def test_a_map_that_holds_its_own_data_is_read(tmp_path):
    with h5py.File(tmp_path / "map.h5", "w") as file:
        file["surface"] = HEIGHTS
    found = read_height_map(tmp_path / "map.h5", spacing=1.0, unit="um")
    np.testing.assert_array_equal(found.heights, HEIGHTS)

"""Result files: what is written comes back, attributes and all."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from data_io import read_result, write_result
from pbrdf.errors import DataFileError

SCALARS = (
    st.text() | st.integers(-(2**70), 2**70) | st.booleans() | st.none()
    | st.floats(allow_nan=False)
)  # fmt: skip
ATTRIBUTES = st.recursive(
    SCALARS, lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner), max_leaves=8
)
NAMES = st.from_regex("[a-z][a-z_0-9]{0,12}", fullmatch=True)


def result(seed=3):
    rng = np.random.default_rng(seed)
    dims = ("bounces", "theta_i", "theta_s", "dphi", "stokes_out", "stokes_in")
    brdf = rng.normal(size=(3, 2, 4, 6, 4, 4))
    brdf[0, 0, 0, 0] = np.nan
    return xr.Dataset(
        {"brdf": (dims, brdf, {"units": "sr-1", "long_name": "Mueller BRDF"})},
        coords={
            "bounces": ["1", "2", "3+"],
            "theta_i": ("theta_i", [0.1, 0.7], {"units": "rad"}),
            "stokes_out": list("IQUV"),
            "stokes_in": list("IQUV"),
            "wavelength": 0.55,
        },
        attrs={"scene": '[surface]\nslope_rms = 0.2\nµ "x"', "seed": 2**80, "ok": True,
               "rays": [1, 2], "nothing": None, "nested": {"a": [1.5, {"b": False}]},
               "version": "0.1.0", "text": "", "elapsed": 1.25},
    )  # fmt: skip


def test_everything_survives(tmp_path):
    before = result()
    write_result(before, tmp_path / "result.nc")
    after = read_result(tmp_path / "result.nc")
    xr.testing.assert_identical(after, before)
    assert after.attrs == before.attrs
    assert {k: type(v) for k, v in after.attrs.items()} == {
        k: type(v) for k, v in before.attrs.items()
    }
    assert after.stokes_in.dtype == before.stokes_in.dtype
    # A second pass changes nothing
    write_result(after, tmp_path / "again.nc")
    xr.testing.assert_identical(read_result(tmp_path / "again.nc"), before)


@given(attrs=st.dictionaries(NAMES, ATTRIBUTES, max_size=12))
@settings(max_examples=8)
def test_attributes_survive(tmp_path_factory, attrs):
    path = tmp_path_factory.mktemp("attrs") / "result.nc"
    before = xr.Dataset({"a": ("x", [1.0, 2.0], attrs)}, attrs=attrs)
    write_result(before, path)
    after = read_result(path)
    assert after.attrs == attrs
    assert after["a"].attrs == attrs


def test_numpy_attributes_come_back_as_plain_values(tmp_path):
    attrs = {
        "a": np.float64(0.5),
        "b": np.arange(3),
        "c": (1, np.int64(2)),
        "d": np.bool_(1),
    }
    write_result(xr.Dataset(attrs=attrs), tmp_path / "r.nc")
    assert read_result(tmp_path / "r.nc").attrs == {
        "a": 0.5,
        "b": [0, 1, 2],
        "c": [1, 2],
        "d": True,
    }


def test_writing_does_not_touch_the_dataset(tmp_path):
    before = result()
    write_result(before, tmp_path / "result.nc")
    xr.testing.assert_identical(before, result())


def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "result.nc"
    write_result(result(), path)
    content = path.read_bytes()
    with pytest.raises(TypeError, match=r"attribute model must be text.*got object"):
        write_result(result().assign_attrs(model=object()), path)
    with pytest.raises(TypeError, match=r"must be an xarray.Dataset, got DataArray"):
        write_result(result().brdf, path)
    assert path.read_bytes() == content
    assert [p.name for p in tmp_path.iterdir()] == ["result.nc"]


def test_other_readers_read_it(tmp_path):
    netcdf4 = pytest.importorskip("netCDF4")
    write_result(result(), tmp_path / "result.nc")
    with netcdf4.Dataset(tmp_path / "result.nc") as stored:
        assert_array_equal(np.asarray(stored["brdf"][:])[1], result().brdf.values[1])
        assert stored["brdf"].units == "sr-1"
        assert stored.version == "0.1.0"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "the file is empty"),
        (b"theta_i_deg,M00\n", "the content is something else"),
        (None, "expected a file, found none"),
        (0.5, "expected a complete HDF5 file"),
        (0.97, "expected a complete HDF5 file"),
    ],
)
def test_a_bad_file_is_refused(tmp_path, content, message):
    path = tmp_path / "result.nc"
    if isinstance(content, float):
        write_result(result(), path)
        content = path.read_bytes()[: int(content * path.stat().st_size)]
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(DataFileError, match=message):
        read_result(path)

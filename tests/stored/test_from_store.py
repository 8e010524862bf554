"""A store of a sweep as a BRDF: at its nodes, between them, and beyond."""

import json
import shutil
import warnings
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import pbrdf
from pbrdf.errors import DataFileError
from pbrdf.plots import hemisphere
from pbrdf.stored import read_sweep
from pbrdf.sweeps import load_sweep, run_sweep
from tests.stored.conftest import SCENE, SWEEP

pytestmark = pytest.mark.filterwarnings("ignore:.*realization:pbrdf.AccuracyWarning")


def test_at_nodes_and_bin_centres_it_returns_what_was_computed(store: Path) -> None:
    source = pbrdf.from_store(store)
    with xr.open_zarr(store) as held:
        point = held.isel(slope_rms=1, n=2, theta_i=3).load()
    theta_s, dphi = np.meshgrid(point.theta_s, point.dphi, indexing="ij")
    found = source.brdf(np.deg2rad(55.0), theta_s, dphi, slope_rms=0.16, n=1.7)
    assert found.shape == (30, 60, 4, 4)
    assert found.dtype == np.float64
    peak = float(point.brdf_total[..., 0, 0].max())
    assert_allclose(found, point.brdf_total, rtol=1e-9, atol=1e-9 * peak)


def test_arguments_broadcast(store: Path) -> None:
    source = pbrdf.from_store(store)
    slopes = np.array([0.13, 0.2, 0.29])[:, None]
    dphi = np.array([2.8, np.pi])
    together = source.brdf(0.5, 0.6, dphi, slope_rms=slopes, n=1.55)
    assert together.shape == (3, 2, 4, 4)
    one = source.brdf(0.5, 0.6, np.pi, slope_rms=0.2, n=1.55)
    assert_allclose(together[1, 1], one, rtol=1e-12)
    assert_allclose(source.brdf(0.5, 0.6, np.pi - 4 * np.pi, slope_rms=0.2, n=1.55), one)


def test_it_is_continuous_and_keeps_mirror_symmetry_of_frames(store: Path) -> None:
    """Across the normal, where meridian frames turn by half, light does not jump."""
    source = pbrdf.from_store(store)
    near = 1e-6
    ahead = source.brdf(0.3, near, np.pi, slope_rms=0.2, n=1.5)
    behind = source.brdf(0.3, near, 0.0, slope_rms=0.2, n=1.5)
    assert_allclose(ahead, behind, rtol=1e-3, atol=1e-3 * ahead[0, 0])
    aside = source.brdf(0.3, near, np.pi / 2, slope_rms=0.2, n=1.5)
    # A quarter turn of the frame changes the sign of Q and U of what comes out
    assert_allclose(aside[1, 0], -ahead[1, 0], atol=2e-2 * ahead[0, 0])


@pytest.mark.slow
def test_the_stated_error_holds_at_fresh_points_and_seeds(store: Path) -> None:
    """Against direct runs of many more rays, in bins half as wide about other centres."""
    source = pbrdf.from_store(store)
    rng = np.random.default_rng(8)
    parts, sizes = [], []
    for _ in range(4):
        slope, index = rng.uniform(0.125, 0.29), rng.uniform(1.42, 1.68)
        theta_i = np.deg2rad(rng.uniform(12, 53))
        scene = pbrdf.Scene(
            pbrdf.GaussianSurface(
                shape=(48, 48), spacing=1.0, corr_length=5.0, slope_rms=slope
            ),
            pbrdf.Material(index, 0.05),
        )
        truth = pbrdf.simulate(
            scene, [theta_i], phi_i="uniform", n_rays=16000, realizations=48,
            seed=int(rng.integers(2**31)), n_theta=60, n_dphi=120,
        ).isel(theta_i=0)  # fmt: skip
        wanted = truth.brdf_total.to_numpy()
        noise = truth.brdf_total_stderr.to_numpy()
        theta_s, dphi = np.meshgrid(truth.theta_s, truth.dphi, indexing="ij")
        where = (theta_i, theta_s, dphi)
        found = source.brdf(*where, slope_rms=slope, n=index)
        stated = source.error(*where, slope_rms=slope, n=index)
        bright = wanted[..., 0, 0] > 0.01 * wanted[..., 0, 0].max()
        parts.append((np.abs(found - wanted) / np.hypot(stated, noise))[bright])
        # An error that holds because it is huge is no use
        part = (stated / found[..., :1, :1])[bright][:, 0, 0]
        sizes.append(np.median(part))
    # What is stated over what holds in nine of ten directions, for each element
    ratio = 1.0 / np.quantile(np.concatenate(parts), 0.9, axis=0)
    assert 0.9 < np.median(ratio) < 2.0, ratio
    assert ratio.min() > 0.7, ratio
    assert ratio.max() < 3.0, ratio
    assert np.median(sizes) < 0.12


def test_interpolation_respects_the_lobe(store: Path) -> None:
    """Halfway between incidences a line between lobes has two; along facets they move."""
    source = pbrdf.from_store(store)
    told = source.interpolation_error
    assert told.axis.values.tolist() == ["slope_rms", "n", "theta_i"]
    m00 = told.isel(stokes_out=0, stokes_in=0)
    assert (m00.between <= m00.left_out).all()
    scene = pbrdf.Scene(
        pbrdf.GaussianSurface(shape=(48, 48), spacing=1.0, corr_length=5.0, slope_rms=0.12),
        pbrdf.Material(1.5, 0.05),
    )
    theta_i = np.deg2rad(32.5)
    truth = pbrdf.simulate(
        scene, [theta_i], phi_i="uniform", n_rays=4000, realizations=48, seed=11,
        n_theta=30, n_dphi=60,
    ).brdf_total.isel(theta_i=0, stokes_out=0, stokes_in=0)  # fmt: skip
    with xr.open_zarr(store) as held:
        line = held.brdf_total[..., 0, 0].sel(slope_rms=0.12, n=1.5).load()
    plain = 0.5 * (line.isel(theta_i=1) + line.isel(theta_i=2))
    found = source.at(theta_i, slope_rms=0.12, n=1.5).brdf_total[0, ..., 0, 0]
    lit = truth > 0.1 * truth.max()
    miss, plain_miss = (
        float((abs(one - truth) / truth).where(lit).median()) for one in (found, plain)
    )
    assert miss < 0.3 * plain_miss


def test_a_surface_of_the_store_under_the_sun(store: Path) -> None:
    """Between the points of the sweep, against a simulation there; the error holds it."""
    scene = pbrdf.Scene(
        pbrdf.GaussianSurface(shape=(48, 48), spacing=1.0, corr_length=5.0, slope_rms=0.18),
        pbrdf.Material(1.6, 0.05),
    )
    view = np.deg2rad(40.0)
    truth = pbrdf.simulate(
        scene, [view], phi_i="uniform", n_rays=4000, realizations=32, seed=7, n_theta=30,
        n_dphi=60,
    )  # fmt: skip
    source = pbrdf.from_store(store)
    sun = pbrdf.signatures.Sun(theta=0.55, phi=np.pi - 0.2)
    there = {"theta_s": view, "sun": sun, "phi_s": 0.1}
    wanted = pbrdf.signature(truth, **there)
    found = pbrdf.signature(source.at(view, slope_rms=0.18, n=1.6), **there)
    noise = pbrdf.signature(
        source.at(view, interpolated=False, slope_rms=0.18, n=1.6), **there
    )
    assert_allclose(found.radiance, noise.radiance, rtol=1e-12)
    apart = abs(found.radiance - wanted.radiance)
    error = np.hypot(found.radiance_stderr, wanted.radiance_stderr)
    assert (apart <= 3 * error + 1e-12).all()
    assert (found.radiance_stderr[..., :3] > noise.radiance_stderr[..., :3]).all()
    # An error that holds anything would say nothing
    assert float(error[..., 0].max()) < 0.15 * float(wanted.radiance[..., 0].max())


SMALL = (
    SWEEP.replace("n_rays = 2000", "n_rays = 100")
    .replace("= 30", "= 6")
    .replace("n_dphi = 60", "n_dphi = 8")
    .replace("[0.12, 0.16, 0.22, 0.3]", "[0.1, 0.7]")
)


def small(folder: Path, more: str) -> pbrdf.stored.source.StoredBRDF:
    (folder / "scene.toml").write_text(SCENE)
    (folder / "sweep.toml").write_text(SMALL + more)
    run_sweep(load_sweep(folder / "sweep.toml"), folder / "s.zarr", workers=1)
    return pbrdf.from_store(folder / "s.zarr")


def test_a_surface_of_the_store_tells_what_it_lost_and_where_it_was_lit(
    tmp_path: Path,
) -> None:
    """Cut after one bounce, steep slopes lose light, which a warm surface would emit."""
    source = small(tmp_path, "max_bounces = 1\nphi_i_deg = 20\n")
    view = np.deg2rad(55.0)
    warm = {"temperature": 300.0, "wavelength": 10.0, "phi_s": np.deg2rad(20.0)}
    whole = xr.open_zarr(tmp_path / "s.zarr").truncated
    at = {"n": 1.6, "interpolated": False}
    steep, flat = source.at(slope_rms=0.7, **at), source.at(slope_rms=0.1, **at)
    for one, slope in ((steep, 0.7), (flat, 0.1)):
        lost = whole.sel(slope_rms=slope, n=[1.5, 1.7]).max()
        assert one.attrs["most_lost"] == pytest.approx(float(lost), rel=1e-9)
    assert flat.attrs["most_lost"] < 1e-3 < steep.attrs["most_lost"]
    with pytest.warns(pbrdf.AccuracyWarning, match="% of the light was lost"):
        pbrdf.signature(steep, view, **warm)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        pbrdf.signature(flat, view, **warm)
    with pytest.warns(pbrdf.AccuracyWarning, match="traced at the azimuth 20 deg"):
        pbrdf.signature(flat, view, **warm | {"phi_s": 0.0})


def test_one_surface_has_one_value_of_each(tmp_path: Path) -> None:
    source = small(tmp_path, "wavelength_um = 0.9\n")
    with pytest.raises(ValueError, match=r"n must be one value, got \[1\.4, 1\.5\]"):
        source.at(slope_rms=0.1, n=[1.4, 1.5])


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"slope_rms": 0.31, "n": 1.5}, "slope_rms must lie in the store's 0.12 to 0.3"),
        ({"slope_rms": 0.2}, "n must be given, the store has it from 1.4 to 1.7"),
        ({"slope_rms": 0.2, "n": 1.5, "q": 0.1}, "must have the axis 'q', it has slope"),
        ({"slope_rms": "rough", "n": 1.5}, "slope_rms must be a number, got 'rough'"),
        ({"slope_rms": 0.2, "n": np.nan}, "n must lie in the store's 1.4 to 1.7, got nan"),
    ],
)  # fmt: skip
def test_outside_of_the_store_is_refused_by_name(
    store: Path, given: dict[str, float], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        pbrdf.from_store(store).brdf(0.5, 0.5, np.pi, **given)


def test_incidences_outside_are_refused(store: Path) -> None:
    with pytest.raises(
        ValueError, match=r"theta_i must lie in the store's \[0.1745329, 0.9599311\]"
    ):
        pbrdf.from_store(store).brdf(1.2, 0.5, np.pi, slope_rms=0.2, n=1.5)


def test_what_is_not_computed_is_refused_by_name(store: Path, tmp_path: Path) -> None:
    shutil.copytree(store, tmp_path / "s.zarr")
    import zarr

    state = zarr.open_array(tmp_path / "s.zarr" / "state", mode="r+")
    state[3, 2] = 2
    source = pbrdf.from_store(tmp_path / "s.zarr")
    assert np.isfinite(source.brdf(0.5, 0.5, np.pi, slope_rms=0.12, n=1.4)).all()
    with pytest.raises(
        ValueError, match=r"finished at slope_rms=0.3, n=1.7, which is failed"
    ):
        source.brdf(0.5, 0.5, np.pi, slope_rms=0.3, n=1.7)
    # In the middle, where schemes are chosen: others still answer
    state[1, 1], state[3, 1] = 0, 2
    hurt = pbrdf.from_store(tmp_path / "s.zarr")
    node = {"slope_rms": 0.12, "n": 1.4}
    assert_allclose(
        hurt.brdf(0.9599310885, 0.5, np.pi, **node),
        pbrdf.from_store(store).brdf(np.deg2rad(55.0), 0.5, np.pi, **node),
        rtol=1e-5, atol=1e-9,
    )  # fmt: skip
    assert np.isfinite(hurt.error(0.5, 0.5, np.pi, **node)).all()
    with pytest.raises(ValueError, match=r"n=1.5, which is not computed yet"):
        hurt.brdf(0.5, 0.5, np.pi, slope_rms=0.16, n=1.5)


def test_other_folders_and_designs_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        pbrdf.from_store(tmp_path / "none.zarr")
    with pytest.raises(ValueError, match="must be a store of pbrdf sweep"):
        pbrdf.from_store(tmp_path)


def test_degrees_and_names_of_the_file_are_understood(tmp_path: Path) -> None:
    """Text is chosen, not interpolated; two values of a number warn with the size."""
    (tmp_path / "scene.toml").write_text(SCENE)
    text = SWEEP.replace("n = [1.4, 1.5, 1.7]", 'material = ["pvc", "bk7"]').replace(
        '"surface.slope_rms" = [0.12, 0.16, 0.22, 0.3]', "corr_length_um = [4.0, 6.0]"
    )
    text = text.replace("theta_i_deg = [10, 25, 40, 55]", "theta_i_deg = 30").replace(
        "[simulate]", "[simulate]\nwavelength_um = 0.55"
    )
    (tmp_path / "sweep.toml").write_text(text)
    scene = (tmp_path / "scene.toml").read_text()
    (tmp_path / "scene.toml").write_text(
        scene.replace("n = 1.5\nkappa = 0.05", 'material = "pvc"')
    )
    run_sweep(load_sweep(tmp_path / "sweep.toml"), tmp_path / "s.zarr", workers=1)
    source = pbrdf.from_store(tmp_path / "s.zarr")
    assert source.ranges["material"] == ("pvc", "bk7")
    theta_i = np.deg2rad(30.0)
    with warnings.catch_warnings():
        # Nothing is interpolated
        warnings.simplefilter("error")
        node = source.at(material="bk7", corr_length=6.0)
    assert node.attrs["interpolated_along"] == ""
    with pytest.warns(pbrdf.AccuracyWarning, match="two values of corr_length"):
        one = source.brdf(theta_i, 0.5, np.pi, material="bk7", corr_length=5.0)
    assert_allclose(
        source.brdf(theta_i, 0.5, np.pi, 0.55, material="bk7", corr_length=5.0), one
    )
    with pytest.raises(ValueError, match=r"wavelength must be 0\.55 um, .* got 0\.6"):
        source.brdf(theta_i, 0.5, np.pi, 0.6, material="bk7", corr_length=5.0)
    between = source.at(material="bk7", corr_length_um=5.0)
    assert between.attrs["interpolated_along"] == "corr_length"
    figure = hemisphere(between, ("M00",), fold=False)
    assert "corr_length_um = 5 (interpolated along corr_length)" in figure.get_suptitle()
    other = source.brdf(theta_i, 0.5, np.pi, material="bk7", corr_length_um=5.0)
    assert_allclose(one, other, rtol=1e-14)
    assert (source.error(theta_i, 0.5, np.pi, material="bk7", corr_length=5.0)[0, 0]) > 0
    with pytest.raises(ValueError, match="material must be one of pvc, bk7, which were"):
        source.brdf(theta_i, 0.5, np.pi, material="gold", corr_length=5.0)
    with pytest.raises(ValueError, match=r"theta_i must lie in the store's"):
        source.brdf(0.1, 0.5, np.pi, material="bk7", corr_length=5.0)


@pytest.mark.slow
def test_a_point_is_exported_and_plotted(store: Path, tmp_path: Path) -> None:
    from pbrdf.cli import main

    at = ["--at", "slope_rms=0.2", "--at", "n=1.55"]
    picture, table, file = (tmp_path / f"one{s}" for s in (".png", ".csv", ".pbsdf"))
    assert main(["plot", str(store), *at, "--theta-i-deg", "30", "-o", str(picture)]) == 0
    assert main(["export", str(store), *at, "-o", str(table)]) == 0
    assert picture.stat().st_size > 10_000
    import data_io

    rows = data_io.read_goniometer(table)
    first = rows.isel(geometry=np.flatnonzero(rows.M00.values > 0.1)[:5])
    found = pbrdf.from_store(store).brdf(
        first.theta_i, first.theta_s, first.dphi, slope_rms=0.2, n=1.55
    )
    assert_allclose(found[:, 1, 0], first.M10, rtol=1e-5)
    with pytest.warns(pbrdf.AccuracyWarning, match="leave much to interpolation"):
        data_io.export_mitsuba(
            pbrdf.from_store(store).at(slope_rms=0.2, n=1.55), file, shape=(19, 10, 12)
        )
    assert main(["export", str(store), "-o", str(file), "--force"]) == 2
    figure = pbrdf.from_store(store).plot(0.5, slope_rms=0.2, n=1.55)
    assert len(figure.axes) >= 3


@pytest.mark.parametrize("opened", [pbrdf.from_store, read_sweep])
def test_stores_from_strangers_are_looked_at_first(store, tmp_path, opened):
    """Codecs run code of their choice, and links lead to other files."""
    foreign = shutil.copytree(store, tmp_path / "foreign.zarr")
    about = foreign / "brdf_total" / "zarr.json"
    held = json.loads(about.read_text())
    held["codecs"][-1]["name"] = "numcodecs.lzma"
    about.write_text(json.dumps(held))
    with pytest.raises(DataFileError, match=r"brdf_total: it is packed by numcodecs\.lzma"):
        opened(foreign)
    together = shutil.copytree(store, tmp_path / "together.zarr")
    held = json.loads((together / "zarr.json").read_text())
    held["consolidated_metadata"]["metadata"]["brdf_total"]["codecs"][-1]["name"] = "x"
    (together / "zarr.json").write_text(json.dumps(held))
    with pytest.raises(DataFileError, match=r"brdf_total: it is packed by x"):
        opened(together)
    linked = shutil.copytree(store, tmp_path / "linked.zarr")
    next(linked.glob("brdf_total/c/**/0")).parent.joinpath("1000").symlink_to("/etc/passwd")
    with pytest.raises(DataFileError, match="1000 is a link"):
        opened(linked)

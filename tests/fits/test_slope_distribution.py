"""Slope distributions with error bars, for the models; pictures of a surface."""

import numpy as np
import pandas as pd
import pytest
from numpy.testing import assert_allclose
from skimage import io

from data_io import Profile
from fitting import slope_distribution
from pbrdf import GaussianSurface, HeightMap, Material, MicrofacetModel
from pbrdf.cli.app import main


def surface(seed, **options):
    chosen = {"corr_length": (12, 6), "height_rms": 1.0} | options
    return GaussianSurface(shape=(160, 192), spacing=(1.0, 0.5), **chosen).sample(seed=seed)


def test_the_distribution_of_each_axis_has_honest_errors():
    rms = np.array([1.0 * np.sqrt(2) / 12, 1.0 * np.sqrt(2) / 6])
    found = [slope_distribution(surface(seed), bins=31) for seed in range(12)]
    for axis, name in enumerate("xy"):
        values = np.array([f.rms[name] for f in found])
        errors = np.array([f.rms_stderr[name] for f in found])
        # Facets of finite steps are a little gentler than the surface
        assert_allclose(values.mean(), rms[axis], rtol=0.03)
        assert 0.5 < errors.mean() / values.std(ddof=1) < 1.8
        width = np.diff(found[0].edges)
        assert_allclose((found[0].density[name] * width).sum(), 1)
    assert_allclose(found[0].table.slope_rms, [found[0].rms[n] for n in "xy"], rtol=0.02)
    frame = found[0].to_frame()
    assert list(frame)[:3] == ["slope", "density_x", "density_x_stderr"]


def test_the_table_serves_the_model():
    found = slope_distribution(surface(3, corr_length=8))
    model = MicrofacetModel(Material(1.5), slope_distribution=found.table)
    gauss = MicrofacetModel(
        Material(1.5), slope_rms=float(np.mean(list(found.rms.values())))
    )
    at = (0.4, 0.4, np.pi)
    ratio = model.brdf(*at)[0, 0] / gauss.brdf(*at)[0, 0]
    assert 0.7 < ratio < 1.3


def test_a_cut_off_takes_what_a_gaussian_filter_takes():
    x = np.arange(3000) * 0.5
    waves = {60.0: 1.0, 12.0: 0.2}
    z = sum(a * np.sin(2 * np.pi * x / w) for w, a in waves.items())
    for cutoff in (12.0, 24.0):
        wanted = 0.0
        for wave, size in waves.items():
            passed = 0.5 ** ((cutoff / wave) ** 2)
            wanted += (2 * np.pi / wave * size * passed) ** 2 / 2
        found = slope_distribution(Profile(x, z), cutoff=cutoff)
        assert_allclose(found.rms["x"], np.sqrt(wanted), rtol=0.02)
    with pytest.raises(ValueError, match="cutoff must lie in"):
        slope_distribution(Profile(x, z), cutoff=1e4)


def test_bands_are_drawn_first():
    true = surface(5, corr_length=10)
    raw = HeightMap(np.round(true.heights / 0.4) * 0.4, true.spacing)
    rms = slope_distribution(true).rms
    assert_allclose(
        list(slope_distribution(raw).rms.values()), list(rms.values()), rtol=0.03
    )


def test_the_command_line_draws_the_surface_and_writes_its_slopes(tmp_path, capsys):
    rows = surface(7).heights.T.copy()
    path = tmp_path / "map.csv"
    rows[20:26, 30:36] = np.nan
    np.savetxt(path, rows, delimiter=",", header="dx_um = 1.0\ndy_um = 0.5\nunit = um")
    picture, table = tmp_path / "map.png", tmp_path / "slopes.csv"
    options = ["--figure", str(picture), "--slopes", str(table), "--cutoff-um", "3"]
    assert main(["statistics", str(path), *options]) == 0, capsys.readouterr().err
    drawn = io.imread(picture)
    assert min(drawn.shape[:2]) > 500
    colours = drawn[..., :3] @ np.array([1, 2**8, 2**16])
    assert np.unique(colours).size > 100
    frame = pd.read_csv(table)
    assert_allclose(np.trapezoid(frame.density_x, frame.slope), 1, rtol=0.02)

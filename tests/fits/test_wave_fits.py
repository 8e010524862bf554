"""Fits of height and correlation length by waves: truth recovered, from the book too."""

import casadi
import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose
from typer.testing import CliRunner

import data_io
import fitting
from fitting.models.waves import WaveSurface
from fitting.readings.observations import Geometry
from pbrdf import Material, WaveModel
from pbrdf.cli.app import app
from pbrdf.errors import DataFileError
from tests.wave_by_the_book import gaussian_first_order

TRUTH = WaveModel(Material(1.5), height_rms=0.13, corr_length=2.1)
START = WaveModel(Material(1.5), height_rms=0.1, corr_length=3.0)
THETA = 0.6


def scan(brdf, waves, noise=0.01, beam=False):
    """In-plane M00 and M10 of a function of (theta_s, dphi, wavelength), with noise."""
    view = np.deg2rad(np.arange(-65.0, 66.0, 5.0))
    if beam:
        view = np.append(view, THETA)
    view, wave = (one.ravel() for one in np.meshgrid(view, waves))
    dphi = np.where(view > 0.0, np.pi, 0.0)
    matrix = np.concatenate([
        brdf(abs(view[wave == w]), dphi[wave == w], w) for w in waves
    ])  # fmt: skip
    rng = np.random.default_rng(4)
    error = noise * (matrix[:, 0, 0] + 0.01 * matrix[:, 0, 0].max())
    columns = {}
    for name, column in (("M00", matrix[:, 0, 0]), ("M10", matrix[:, 1, 0])):
        columns[name] = ("geometry", column + error * rng.standard_normal(view.size))
        columns[f"{name}_stderr"] = ("geometry", error)
    coords = {
        "theta_i": np.full(view.size, THETA), "theta_s": abs(view), "dphi": dphi,
        "wavelength": wave,
    }  # fmt: skip
    return xr.Dataset(columns, {k: ("geometry", v) for k, v in coords.items()})


def seen(model):
    return lambda theta_s, dphi, wave: model.brdf(THETA, theta_s, dphi, wave)


def test_a_polished_surface_read_by_the_book():
    """Readings of Rice's first order, which shares no code with the model."""
    height, length, index = 0.006, 0.45, 1.5 + 0.2j

    def rice(theta_s, dphi, wave):
        return np.array([
            gaussian_first_order(THETA, s, d, wave, index, height, length)
            for s, d in zip(theta_s, dphi, strict=True)
        ])  # fmt: skip

    start = WaveModel(Material(1.5, 0.2), height_rms=0.009, corr_length=0.35)
    result = fitting.fit(
        scan(rice, (0.633,)), start, ("height_rms", "corr_length"), accept=["all"]
    )
    assert abs(result.values["height_rms"] - height) < 4 * result.stderr["height_rms"]
    assert abs(result.values["corr_length"] - length) < 4 * result.stderr["corr_length"]
    assert result.stderr["height_rms"] < 0.01 * height


@pytest.mark.parametrize(
    ("free", "start"),
    [
        (("height_rms", "corr_length"), START),
        (
            ("height_rms", "corr_length", "n"),
            START.with_parameters(material=Material(1.42)),
        ),
    ],
)
def test_height_and_length_of_two_wavelengths(free, start):
    """Waves tell heights from lengths, which a facet model knows only by their ratio."""
    data = scan(seen(TRUTH), (0.633, 1.55))
    separate = {"n": "nothing"} if "n" in free else {}
    result = fitting.fit(data, start, free, separate=separate, accept=["all"])
    assert result.converged
    wanted = {"height_rms": 0.13, "corr_length": 2.1, "n": 1.5}
    for name in free:
        error = result.stderr[name]
        assert error < 0.02 * wanted[name]
        assert abs(result.values[name] - wanted[name]) < 4 * error
    assert result.chi2 / result.dof == pytest.approx(1.0, abs=0.35)
    model = result.model.model
    assert (model.height_rms, model.corr_length) == tuple(
        result.values[name] for name in free[:2]
    )
    assert any("known to" in note for note in result.warnings)


def test_the_curve_is_the_model_and_its_slope_is_the_models():
    """All kinds of elements, out of plane, absorbing, gain and base; numbers and slopes."""
    material = Material(1.7, 0.3)
    model = WaveModel(material, height_rms=0.2, corr_length=2.5)
    surface = WaveSurface(model, reach=1.5, specular_gain=0.8, diffuse_albedo=0.1)
    where = Geometry(
        theta_i=np.array([0.3, 0.7]), theta_s=np.array([0.5, 0.9]),
        dphi=np.array([2.1, -2.7]), phi_i=np.zeros(2), wavelength=np.full(2, 0.8),
    )  # fmt: skip
    elements = (8, 0, 13)
    x = casadi.MX.sym("x", 2)
    rows = {name: casadi.DM(v).T for name, v in surface.values(where).items()}
    rows["height_rms"] = casadi.repmat(x[0], 1, 2)
    rows["diffuse_albedo"] = casadi.repmat(x[1], 1, 2)
    expression = surface.mueller(rows, where, elements)
    function = casadi.Function("f", [x], [expression, casadi.jacobian(expression, x)])

    def exact(height, albedo):
        there = surface.updated({"height_rms": height, "diffuse_albedo": albedo})
        matrix = there.brdf(where.theta_i, where.theta_s, where.dphi, 0.8)
        return matrix.reshape(2, 16)[:, elements].T

    value, slope = (one.full() for one in function([0.23, 0.05]))
    now = exact(0.23, 0.05)
    assert_allclose(value, now, atol=3e-4 * now[1].min())
    step = 1e-4
    by_height = (exact(0.23 + step, 0.05) - exact(0.23 - step, 0.05)) / (2 * step)
    assert_allclose(
        slope[:, 0].reshape(2, 3).T, by_height, atol=0.02 * abs(by_height).max()
    )
    assert_allclose(slope[:, 1].reshape(2, 3).T, [[0, 0], [1 / np.pi] * 2, [0, 0]])


def test_what_a_fit_of_waves_says():
    beam = scan(seen(TRUTH), (0.633,), beam=True)
    result = fitting.fit(beam, START, ("height_rms",), fixed={"corr_length": 2.1})
    assert any("1 readings lie in the specular beam" in note for note in result.warnings)
    assert result.values["height_rms"] == pytest.approx(0.13, abs=5 * 0.13 * 0.01)
    # Beyond its reach the height stops at the bound and says so
    near = WaveSurface(TRUTH.with_parameters(height_rms=0.08), reach=1.2)
    stopped = fitting.fit(beam, near, ("height_rms",))
    assert any("height_rms stands at its bound" in note for note in stopped.warnings)
    with pytest.raises(ValueError, match="WaveSurface a wider index_range"):
        fitting.fit(beam, near, ("height_rms",), bounds={"height_rms": (0.01, 1.0)})
    with pytest.raises(ValueError, match="reach must be above 1"):
        WaveSurface(TRUTH, reach=1.0)
    with pytest.raises(ValueError, match="every wavelength where waves are fitted"):
        fitting.fit(beam.drop_vars("wavelength"), START, ("height_rms",))


def test_a_table_of_correlation_keeps_its_shape():
    lag = np.linspace(0.0, 12.0, 200)
    given = WaveModel(
        Material(1.5), height_rms=0.1, autocorrelation=(lag, np.exp(-((lag / 2.1) ** 2)))
    )
    with pytest.raises(ValueError, match="free must name parameters, got 'corr_length'"):
        fitting.fit(scan(seen(TRUTH), (0.633,)), given, ("corr_length",))


def test_the_command_fits_heights_and_writes_a_model(tmp_path):
    data_io.write_goniometer(scan(seen(TRUTH), (1.55,)), tmp_path / "scan.csv")
    words = ["fit", str(tmp_path / "scan.csv"), "--n", "1.5", "--height-rms-um", "0.1"]
    free = ["--free", "height_rms,corr_length", "-o", str(tmp_path / "fit")]
    refused = CliRunner().invoke(app, [*words, *free])
    assert "--corr-length-um must be given where waves are fitted" in str(refused.exception)
    done = CliRunner().invoke(app, [*words, "--corr-length-um", "3", *free])
    assert done.exit_code == 0, done.output
    file = tmp_path / "fit" / "model.toml"
    model = data_io.read_wave_model(file)
    assert model.height_rms == pytest.approx(0.13, rel=0.05)
    assert model.corr_length == pytest.approx(2.1, rel=0.03)
    assert (tmp_path / "fit" / "scan.png").stat().st_size > 10_000
    with pytest.raises(DataFileError, match=r"Read it with data_io\.read_wave_model"):
        data_io.read_model(file)
    text = file.read_text(encoding="utf-8")
    for wrong, message in (
        ("height_rms_um = -", "height_rms"),
        ("hight = ", "unknown key"),
    ):
        file.write_text(text.replace("height_rms_um = ", wrong), encoding="utf-8")
        with pytest.raises(DataFileError, match=message):
            data_io.read_wave_model(file)

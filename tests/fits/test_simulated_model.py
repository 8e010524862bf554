"""The Monte Carlo in the fit's loop: reading of the bins, any index, errors, recovery."""

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

from data_io import read_model, write_goniometer
from fitting import SimulatedModel, fit
from fitting.models.index_grid import IndexGrid
from fitting.models.simulated_trace import interpolate_bins, merged
from fitting.readings.aperture import Aperture, cones_of, rays_through
from fitting.readings.observations import Geometry
from pbrdf import GaussianSurface, HeightMap, Material, MicrofacetModel, Scene, simulate
from pbrdf.cli import main
from pbrdf.optics import specular_mueller
from studies.fits.monte_carlo import TRUTH, models, pulls, simulated_scan

THETA_I = 0.9
SURFACE = GaussianSurface(shape=(64, 64), spacing=1.0, corr_length=8.0, slope_rms=0.3)
FREE = ("n", "kappa", "specular_gain", "diffuse_albedo")


@pytest.fixture(scope="module")
def model() -> SimulatedModel:
    return SimulatedModel(
        Scene(SURFACE, Material(1.45, 0.3)),
        n_rays=3000,
        realizations=32,
        seed=4,
        n_theta=30,
    )


def plane(step: float = 3.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    view = np.deg2rad(np.arange(-70.0, 71.0, step))
    return np.full(view.size, THETA_I), np.abs(view), np.where(view > 0.0, np.pi, 0.0)


def scan(model: SimulatedModel, noise: float, seed: int = 5) -> xr.Dataset:
    where = plane()
    brdf = model.brdf(*where)
    rng = np.random.default_rng(seed)
    sigma = noise * brdf[:, 0, 0]
    data = {}
    for name, (out, into) in {"M00": (0, 0), "M10": (1, 0), "M23": (2, 3)}.items():
        value = brdf[:, out, into] + sigma * rng.standard_normal(sigma.size)
        data[name] = ("geometry", value)
        data[f"{name}_stderr"] = ("geometry", sigma)
    coords = dict(zip(("theta_i", "theta_s", "dphi"), where, strict=True))
    return xr.Dataset(data, {name: ("geometry", value) for name, value in coords.items()})


def test_a_cone_of_light_is_simulated_at_its_axis(model) -> None:
    """The analytical lobe is averaged, the noise of the bins is not."""
    point = Geometry(*plane(9.0), np.zeros(16), np.full(16, np.nan))
    traced, expected = len(model._run.traces), model._brdf(point)[:, 0, 0]
    rays = rays_through(point, cones_of(point, Aperture(source=0.01, detector=0.01)))
    found = np.bincount(rays.parent, rays.weight * model._brdf(rays.geometry)[:, 0, 0])
    # Far from grazing (r / 4)^2 beside the slope's square is 1e-4; next to the zenith the
    # several bounces, read at each ray, bring the noise of small bins
    inner = np.abs(np.rad2deg(point.theta_s) - 25.0) < 20.0
    assert inner.sum() > 6
    assert_allclose(found[inner], expected[inner], rtol=3e-3)
    assert len(model._run.traces) == max(traced, 1)


def test_bins_are_read_between_their_centres_and_through_the_pole() -> None:
    n_theta, n_dphi = 90, 180
    theta = (np.arange(n_theta) + 0.5) * (0.5 * np.pi / n_theta)
    dphi = np.arange(n_dphi) * (2.0 * np.pi / n_dphi)

    def smooth(theta: np.ndarray, dphi: np.ndarray) -> np.ndarray:
        x, y = np.sin(theta) * np.cos(dphi), np.sin(theta) * np.sin(dphi)
        return np.stack([1.0 + x - 0.5 * y + x * y, np.cos(theta) + y**2], axis=-1)

    rng = np.random.default_rng(2)
    # The first three lie between the pole and the first bin's centre
    theta_s = np.concatenate([[0.0, 0.004, 0.009], rng.uniform(0.0, 1.5, 40)])
    azimuth = np.concatenate([[2.1, 0.7, 5.9], rng.uniform(-4.0, 7.0, 40)])
    table = smooth(theta[:, None], dphi[None, :])
    read = interpolate_bins(table, theta_s, azimuth)
    assert_allclose(read, smooth(theta_s, azimuth), atol=5e-4)
    # At a centre nothing is mixed in
    assert_allclose(interpolate_bins(table, theta[7:8], dphi[11:12])[0], table[7, 11])


@pytest.mark.parametrize(
    ("ranges", "error"),
    [(((1.15, 2.6), (0.0, 1.5)), 1e-3), (((0.5, 3.0), (3.5, 12.0)), 1e-3)],
    ids=["dielectric", "metal"],
)
def test_few_indices_tell_of_all_between(ranges, error) -> None:
    # Two reflections in planes turned against each other, up to 80 degrees of incidence
    def twice(index: complex) -> np.ndarray:
        matrices = []
        for beta in (0.3, 0.8, 1.1, 1.4):
            one = specular_mueller(np.cos(beta), index.real, index.imag)
            other = specular_mueller(np.cos(1.2 - 0.5 * beta), index.real, index.imag)
            c, s = np.cos(2.0 * beta), np.sin(2.0 * beta)
            turn = np.array([[1, 0, 0, 0], [0, c, s, 0], [0, -s, c, 0], [0, 0, 0, 1]])
            matrices.append(other @ turn @ one)
        return np.mean(matrices, axis=0)

    grid = IndexGrid(*ranges)
    table = np.tensordot(grid.coefficients, [twice(node) for node in grid.nodes], axes=1)
    rng = np.random.default_rng(1)
    for n, kappa in zip(
        rng.uniform(*grid.n, 30), rng.uniform(*grid.kappa, 30), strict=True
    ):
        exact = twice(complex(n, kappa))
        read = np.tensordot(grid.basis(n, kappa), table, axes=1)
        # Measured by the light of one bounce, of which that of two is a small part
        once = specular_mueller(np.cos(0.8), n, kappa)[0, 0]
        assert_allclose(read, exact, atol=error * once)


def test_another_index_is_what_a_simulation_of_it_gives(model: SimulatedModel) -> None:
    index = (1.8, 0.9)
    other = SimulatedModel(
        Scene(SURFACE, Material(*index)), n_rays=3000, realizations=32, seed=4, n_theta=30,
        index_range=((1.8, 1.8), (0.9, 0.9)),
    )  # fmt: skip
    direct = other.simulation([THETA_I])
    there = direct.brdf_total.isel(theta_i=0, theta_s=slice(2, 24), dphi=[0, 7, 18, 29])
    there = there.transpose("theta_s", "dphi", ...)
    moved = model.updated({"n": index[0], "kappa": index[1]})
    read = moved.brdf(
        THETA_I, there.theta_s.values[:, None], there.dphi.values[None, :]
    )  # fmt: skip
    # The same paths: what differs is the mean over a bin from the value at its centre
    m00 = there.values[..., 0, 0]
    assert_allclose(read, there.values, atol=0.02 * m00.max())
    lit = m00 > 0.1 * m00.max()
    assert np.abs(read[lit, 0, 0] / m00[lit] - 1.0).mean() < 0.01
    # and light of several bounces is part of it
    single = direct.brdf.sel(bounces="1").isel(theta_i=0, theta_s=slice(2, 24))
    assert (single.isel(dphi=18).values[..., 0, 0] < 0.98 * read[:, 2, 0, 0]).any()


def test_the_expression_is_the_number(model: SimulatedModel) -> None:
    import casadi

    theta_i, theta_s, dphi = plane(7.0)
    geometry = Geometry(theta_i, theta_s, dphi, 0.0 * dphi, np.full(dphi.size, np.nan))
    new = {"n": 1.7, "kappa": 0.2, "specular_gain": 0.6, "diffuse_albedo": 0.1}
    values = {k: casadi.DM(v).T for k, v in model.values(geometry).items()}
    values |= {k: casadi.DM(np.full(geometry.size, v)).T for k, v in new.items()}
    found = casadi.evalf(model.mueller(values, geometry, range(16))).full()
    expected = model.updated(new).brdf(theta_i, theta_s, dphi)
    assert_allclose(found.T.reshape(-1, 4, 4), expected, rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("solver", ["casadi", "nlopt"])
def test_a_fit_recovers_index_and_gains(model: SimulatedModel, solver: str) -> None:
    truth = {"n": 1.7, "kappa": 0.6, "specular_gain": 0.7, "diffuse_albedo": 0.15}
    result = fit(scan(model.updated(truth), 0.01), model, free=FREE, solver=solver)
    assert result.converged
    for name, true in truth.items():
        # The scan shares the simulation's paths: only its noise is between them
        noise = result.stderr_parts[name]["noise"]
        assert abs(result.values[name] - true) < 4.0 * noise, name
        assert result.stderr[name] > noise
    assert result.model.model.material.n == result.values["n"]


def test_the_simulations_error_is_that_of_the_parameters(model: SimulatedModel) -> None:
    truth = {"specular_gain": 0.7, "diffuse_albedo": 0.15}
    data = scan(model.updated(truth), 0.002)
    result = fit(data, model)
    groups = [fit(data, replica) for replica in model.replicas]
    for name in truth:
        found = [group.values[name] for group in groups]
        expected = np.std(found, ddof=1) / np.sqrt(len(found))
        # Each group alone is weighed a little differently from all together
        part = result.stderr_parts[name]["simulation"]
        assert part == pytest.approx(expected, rel=0.25), name
        noise = result.stderr_parts[name]["noise"]
        assert result.stderr[name] == pytest.approx(np.hypot(noise, part))


def test_the_simulations_error_joins_the_weights(model: SimulatedModel) -> None:
    data = scan(model.updated({"specular_gain": 0.5}), 0.02)
    result = fit(data, model, use=["M00"])
    fitted = result.model
    where = plane()
    sigma, error = data.M00_stderr.values, fitted.stderr(*where)[:, 0, 0]
    assert_allclose(result.readings.stderr.values, np.hypot(sigma, error), rtol=1e-3)
    assert (error > 0.1 * sigma).any()


def test_the_measured_slopes_error_reaches_the_gain(model: SimulatedModel) -> None:
    data = scan(model.updated({"specular_gain": 0.7, "diffuse_albedo": 0.2}), 0.01)
    stderr = 0.012
    held = fit(data, model, priors={"slope_rms": (0.3, stderr)})
    ends = [
        fit(data, model, fixed={"slope_rms": 0.3 + sign * stderr}).values["specular_gain"]
        for sign in (-1.0, 1.0)
    ]
    half = 0.5 * abs(ends[1] - ends[0])
    assert held.stderr_parts["specular_gain"]["slope_rms"] == pytest.approx(half, rel=0.1)
    assert held.stderr["specular_gain"] > half


def test_a_slope_far_from_the_traced_one_is_named(model: SimulatedModel) -> None:
    data = scan(model.updated({"slope_rms": 0.36}), 0.01)
    result = fit(data, model, free=("specular_gain", "diffuse_albedo", "slope_rms"))
    assert result.values["slope_rms"] == pytest.approx(0.36, rel=0.02)
    (text,) = (w for w in result.warnings if "traced" in w)
    assert text.startswith("the surface was traced with slope_rms 0.3, far from 0.36")
    assert not model.remarks


@pytest.mark.slow
def test_an_index_for_each_wavelength(model: SimulatedModel) -> None:
    table = Material.from_table(wavelength=[0.4, 0.8], n=[1.6, 1.4], kappa=[0.1, 0.3])
    coloured = SimulatedModel(
        Scene(SURFACE, table), n_rays=3000, realizations=32, seed=4, n_theta=30,
        index_range=((1.3, 1.7), (0.0, 0.5)),
    )  # fmt: skip
    where = (THETA_I, 0.6, np.pi)
    both = coloured.brdf(*where, np.array([0.4, 0.7]))
    for one, (n, kappa) in zip(both, ((1.6, 0.1), (1.45, 0.25)), strict=True):
        plain = model.updated({"n": n, "kappa": kappa}).brdf(*where)
        # The same paths; light of one bounce was counted at another index
        assert_allclose(one, plain, atol=0.02 * plain[0, 0])
    with pytest.raises(ValueError, match="must hold every wavelength"):
        coloured.brdf(*where)
    narrow = SimulatedModel(
        Scene(SURFACE, table), index_range=((1.45, 1.55), (0.15, 0.25))
    )  # fmt: skip
    with pytest.raises(
        ValueError, match=r"hold every n of the scan, 1\.45 \.\. 1\.55 does"
    ):
        narrow.brdf(*where, 0.4)


def test_merged_runs_are_their_mean_and_its_error() -> None:
    scene = Scene(SURFACE, Material(1.5))
    runs = [
        simulate(scene, 0.5, n_rays=400, realizations=8, seed=s, n_theta=6, n_dphi=4)
        for s in range(9)
    ]
    found = merged(runs)
    values = np.stack([run.brdf_total.values for run in runs])
    assert_allclose(found.brdf_total.values, values.mean(axis=0), atol=1e-15)
    spread = values.std(axis=0, ddof=1) / 3.0
    lit = spread > 0.0
    assert_allclose(found.brdf_total_stderr.values[lit], spread[lit])
    # Two routes to one error: within the runs, and between them
    inside = np.sqrt((np.stack([run.albedo_stderr for run in runs]) ** 2).mean(0) / 9)
    assert_allclose(found.albedo_stderr.values[0], inside[0], rtol=0.8)
    assert found.attrs["realizations"] == 72


def refuse(message: str, *, scene: Scene | None = None, **options: object) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        SimulatedModel(scene or Scene(SURFACE, Material(1.5)), **options)


def test_what_cannot_be_simulated_once_for_all_is_refused(model: SimulatedModel) -> None:
    based = Scene(SURFACE, Material(1.5, diffuse_albedo=0.3))
    refuse("got a diffuse base under the interface", scene=based)
    flat = Scene(HeightMap.flat(size=(10.0, 10.0)), Material(1.5))
    refuse("scene must have a rough surface", scene=flat)
    refuse("realizations must be at least 8 .* got 4", realizations=4)
    refuse("must hold the model's n 1.5", index_range=((1.6, 2.0), (0.0, 1.0)))
    refuse("must give both n and kappa room", index_range=((1.4, 1.6), (0.0, 0.0)))
    refuse("scene must be a Scene, got float", scene=1.5)
    with pytest.raises(ValueError, match=r"bounds of n must lie in \[1\.15, 2\.6\]"):
        fit(scan(model, 0.01), model, free=("n",), bounds={"n": (1.0, 2.0)})
    with pytest.raises(ValueError, match="must name parameters, got 'slope_rms_x'"):
        fit(scan(model, 0.01), model, free=("slope_rms_x",))


def test_a_measured_map_brings_its_own_slopes_and_azimuth() -> None:
    heights = GaussianSurface(
        shape=(64, 64), spacing=1.0, corr_length=(6.0, 12.0), slope_rms=0.25
    ).sample(3)
    model = SimulatedModel(
        Scene(heights, Material(1.5, 0.1)), n_rays=400, realizations=16,
        index_range=((1.5, 1.5), (0.1, 0.1)),
    )  # fmt: skip
    x, y = (float(np.sqrt(np.mean(slope**2))) for slope in heights.slopes())
    assert model.model.slope_rms == (x, y)
    here, there = (
        model.brdf(0.5, 0.4, np.pi, phi_i=phi)[0, 0] for phi in (0.0, 0.5 * np.pi)
    )
    assert not np.isclose(here, there, rtol=0.05)


def test_a_bin_without_rays_keeps_the_analytical_curve() -> None:
    surface = GaussianSurface(shape=(64, 64), spacing=1.0, corr_length=8.0, slope_rms=0.05)
    material = Material(1.5, 0.1)
    model = SimulatedModel(
        Scene(surface, material), n_rays=400, realizations=16,
        index_range=((1.5, 1.5), (0.1, 0.1)),
    )  # fmt: skip
    analytic = MicrofacetModel(material, slope_rms=0.05)
    # Ten standard deviations of the slope off the peak no ray ever went
    far = (0.2, 1.0, np.pi)
    assert_allclose(model.brdf(*far), analytic.brdf(*far), rtol=1e-12)


def test_the_command_fits_a_scene(model: SimulatedModel, tmp_path: Path) -> None:
    truth = {"specular_gain": 0.7, "diffuse_albedo": 0.15}
    Scene(SURFACE, Material(1.45, 0.3)).to_toml(tmp_path / "scene.toml")
    data = scan(model.updated(truth), 0.01).drop_vars(["M23", "M23_stderr"])
    write_goniometer(data, tmp_path / "scan.csv")
    arguments = ["fit", str(tmp_path / "scan.csv"), "--scene", str(tmp_path / "scene.toml")]
    few = ["--n-rays", "1000", "--realizations", "16", "-o", str(tmp_path / "out")]
    assert main([*arguments, *few]) == 0
    found = json.loads((tmp_path / "out" / "fit.json").read_text())
    for name, true in truth.items():
        value, stderr = (found["parameters"][name][key] for key in ("value", "stderr"))
        assert abs(value - true) < 4.0 * stderr
        assert found["stderr_parts"][name]["simulation"] > 0.0
    read = read_model(tmp_path / "out" / "model.toml")
    assert read.specular_gain == found["parameters"]["specular_gain"]["value"]


def test_the_command_wants_one_surface(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    analytic = MicrofacetModel(Material(1.5), slope_rms=0.3)
    brdf = analytic.brdf(*plane())[:, 0, 0]
    coords = dict(zip(("theta_i", "theta_s", "dphi"), plane(), strict=True))
    data = xr.Dataset(
        {"M00": ("geometry", brdf)}, {k: ("geometry", v) for k, v in coords.items()}
    )
    write_goniometer(data, tmp_path / "scan.csv")
    paint = ["--n", "1.5", "--slope-rms", "0.2"]
    waves = ["--n", "1.5", "--height-rms-um", "0.1", "--corr-length-um", "2"]
    for options, message in (
        (["--n", "1.5"], "--slope-rms must be given, got none"),
        (["--n", "1.5", "--scene", "none.toml"], "--n is not used beside --scene"),
        (["--shadowing", "smith", "--scene", "none.toml"], "--shadowing is not used"),
        ([*paint, "--seed", "3"], "--seed is not used without --scene"),
        ([*paint, "--reach", "3"], "--reach is not used without --height-rms-um"),
        (
            [*waves, "--shadowing", "smith"],
            "--shadowing is not used beside --height-rms-um",
        ),
        (
            ["--n", "1.5", "--slope-rms", "0.2", "--slope-distribution", "odd"],
            "--slope-distribution must be one of gaussian",
        ),
    ):
        assert main(["fit", str(tmp_path / "scan.csv"), *options]) == 2
        assert message in capsys.readouterr().err


@pytest.mark.slow
def test_only_the_simulation_is_unbiased_on_light_of_all_bounces() -> None:
    scans = [simulated_scan(seed, n_rays=8_000) for seed in range(8)]
    bias, ratio = {}, {}
    for title, tried in models(n_rays=4_000).items():
        results = [fit(one, tried, free=tuple(TRUTH)) for one in scans]
        bias[title] = {name: row[3] for name, row in pulls(results).items()}
        ratio[title] = np.mean([result.chi2 / result.dof for result in results])
    # Four parameters: a correct fit exceeds 4 standard errors of 8 scans once in 1000
    assert max(abs(value) for value in bias["Monte Carlo"].values()) < 4.0, bias
    assert bias["analytical"]["specular_gain"] > 15.0
    assert bias["analytical"]["n"] < -8.0
    # and only one of them fits within the errors; 8 scans of 440 readings know it to 2.4 %,
    # the noise of 320 realisations adds 3 % (of 160: 10 %)
    assert abs(ratio["Monte Carlo"] - 1.0) < 0.12
    assert ratio["analytical"] > 1.4

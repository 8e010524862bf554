"""Files for Mitsuba 3, read back by a parser of its own and compared with the source.

With Mitsuba itself in the environment the renderer's own plugin evaluates the file.
"""

# One line a bad case
# ruff: noqa: E501

import json
import struct

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose, assert_array_equal

from data_io import ConventionWarning, export_mitsuba, read_goniometer
from data_io.reflectance import pbsdf
from data_io.reflectance.half_vector import HalfVectorGrid, tabulate
from pbrdf import AccuracyWarning, Material, MicrofacetModel
from pbrdf.errors import DataFileError
from pbrdf.optics.exchange import convert_brdf

METAL = MicrofacetModel(Material(1.37, kappa=7.62), slope_rms=0.3, diffuse_albedo=0.2)


def parse(path):
    """Read a tensor file as its description says, sharing nothing with the writer."""
    content = path.read_bytes()
    assert content[:12] == b"tensor_file\0"
    assert content[12:14] == b"\x01\x00"
    count = int.from_bytes(content[14:18], "little")
    position, fields = 18, {}
    for _ in range(count):
        length = int.from_bytes(content[position : position + 2], "little")
        name = content[position + 2 : position + 2 + length].decode()
        position += 2 + length
        ndim, code, offset = struct.unpack_from("<HBQ", content, position)
        shape = struct.unpack_from(f"<{ndim}Q", content, position + 11)
        position += 11 + 8 * ndim
        assert offset % 8 == 0
        dtype = {3: "<u2", 10: "<f4"}[code]
        fields[name] = np.frombuffer(content, dtype, np.prod(shape), offset).reshape(shape)
    return fields


def directions(phi_d, theta_d, theta_h):
    """L and E by rotating the half vector's frame, from the definition of the angles."""
    n = np.array([0.0, 0.0, 1.0])
    h = np.array([np.sin(theta_h), 0.0, np.cos(theta_h)])
    b = np.cross(n, h) / np.linalg.norm(np.cross(n, h))
    t = np.cross(b, h)
    light = np.cos(theta_d) * h + np.sin(theta_d) * (np.cos(phi_d) * t + np.sin(phi_d) * b)
    viewer = 2 * (h @ light) * h - light
    return light, viewer


def angles(light, viewer):
    theta_i, theta_s = np.arccos(light[2]), np.arccos(viewer[2])
    dphi = np.arctan2(viewer[1], viewer[0]) - np.arctan2(light[1], light[0])
    return theta_i, theta_s, np.mod(dphi, 2 * np.pi)


def nodes_above_horizon(fields, count, seed=5):
    """Yield random nodes whose two directions lie above the horizon, off every axis."""
    rng = np.random.default_rng(seed)
    phi_d, theta_d, theta_h = (
        fields[name][0].astype(float) for name in ("phi_d", "theta_d", "theta_h")
    )
    found = 0
    while found < count:
        i, j, k = (rng.integers(1, axis.size - 1) for axis in (phi_d, theta_d, theta_h))
        light, viewer = directions(phi_d[i], theta_d[j], theta_h[k])
        if min(light[2], viewer[2]) > np.cos(np.radians(85)):
            found += 1
            yield (i, j, k), angles(light, viewer)


def test_model_file(tmp_path):
    path = tmp_path / "metal.pbsdf"
    export_mitsuba(METAL, path, shape=(25, 16, 18))
    fields = parse(path)
    assert {name: (f.dtype.str, f.shape) for name, f in fields.items()} == {
        "phi_d": ("<f4", (1, 25)),
        "theta_d": ("<f4", (1, 16)),
        "theta_h": ("<f4", (1, 18)),
        "wvls": ("<u2", (1,)),
        "M": ("<f4", (25, 16, 18, 1, 4, 4)),
    }
    assert_allclose(fields["phi_d"][0, [0, -1]], [-np.pi, np.pi], rtol=1e-6)
    assert_allclose(fields["theta_d"][0, [0, -1]], [0, np.pi / 2], rtol=1e-6)
    assert_allclose(fields["theta_h"][0, [0, -1]], [0, np.pi / 2], rtol=1e-6)
    assert_array_equal(fields["wvls"], [550])
    assert np.isfinite(fields["M"]).all()
    for node, geometry in nodes_above_horizon(fields, 60):
        expected, _ = convert_brdf(METAL.brdf(*geometry), *geometry, target="mitsuba")
        assert_allclose(fields["M"][(*node, 0)], expected, atol=2e-6 * expected[0, 0])


@pytest.mark.parametrize("slope", [0.01, 0.3])
def test_nodes_suit_the_lobe_and_the_file_says_how_well(tmp_path, slope):
    """Directions of light and viewer about the lobe, interpolated here, not by the writer."""
    from scipy.interpolate import interpn

    model = MicrofacetModel(Material(1.37, kappa=7.62), slope_rms=slope)
    stated = export_mitsuba(model, tmp_path / "metal.pbsdf")
    fields = parse(tmp_path / "metal.pbsdf")
    axes = [fields[name][0].astype(float) for name in ("phi_d", "theta_d", "theta_h")]
    rng = np.random.default_rng(7)
    points = rng.uniform([-3.1, 0.02, 0.0], [3.1, 1.3, min(1.2, 4 * slope)], (1500, 3))
    both = [(p, *directions(*p)) for p in points]
    both = [(p, a, b) for p, a, b in both if min(a[2], b[2]) > np.cos(np.radians(80))]
    expected = np.array([model.brdf(*angles(a, b))[0, 0] for _, a, b in both])
    table = fields["M"][..., 0, 0, 0].astype(float)
    found = interpn(axes, table, np.array([p for p, *_ in both]))
    bright = expected > 0.01 * expected.max()
    error = np.abs(found / expected - 1)[bright]
    assert bright.sum() > 100
    assert np.quantile(error, 0.95) < 0.01
    said = stated.error.isel(stokes_out=0, stokes_in=0).sel(quantile="p95")
    assert np.quantile(error, 0.95) < 2.5 * float(said.isel(brightness=slice(2)).max())
    beside = json.loads((tmp_path / "metal.pbsdf.json").read_text(encoding="utf-8"))
    here = beside["error"]["M00 1 to 10 % of its peak"]["M00"]["p95"]
    assert here == pytest.approx(float(said.sel(brightness="1 to 10 %")), abs=1e-6)


def test_the_stated_error_holds_for_all_pairs_of_directions(tmp_path):
    """A steep surface, bright near the horizon; directions by zenith and azimuth here."""
    from scipy.interpolate import interpn

    model = MicrofacetModel(Material(1.5, 0.3), slope_rms=1.0)
    stated = export_mitsuba(model, tmp_path / "steep.pbsdf")
    fields = parse(tmp_path / "steep.pbsdf")
    axes = [fields[name][0].astype(float) for name in ("phi_d", "theta_d", "theta_h")]
    rng = np.random.default_rng(3)
    points = rng.uniform([-3.14, 0.0, 0.0], [3.14, 1.57, 1.57], (4000, 3))
    zeniths = np.array([angles(*directions(*point)) for point in points])
    kept = np.max(zeniths[:, :2], axis=1) < np.radians(84.9)
    points, zeniths = points[kept], zeniths[kept]
    # Even over pairs of directions: 4 cos theta_d is the Jacobian of the half vector
    weight = np.sin(2 * points[:, 1]) * np.sin(points[:, 2])
    expected = model.brdf(*zeniths.T)[:, 0, 0]
    found = interpn(axes, fields["M"][..., 0, 0, 0].astype(float), points)
    error, part = np.abs(found / expected - 1), expected / stated.attrs["peak_M00"]
    order = np.flatnonzero(part > 0.01)[np.argsort(error[part > 0.01])]
    share = np.cumsum(weight[order])
    p95 = error[order][np.searchsorted(share, 0.95 * share[-1])]
    assert p95 < 0.01
    said = stated.error.isel(brightness=slice(2)).sel(quantile="p95")[:, 0, 0]
    assert 0.3 * float(said.min()) < p95 < 2.0 * float(said.max())
    grazing = stated.error.sel(brightness="beyond 85 degrees", quantile="p95")
    assert float(grazing[0, 0]) > 0.05


def test_a_table_too_coarse_states_its_error(tmp_path):
    fine = export_mitsuba(METAL, tmp_path / "fine.pbsdf")
    coarse = export_mitsuba(METAL, tmp_path / "coarse.pbsdf", shape=(25, 16, 18))
    ratio = coarse.error.sel(quantile="p95", brightness="1 to 10 %") / fine.error.sel(
        quantile="p95", brightness="1 to 10 %"
    )
    assert float(ratio[0, 0]) > 3


def test_a_metal_mirrors_in_the_frame_of_the_half_vector(tmp_path):
    """In the scattering plane's frame every facet's matrix is block diagonal, with M10 > 0."""
    bare = METAL.with_parameters(diffuse_albedo=0.0)
    path = tmp_path / "metal.pbsdf"
    export_mitsuba(bare, path, shape=(9, 10, 8))
    fields = parse(path)
    for node, _ in nodes_above_horizon(fields, 20):
        m = fields["M"][(*node, 0)] / fields["M"][(*node, 0, 0, 0)]
        assert_allclose(m[:2, 2:], 0, atol=1e-6)
        assert_allclose(m[2:, :2], 0, atol=1e-6)
        assert m[1, 0] > 0
        # Amplitudes of a metal: D = Im(r_s conj r_p) is negative below grazing
        beta = float(fields["theta_d"][0, node[1]])
        cosine, index = np.cos(beta), 1.37 + 7.62j
        transmitted = np.sqrt(1 - (np.sin(beta) / index) ** 2)
        r_s = (cosine - index * transmitted) / (cosine + index * transmitted)
        r_p = (index * cosine - transmitted) / (index * cosine + transmitted)
        mean = (abs(r_s) ** 2 + abs(r_p) ** 2) / 2
        assert_allclose(m[3, 2], (r_s * r_p.conjugate()).imag / mean, atol=2e-6)
        assert_allclose(m[2, 2], (r_s * r_p.conjugate()).real / mean, atol=2e-6)


def lopsided(theta_i, theta_s, dphi):
    """A matrix field without any symmetry, so that no swap or sign can hide."""
    rng = np.random.default_rng(8)
    a, b, c, d = rng.normal(size=(4, 4, 4))
    ti, ts, dp = (x[..., None, None] for x in np.broadcast_arrays(theta_i, theta_s, dphi))
    return a + b * np.sin(ti) + c * ts * np.cos(dp) + d * np.sin(ts) * np.sin(dp + 0.3)


def test_frames_and_angles_of_a_field_without_symmetry():
    grid = HalfVectorGrid(
        phi_d=np.linspace(-np.pi, np.pi, 14),
        theta_d=np.linspace(0, np.pi / 2, 9),
        theta_h=np.linspace(0, np.pi / 2, 11),
    )
    table = tabulate(lambda *geometry: lopsided(*geometry)[None], grid)[0]
    fields = {name: axis[None] for name, axis in grid._asdict().items()}
    for node, geometry in nodes_above_horizon(fields, 60):
        expected, _ = convert_brdf(
            lopsided(*map(np.asarray, geometry)), *geometry, target="mitsuba"
        )
        assert_allclose(table[node], expected, atol=1e-12)


def result(model, theta_i_deg=range(0, 81, 5), n_theta=45, n_dphi=90, waves=None):
    """A dataset as a simulation returns it, but holding the model at the bin centres."""
    theta_i = np.radians(theta_i_deg)
    theta_s = (np.arange(n_theta) + 0.5) * np.pi / 2 / n_theta
    dphi = np.arange(n_dphi) * 2 * np.pi / n_dphi
    geometry = np.meshgrid(theta_i, theta_s, dphi, indexing="ij")
    brdf = np.stack(
        [model.brdf(*geometry, wavelength=w) for w in (waves or [None])], axis=1
    )
    dims = ["theta_i", "wavelength", "theta_s", "dphi", "stokes_out", "stokes_in"]
    coords = {
        "theta_i": theta_i, "theta_s": theta_s, "dphi": dphi,
        "stokes_out": list("IQUV"), "stokes_in": list("IQUV"),
    }  # fmt: skip
    if waves is None:
        brdf, dims = brdf[:, 0], [d for d in dims if d != "wavelength"]
    else:
        coords["wavelength"] = waves
    share = xr.DataArray(
        [0.5, 0.25, 0.25], dims="bounces", coords={"bounces": ["1", "2", "3+"]}
    )
    return xr.Dataset({"brdf": share * xr.DataArray(brdf, dims=dims, coords=coords)})


def test_dataset_file_agrees_with_the_model_file_to_interpolation(tmp_path):
    rough = METAL.with_parameters(slope_rms=0.5)
    export_mitsuba(rough, tmp_path / "model.pbsdf", shape=(25, 16, 18))
    export_mitsuba(result(rough), tmp_path / "result.pbsdf", shape=(25, 16, 18))
    model, simulated = (parse(tmp_path / f"{name}.pbsdf") for name in ("model", "result"))
    assert_array_equal(model["theta_h"], simulated["theta_h"])
    errors = []
    for node, (theta_i, theta_s, _) in nodes_above_horizon(model, 300):
        if max(theta_i, theta_s) < np.radians(78):
            scale = model["M"][(*node, 0, 0, 0)]
            errors.append(
                np.abs(simulated["M"][(*node, 0)] - model["M"][(*node, 0)]).max() / scale
            )
    assert len(errors) > 150
    assert np.median(errors) < 0.003
    assert max(errors) < 0.03


def test_dataset_near_the_normal_keeps_its_polarisation(tmp_path):
    """Bins on both sides of the normal are neighbours, in a frame that does not turn."""
    rough = METAL.with_parameters(slope_rms=0.5)
    # The innermost bins are centred 5 degrees from the normal
    export_mitsuba(
        result(rough, n_theta=9, n_dphi=36), tmp_path / "r.pbsdf", shape=(37, 40, 40)
    )
    fields = parse(tmp_path / "r.pbsdf")
    errors = []
    for node, (theta_i, theta_s, dphi) in nodes_above_horizon(fields, 3000, seed=9):
        if theta_s < np.radians(4.5) and theta_i < np.radians(75):
            geometry = theta_i, theta_s, dphi
            expected, _ = convert_brdf(rough.brdf(*geometry), *geometry, target="mitsuba")
            errors.append(np.abs(fields["M"][(*node, 0)] - expected).max() / expected[0, 0])
    assert len(errors) > 20
    assert max(errors) < 0.005


def test_wavelengths_are_stored_in_nanometres(tmp_path):
    waves = [0.45, 0.55, 0.65]
    table = Material.from_table(wavelength=[0.4, 0.7], n=[1.3, 2.1], kappa=[0.0, 0.6])
    model = MicrofacetModel(table, slope_rms=0.4)
    export_mitsuba(model, tmp_path / "m.pbsdf", wavelength=waves, shape=(7, 6, 5))
    bins = result(model, range(0, 81, 10), n_theta=9, n_dphi=12, waves=waves)
    export_mitsuba(bins, tmp_path / "r.pbsdf", shape=(7, 6, 5))
    fields = parse(tmp_path / "m.pbsdf")
    assert_array_equal(fields["wvls"], [450, 550, 650])
    assert_array_equal(parse(tmp_path / "r.pbsdf")["wvls"], [450, 550, 650])
    for node, geometry in nodes_above_horizon(fields, 5):
        for k, w in enumerate(waves):
            expected = model.brdf(*geometry, wavelength=w)[0, 0]
            assert_allclose(fields["M"][(*node, k, 0, 0)], expected, rtol=1e-5)


@pytest.mark.parametrize(
    ("source", "options", "message"),
    [
        (METAL, {"wavelength": [0.4, 0.5]}, "wavelength must hold 1, 3, 4 or 5 values, got 2"),
        (METAL, {"wavelength": 550}, r"wavelength must lie in \[0.01, 65.5\] um, got 550"),
        (METAL, {"wavelength": [0.6, 0.5, 0.4]}, "wavelength must rise"),
        (METAL, {"shape": (1, 5, 5)}, "shape must be three numbers of nodes"),
        (result(METAL, n_theta=4, n_dphi=4).isel(theta_i=[3]), {}, "at least 2 incident zeniths"),
        (result(METAL, n_theta=4, n_dphi=4).isel(stokes_out=[0]), {}, 'got 1 x 4. Simulate with stokes="full"'),
        (result(METAL, n_theta=4, n_dphi=4).rename(brdf="f"), {}, "must hold the variable brdf"),
        (result(METAL, n_theta=4, n_dphi=4).expand_dims(phi_i=[0.0, 1.0]), {}, "must not depend on phi_i"),
    ],
)  # fmt: skip
def test_what_cannot_be_exported_is_refused_and_leaves_no_file(
    tmp_path, source, options, message
):
    with pytest.raises(ValueError, match=message):
        export_mitsuba(source, tmp_path / "x.pbsdf", **options)
    assert not list(tmp_path.iterdir())


def test_other_sources_and_wide_gaps(tmp_path):
    with pytest.raises(
        TypeError, match=r"source must be a Dataset or a MicrofacetModel, got list"
    ):
        export_mitsuba([1], tmp_path / "x.pbsdf")
    sparse = result(METAL, theta_i_deg=[10, 40, 60], n_theta=6, n_dphi=8)
    with pytest.warns(AccuracyWarning, match=r"from 10 to 60 deg with gaps up to 30 deg"):
        export_mitsuba(sparse, tmp_path / "x.pbsdf", shape=(5, 5, 5))


def test_mitsuba_itself_reads_the_file(tmp_path):
    """eval() returns M cos(theta_light) in the frames of mueller.stokes_basis."""
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_spectral_polarized")
    path = tmp_path / "metal.pbsdf"
    export_mitsuba(METAL, path)
    bsdf = mi.load_dict({"type": "measured_polarized", "filename": str(path)})
    rng = np.random.default_rng(2)
    errors = []
    for theta_i, theta_s, dphi in rng.uniform([0.1, 0.1, 0.0], [1.3, 1.3, 6.28], (60, 3)):
        light = np.array([np.sin(theta_i), 0.0, np.cos(theta_i)])
        viewer = np.array(
            [
                np.sin(theta_s) * np.cos(dphi),
                np.sin(theta_s) * np.sin(dphi),
                np.cos(theta_s),
            ]
        )
        si = mi.SurfaceInteraction3f()
        si.p, si.wi, si.sh_frame = [0, 0, 0], viewer, mi.Frame3f([0, 0, 1])
        si.wavelengths = [550] * 4
        value = np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(light)))[..., 0]
        x = np.cross(light, viewer)
        x /= np.linalg.norm(x)
        out, into = (
            np.array(
                mi.mueller.rotate_stokes_basis(
                    mi.Vector3f(k), mi.mueller.stokes_basis(mi.Vector3f(k)), mi.Vector3f(x)
                )
            )
            for k in (viewer, -light)
        )
        found = out @ value @ into.T / np.cos(theta_i)
        geometry = (theta_i, theta_s, dphi)
        expected, _ = convert_brdf(METAL.brdf(*geometry), *geometry, target="mitsuba")
        errors.append(np.abs(found - expected).max() / expected[0, 0])
    assert np.median(errors) < 2e-3
    assert max(errors) < 0.05


def test_a_file_is_read_back_as_the_scan_it_holds(tmp_path):
    """All elements at the file's own directions, in the project's frames again."""
    path = tmp_path / "metal.pbsdf"
    export_mitsuba(METAL, path, shape=(25, 12, 13), wavelength=[0.45, 0.55, 0.65])
    scan = read_goniometer(path)
    angles_ = [scan[name].values for name in ("theta_i", "theta_s", "dphi")]
    expected = METAL.brdf(*angles_)
    for i in range(4):
        for j in range(4):
            # Nodes and values have 24 bits
            assert_allclose(scan[f"M{i}{j}"], expected[:, i, j], rtol=1e-5, atol=1e-5)
    assert_allclose(np.unique(scan.wavelength), [0.45, 0.55, 0.65])
    keys = np.column_stack([*(np.round(a, 6) for a in angles_), scan.wavelength])
    assert len(np.unique(keys, axis=0)) == scan.sizes["geometry"] > 3000
    # Out of the plane, where frames differ, among them
    assert (np.abs(np.sin(angles_[2])) > 0.5).sum() > 500
    with pytest.raises(ValueError, match="fixes its conventions, got quantity relative"):
        read_goniometer(path, quantity="relative")


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda b: b[:-400], "truncated"),
        (lambda b: b[:30], "expected a table of fields, found it damaged"),
        (lambda b: b.replace(b"wvls", b"wxls"), "lacks wvls"),
        (lambda b: b[:12] + b"\x07" + b[13:], "expected version 1.0, got 7.0"),
    ],
)
def test_a_damaged_file_is_refused(tmp_path, edit, message):
    path = tmp_path / "metal.pbsdf"
    export_mitsuba(METAL, path, shape=(5, 4, 4))
    path.write_bytes(edit(path.read_bytes()))
    with pytest.raises(pbsdf.DataFileError, match=message):
        read_goniometer(path)


def test_a_large_table_is_thinned_with_a_word(tmp_path, monkeypatch):
    path = tmp_path / "metal.pbsdf"
    export_mitsuba(METAL, path, shape=(9, 8, 8))
    monkeypatch.setattr(pbsdf, "_ROWS", 200)
    with pytest.warns(UserWarning, match="every 2. node of each angle is read, of 576"):
        assert read_goniometer(path).sizes["geometry"] < 200


def test_nodes_without_numbers_are_left_out_with_a_word(tmp_path):
    path = tmp_path / "holed.pbsdf"
    export_mitsuba(METAL, path, shape=(7, 6, 5))
    whole = read_goniometer(path)
    fields, content = pbsdf.tensor_fields(path, path.read_bytes()), path.read_bytes()
    place = content.rindex(fields["M"].tobytes())
    table = fields["M"].copy()
    # One element of a node well above the horizon
    table[3, 1, 1, 0, 2, 1] = np.nan
    path.write_bytes(content[:place] + table.tobytes() + content[place + table.nbytes :])
    size = whole.sizes["geometry"]
    with pytest.warns(ConventionWarning, match=f"1 of {size} rows are left out, .* nan"):
        holed = read_goniometer(path)
    assert holed.sizes["geometry"] == size - 1
    rows = [
        set(zip(one.theta_i.values, one.theta_s.values, one.dphi.values, strict=True))
        for one in (holed, whole)
    ]
    assert rows[0] < rows[1]
    table[:] = np.inf
    path.write_bytes(content[:place] + table.tobytes() + content[place + table.nbytes :])
    with pytest.raises(DataFileError, match=f"got none at any of {size} nodes"):
        read_goniometer(path)

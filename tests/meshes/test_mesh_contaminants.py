"""Drops and spheres on meshes: as on the height map of the same facets, and refusals."""

import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose

from pbrdf import (
    Drops,
    Film,
    GaussianSurface,
    HeightMap,
    Material,
    MeshSurface,
    Scene,
    Spheres,
    load_scene,
    simulate,
)
from pbrdf.contaminants.bodies import place
from pbrdf.contaminants.ground import Ground
from pbrdf.contaminants.mesh_ground import MeshGround
from tests.contaminants.scenes import assert_closed, clean_counters
from tests.meshes.shapes import joined, pair, plate

pytestmark = pytest.mark.filterwarnings("ignore::pbrdf.errors.AccuracyWarning")
PERIOD = (10.0, 8.0)
WATER, GLASS = Material(1.333), Material(1.5, 0.05)
SEED = np.random.SeedSequence(1)
ROUGH = GaussianSurface(
    shape=(24, 20), spacing=0.5, corr_length=2.4, slope_rms=0.25
).sample(4)


def agree(one, other, limit=5.0):
    """All 16 elements, and the albedo by bounces, within combined standard errors."""
    combined = np.hypot(one.brdf_total_stderr, other.brdf_total_stderr)
    assert (np.abs(one.brdf_total - other.brdf_total) <= limit * combined + 1e-12).all()
    spread = np.hypot(one.albedo_stderr, other.albedo_stderr)
    assert (np.abs(one.albedo - other.albedo) <= limit * spread + 1e-12).all()


def on_both(map_surface, mesh, base, contaminants, **options):
    """Runs over a map and a mesh, with rays of their own."""
    given = {"n_rays": 32_000, "phi_i": 0.4, "n_theta": 9, "n_dphi": 12} | options
    return (
        simulate(Scene(map_surface, base, contaminants), 0.6, **given),
        simulate(Scene(mesh, base, contaminants), 0.6, seed=7, **given),
    )


@pytest.mark.parametrize("material", [WATER, Material(1.4, 0.02)])
def test_drops_and_spheres_on_a_flat_mesh_as_on_a_flat_map(material):
    lying = [
        Drops.at(
            [[2.0, 3.1], [9.6, 6.9]],
            volume=[9.0, 4.0],
            contact_angle=1.1,
            material=material,
        ),
        Spheres.at([[6.0, 2.0], [5.0, 7.5]], radius=[1.2, 0.8], material=GLASS),
    ]
    walked, meshed = on_both(
        HeightMap.flat(size=PERIOD), MeshSurface(plate(), PERIOD), Material(1.7, 0.4),
        lying,
        wavelength=2.0,
    )  # fmt: skip
    agree(walked, meshed)
    clean_counters(meshed)
    # Weak beams go on by chance
    assert assert_closed(meshed) < 3e-6
    placed = [
        place(lying, one, SEED) for one in (HeightMap.flat(size=PERIOD), mesh_plate())
    ]
    assert_allclose(placed[1].bodies.z, placed[0].bodies.z, atol=1e-12)
    for one, other in zip(placed[0].reports, placed[1].reports, strict=True):
        assert one.keys() == other.keys()
        assert other["volume_placed"] == pytest.approx(one["volume_placed"], rel=1e-12)
    # The contaminants matter
    bare = simulate(
        Scene(HeightMap.flat(size=PERIOD), Material(1.7, 0.4)),
        0.6,
        n_rays=640,
        wavelength=2.0,
    )
    assert abs(bare.albedo.sum() - meshed.albedo.sum()) > 0.01


def mesh_plate():
    return MeshSurface(plate(), PERIOD)


def test_bodies_on_a_rough_mesh_as_on_the_map_of_its_facets():
    mesh = MeshSurface.of_map(ROUGH)
    lying = [
        Spheres.at([[3.0, 4.0], [9.3, 9.6]], radius=[1.3, 0.7], material=WATER, sink=0.1),
        Drops.at([[7.0, 5.0]], volume=6.0, contact_angle=1.7, material=WATER),
    ]
    walked, meshed = on_both(ROUGH, mesh, Material(1.6, 0.3), lying)
    agree(walked, meshed)
    clean_counters(meshed)
    one, other = (place(lying, surface, SEED) for surface in (ROUGH, mesh))
    # Spheres touch the same facets; a drop is laid by samples of the surface
    assert_allclose(other.bodies.z[:2], one.bodies.z[:2], atol=1e-12)
    kept = other.bodies.shape(2)
    above = Ground(ROUGH).volume_above(kept, 7.0, 5.0, other.bodies.z[2], 2048).volume
    assert above == pytest.approx(6.0, rel=3e-4)
    assert other.bodies.z[2] == pytest.approx(one.bodies.z[2], abs=2e-4)
    for a, b in zip(one.reports, other.reports, strict=True):
        assert b["volume_placed"] == pytest.approx(a["volume_placed"], rel=3e-3)
        assert b["coverage_wetted"] == pytest.approx(a["coverage_wetted"], abs=2e-3)


def test_spheres_come_to_rest_where_they_do_on_the_map():
    mesh = MeshSurface.of_map(ROUGH)
    rng = np.random.default_rng(2)
    for x, y in rng.random((40, 2)) * ROUGH.size:
        radius = rng.uniform(0.05, 2.5)
        expected = Ground(ROUGH).rest(x, y, radius)
        assert MeshGround(mesh).rest(x, y, radius) == pytest.approx(expected, abs=1e-12)


@pytest.mark.filterwarnings("ignore:.*sideways")
def test_a_sphere_on_a_finite_sheet_wherever_its_corner_is():
    side, radius = 1.0, 0.2
    flat = HeightMap(np.zeros((17, 17)), side / 16)
    points, faces = pair(MeshSurface.of_map(flat).to_trimesh(), (-7.3, 4.1, 0.0))
    sheet = MeshSurface((points, faces))
    assert sheet.kind == "sheet"
    options = {"n_rays": 32_000, "n_theta": 9, "n_dphi": 12}
    found = [
        simulate(
            Scene(surface, Material(1.5), Spheres.at([at], radius=radius, material=WATER)),
            0.4, **options,
        )
        for surface, at in ((flat, [0.45, 0.5]), (sheet, [-6.85, 4.6]))
    ]  # fmt: skip
    agree(*found)
    with pytest.raises(ValueError, match="inside the finite mesh"):
        place([Spheres.at([[-7.2, 4.6]], radius=radius, material=WATER)], sheet, SEED)


def mushroom():
    """A plate with a ball on a stem."""
    ball = trimesh.creation.icosphere(subdivisions=3, radius=1.5)
    stem = trimesh.creation.cylinder(radius=0.4, height=3.0, sections=9)
    parts = plate(), pair(ball, (5.0, 4.0, 3.5)), pair(stem, (5.0, 4.0, 1.0))
    labels = np.concatenate([np.full(len(f), k) for k, (_, f) in enumerate(parts)])
    return joined(*parts), PERIOD, labels


def test_a_drop_on_a_ball_has_its_volume_above_it():
    ground = MeshGround(MeshSurface(*mushroom()))
    drop = Drops.at([[5.0, 4.0]], volume=0.4, contact_angle=1.2, material=WATER)
    placed = place([drop], ground.surface, SEED)
    assert placed.reports[0]["volume_placed"] == pytest.approx(0.4, rel=1e-6)
    # Two spheres that cut each other: the cap of the drop's less the lens of the ball's
    z, shape = placed.bodies.z[0], placed.bodies.shape(0)
    radius = np.sqrt(
        (shape.slabs[0, 2:] * [1.0, 0.0, 0.0]).sum() + (shape.slabs[0, 3] / 2) ** 2
    )
    centre = z + shape.slabs[0, 3] / 2
    apart = centre - 3.5
    lens = (
        np.pi * (1.5 + radius - apart) ** 2 / (12 * apart)
        * (apart**2 + 2 * apart * (1.5 + radius) - 3 * (1.5 - radius) ** 2)
    )  # fmt: skip
    # The facets of the ball lie within it
    assert 4 / 3 * np.pi * radius**3 - lens == pytest.approx(0.4, rel=0.03)
    scene = Scene(ground.surface, [Material.mirror()] * 3, drop)
    result = simulate(scene, 0.5, n_rays=16_000, n_theta=9, n_dphi=12)
    clean_counters(result)
    sent = result.albedo.sum() + result.truncated
    assert sent.item() == pytest.approx(1.0, abs=1e-9)


def test_water_on_clear_solids_ends_at_their_surface():
    """A drop of the glass that it lies on is a lens of one piece with it."""
    mesh = MeshSurface(*mushroom(), transparent=[1])
    base = [Material.mirror(), Material(1.5), Material(1.2, 0.4)]
    for material in (Material(1.5), WATER):
        drop = Drops.at([[5.0, 4.0]], volume=0.4, contact_angle=1.2, material=material)
        result = simulate(Scene(mesh, base, drop), 0.5, n_rays=16_000, n_theta=9, n_dphi=12)
        assert result.attrs["medium_mismatches"] <= 1
        sent = result.albedo.sum() + result.truncated + result.absorbed + result.leaked
        assert sent.item() == pytest.approx(1.0, abs=3e-6)
        assert result.leaked.item() < 1e-5


def test_random_spheres_on_a_closed_ground():
    options = {"n_rays": 1000, "realizations": 16, "phi_i": 0.3, "n_theta": 9, "n_dphi": 12}
    dust = Spheres(radius=0.7, coverage=0.1, material=GLASS)
    walked, meshed = (
        simulate(Scene(one, Material.black(), dust), 0.4, wavelength=0.5, **options)
        for one in (HeightMap.flat(size=PERIOD), mesh_plate())
    )
    agree(walked, meshed)
    assert meshed.albedo.sum().item() > 1e-3


def test_scene_files_and_solids_of_a_mesh_with_drops(tmp_path):
    from pbrdf.scene.solids import scene_solids

    drop = Drops.at([[2.0, 3.0]], volume=9.0, contact_angle=1.1, material=WATER)
    scene = Scene(mesh_plate(), Material(1.5), drop)
    scene.to_toml(tmp_path / "scene.toml")
    back = load_scene(tmp_path / "scene.toml")
    assert_allclose(back.contaminants[0].positions, drop.positions)
    solids = scene_solids(back)
    assert {"surface", "body 0"} <= solids.keys()
    assert solids["body 0"].is_watertight


def thin():
    """A thin plate in the air, periodic."""
    points, faces = plate()
    lower = points - np.array([0.0, 0.0, 0.05])
    return MeshSurface(joined((points, faces), (lower, faces[:, ::-1])), PERIOD)


AT = {"contact_angle": 1.9, "volume": 5.0, "material": WATER}


@pytest.mark.parametrize(
    ("surface", "lying", "message"),
    [
        (mesh_plate, Film(thickness=3.0), "must not hold films"),
        (
            mesh_plate,
            Drops(contact_angle=1.0, volume_per_area=0.1, number_density=0.05),
            r"drops at random places, got Drops\. .*Drops\.at",
        ),
        (
            mesh_plate,
            Drops.at([[1.0, 1.0]], roughness="wenzel", **AT),
            "wenzel",
        ),
        (thin, Spheres(radius=1.0, coverage=0.1, material=WATER), "no closed ground"),
        (
            lambda: MeshSurface(trimesh.creation.icosphere(subdivisions=1)),
            Spheres.at([[0.0, 0.0]], radius=0.1, material=WATER),
            "bodies that stand alone",
        ),
    ],
)
def test_what_a_mesh_does_not_take_is_refused(surface, lying, message):
    with pytest.raises(ValueError, match=message):
        Scene(surface(), Material(1.5), lying)


@pytest.mark.parametrize(
    ("surface", "lying", "message"),
    [
        (thin, Drops.at([[5.0, 4.0]], **AT), None),
        (
            lambda: MeshSurface(*mushroom()),
            Drops.at([[7.9, 4.0]], volume=64.5, contact_angle=2.6, material=WATER),
            "end in the solid",
        ),
        (
            lambda: MeshSurface(*mushroom()),
            Drops.at([[6.2, 4.0]], volume=0.1, contact_angle=1.0, material=WATER),
            "gently curved",
        ),
    ],
)
def test_drops_where_no_drop_can_lie_are_refused(surface, lying, message):
    mesh = surface()
    if message is None:
        # A thin plate is flat; the drop ends in it
        assert place([lying], mesh, SEED).bodies.z[0] == pytest.approx(0.0, abs=1e-12)
        return
    with pytest.raises(ValueError, match=message):
        place([lying], mesh, SEED)

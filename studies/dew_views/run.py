"""Figure 9 of the paper: the same water on one rough surface at three contact angles."""

import argparse
from pathlib import Path

import numpy as np

from pbrdf import Drops, GaussianSurface, HeightMap, Material
from pbrdf.contaminants import Bodies, place

HERE = Path(__file__).parent
CONTACT = (179.0, 90.0, 15.0)
SURFACE = GaussianSurface(shape=(256, 256), spacing=1.0, corr_length=15.0, slope_rms=0.05)
VOLUME, NUMBER_DENSITY = 1.0, 120e-6  # um, 1/um²
# The camera looks down from 40 degrees above the horizon; the lamp stands to the left
VIEW = np.array([0.0, -np.cos(np.deg2rad(40.0)), np.sin(np.deg2rad(40.0))])
LAMP = np.array([-0.65, -0.25, 0.7]) / np.linalg.norm([-0.65, -0.25, 0.7])
PIXELS = 620
WATER = np.array([0.25, 0.52, 0.80])
PAINT = np.array([0.78, 0.68, 0.55])
# Slopes of 0.05 would hardly be seen: shading takes them five times as steep
EXAGGERATION = 5.0


def camera(surface: HeightMap) -> tuple[np.ndarray, np.ndarray]:
    """Places in the image plane (rows, columns, 3) and direction of the light rays."""
    length_x, length_y = surface.size
    up = np.cross(VIEW, [1.0, 0.0, 0.0])
    up = up if up[2] > 0 else -up
    width, height = 0.53 * length_x, 0.53 * length_y * VIEW[2] + 10.0
    across = np.linspace(-width, width, PIXELS)
    along = np.linspace(height + 12.0, -height, int(PIXELS * height / width))
    middle = np.array([0.5 * length_x, 0.5 * length_y, 0.0])
    places = (
        middle
        + across[None, :, None] * np.array([1.0, 0.0, 0.0])
        + along[:, None, None] * up
        + 500.0 * VIEW
    )
    return places, -VIEW


def height_and_slope(surface: HeightMap, x, y):
    """Heights between the nodes, bilinear, and slopes there."""
    nx, ny = surface.shape
    u, v = x % nx, y % ny
    i, j = np.minimum(u.astype(int), nx - 1), np.minimum(v.astype(int), ny - 1)
    u, v = u - i, v - j
    i1, j1 = (i + 1) % nx, (j + 1) % ny
    z = surface.heights
    low, high = z[i, j] * (1 - u) + z[i1, j] * u, z[i, j1] * (1 - u) + z[i1, j1] * u
    along_x = (z[i1, j] - z[i, j]) * (1 - v) + (z[i1, j1] - z[i, j1]) * v
    return low * (1 - v) + high * v, along_x, high - low


def hit_ground(surface: HeightMap, start, ray):
    """Where rays meet the surface: the fixed point of z = h(x, y), slopes being small."""
    t = -start[..., 2] / ray[2]
    for _ in range(12):
        place = start + t[..., None] * ray
        height, _, _ = height_and_slope(surface, place[..., 0], place[..., 1])
        t = (height - start[..., 2]) / ray[2]
    return t


def hit_drops(bodies: Bodies, start, ray, t_ground):
    """Nearest drop, above the surface, that rays meet: distance and normal."""
    nearest = np.full(t_ground.shape, np.inf)
    normals = np.zeros(start.shape)
    radius = 0.5 * (bodies.slabs[:, 1] - bodies.slabs[:, 0])
    centre_z = bodies.z + 0.5 * (bodies.slabs[:, 1] + bodies.slabs[:, 0])
    for k in range(len(bodies)):
        centre = np.array([bodies.x[k], bodies.y[k], centre_z[k]])
        off = start - centre
        half = off @ ray
        square = half**2 - np.sum(off**2, axis=-1) + radius[k] ** 2
        t = -half - np.sqrt(np.maximum(square, 0.0))
        seen = (square > 0) & (t < nearest) & (t < t_ground)
        nearest = np.where(seen, t, nearest)
        here = (off + t[..., None] * ray) / radius[k]
        normals = np.where(seen[..., None], here, normals)
    return nearest, normals


def picture(surface: HeightMap, bodies: Bodies) -> np.ndarray:
    """Shaded view (rows, columns, 3): a drawing of the geometry, not a simulation."""
    start, ray = camera(surface)
    t_ground = hit_ground(surface, start, ray)
    place = start + t_ground[..., None] * ray
    inside = np.all((place[..., :2] >= 0) & (place[..., :2] <= surface.size), axis=-1)
    _, along_x, along_y = height_and_slope(surface, place[..., 0], place[..., 1])
    normal = np.stack(
        [-EXAGGERATION * along_x, -EXAGGERATION * along_y, np.ones_like(along_x)], axis=-1
    )
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    light = np.maximum(normal @ LAMP, 0.0)
    # The shadow of a drop on the ground
    far = np.full_like(t_ground, 1e9)
    t_shade, _ = hit_drops(bodies, place + 1e-3 * LAMP, LAMP, far)
    light = np.where(np.isfinite(t_shade) & (t_shade > 0), 0.72 * light, light)
    image = PAINT * (0.25 + 0.85 * light)[..., None]
    image = np.where(inside[..., None], image, 1.0)

    t_drop, normal = hit_drops(bodies, start, ray, t_ground)
    wet = np.isfinite(t_drop)
    facing = np.clip(normal @ VIEW, 0.0, 1.0)
    # More reflects towards the rim of a drop, and the lamp in one spot
    rim = 0.35 + 0.55 * (1 - facing) ** 2
    half = (LAMP + VIEW) / np.linalg.norm(LAMP + VIEW)
    spot = np.clip(normal @ half, 0.0, 1.0) ** 400
    shade = WATER * (0.45 + 0.6 * np.clip(normal @ LAMP, 0.0, 1.0))[..., None]
    drop = image * (1 - rim)[..., None] + shade * rim[..., None] + spot[..., None]
    return np.clip(np.where(wet[..., None], drop, image), 0.0, 1.0)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=4)
    seed = np.random.SeedSequence(parser.parse_args().seed)
    from matplotlib.figure import Figure

    surface = SURFACE.sample(seed)
    sheet = Figure(figsize=(15, 3.9), layout="constrained")
    axes = sheet.subplots(1, len(CONTACT))
    for axis, degrees in zip(axes, CONTACT, strict=True):
        # Gravity does not show in drops this small; without it all are spheres
        water = Drops(
            contact_angle=np.deg2rad(degrees), volume_per_area=VOLUME, gravity=False,
            number_density=NUMBER_DENSITY, material=Material(1.333), seed=2,
        )  # fmt: skip
        placement = place([water], surface, seed)
        report = placement.reports[0]
        axis.imshow(picture(surface, placement.bodies))
        axis.set_axis_off()
        axis.set_title(
            f"{degrees:g} deg: {report['number']} drops, "
            f"{100 * report['coverage_projected']:.1f} % covered"
        )
        print(
            f"{degrees:g} deg: volume asked {report['volume']:.10g} um³, above ground "
            f"{report['volume_placed']:.10g}; {100 * report['coverage_wetted']:.3g} % wet, "
            f"{100 * report['coverage_projected']:.3g} % covered"
        )
        for note in placement.notes:
            print("  ", note)
    sheet.savefig(HERE / "figure9.png", dpi=100)


if __name__ == "__main__":
    main()

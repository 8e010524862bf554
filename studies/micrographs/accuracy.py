"""Print how well edges are read from synthetic micrographs; see README.md."""

import argparse
import itertools
import tempfile
import warnings
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline
from skimage.io import imsave

from data_io import Profile
from data_io.micrograph.read import read_profile_image
from examples.micrograph import Camera, Edge, gaussian_edge, photograph
from fitting import surface_statistics

SLOPE_RMS = 0.252


def slope_rms(x: np.ndarray, z: np.ndarray) -> float:
    """Slope rms of the cubic spline: differences lose 1 % at 10 pixels a length. [1]"""
    return float(np.std(CubicSpline(x, z)(x, 1)))


def one_picture(
    folder: Path, seed: int, corr_pixels: float, camera: Camera, n_corr: float
) -> dict[str, float]:
    """Photograph one edge, read it, and compare with that edge itself."""
    rng = np.random.default_rng(seed)
    corr_length = corr_pixels * camera.um_per_pixel
    edge = gaussian_edge(
        rng,
        n_corr * corr_length,
        camera.um_per_pixel / 8,
        height_rms=SLOPE_RMS * corr_length / np.sqrt(2),
        corr_length=corr_length,
    )
    path = folder / "edge.png"
    imsave(path, photograph(edge, camera, rng), check_contrast=False)
    truth = in_view(edge, camera)
    raw = read_profile_image(path, camera.um_per_pixel, restoring=False)
    read = read_profile_image(path, camera.um_per_pixel)
    error = read.z - aligned(truth, read.x)
    statistics = surface_statistics(read)
    exact = surface_statistics(Profile(truth.x[::8], truth.z[::8]))
    return {
        "raw slope": slope_rms(raw.x, raw.z) / slope_rms(truth.x, truth.z),
        "slope": slope_rms(read.x, read.z) / slope_rms(truth.x, truth.z),
        "height": read.z.std() / truth.z.std(),
        "fitted slope": statistics.slope_rms.value / slope_rms(truth.x, truth.z),
        "ensemble slope": statistics.slope_rms.value / edge.slope_rms,
        "ensemble height": statistics.height_rms.value / edge.height_rms,
        "exact slope": exact.slope_rms.value / edge.slope_rms,
        "exact height": exact.height_rms.value / edge.height_rms,
        "error": float(error.std()) / camera.um_per_pixel,
        "blur": read.blur / camera.um_per_pixel / np.hypot(camera.blur, np.sqrt(1 / 12)),
        "tilt": float(np.rad2deg(read.tilt - camera.tilt)),
    }


def in_view(edge: Edge, camera: Camera) -> Edge:
    """Return the part of the edge that is in the picture, its mean line removed."""
    turned = edge.x * np.cos(camera.tilt) - edge.z * np.sin(camera.tilt)
    pixel = camera.um_per_pixel
    low = np.ceil(turned.min() / pixel + 1) * pixel
    high = np.floor(turned.max() / pixel - 1) * pixel
    inside = (turned >= low) & (turned <= high)
    x, z = edge.x[inside], edge.z[inside]
    z = z - np.polyval(np.polyfit(x, z, 1), x)
    return Edge(x=x - x[0], z=z, height_rms=edge.height_rms, corr_length=edge.corr_length)


def aligned(truth: Edge, x: np.ndarray) -> np.ndarray:
    """Return the true heights at the read positions, which start half a pixel in."""
    return np.interp(x + truth.x[-1] / 2 - x[-1] / 2, truth.x, truth.z)


# Of the ensemble: root mean square over the pictures, and of fits to the exact edges
HEAD = """
corr blur grain light tilt |  raw   | read slope  | fitted slope | read height | edge | blur
 px   px    %     %   deg  | slope  | ratio  sd % | ratio  sd %  | ratio  sd % |  px  |
     | fitted slope and height over the ensemble's (of the exact edges)"""


def main() -> None:
    """Print a table of conditions; every ratio is read over true."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pictures", type=int, default=5, help="pictures a condition")
    parser.add_argument("--lengths", type=float, default=50, help="in corr_length")
    parser.add_argument(
        "--corr", type=float, nargs="+", default=(10, 30, 100), help="pixels"
    )
    parser.add_argument("--first-seed", type=int, default=0)
    arguments = parser.parse_args()
    print(HEAD)
    kinds = [
        (0.5, 0.02, 0.1, 0.0),
        (0.5, 0.10, 0.4, 5.0),
        (1.5, 0.05, 0.3, 2.0),
        (3.0, 0.02, 0.1, 0.0),
        (3.0, 0.05, 0.3, 2.0),
        (3.0, 0.10, 0.4, 5.0),
    ]
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for corr, (blur, grain, light, tilt) in itertools.product(arguments.corr, kinds):
            camera = Camera(
                blur=blur, grain=grain, uneven_light=light, tilt=np.deg2rad(tilt)
            )
            rows = [
                one_picture(Path(folder), seed, corr, camera, arguments.lengths)
                for seed in range(
                    arguments.first_seed, arguments.first_seed + arguments.pictures
                )
            ]
            mean = {key: np.mean([row[key] for row in rows]) for key in rows[0]}
            sd = {key: 100 * np.std([row[key] for row in rows]) for key in rows[0]}
            rms = {
                key: np.sqrt(np.mean(np.square([row[key] for row in rows])))
                for key in rows[0]
            }
            print(
                f"{corr:4.0f} {blur:4.1f} {100 * grain:5.0f} {100 * light:5.0f} "
                f"{tilt:5.1f}  | {mean['raw slope']:6.3f} | "
                f"{mean['slope']:.3f} {sd['slope']:5.1f} | "
                f"{mean['fitted slope']:.3f} {sd['fitted slope']:5.1f}  | "
                f"{mean['height']:.3f} {sd['height']:5.1f} | {mean['error']:.2f} | "
                f"{mean['blur']:.3f}\n     | "
                f"{rms['ensemble slope']:.3f}, {rms['ensemble height']:.3f} "
                f"({rms['exact slope']:.3f}, {rms['exact height']:.3f})",
                flush=True,
            )


if __name__ == "__main__":
    main()

"""Print what kinds of pictures do to the slope of one and the same edge; see README.md."""

import argparse
import tempfile
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
from accuracy import in_view, slope_rms
from scipy import ndimage
from skimage.io import imsave

from data_io import Profile, read_profile_image
from examples.micrograph import Camera, gaussian_edge, photograph
from fitting import surface_statistics

CAMERA = Camera(blur=1.5, grain=0.05, uneven_light=0.3, tilt=np.deg2rad(2))


def pictures(rng: np.random.Generator) -> tuple[object, dict[str, np.ndarray]]:
    """Return the true edge in view and pictures of it."""
    edge = gaussian_edge(rng, 60 * 14.5, 0.5 / 8, height_rms=2.6, corr_length=14.5)
    plain = photograph(edge, CAMERA, rng)
    ideal = replace(CAMERA, blur=0.01, grain=0.0, uneven_light=0.0, dust=0.0)
    sharp = photograph(edge, ideal, rng).astype(float)
    blurred = ndimage.gaussian_filter(sharp, 1.5)
    y, x = np.mgrid[-3:4, -3:4]
    disc = (x**2 + y**2 <= 9).astype(float)
    defocused = ndimage.convolve(sharp, disc / disc.sum(), mode="nearest")
    rim = 60 * np.exp(-(((blurred - 110) / 30) ** 2))
    texture = ndimage.gaussian_filter(rng.normal(0, 1, plain.shape), 6)
    texture *= 25 / texture.std() * (sharp < 110)

    def camera(**changes: float) -> np.ndarray:
        return photograph(edge, replace(CAMERA, **changes), rng)

    kinds = {
        "plain": plain,
        "dark field": 255 - plain,
        "light falls by 80 %": camera(uneven_light=0.8),
        "grain 20 %": camera(grain=0.2),
        "grain of 1 px, 8 %": camera(grain=0.08, grain_size=1.0),
        "150 specks / Mpx": camera(dust=150.0),
        "disc blur": defocused + rng.normal(0, 6, plain.shape),
        "gamma 1 / 2.2": 255
        * (blurred / 255 + rng.normal(0, 0.01, plain.shape)).clip(0) ** 0.45,
        "bright rim": 255 - blurred + rim + rng.normal(0, 10, plain.shape),
        "clipped levels": (plain.astype(float) - 60) * 2.2,
        "texture, rms 16 %": plain + texture,
    }
    return in_view(edge, CAMERA), {
        name: np.clip(image, 0, 255).astype(np.uint8) for name, image in kinds.items()
    }


def main() -> None:
    """Print slope and height, read over true; slope fitted over that of the exact edge."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--edges", type=int, default=4)
    parser.add_argument("--first-seed", type=int, default=0)
    arguments = parser.parse_args()
    ratios: dict[str, list[tuple[float, float, float]]] = {}
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        path = Path(folder) / "edge.png"
        for seed in range(arguments.first_seed, arguments.first_seed + arguments.edges):
            truth, kinds = pictures(np.random.default_rng(seed))
            exact = surface_statistics(Profile(truth.x[::8], truth.z[::8])).slope_rms.value
            for name, image in kinds.items():
                imsave(path, image, check_contrast=False)
                read = read_profile_image(path, 0.5)
                slope = slope_rms(read.x, read.z) / slope_rms(truth.x, truth.z)
                fitted = surface_statistics(read).slope_rms.value / exact
                height = read.z.std() / truth.z.std()
                ratios.setdefault(name, []).append((slope, height, fitted))
    for name, values in ratios.items():
        parts = zip(
            ("read slope", "height", "fitted slope"),
            np.mean(values, 0),
            np.std(values, 0),
            strict=True,
        )
        print(f"{name:20s}", "  ".join(f"{n} {v:.3f} ± {sd:.3f}" for n, v, sd in parts))


if __name__ == "__main__":
    main()

"""Draw the silhouette of a sessile drop of known contact angle.

Run it:  python examples/drop_picture.py drop.png --angle 75 --bond 0.5
"""

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp
from scipy.ndimage import gaussian_filter


@dataclass(frozen=True, kw_only=True)
class DropPicture:
    """A drop and how it is photographed.

    Parameters
    ----------
    angle : float
        Contact angle. [rad]
    bond_number : float
        Gravity over surface tension, (density g / tension) apex radius^2. 0 is a sphere.
    base_width : float
        Width of the drop's base, or of its belly above 90 degrees. [pixels]
    lean : float
        Counter-clockwise angle of the substrate with the rows. [rad]
    blur : float
        Standard deviation of the blur, before the pixel's own width. [pixels]
    grain : float
        Standard deviation of the noise over the contrast. [1]
    uneven_light : float
        Relative fall of the light from left to right. [1]
    """

    angle: float
    bond_number: float = 0.0
    base_width: float = 400.0
    lean: float = 0.0
    blur: float = 1.0
    grain: float = 0.02
    uneven_light: float = 0.1


def meridian(angle: float, bond_number: float) -> np.ndarray:
    """Return (x, depth) of a drop of apex radius 1 down to its contact, shape (n, 2).

    The Young-Laplace equation with the arc length as parameter, by an adaptive method.
    """

    def slope(_: float, y: np.ndarray) -> list[float]:
        around = np.sin(y[2]) / y[0] if y[0] > 1e-8 else 1.0
        return [np.cos(y[2]), np.sin(y[2]), 2 + bond_number * y[1] - around]

    def at_contact(_: float, y: np.ndarray) -> float:
        return y[2] - angle

    at_contact.terminal = True  # type: ignore[attr-defined]
    found = solve_ivp(
        slope, (0, 20), [0, 0, 0], events=at_contact, rtol=1e-10, atol=1e-12, max_step=0.01
    )
    return found.y[:2].T


def draw(picture: DropPicture, rng: np.random.Generator) -> np.ndarray:
    """Return the picture, 8 bits, drop and substrate dark on bright ground."""
    half = meridian(picture.angle, picture.bond_number)
    half = half * picture.base_width / 2 / half[:, 0].max()
    height = half[-1, 1]
    outline = np.concatenate([(half * [-1, 1])[::-1], half[1:]])
    x, z = outline[:, 0], height - outline[:, 1]
    # The substrate reaches beyond the picture
    far = 3 * picture.base_width
    x = np.concatenate([[-far, -far], x, [far, far]])
    z = np.concatenate([[-far, 0], z, [0, -far]])
    cos, sin = np.cos(picture.lean), np.sin(picture.lean)
    columns = int(2 * picture.base_width + 61)
    rows = int(height + 0.5 * picture.base_width + 80)
    column = columns / 2 + x * cos - z * sin + rng.uniform(-0.5, 0.5)
    row = rows - 0.25 * picture.base_width - x * sin - z * cos + rng.uniform(-0.5, 0.5)
    level = gaussian_filter(fill(row, column, rows, columns), picture.blur, mode="nearest")
    level = (0.85 - 0.75 * level) * (1 - picture.uneven_light * np.linspace(0, 1, columns))
    level = level + 0.75 * picture.grain * rng.standard_normal(level.shape)
    return np.clip(np.rint(255 * level), 0, 255).astype(np.uint8)


def fill(row: np.ndarray, column: np.ndarray, rows: int, columns: int) -> np.ndarray:
    """Fraction of each pixel inside a polygon, from eight exact chords a pixel."""
    fine = 8
    chord = (np.arange(rows * fine) + 0.5) / fine - 0.5
    covered = np.zeros((rows * fine, columns))
    left_of = np.arange(columns + 1) - 0.5
    for r0, r1, c0, c1 in zip(
        row, np.roll(row, -1), column, np.roll(column, -1), strict=True
    ):
        low, high = np.searchsorted(chord, sorted((r0, r1)))
        if low == high:
            continue
        cut = c0 + (chord[low:high] - r0) * (c1 - c0) / (r1 - r0)
        # What lies right of the side, added on the way down and taken off on the way up
        beyond = np.clip(left_of[1:] - cut[:, None], 0, 1)
        covered[low:high] += np.sign(r1 - r0) * beyond
    return np.abs(covered).reshape(rows, fine, columns).mean(axis=1)


def main() -> None:
    """Write one picture."""
    from skimage.io import imsave

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("path", type=Path)
    parser.add_argument("--angle", type=float, default=75.0, help="degrees")
    parser.add_argument("--bond", type=float, default=0.5)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    picture = DropPicture(angle=np.deg2rad(arguments.angle), bond_number=arguments.bond)
    image = draw(picture, np.random.default_rng(arguments.seed))
    imsave(arguments.path, image, check_contrast=False)


if __name__ == "__main__":
    main()

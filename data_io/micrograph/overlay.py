"""What a person looks at: the picture with its edges drawn in."""

from pathlib import Path

import numpy as np

from data_io.micrograph.edge import EdgeProfile
from data_io.micrograph.levels import load_grey

GOOD, POOR, OVERHANG = np.array([[0.1, 0.9, 0.2], [1.0, 0.1, 0.1], [1.0, 0.2, 1.0]])


def write_profile_overlay(
    overlay_path: str | Path, path: str | Path, profiles: list[EdgeProfile]
) -> None:
    """Write the picture as PNG with its edges drawn in, to check by eye.

    Green where the quality is good, red where it is poor, magenta where the edge overhangs.

    Parameters
    ----------
    overlay_path : str or Path
        The PNG to write.
    path : str or Path
        The picture that was read.
    profiles : list of EdgeProfile
        What `read_profile_images` made of it.
    """
    from skimage import io

    grey, _ = load_grey(path)
    picture = np.repeat(grey[..., None], 3, axis=-1)
    for profile in profiles:
        at = np.linspace(0, profile.size - 1, len(profile.pixels)).round().astype(int)
        draw_edge(picture, profile.pixels, profile.quality[at], profile.overhang[at])
    image = (picture * 255).round().astype(np.uint8)
    io.imsave(Path(overlay_path), image, check_contrast=False)


def draw_edge(
    picture: np.ndarray, pixels: np.ndarray, quality: np.ndarray, overhang: np.ndarray
) -> None:
    """Draw an edge into a colour picture, as thin as its size allows.

    Parameters
    ----------
    picture : ndarray, shape (rows, columns, 3)
        Colours in [0, 1], written into.
    pixels : ndarray, shape (n, 2)
        Rows and columns of the edge.
    quality : ndarray, shape (n,)
        1 is drawn green, 0 red.
    overhang : ndarray of bool, shape (n,)
        Drawn magenta.
    """
    colour = quality[:, None] * GOOD + (1 - quality[:, None]) * POOR
    colour[overhang] = OVERHANG
    rows, columns = picture.shape[:2]
    thickness = max(1, round(min(rows, columns) / 700))
    for shift in np.ndindex(thickness, thickness):
        row, column = (pixels + np.array(shift) - thickness // 2).round().astype(int).T
        picture[row.clip(0, rows - 1), column.clip(0, columns - 1)] = colour

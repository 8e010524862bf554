"""What a person looks at: the photograph with the drop's outline and baseline."""

from pathlib import Path

import numpy as np

from data_io.micrograph.levels import load_grey
from data_io.micrograph.overlay import draw_edge
from fitting.drops.silhouette import ContactAngle


def write_drop_overlay(
    overlay_path: str | Path, path: str | Path, found: ContactAngle
) -> None:
    """Write the picture as PNG with the outline in green and the baseline in magenta.

    Parameters
    ----------
    overlay_path : str or Path
        The PNG to write.
    path : str or Path
        The photograph that was measured.
    found : ContactAngle
        What `contact_angle` made of it.
    """
    from skimage import io

    grey, _ = load_grey(path)
    picture = np.repeat(grey[..., None], 3, axis=-1)
    left, right = found.baseline
    # Longer than the base, so that its fit to the substrate can be judged
    count = int(3 * np.hypot(*(right - left))) + 2
    line = left + np.linspace(-0.5, 1.5, count)[:, None] * (right - left)
    inside = np.all((line >= 0) & (line <= np.array(grey.shape) - 1), axis=1)
    line = line[inside]
    for pixels, is_line in ((line, True), (found.contour, False)):
        good = np.ones(len(pixels))
        draw_edge(picture, pixels, good, np.full(len(pixels), is_line))
    image = (picture * 255).round().astype(np.uint8)
    io.imsave(Path(overlay_path), image, check_contrast=False)

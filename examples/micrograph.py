"""Make the embedded example's micrograph: the edge of vinyl siding, seen from the side.

The surface has the statistics that the paper measured (section 4.2 and Fig. 7): height rms
2.6 and correlation length 14.5, which the paper gives in relative units and which are um
here, so slope rms sqrt(2) 2.6 / 14.5 = 0.2536 (printed there as 0.252, which agrees within
the rounding of the other two). The picture has what a real one has: blur, uneven light,
grain, pixels, eight bits, dust and a slightly tilted sample.

Run it:  python examples/micrograph.py edge.png --seed 1
"""

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter

HEIGHT_RMS = 2.6
CORR_LENGTH = 14.5
# A slope rms measured on n correlation lengths scatters by about 70 % / sqrt(n)
N_CORR_LENGTHS = 200


@dataclass(frozen=True, kw_only=True)
class Edge:
    """A rough edge and the statistics of the ensemble that it was drawn from.

    Parameters
    ----------
    x, z : ndarray, shape (n,)
        Positions and heights, x evenly spaced. [um]
    height_rms, corr_length : float
        Of the ensemble, not of this one edge. [um]
    """

    x: np.ndarray
    z: np.ndarray
    height_rms: float
    corr_length: float

    @property
    def slope_rms(self) -> float:
        """Slope rms of the ensemble, sqrt(2) height_rms / corr_length. [1]"""
        return np.sqrt(2) * self.height_rms / self.corr_length


@dataclass(frozen=True, kw_only=True)
class Camera:
    """How the edge was photographed.

    Parameters
    ----------
    um_per_pixel : float
        Size of a pixel on the sample. [um]
    blur : float
        Standard deviation of the Gaussian blur, before the pixel's own width. [pixels]
    grain : float
        Standard deviation of the noise over the contrast of the edge. [1]
    grain_size : float
        Standard deviation of the Gaussian that the noise was smoothed with. [pixels]
    uneven_light : float
        Relative difference of the illumination between its extremes. [1]
    tilt : float
        Counter-clockwise angle of the mean line with the picture's rows. [rad]
    dust : float
        Specks per million pixels.
    dark, bright : float
        Levels of silhouette and background before light and grain, 0 to 1.
    margin : float
        Space above and below the edge's extremes. [pixels]
    """

    um_per_pixel: float = 0.5
    blur: float = 1.3
    grain: float = 0.04
    grain_size: float = 0.0
    uneven_light: float = 0.25
    tilt: float = 0.012
    dust: float = 8.0
    dark: float = 0.12
    bright: float = 0.75
    margin: float = 40.0


def gaussian_edge(
    rng: np.random.Generator,
    length: float,
    spacing: float,
    *,
    height_rms: float,
    corr_length: float,
) -> Edge:
    """Draw an edge with Gaussian heights and autocorrelation h^2 exp(-r^2 / l^2).

    A Fourier series of twice the length with independent Gaussian amplitudes, of which half
    is kept: its ends do not meet, as on a real sample. The variance of the amplitudes
    follows S(k) = h^2 l / (2 sqrt(pi)) exp(-k^2 l^2 / 4) and is scaled to give h exactly in
    the ensemble.
    """
    n_points = 2 * int(np.ceil(length / spacing))
    wavenumber = 2 * np.pi * np.fft.rfftfreq(n_points, spacing)
    power = np.exp(-((wavenumber * corr_length) ** 2) / 4)
    power[0] = 0.0
    amplitude = np.sqrt(power / power.sum()) * height_rms
    # Real and imaginary part each carry the variance of a cosine, amplitude^2
    noise = rng.standard_normal((2, wavenumber.size))
    z = np.fft.irfft(amplitude * (noise[0] + 1j * noise[1]), n_points) * n_points / 2
    half = n_points // 2
    x = np.arange(half) * spacing
    return Edge(x=x, z=z[:half], height_rms=height_rms, corr_length=corr_length)


def photograph(edge: Edge, camera: Camera, rng: np.random.Generator) -> np.ndarray:
    """Return the picture of an edge, shape (rows, columns), 8 bits, the sample below.

    The silhouette is dark on bright ground. Light gathers linearly up to the end, so blur,
    pixels and uneven light act on intensities.
    """
    coverage = gaussian_filter(_coverage(edge, camera), camera.blur, mode="nearest")
    level = camera.bright + (camera.dark - camera.bright) * coverage
    rows, columns = level.shape
    level = _add_dust(level, camera, rng)
    # Light falls off to one side and to the corners
    across = np.linspace(-1, 1, columns)[None, :]
    down = np.linspace(-1, 1, rows)[:, None]
    field = 0.5 * across - 0.5 * across**2 + 0.2 * down
    field = (field - field.min()) / (field.max() - field.min())
    level = level * (1 - camera.uneven_light * (1 - field))
    noise = rng.standard_normal(level.shape)
    if camera.grain_size:
        noise = gaussian_filter(noise, camera.grain_size, mode="wrap")
        noise = noise / noise.std()
    level = level + camera.grain * (camera.bright - camera.dark) * noise
    return np.clip(np.rint(level * 255), 0, 255).astype(np.uint8)


def _coverage(edge: Edge, camera: Camera) -> np.ndarray:
    """Fraction of each pixel that the sample covers, from eight slices a column."""
    cos, sin = np.cos(camera.tilt), np.sin(camera.tilt)
    # Turn the edge, then read it at the slices of the columns
    column = (edge.x * cos - edge.z * sin) / camera.um_per_pixel
    height = (edge.x * sin + edge.z * cos) / camera.um_per_pixel
    first, last = int(np.ceil(column.min() + 1)), int(np.floor(column.max() - 1))
    slices = np.arange(first, last, 1 / 8) + 1 / 16
    row = height.max() + camera.margin - np.interp(slices, column, height)
    rows = np.arange(int(np.ceil(row.max() + camera.margin)))[:, None]
    covered = np.clip(rows + 1 - row, 0, 1)
    return covered.reshape(rows.size, -1, 8).mean(axis=2)


def _add_dust(level: np.ndarray, camera: Camera, rng: np.random.Generator) -> np.ndarray:
    """Draw soft specks: dark ones on the bright ground, bright ones on the silhouette."""
    level = level.copy()
    rows, columns = level.shape
    for _ in range(rng.poisson(camera.dust * level.size / 1e6)):
        row, column, radius = (
            rng.uniform(0, rows),
            rng.uniform(0, columns),
            rng.uniform(1, 5),
        )
        top, left = max(int(row) - 12, 0), max(int(column) - 12, 0)
        patch = level[top : top + 25, left : left + 25]
        r, c = np.mgrid[top : top + patch.shape[0], left : left + patch.shape[1]]
        speck = np.clip(radius + 0.5 - np.hypot(r - row, c - column), 0, 1)
        ground = patch.mean() > (camera.dark + camera.bright) / 2
        patch += speck * ((camera.dark if ground else camera.bright) - patch) * 0.8
    return level


def make_micrograph(path: str | Path, seed: int, camera: Camera | None = None) -> Edge:
    """Write the picture of a vinyl edge of 200 correlation lengths and return the truth.

    Parameters
    ----------
    path : str or Path
        The PNG to write; 0.5 um a pixel unless the camera says otherwise.
    seed : int
        Makes edge, dust and grain reproducible.
    camera : Camera, optional
        How it is photographed.

    Returns
    -------
    Edge
        The edge before it was photographed, with its ensemble statistics.
    """
    from skimage.io import imsave

    camera = camera or Camera()
    rng = np.random.default_rng(seed)
    length = N_CORR_LENGTHS * CORR_LENGTH
    spacing = camera.um_per_pixel / 8
    edge = gaussian_edge(
        rng, length, spacing, height_rms=HEIGHT_RMS, corr_length=CORR_LENGTH
    )
    imsave(path, photograph(edge, camera, rng), check_contrast=False)
    return edge


def main() -> None:
    """Write a micrograph and print what is true of its edge."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("path", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    edge = make_micrograph(arguments.path, arguments.seed)
    print(
        f"{arguments.path}: {Camera().um_per_pixel} um a pixel, "
        f"height_rms {edge.height_rms} um, "
        f"corr_length {edge.corr_length} um, slope_rms {edge.slope_rms:.4f}"
    )


if __name__ == "__main__":
    main()

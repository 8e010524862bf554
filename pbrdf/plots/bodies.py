"""A scene as it would look: its surface and what lies on it, shaded, with a scale bar."""

from typing import TYPE_CHECKING, Any

import numpy as np

from pbrdf.plots.sheet import lay_out, new_figure, small, width
from pbrdf.scene.solids import scene_solids

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from pbrdf.scene import Scene

__all__ = ["scene_picture"]

# Pixels across, light from the upper left, colours of the surface and of bodies
_PIXELS = 900
_LIGHT = np.array([-0.45, 0.35, 0.82])
_SURFACE, _BODIES = np.array([0.78, 0.75, 0.70]), np.array([0.25, 0.55, 0.85])
# A wider sheet has its title in one line [in]
_WIDE = 4.5
_SHADE, _GLOSS, _POWER = 0.35, 0.55, 40


def scene_picture(
    scene: "Scene",
    *,
    seed: int = 0,
    elevation: float = np.pi / 5,
    azimuth: float = 0.6,
    width_mm: float = 170.0,
) -> "Figure":
    """Draw one realisation of a scene in parallel projection.

    Shading shows shape only, it is no simulation of light; heights and lengths have one
    scale, which the bar gives.

    Parameters
    ----------
    scene : Scene
        What to draw.
    seed : int
        Of the realisation.
    elevation, azimuth : float
        Direction to the eye, elevation above the mean surface in (0, pi/2). [rad]
    width_mm : float
        Width that the figure is printed at. [mm]

    Raises
    ------
    ValueError
        If the elevation leaves its range.
    """
    from matplotlib import rc_context

    if not 0.0 < elevation < np.pi / 2:
        msg = f"elevation must lie in (0, 1.571) rad, got {elevation:g}."
        raise ValueError(msg)
    image, step, share = _rendered(scene_solids(scene, seed=seed), elevation, azimuth)
    rows, columns, _ = image.shape
    with rc_context(small()):
        inches = width(width_mm)
        figure, axes = new_figure(1, 1, (inches, inches * rows / columns + 0.35))
        axis = axes[0, 0]
        axis.imshow(image, interpolation="antialiased")
        axis.axis("off")
        length = 10 ** np.floor(np.log10(columns * step / 4))
        length *= max(k for k in (1, 2, 5) if k * length <= columns * step / 4)
        low, left = 0.985 * rows, 0.02 * columns
        axis.plot([left, left + length / step], [low, low], color="black", linewidth=2.5)
        axis.text(left, low - 0.015 * rows, f"{length:g} µm", va="bottom")
        what = [type(one).__name__.lower() for one in scene.contaminants]
        on = f", {' and '.join(what)} on {100 * share:.2g} % of the picture" if what else ""
        apart = " " if inches > _WIDE else "\n"
        axis.set_title(f"surface{on};{apart}one scale for lengths and heights")
    lay_out(figure)
    return figure


def _rendered(
    solids: dict, elevation: float, azimuth: float
) -> tuple[np.ndarray, float, float]:
    """Return colours (rows, columns, 3), the width of a pixel [um], the share of bodies."""
    import trimesh

    names = list(solids)
    whole: Any = trimesh.util.concatenate([solids[name] for name in names])
    counts = [len(solids[name].faces) for name in names]
    body = np.repeat([name != "surface" for name in names], counts)
    eye = np.array(
        [
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
        ]
    )
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    up = np.cross(eye, right)
    across, along = whole.vertices @ right, whole.vertices @ up
    step = float(np.ptp(across)) / _PIXELS
    u = np.arange(across.min() + step / 2, across.max(), step)
    v = np.arange(along.max() - step / 2, along.min(), -step)
    far = float((whole.vertices @ eye).max()) + 1.0
    grid = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
    origins = grid @ np.stack([right, up]) + far * eye
    toward = np.broadcast_to(-eye, origins.shape)
    face = whole.ray.intersects_first(origins, toward)
    hit = face >= 0
    normal = whole.face_normals[face]
    normal = np.where((normal @ eye)[:, None] < 0, -normal, normal)
    # The light is fixed to the picture
    light = _LIGHT @ np.stack([right, up, eye])
    light /= np.linalg.norm(light)
    bright = _SHADE + (1 - _SHADE) * np.clip(normal @ light, 0, 1)
    colour = np.where(body[face][:, None], _BODIES, _SURFACE) * bright[:, None]
    half = (light + eye) / np.linalg.norm(light + eye)
    gloss = _GLOSS * np.clip(normal @ half, 0, 1) ** _POWER
    colour = np.clip(colour + (gloss * body[face])[:, None], 0, 1)
    colour[~hit] = 1.0
    share = float((body[face] & hit).sum() / max(hit.sum(), 1))
    return colour.reshape(v.size, u.size, 3), step, share

"""Arguments of a run, checked once and turned into numbers."""

import os
from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from pbrdf.errors import check_seed, one_number, require
from pbrdf.kernels.paths.shading import base_strength
from pbrdf.scene.scene import Contamination, Scene
from pbrdf.surface import FixedSurface, HeightMap, MeshSurface, Surface
from pbrdf.validity import (
    Judgement,
    judge,
    resolution_warnings,
    roughness_of,
    roughness_of_mesh,
)

STOKES_COUNT = {"full": 4, "linear": 3, "unpolarized": 1}
# A fixed surface has no realisations; its rays are dealt to this many independent batches
BATCHES = 32
# Below this many realisations the standard errors themselves are too uncertain
FEW_REALIZATIONS = 8
# Half-angle of the widest source [rad]
WIDEST_SOURCE = 0.5


def zeniths(theta_i: npt.ArrayLike) -> np.ndarray:
    """Zenith angles of the source, one-dimensional. [rad]"""
    angles = np.atleast_1d(
        require(
            "theta_i",
            theta_i,
            lambda v: (v >= 0) & (v < np.pi / 2),
            "lie in [0, 1.571) rad",
            "Angles are radians; use np.deg2rad.",
        )
    )
    if angles.ndim != 1 or angles.size == 0:
        msg = (
            f"theta_i must be a number or one-dimensional [rad], got shape {angles.shape}."
        )
        raise ValueError(msg)
    return angles


def wavelengths(wavelength: npt.ArrayLike | None) -> np.ndarray | None:
    """Vacuum wavelengths, or None. [um]"""
    if wavelength is None:
        return None
    waves = require(
        "wavelength",
        wavelength,
        lambda v: (v > 0) & np.isfinite(v),
        "be positive [um]",
        "Wavelengths are micrometres.",
    )
    if waves.ndim > 1 or waves.size == 0:
        msg = (
            f"wavelength must be a number or one-dimensional [um], got shape {waves.shape}."
        )
        raise ValueError(msg)
    return waves


def azimuth(phi_i: float | str) -> float | None:
    """Azimuth of the source [rad]; None for any."""
    if isinstance(phi_i, str):
        if phi_i != "uniform":
            msg = f'phi_i must be an angle [rad] or "uniform", got {phi_i!r}.'
            raise ValueError(msg)
        return None
    value = require("phi_i", phi_i, np.isfinite, "be finite [rad]", 'Or pass "uniform".')
    if value.ndim > 0:
        msg = f"phi_i must be one angle [rad], got shape {value.shape}. Run once for each."
        raise ValueError(msg)
    return float(value)


def azimuths(phi_i: npt.ArrayLike | str) -> tuple[list[float | None], bool]:
    """Azimuths of the source [rad], None for any, and whether they are a dimension."""
    if isinstance(phi_i, str) or np.ndim(phi_i) == 0:
        return [azimuth(phi_i)], False  # type: ignore[arg-type]
    listed = require("phi_i", phi_i, np.isfinite, "be finite [rad]", 'Or pass "uniform".')
    if listed.ndim > 1 or listed.size == 0:
        msg = f"phi_i must be a number or one-dimensional [rad], got shape {listed.shape}."
        raise ValueError(msg)
    return [azimuth(one) for one in listed], True


def half_angle(value: float, angles: np.ndarray) -> float:
    """Half-angle of the source. [rad]"""
    half = one_number(
        "source_half_angle",
        value,
        lambda v: (v >= 0) & (v <= WIDEST_SOURCE),
        f"lie in [0, {WIDEST_SOURCE}] rad",
        "Angles are radians; use np.deg2rad.",
    )
    if half > 0.0 and angles.max() + half >= np.pi / 2:
        msg = (
            f"source_half_angle must leave the cone above the horizon [rad], got {half:g} "
            f"about theta_i {angles.max():g}. Take a smaller cone or a steeper source."
        )
        raise ValueError(msg)
    return half


def count(name: str, value: int, least: int) -> int:
    """Return a whole number that is large enough."""
    number = one_number(
        name,
        value,
        lambda v: (v >= least) & (v == np.floor(v)) & (v < 2**53),
        f"be a whole number of at least {least}",
        "Counts are whole numbers.",
    )
    return int(number)


def switch(name: str, value: bool) -> bool:
    """Return what is on or off."""
    if not isinstance(value, bool | np.bool_):
        msg = (
            f"{name} must be True or False, got {value!r}. It switches one thing on or off."
        )
        raise TypeError(msg)
    return bool(value)


def even_count(name: str, value: int) -> int:
    """Return a whole number that is even."""
    number = count(name, value, 2)
    if number % 2:
        msg = f"{name} must be even, got {number}. Bins are centred on 0 and on pi."
        raise ValueError(msg)
    return number


def stokes_count(stokes: str) -> int:
    """Count the Stokes elements of a kind of output."""
    if stokes not in STOKES_COUNT:
        msg = f"stokes must be one of {', '.join(STOKES_COUNT)}, got {stokes!r}."
        raise ValueError(msg)
    return STOKES_COUNT[stokes]


def target_error(value: float) -> float:
    """Return the relative error to reach. [1]"""
    return one_number(
        "target_rel_error",
        value,
        lambda v: (v > 0) & (v < 1),
        "lie in (0, 1) [1]",
        "0.01 asks for 1 %.",
    )


def seed_sequence(seed: int | None) -> np.random.SeedSequence:
    """Root of all random streams of a run."""
    check_seed(seed)
    return np.random.SeedSequence(None if seed is None else int(seed))


def worker_count(workers: int | None) -> int:
    """Count the threads: those asked for, or one for each core."""
    if workers is None:
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 1
    return count("workers", workers, 1)


def constants(
    scene: Scene, waves: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Index n, kappa and strength of the diffuse base, (wavelengths, materials)."""
    count = 1 if waves is None or waves.ndim == 0 else waves.size
    shape = (count, len(scene.materials))
    n, kappa, base = np.empty(shape), np.empty(shape), np.empty(shape)
    for column, material in enumerate(scene.materials):
        n[:, column], kappa[:, column] = material.indices(waves)
        albedo = np.broadcast_to(material.albedo(waves), count)
        opaque = kappa[:, column].any() or not np.isfinite(n[:, column]).all()
        if material.has_base and opaque:
            msg = (
                f"kappa must be 0 over a diffuse base [1], got {kappa[:, column].max():g} "
                f"and diffuse_albedo {albedo.max():g}. "
                "Light does not reach a base under an absorber."
            )
            raise ValueError(msg)
        base[:, column] = [
            base_strength(*constants) if constants[0] else 0.0
            for constants in zip(albedo, n[:, column], kappa[:, column], strict=True)
        ]
    return n, kappa, base if base.any() else np.empty((count, 0))


def check_scene(scene: Scene) -> None:
    """Refuse what cannot be traced."""
    if isinstance(scene.surface, HeightMap) and scene.surface.missing > 0.0:
        msg = (
            "heights must be complete to be traced, got "
            f"{100 * scene.surface.missing:.2g} % missing. Fill the holes with "
            "HeightMap.filled()."
        )
        raise ValueError(msg)


def scene_warnings(scene: Scene, drawn: int) -> list[str]:
    """Say what limits the trust in a run."""
    notes: list[str] = []
    if varies(scene) and drawn == 1:
        notes.append(
            "One realisation of a random scene: standard errors hold for this "
            "one only. Ask for 16 realizations or more."
        )
    elif varies(scene) and drawn < FEW_REALIZATIONS:
        notes.append(
            f"{drawn} realizations are too few for honest standard errors; "
            "ask for 16 or more."
        )
    if not isinstance(scene.surface, FixedSurface):
        notes += resolution_warnings(roughness_of(scene.surface))
    return notes


def judge_surface(scene: Scene, angles: np.ndarray, waves: np.ndarray | None) -> Judgement:
    """Judge the surface of a scene, where a wavelength is known."""
    if waves is None:
        return Judgement()
    surface = scene.surface
    if isinstance(surface, MeshSurface):
        return judge(roughness_of_mesh(surface), angles, waves)
    return judge(roughness_of(surface), angles, waves)


def varies(scene: Scene) -> bool:
    """Whether realisations of the scene differ."""
    drawn = any(getattr(one, "random", False) for one in scene.contaminants)
    return drawn or not isinstance(scene.surface, FixedSurface)


def in_range(name: str, value: float, low: float, high: float, cure: str) -> float:
    """One number in [low, high]."""
    return one_number(
        name, value, lambda v: (v >= low) & (v <= high), f"lie in [{low:g}, {high:g}]", cure
    )


def one_of(name: str, value: str, known: Iterable[str]) -> str:
    """One of the known words."""
    if value not in known:
        msg = f"{name} must be one of {', '.join(known)}, got {value!r}."
        raise ValueError(msg)
    return value


def mirrored(fold: bool, scene: Scene, phi_i: npt.ArrayLike | str) -> bool:
    """Return `fold`, refused where the mean is not its own mirror image."""
    fold = switch("fold", fold)
    symmetric = (
        isinstance(phi_i, str)
        and isotropic(scene.surface)
        and not any(_pinned(one) for one in scene.contaminants)
    )
    if fold and not symmetric:
        msg = (
            "fold must be left out where the mean is not its own mirror image, got a "
            f"{type(scene.surface).__name__}, {len(scene.contaminants)} contaminants and "
            f"phi_i {phi_i!r}. It takes an isotropic random surface with dx = dy or a flat "
            'one, bodies drawn anew for every realisation, and phi_i="uniform".'
        )
        raise ValueError(msg)
    return fold


def _pinned(contaminant: Contamination) -> bool:
    """Whether bodies lie at the same places in every realisation."""
    return any(
        getattr(contaminant, name, None) is not None for name in ("positions", "seed")
    )


def isotropic(surface: Surface) -> bool:
    """Whether a surface is its own mirror image in the mean over azimuth."""
    if isinstance(surface, HeightMap):
        return surface.labels is None and not np.ptp(surface.heights)
    if isinstance(surface, MeshSurface):
        return False
    # The diagonal of a cell is its own image where both steps are the same
    return len({*np.ravel(surface.corr_length)}) == len({*np.ravel(surface.spacing)}) == 1

"""What every run is asked alike, from light to hemisphere or from detector to source."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from pbrdf.scene.scene import Scene
from pbrdf.tracer import arguments
from pbrdf.validity import Judgement

__all__ = ["Run"]


@dataclass(frozen=True)
class Run:
    """Arguments that `simulate` and `observe` share, checked.

    Attributes
    ----------
    scene : Scene
        What is looked at.
    root : SeedSequence
        Root of all random streams.
    rays : int
        Rays a direction and realisation, as asked for.
    drawn : int
        Realisations, as asked for.
    waves : ndarray or None
        Vacuum wavelengths. [um]
    n, kappa, base : ndarray, shape (wavelengths, materials)
        Optical constants and strength of the diffuse base; see `arguments.constants`. [1]
    stokes : str
        Stokes elements, by name.
    target : float or None
        Relative error to reach. [1]
    workers : int
        Threads.
    progress : callable or None
        Called with (samples done, samples in all).
    """

    scene: Scene
    root: np.random.SeedSequence
    rays: int
    drawn: int
    waves: np.ndarray | None
    n: np.ndarray
    kappa: np.ndarray
    base: np.ndarray
    stokes: str
    target: float | None
    workers: int
    progress: Callable[[int, int], None] | None

    @classmethod
    def asked(  # noqa: PLR0913  (the common part of two public signatures)
        cls, scene: Scene, *, root: np.random.SeedSequence, n_rays: int, realizations: int,
        wavelength: npt.ArrayLike | None, stokes: str, target_rel_error: float | None,
        workers: int | None, progress: Callable[[int, int], None] | None,
    ) -> "Run":  # fmt: skip
        """Check the arguments that are asked for.

        Raises
        ------
        TypeError, ValueError
            If one is out of its range.
        """
        rays = arguments.count("n_rays", n_rays, arguments.BATCHES)
        drawn = arguments.count("realizations", realizations, 1)
        waves = arguments.wavelengths(wavelength)
        n, kappa, base = arguments.constants(scene, waves)
        arguments.stokes_count(stokes)
        target = target_rel_error
        if target is not None:
            target = arguments.target_error(target)
        return cls(
            scene, root, rays, drawn, waves, n, kappa, base, stokes, target,
            arguments.worker_count(workers), progress,
        )  # fmt: skip

    @property
    def batched(self) -> bool:
        """Whether samples are batches of rays over one surface, not surfaces."""
        return not arguments.varies(self.scene) or self.drawn == 1

    @property
    def samples(self) -> int:
        """How many samples there are at the least."""
        return max(arguments.BATCHES, self.drawn) if self.batched else self.drawn

    @property
    def rays_of_sample(self) -> int:
        """How many rays a direction one sample has."""
        return -(-self.rays * self.drawn // self.samples) if self.batched else self.rays

    @property
    def n_stokes(self) -> int:
        """How many Stokes elements are computed."""
        return arguments.stokes_count(self.stokes)

    def judged(self, angles: np.ndarray, waves: np.ndarray | None) -> Judgement:
        """Refuse what cannot be traced, and say what limits the trust in the rest."""
        arguments.check_scene(self.scene)
        judged = arguments.judge_surface(self.scene, angles, waves)
        notes = [*arguments.scene_warnings(self.scene, self.drawn), *judged.notes]
        return replace(judged, notes=tuple(notes))

    def attributes(self, done: int) -> dict[str, Any]:
        """Attributes of a result of so many samples that say what was asked."""
        return {
            "seed": int(self.root.entropy),  # type: ignore[arg-type]
            "n_rays": self.rays,
            "realizations": 1 if self.batched else done,
            "ray_batches": done if self.batched else 0,
            "stderr_excludes_surface": self.batched,
            "stokes": self.stokes,
            "target_rel_error": np.nan if self.target is None else self.target,
        }

"""What a scene does not need: work left out without a change of the result.

Each skip is exact, and each can be switched off by its name, so that a test can compare.
"""

from collections.abc import Iterable

from pbrdf.kernels.bodies.media import DEEP
from pbrdf.kernels.optics.fresnel_table import TOLERANCE
from pbrdf.kernels.terrain.horizon import BLOCK
from pbrdf.simulation.plan import Plan

SKIPS = {
    "walk": "rays over a height field need no mesh and no tree: an exact walk follows them",
    "sweep": "first hits on a periodic surface need no search: one pass a line finds them",
    "steep": "a ray that rises more steeply than every facet is not traced",
    "horizon": "a ray that rises above all that lies ahead of it is not traced",
    "deep": "light with too far to go in an absorber to come out again is not followed",
    "spectra": "many wavelengths: single bounces are summed by bin and shaded once a bin",
}


def chosen_skips(skips: bool | Iterable[str]) -> frozenset[str]:
    """Names of the skips to use: all, none, or those named.

    Raises
    ------
    ValueError
        If a name is unknown.
    """
    if isinstance(skips, bool):
        return frozenset(SKIPS) if skips else frozenset()
    names = frozenset([skips] if isinstance(skips, str) else skips)
    for name in sorted(names - frozenset(SKIPS)):
        msg = f"skips must be True, False or names of {', '.join(SKIPS)}, got {name!r}."
        raise ValueError(msg)
    return names


def explanation(plan: Plan, *, periodic: bool, steepest: float) -> list[str]:
    """Say in sentences what a run leaves out and why.

    Parameters
    ----------
    plan : Plan
        The run.
    periodic : bool
        Whether the surface repeats.
    steepest : float
        Largest slope of a facet of one sample of the surface. [1]
    """
    if plan.media is not None:
        lines = _about_contaminants(plan, periodic, steepest)
    elif "walk" in plan.skips:
        lines = _about_the_walk(plan.skips, periodic, steepest)
    else:
        lines = ["Nothing skipped: Embree traces every ray."]
    return lines + _about_the_plan(plan)


def mesh_explanation(plan: Plan, *, faces: int, kind: str) -> list[str]:
    """Say the same of a run over a mesh of so many faces, of a kind of `MeshSurface`."""
    below = {
        "ground": "no light passes below",
        "bodies": "light that passes below is transmitted",
        "sheet": "light that leaves beyond the rim is left out",
    }[kind]
    lines = [
        f"Embree: one tree over {faces} faces finds facets for all angles; float64 says "
        f"where they are met; {below}."
    ]
    if plan.media is not None:
        lines += _about_beams(plan)
    return lines + _about_the_plan(plan)


def _about_the_plan(plan: Plan) -> list[str]:
    """Say which bounces, elements and wavelengths a run leaves out."""
    lines = []
    if plan.base.shape[1] == 0 and plan.media is None:
        lines.append("Diffuse base: none, so no path is split; nothing is transmitted.")
    if plan.max_bounces < 3:
        lines.append(
            f"Bounces beyond {plan.max_bounces}: not traced; their light is truncated."
        )
    if plan.n_stokes == 3:
        lines.append("V: not computed in or out (it is followed inside paths).")
    if plan.n_stokes == 1:
        lines.append("All but M00: not computed (paths stay polarised inside).")
    if len(plan.n) > 1 and plan.media is None:
        lines.append(f"Tracing for {len(plan.n) - 1} of {len(plan.n)} wavelengths: shared.")
    if plan.spectrum is not None:
        lines.append(
            "Single bounces: summed by bin, and shaded once a bin and wavelength, to "
            f"{TOLERANCE:g} of M00."
        )
    return lines


def _about_contaminants(plan: Plan, periodic: bool, steepest: float) -> list[str]:
    assert plan.media is not None
    lines = [
        "Embree: not built; bodies are met exactly, by a grid, and the ground by a walk.",
    ]
    if "sweep" in plan.skips and periodic:
        lines.append(
            "Search for the first facets: none; one pass along each line finds them."
        )
    if "steep" in plan.skips:
        lines.append(
            "The ground, for rays rising above its steepest facet in the first sample, a "
            f"slope of {steepest:.3g}: not searched."
        )
    if "horizon" in plan.skips:
        lines.append(
            "The ground, for rays rising above all that lies ahead of it in their octant, "
            f"by blocks of {BLOCK} cells: not searched."
        )
    return lines + _about_beams(plan)


def _about_beams(plan: Plan) -> list[str]:
    """Say what is left out of the parts into which light comes apart."""
    assert plan.media is not None
    lines = [
        "Parts of a split ray below a hundredth of it: one of the two is followed, by "
        "chance; below a thousandth, by chance or not at all.",
    ]
    if not plan.media.absorption.any():
        lines.append("Absorption on the way: none in any medium, not computed.")
    elif "deep" in plan.skips:
        lines.append(
            f"Light with an optical depth beyond {DEEP:g} before it, of which less than "
            "the rounding would be left: not followed."
        )
    return lines


def _about_the_walk(skips: frozenset[str], periodic: bool, steepest: float) -> list[str]:
    lines = ["Embree: not built; an exact float64 walk settles every ray."]
    if "sweep" in skips and periodic:
        lines.append("Search for first hits: none; one pass along each line finds them.")
    if "steep" in skips:
        lines.append(
            "Rays rising above the steepest facet of the first sample, a slope of "
            f"{steepest:.3g}: not traced."
        )
    if "horizon" in skips:
        lines.append(
            "Rays rising above all that lies ahead in their octant, by blocks of "
            f"{BLOCK} cells: not traced."
        )
    return lines

"""The same surfaces measured by SurfaceTopography and surfalize, where they are installed.

Both are compared as a user would call them: form removed, no other treatment. Neither is a
dependency (surfalize is GPL): install them in an environment of their own that also sees
this project, and run

    python studies/surface_statistics/other_tools.py --realisations 40
"""

import argparse
from collections.abc import Callable

import numpy as np
from benchmark import CASES, LENGTH, TRUTH, measure

from fitting import surface_statistics
from pbrdf.surface import GaussianSurface, HeightMap

Row = tuple[float, float]


def measure_map(noise: float, step: float, seed: int) -> HeightMap:
    """Give 25 x 25 correlation lengths at 1 um, as an instrument reports them."""
    surface = GaussianSurface(
        shape=(725, 725), spacing=1.0, corr_length=LENGTH, height_rms=TRUTH[0]
    )
    z = surface.sample(seed).heights[:363, :363]
    z = z + noise * np.random.default_rng(seed).standard_normal(z.shape)
    return HeightMap(step * np.round(z / step) if step > 0 else z, 1.0)


def own(surface: object) -> Row:
    found = surface_statistics(surface)
    return found.height_rms.value, found.slope_rms.value


def surface_topography_profile() -> Callable[[object], Row]:
    from SurfaceTopography import UniformLineScan

    def tool(profile: object) -> Row:
        spacing = profile.x[1] - profile.x[0]
        scan = UniformLineScan(profile.z, profile.z.size * spacing).detrend("slope")
        return scan.rms_height_from_profile(), scan.rms_slope_from_profile()

    return tool


def surface_topography_map() -> Callable[[object], Row]:
    from SurfaceTopography import Topography

    def tool(surface: object) -> Row:
        z = surface.heights
        scan = Topography(
            z, tuple(n * d for n, d in zip(z.shape, surface.spacing, strict=True))
        )
        scan = scan.detrend("slope")
        # Its gradient is of both axes
        return scan.rms_height_from_area(), scan.rms_gradient() / np.sqrt(2)

    return tool


def surfalize_map() -> Callable[[object], Row]:
    from surfalize import Surface

    def tool(surface: object) -> Row:
        levelled = Surface(surface.heights.T.copy(), *surface.spacing).level()
        return levelled.Sq(), levelled.Sdq() / np.sqrt(2)

    return tool


def collect(factories: dict[str, Callable]) -> dict[str, Callable[[object], Row]]:
    tools = {}
    for name, factory in factories.items():
        try:
            tools[name] = factory()
        except ImportError as error:
            print(f"{name} left out: {error}")
    return tools


def print_rows(name: str, tools: dict[str, Callable], surfaces: list) -> None:
    for tool, function in tools.items():
        values = np.array([function(surface) for surface in surfaces])
        bias = 100 * (np.sqrt(np.mean(values**2, axis=0)) / TRUTH[[0, 2]] - 1)
        spread = 100 * values.std(axis=0) / TRUTH[[0, 2]]
        print(
            f"{name:>20} | {tool:>18} | {bias[0]:+7.1f} ± {spread[0]:4.1f} | "
            f"{bias[1]:+7.1f} ± {spread[1]:4.1f}",
            flush=True,
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--realisations", type=int, default=40)
    options = parser.parse_args()
    header = f"{'case':>20} | {'tool':>18} | {'height_rms [%]':>14} | slope_rms [%]"
    print(f"bias of the rms ± spread of one, {options.realisations} realisations\n{header}")

    tools = {"this project": own} | collect(
        {"SurfaceTopography": surface_topography_profile}
    )
    for case in CASES:
        rng = np.random.default_rng(3)
        surfaces = [measure(case, 50, rng)[0] for _ in range(options.realisations)]
        print_rows(f"profile {case.name}", tools, surfaces)

    tools = {"this project": own} | collect(
        {"SurfaceTopography": surface_topography_map, "surfalize": surfalize_map}
    )
    for name, noise, step in (
        ("clean", 0, 0),
        ("noise 0.1", 0.1, 0),
        ("noise 0.26", 0.26, 0),
        ("step 0.5", 0, 0.5),
        ("step 1", 0, 1),
    ):
        surfaces = [
            measure_map(noise, step, seed) for seed in range(options.realisations // 4)
        ]
        print_rows(f"map {name}", tools, surfaces)


if __name__ == "__main__":
    main()

"""Speed of the Monte Carlo engine, each figure as a ratio of two timings of one run."""

import argparse
import os
import platform
import resource
import time
import warnings

import numpy as np
from embree_replay import Replay

import pbrdf
from pbrdf.bench.yardstick import simulate_plainly
from pbrdf.simulation.moments import Moments
from pbrdf.simulation.plan import Plan, Tally
from pbrdf.simulation.skips import SKIPS
from pbrdf.simulation.trace import prepare, trace_sample

SIZE = 512
SLOPE = 0.30
THETA = np.deg2rad(60.0)


def surface(slope, size=SIZE):
    """Surface of the benchmark: 16 cells a correlation length."""
    return pbrdf.GaussianSurface(
        shape=(size, size), spacing=1.0, corr_length=16.0, slope_rms=slope
    )


def plan(n_rays, *, theta=THETA, skips=frozenset(SKIPS), n=1.5, stokes=4):
    """All wavelengths of a list n over one surface."""
    index = np.atleast_1d(np.asarray(n, dtype=float))[:, None]
    return Plan(
        theta_i=np.array([theta]), phi_i=0.3, n_rays=n_rays, max_bounces=64, n=index,
        kappa=np.zeros_like(index), base=np.empty((len(index), 0)), n_stokes=stokes,
        n_theta=45, n_dphi=90, skips=skips,
    )  # fmt: skip


def seconds(work, repeats=3, clock=time.process_time):
    """Time of the fastest of some runs after a first: of the CPU, or by another clock."""
    work()
    best = np.inf
    for _ in range(repeats):
        start = clock()
        work()
        best = min(best, clock() - start)
    return best


def in_turn(*works, repeats=5):
    """Processor time of each work: the median of runs taken in turn after a first."""
    spent = [[] for _ in works]
    for _ in range(repeats + 1):
        for work, times in zip(works, spent, strict=True):
            start = time.process_time()
            work()
            times.append(time.process_time() - start)
    return [float(np.median(times[1:])) for times in spent]


def against_embree(n_rays):
    """Path segments through Embree: the engine against a replay of the very same rays."""
    target = prepare(surface(SLOPE).sample(3), frozenset())
    work = plan(n_rays, skips=frozenset())

    def trace(field):
        trace_sample(field, work, np.random.SeedSequence(1))

    replay = Replay.of(target, trace, 4 * n_rays)
    engine, raw = in_turn(lambda: trace(target), replay.run)
    segments = replay.segments
    print(
        f"  segments through Embree      {segments / engine / 1e6:6.2f} M per core-second"
    )
    print(f"  the same rays, Embree alone  {segments / raw / 1e6:6.2f} M per core-second")
    print(f"  ratio                        {raw / engine:6.2f}   (goal 0.75)")


def complete_paths(n_rays):
    """Complete paths with all 16 elements binned, everything on."""
    field = prepare(surface(SLOPE).sample(3), frozenset(SKIPS))
    for degrees in (10, 60, 75):
        work = plan(n_rays, theta=np.deg2rad(degrees))
        took = seconds(
            lambda work=work: trace_sample(field, work, np.random.SeedSequence(1))
        )
        goal = "   (goal 4)" if degrees == 60 else ""
        print(
            f"  incidence {degrees:2d} deg   {n_rays / took / 1e6:6.2f} M paths "
            f"a core-second{goal}"
        )


def workers(n_rays):
    """Wall time of one worker over two."""
    scene = pbrdf.Scene(surface(SLOPE), pbrdf.Material(1.5))

    def took(count):
        def work():
            pbrdf.simulate(scene, THETA, n_rays=n_rays, realizations=32, workers=count)

        return seconds(work, clock=time.perf_counter)

    ratio = took(1) / took(2)
    print(
        f"  two workers are {ratio:.2f} times one   (goal 1.8; {os.cpu_count()} cores here)"
    )


def skips(n_rays):
    """Time a scene that needs little: skips on against off, whole runs."""
    scene = pbrdf.Scene(surface(0.05), pbrdf.Material(1.5))

    def work(allowed):
        pbrdf.simulate(
            scene, np.deg2rad(10.0), n_rays=n_rays, realizations=8, skips=allowed
        )

    ratio = seconds(lambda: work(False), 2) / seconds(lambda: work(True), 2)
    print(f"  slope 0.05 at 10 deg: {ratio:.1f} times faster with skips   (goal 8)")


def wavelengths(n_rays):
    """Many wavelengths and fewer Stokes elements over one trace, added to the means."""
    field = prepare(surface(SLOPE).sample(3), frozenset(SKIPS))

    def took(**options):
        work = plan(n_rays, **options)
        moments, tally = Moments(work), Tally.empty(work)

        def one_sample():
            moments.add(
                trace_sample(field, work, np.random.SeedSequence(1), tally.emptied())
            )

        return seconds(one_sample, 2)

    one = took()
    print(
        f"  20 wavelengths cost {took(n=np.linspace(1.4, 1.6, 20)) / one:.2f} times one"
        "   (goal 2)"
    )
    print(
        f"  100 wavelengths cost {took(n=np.linspace(1.4, 1.6, 100)) / one:.2f} times one"
        "   (goal 6)"
    )
    print(
        f"  linear output costs {took(stokes=3) / one:.2f} of full, "
        f"M00 alone {took(stokes=1) / one:.2f}"
    )


def whole_runs(n_rays):
    """Many wavelengths through `simulate`: surfaces, means and errors counted too."""
    wave = np.linspace(0.4, 0.9, 100)
    glass = pbrdf.Material.from_table(wavelength=wave, n=np.linspace(1.6, 1.4, 100))
    scene = pbrdf.Scene(surface(SLOPE), glass)

    def took(waves):
        return seconds(
            lambda: pbrdf.simulate(
                scene, THETA, wavelength=waves, n_rays=n_rays, realizations=16
            ), 2,
        )  # fmt: skip

    one = took(wave[:1])
    for count, goal in ((20, 2), (100, 6)):
        ratio = took(np.linspace(0.4, 0.9, count)) / one
        print(f"  whole run, {count:3d} over one: {ratio:.2f}   (goal {goal})")


def linearity(n_rays):
    """Time and memory against the number of rays."""
    field = prepare(surface(SLOPE).sample(3), frozenset(SKIPS))

    def took(rays):
        return seconds(
            lambda: trace_sample(field, plan(rays), np.random.SeedSequence(1)), 1
        )

    few, many = took(n_rays), took(10 * n_rays)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(
        f"  ten times the rays take {many / few:.2f} times as long; "
        f"peak memory {peak:.2f} GB"
    )


def time_to_error(target):
    """Whole time to a stated error, against the same physics in plain NumPy and embreex."""
    drawn = surface(SLOPE)
    scene = pbrdf.Scene(drawn, pbrdf.Material(1.5))
    start = time.perf_counter()
    result = pbrdf.simulate(
        scene, THETA, n_rays=60_000, realizations=16, target_rel_error=target,
        n_theta=18, n_dphi=36,
    )  # fmt: skip
    ours = time.perf_counter() - start
    samples = result.attrs["realizations"]
    # Realisations limit both: the plain program needs as many, with as many rays each
    start = time.perf_counter()
    rng = np.random.default_rng(1)
    tried = 3
    for k in range(tried):
        simulate_plainly(drawn.sample(k).heights, THETA, 1.5, 60_000, 18, 36, rng)
    plain = (time.perf_counter() - start) / tried * samples
    print(
        f"  {100 * target:g} % in all bins within a tenth of the peak: "
        f"{samples} realisations"
    )
    print(
        f"  engine {ours:.1f} s, plain NumPy and embreex {plain:.0f} s "
        f"(from {tried} realisations)"
    )
    print(f"  {plain / ours:.1f} times faster   (goal 10)")


def curves():
    """Time to 1 % against rays, realisations and cells of a correlation length.

    The error of a run falls as the square root of its realisations: each run is carried on
    to 1 % by that law.
    """
    for cells, n_rays, realizations in (
        (16, 15_000, 32), (16, 60_000, 32), (16, 240_000, 32), (16, 60_000, 128),
        (8, 60_000, 32), (32, 60_000, 32),
    ):  # fmt: skip
        drawn = pbrdf.GaussianSurface(
            shape=(32 * cells, 32 * cells), spacing=16.0 / cells, corr_length=16.0,
            slope_rms=SLOPE,
        )  # fmt: skip
        scene = pbrdf.Scene(drawn, pbrdf.Material(1.5))
        for how in ({"phi_i": 0.0}, {"phi_i": "uniform", "fold": True}):
            start = time.perf_counter()
            result = pbrdf.simulate(
                scene, THETA, n_rays=n_rays, realizations=realizations, n_theta=18,
                n_dphi=36, **how,
            )  # fmt: skip
            took = time.perf_counter() - start
            error = result.attrs["rel_error"]
            print(
                f"  {cells:2d} cells, {n_rays:6d} rays, {realizations:3d} realisations, "
                f"{'folded' if 'fold' in how else 'plain '}: {100 * error:5.2f} % in "
                f"{took:5.2f} s; 1 % in {took * (error / 0.01) ** 2:6.1f} s"
            )


def main():
    """Print every figure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rays", type=int, default=1_000_000)
    parser.add_argument("--error", type=float, default=0.02)
    parser.add_argument("--heights", help="only write the height map of the benchmark")
    options = parser.parse_args()
    if options.heights:
        np.save(options.heights, surface(SLOPE).sample(3).heights)
        return
    warnings.simplefilter("ignore", pbrdf.AccuracyWarning)
    print(
        f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, "
        f"pbrdf {pbrdf.__version__}"
    )
    for title, work in (
        (f"Embree, every skip off (slope {SLOPE}, 60 deg, {SIZE} x {SIZE} cells)",
         lambda: against_embree(options.rays // 4)),
        ("Complete paths, everything on", lambda: complete_paths(options.rays)),
        ("Workers", lambda: workers(options.rays // 8)),
        ("Skips", lambda: skips(options.rays // 10)),
        ("Wavelengths and Stokes elements", lambda: wavelengths(options.rays // 8)),
        ("Wavelengths, whole runs", lambda: whole_runs(options.rays // 8)),
        ("Rays", lambda: linearity(options.rays // 4)),
        ("Time to 1 % in all bins within a tenth of the peak", curves),
        ("Time to a given error", lambda: time_to_error(options.error)),
    ):  # fmt: skip
        print(title)
        work()


if __name__ == "__main__":
    main()

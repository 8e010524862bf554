"""`pbrdf doctor`: is this installation sound, and how fast is it here."""

from collections.abc import Iterator

import typer


def command() -> None:
    """Show versions, cores and the cache of compiled kernels, and test the tracer.

    The test takes seconds once the kernels are compiled. Exit code 1 if it fails.
    """
    import platform
    from importlib.metadata import PackageNotFoundError, version

    from pbrdf import __version__
    from pbrdf.kernels import cache_folder
    from pbrdf.tracer.arguments import worker_count

    typer.echo(f"pbrdf       {__version__}")
    typer.echo(f"Python      {platform.python_version()}, {platform.platform()}")
    for name in ("numpy", "numba", "scipy", "xarray", "embreex", "casadi", "nlopt"):
        try:
            typer.echo(f"{name:<11} {version(name)}")
        except PackageNotFoundError:
            typer.echo(f"{name:<11} is missing: install the package again")
    typer.echo(f"cores       {worker_count(None)}")
    folder = cache_folder()
    kept = len(list(folder.rglob("*.nbc"))) if folder.is_dir() else 0
    typer.echo(f"kernels     {kept} compiled in {folder} (PBRDF_CACHE_DIR)")
    faults = list(self_test())
    for fault in faults:
        typer.echo(f"FAULT       {fault}", err=True)
    if faults:
        raise typer.Exit(1)


def self_test() -> Iterator[str]:
    """Yield what is wrong with the tracer: energy of a mirror, Fresnel, speed."""
    import time

    import numpy as np

    from pbrdf import GaussianSurface, Material, Scene, simulate
    from pbrdf.cli.progress import progress_bar

    surface = GaussianSurface(
        shape=(128, 128), spacing=1.0, corr_length=12.0, slope_rms=0.3
    )
    mirror = Scene(surface, Material.mirror())
    with progress_bar("testing"):
        simulate(mirror, 1.0, n_rays=1000, realizations=8, stokes="unpolarized")
    start = time.perf_counter()
    result = simulate(mirror, 1.0, n_rays=40_000, realizations=8, stokes="unpolarized")
    seconds = time.perf_counter() - start
    lost = abs(result.albedo.sum().item() - 1.0)
    typer.echo(f"mirror      energy kept to {lost:.1e}; {8 * 40_000 / seconds:.2g} paths/s")
    if not lost < 1e-6:
        yield f"a rough mirror loses {lost:.2g} of the light; expected less than 1e-6."
    flat = GaussianSurface(shape=(64, 64), spacing=1.0, corr_length=16.0, slope_rms=1e-6)
    glass = simulate(Scene(flat, Material(1.5)), 0.0, n_rays=1000, realizations=8)
    error = abs(glass.albedo.sum().item() - 0.04)
    typer.echo(f"glass       reflects 4 % to {error:.1e}")
    if not error < 1e-6:
        yield f"glass at normal incidence is off by {error:.2g}; expected less than 1e-6."
    if not np.isfinite(result.brdf_stderr).all():
        yield "standard errors are not finite."

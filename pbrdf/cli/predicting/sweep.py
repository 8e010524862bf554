"""`pbrdf sweep`: one simulation for each combination of varied scene parameters."""

from collections.abc import Mapping
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from pbrdf.cli import options
from pbrdf.cli.options import Stokes

if TYPE_CHECKING:
    from pbrdf.scene.scene import Scene

# Option name: (part of the scene, field, fields it takes the place of)
VARIED = {
    "slope_rms": ("surface", "slope_rms", "height_rms"),
    "height_rms_um": ("surface", "height_rms", "slope_rms"),
    "corr_length_um": ("surface", "corr_length", None),
    "n": ("substrate", "n", None),
    "kappa": ("substrate", "kappa", None),
}
# Keys of a contaminant's table in the scene file
OF_CONTAMINANTS = (
    "contact_angle_deg", "volume_per_area_um", "coverage", "number_density_per_mm2",
    "width", "capillary_length_um", "radius_um", "sink", "thickness_um",
)  # fmt: skip
NAMES = (*VARIED, *OF_CONTAMINANTS)


def command(
    scene: Annotated[Path, typer.Argument(help="Scene file (TOML).", show_default=False)],
    vary: Annotated[
        list[str],
        typer.Option(help=f"NAME=VALUE,VALUE,... once or more. Names: {', '.join(NAMES)}."),
    ],
    theta_i: options.Incidences = "30",
    phi_i: options.Azimuths = "uniform",
    source_half_angle: options.SourceHalfAngle = 0.0,
    fold: options.Fold = False,
    output: options.Output = None,
    force: options.Force = False,
    n_rays: options.Rays = 100_000,
    realizations: options.Realizations = 16,
    target: options.Target = None,
    max_bounces: options.Bounces = None,
    wavelength: options.Wavelengths = None,
    n_theta: options.ThetaBins = 45,
    n_dphi: options.DphiBins = 90,
    stokes: options.StokesOption = Stokes.full,
    seed: options.Seed = 0,
    workers: options.Workers = None,
) -> None:
    """Simulate every combination of the varied parameters into one file.

    Keys of drops, spheres and films vary in the one contaminant that has them. All
    combinations share the seed, so that differences between them are less noisy than the
    results.

    Example: pbrdf sweep scene.toml --vary slope_rms=0.05,0.15,0.3 --theta-i-deg 10,60
    """
    given = dict(locals())
    import numpy as np
    import xarray as xr

    import pbrdf
    from data_io import write_result
    from fitting.report.record import record_of
    from pbrdf.cli.progress import StageBars
    from pbrdf.cli.staging import staged_file
    from pbrdf.cli.typed import words_typed

    axes = dict(_axis(text) for text in vary)
    combinations = list(product(*axes.values()))
    loaded = pbrdf.load_scene(scene)
    scenes = [
        changed(loaded, dict(zip(axes, values, strict=True))) for values in combinations
    ]
    waves = None if wavelength is None else options.numbers(wavelength, "--wavelength-um")
    target_file = options.result_file(output or scene.with_name(f"{scene.stem}-sweep.nc"))
    results = []
    with staged_file(target_file, force=force) as stage, StageBars() as bars:
        for step, (variant, values) in enumerate(zip(scenes, combinations, strict=True)):
            result = pbrdf.simulate(
                variant,
                options.incidences(theta_i),
                phi_i=options.azimuths(phi_i),
                n_rays=n_rays,
                realizations=realizations,
                seed=seed,
                max_bounces=max_bounces,
                target_rel_error=target,
                wavelength=waves,
                n_theta=n_theta,
                n_dphi=n_dphi,
                stokes=stokes.value,
                workers=workers,
                source_half_angle=float(np.deg2rad(source_half_angle)),
                fold=fold,
            )
            here = {name: [value] for name, value in zip(axes, values, strict=True)}
            # What describes the axes is the same in every combination
            shared = {name: result[name] for name in ("projected_solid_angle",)}
            results.append(result.drop_vars(shared).expand_dims(here).assign(shared))
            bars.update("sweep", step + 1, len(scenes))
        together = xr.combine_by_coords(
            results, data_vars="minimal", coords="minimal", compat="override",
            combine_attrs="drop_conflicts",
        )  # fmt: skip
        together = cast("xr.Dataset", together).assign_attrs(
            made_by=record_of(
                {"scene": scene}, command="sweep", options=options.recorded(given),
                typed=words_typed(),
            )
        )  # fmt: skip
        write_result(together, stage)
    typer.echo(f"{len(scenes)} simulations: {target_file}")


def changed(scene: "Scene", values: Mapping[str, float]) -> "Scene":
    """Return the scene with these parameters.

    Raises
    ------
    ValueError
        If the scene has no such parameter, or a value is out of its range.
    """
    from pbrdf import GaussianSurface, Material, Scene
    from pbrdf.scene.contaminant_tables import with_value

    changes: dict[str, dict[str, Any]] = {"surface": {}, "substrate": {}}
    contaminants = scene.contaminants
    for name, value in values.items():
        if name in OF_CONTAMINANTS:
            contaminants = with_value(contaminants, name, value)
            continue
        part, field, instead_of = VARIED[name]
        changes[part] |= {field: value} | ({instead_of: None} if instead_of else {})
    surface, substrate = scene.surface, scene.substrate
    if changes["surface"]:
        if not isinstance(surface, GaussianSurface):
            msg = "--vary needs a gaussian surface for that, got a height map. Vary n."
            raise ValueError(msg)
        surface = replace(surface, **changes["surface"])
    if changes["substrate"]:
        if not isinstance(substrate, Material):
            msg = "--vary needs a substrate of one material, got several. Vary the surface."
            raise ValueError(msg)
        substrate = replace(substrate, **changes["substrate"])
    return Scene(surface, substrate, contaminants)


def _axis(text: str) -> tuple[str, list[float]]:
    """Return name and values of NAME=VALUE,VALUE,..."""
    name, equals, values = text.partition("=")
    if not equals or name not in NAMES:
        known = ", ".join(NAMES)
        msg = f"--vary must be NAME=VALUE,VALUE with NAME one of {known}, got {text!r}."
        raise ValueError(msg)
    return name, options.numbers(values, f"--vary {name}")

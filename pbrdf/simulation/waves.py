"""Single scattering by waves in place of the first bounce of rays; later bounces stay.

The two count different light: a wave form is single scattering, less what Smith's factor
hides, and that goes on to the second bounce of the rays. Only scattered light does: later
bounces are taken by the share that is not in the mean field.
"""

from typing import Any

import numpy as np
import xarray as xr

from pbrdf.conventions import RESULT_VARIABLES
from pbrdf.optics.fresnel import specular_mueller
from pbrdf.scene.scene import Scene
from pbrdf.simulation.plan import Plan
from pbrdf.surface import GaussianSurface
from pbrdf.tracer import arguments
from pbrdf.wave import TwoScaleModel, WaveModel
from pbrdf.wave.methods import METHODS

__all__ = ["check_waves", "join_waves"]

Array = np.ndarray

# Nodes per axis of a bin: at the least, for a lobe as wide as the bin, and at the most
FEWEST, PER_WIDTH, MOST = 3, 4, 12
# Azimuths of an average over all of them, and the beam of coarse heights that is none
EVEN_AZIMUTHS, MOST_BEAM = 16, 1e-3


def check_waves(
    scene: Scene, wave: str | WaveModel, waves: Array | None, stokes: str,
    plans: list[Plan],
) -> None:  # fmt: skip
    """Refuse what the waves do not know, by name. Each azimuth has a plan."""
    plan = plans[0]
    if isinstance(wave, str):
        arguments.one_of("wave", wave, METHODS)
    elif not isinstance(wave, WaveModel):
        msg = f"wave must be a form or a WaveModel, got {type(wave).__name__}."
        raise TypeError(msg)
    if waves is None:
        msg = "wavelength must be given with wave, got None. Pass it in um."
        raise ValueError(msg)
    if stokes != "full":
        msg = f"stokes must be 'full' with wave, got {stokes!r}. Select elements later."
        raise ValueError(msg)
    if plan.half_angle:
        msg = (
            f"source_half_angle must be 0 with wave, got {plan.half_angle:g}. Average over "
            "incidences."
        )
        raise ValueError(msg)
    _check_scene(scene, len(plans))
    if isinstance(wave, WaveModel):
        longest, lowest = float(np.max(waves)), float(plan.theta_i.max())
        _check_fine(scene, wave, longest, lowest)


def _check_scene(scene: Scene, azimuths: int) -> None:
    """Refuse a scene that waves do not know."""
    surface = scene.surface
    if not isinstance(surface, GaussianSurface):
        kind = type(surface).__name__
        msg = (
            f"the surface must be a GaussianSurface with wave, got {kind}: waves see its "
            "statistics. pbrdf.wave.map_scattering takes one map."
        )
        raise ValueError(msg)
    if azimuths > 1 and not surface.isotropic:
        msg = (
            f"phi_i must be one azimuth with wave over two lengths, got {azimuths}: the "
            "specular beam has none. Simulate each azimuth by itself."
        )
        raise ValueError(msg)
    if scene.contaminants:
        msg = (
            "contaminants must be left out with wave: the first bounce of rays holds light "
            "of bodies and of the dry ground between them, and cannot be told apart. Take "
            "WaveModel of the dry share, and simulate the wet scene without wave."
        )
        raise ValueError(msg)
    if any(material.has_base for material in scene.materials):
        msg = (
            "diffuse_albedo of the substrate must be 0 with wave: its light is in the "
            "first bounce, which the waves replace."
        )
        raise ValueError(msg)


def _check_fine(scene: Scene, fine: WaveModel, longest: float, theta: float) -> None:
    """Refuse a fine structure that does not belong to this scene."""
    surface = scene.surface
    assert isinstance(surface, GaussianSurface)
    if not surface.isotropic:
        msg = "the surface must be isotropic under a fine structure, got two lengths."
        raise ValueError(msg)
    if fine.material != scene.materials[0]:
        msg = "wave must have the material of the substrate, got another one."
        raise ValueError(msg)
    phase = 4 * np.pi * surface.ensemble_height_rms * np.cos(theta) / longest
    share = float(np.exp(-(phase**2)))
    if share > MOST_BEAM:
        msg = (
            f"the surface must be rough on the scale of the wavelength under a fine "
            f"structure, got a specular share of {share:.2g} at {longest:g} um and "
            f"{np.rad2deg(theta):.4g} degrees. Put both into one WaveModel."
        )
        raise ValueError(msg)


def _form(scene: Scene, wave: str | WaveModel) -> WaveModel | TwoScaleModel:
    """Return what scatters once."""
    surface = scene.surface
    assert isinstance(surface, GaussianSurface)
    if isinstance(wave, WaveModel):
        return TwoScaleModel(wave, float(np.mean(surface.facet_slope_rms)))
    both = np.broadcast_to(np.asarray(surface.corr_length, dtype=np.float64), (2,))
    length: Any = float(both[0]) if surface.isotropic else tuple(both)
    return WaveModel(
        scene.materials[0], height_rms=surface.ensemble_height_rms, corr_length=length,
        method=wave,
    )  # fmt: skip


def join_waves(result: xr.Dataset, scene: Scene, wave: str | WaveModel) -> xr.Dataset:
    """Replace the first bounce of a result, and add the mean field as `coherent`.

    The standard error of the first bounce is then that which the form states of itself.
    """
    substrate = scene.materials[0]
    model = _form(scene, wave)
    waves = np.atleast_1d(result.wavelength.values)
    angles = result.theta_i.values
    once, error = (np.empty((angles.size, waves.size, *_bins(result), 4, 4)) for _ in "12")
    beam = np.zeros((angles.size, waves.size, 4, 4))
    share = np.zeros((angles.size, waves.size))
    azimuths = _azimuths(result, model)
    for i, theta_i in enumerate(angles):
        for j, wavelength in enumerate(map(float, waves)):
            sides = [_averages(result, model, theta_i, wavelength, phi) for phi in azimuths]
            once[i, j], error[i, j] = (
                np.mean(part, axis=0) for part in zip(*sides, strict=True)
            )
            if isinstance(model, TwoScaleModel):
                continue
            beam[i, j] = np.mean(
                [model.coherent(theta_i, wavelength, phi_i=phi) for phi in azimuths], axis=0
            )
            flat = specular_mueller(np.cos(theta_i), *substrate.index(wavelength))[0, 0]
            share[i, j] = min(beam[i, j, 0, 0] / flat, 1.0) if flat else 0.0
    spectral = "wavelength" in result.dims
    if not spectral:
        once, error, beam, share = once[:, 0], error[:, 0], beam[:, 0], share[:, 0]
    light = ("theta_i", "wavelength") if spectral else ("theta_i",)
    axes = (*light, "theta_s", "dphi", "stokes_out", "stokes_in")
    entry = RESULT_VARIABLES["coherent"]
    coherent = xr.DataArray(
        beam,
        dims=(*light, "stokes_out", "stokes_in"),
        attrs={"units": entry.units, "long_name": entry.long_name},
    )
    joined = _replaced(
        result,
        xr.DataArray(once, dims=axes),
        xr.DataArray(error, dims=axes),
        1.0 - xr.DataArray(share, dims=light),
    )
    joined = joined.assign(coherent=coherent).assign_attrs(wave=_name(wave))
    if not np.isinf(substrate.indices(waves)[0]).any():
        joined["absorbed"] = _below(joined).assign_attrs(result.absorbed.attrs)
    return joined


def _name(wave: str | WaveModel) -> str:
    """Name a form, or a fine structure, in a file."""
    if isinstance(wave, str):
        return wave
    heights = wave.surface.heights
    return (
        f"two scales: {wave.method}, height_rms {heights.height_rms:.6g} um, corr_length "
        f"{heights.corr_length:.6g} um"
    )


def _azimuths(result: xr.Dataset, model: WaveModel | TwoScaleModel) -> list[float]:
    """Azimuths of the source over which waves are averaged. [rad]"""
    if isinstance(model, TwoScaleModel) or model.directional is None:
        return [0.0]
    phi_i = result.attrs["phi_i"]
    if isinstance(phi_i, str):
        # A half turn leaves the heights as they are
        return [np.pi * k / EVEN_AZIMUTHS for k in range(EVEN_AZIMUTHS)]
    return [float(np.ravel(phi_i)[0])]


def _below(joined: xr.Dataset) -> xr.DataArray:
    """Share of the light that enters the substrate: what is left of one."""
    elsewhere = ("truncated", "leaked", "left_sideways", "transmitted")
    gone = joined.albedo.sum("bounces") + sum(joined[name] for name in elsewhere)
    beam = joined.coherent.isel(stokes_out=0, stokes_in=0, drop=True)
    return (1.0 - gone - beam).transpose(*joined.absorbed.dims)


def _bins(result: xr.Dataset) -> tuple[int, int]:
    """Numbers of bins in zenith and azimuth."""
    return result.sizes["theta_s"], result.sizes["dphi"]


def _averages(
    result: xr.Dataset, model: WaveModel | TwoScaleModel, theta_i: float,
    wavelength: float, phi_i: float,
) -> tuple[Array, Array]:  # fmt: skip
    """Averages over the bins, weighted with cos(theta_s), and their stated errors."""
    n_theta, n_dphi = _bins(result)
    zenith, turn = 0.5 * np.pi / n_theta, 2 * np.pi / n_dphi
    turned = {"phi_i": phi_i}
    if isinstance(model, TwoScaleModel):
        lobe, turned = model.slope_rms, {}
    else:
        heights = model.surface.heights
        slope = float(model.surface.slopes(np.array([wavelength]))[0])
        lobe = max(slope, 0.15 * wavelength / heights.corr_length)
    x, w = np.polynomial.legendre.leggauss(
        int(np.clip(np.ceil(PER_WIDTH * zenith / lobe), FEWEST, MOST))
    )
    theta_s = result.theta_s.values[:, None] + 0.5 * zenith * x
    dphi = result.dphi.values[:, None] + 0.5 * turn * x
    weight = w * np.cos(theta_s) * np.sin(theta_s)
    weight = weight / weight.sum(axis=1, keepdims=True)
    once = np.empty((n_theta, n_dphi, 4, 4))
    for row in range(n_theta):
        zeniths = theta_s[row, :, None, None]
        values = model.brdf(theta_i, zeniths, dphi, wavelength, **turned)
        once[row] = np.einsum("i,idjab,j->dab", weight[row], values, w / 2)
    stated = model.error_estimate(
        theta_i, result.theta_s.values[:, None], result.dphi.values, wavelength, **turned
    )
    return once, np.abs(stated * once[..., 0, 0])[..., None, None] * np.ones((4, 4))


def _replaced(
    result: xr.Dataset, once: xr.DataArray, error: xr.DataArray, scattered: xr.DataArray
) -> xr.Dataset:
    """Dataset with another first bounce, and all that is summed from it."""
    later = [label for label in result.bounces.values if label != "1"]
    area = result.projected_solid_angle
    # The form errs in all bins together
    first = {
        "brdf": once,
        "brdf_stderr": error,
        "albedo": (once[..., 0, 0] * area).sum(["theta_s", "dphi"]),
        "albedo_stderr": (error[..., 0, 0] * area).sum(["theta_s", "dphi"]),
    }
    out = result.copy()
    for name, ours in first.items():
        rest = result[name].sel(bounces=later) * scattered
        same = ours.broadcast_like(rest.isel(bounces=0, drop=True))
        joined = xr.concat([same.expand_dims(bounces=["1"]), rest], dim="bounces")
        out[name] = joined.transpose(*result[name].dims).assign_attrs(result[name].attrs)
    total = out.brdf.sum("bounces")
    error = np.sqrt((out.brdf_stderr**2).sum("bounces"))
    out["brdf_total"] = total.assign_attrs(result.brdf_total.attrs)
    out["brdf_total_stderr"] = error.assign_attrs(result.brdf_total_stderr.attrs)
    return out

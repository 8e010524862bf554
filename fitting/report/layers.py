"""What a page shows over the hemisphere: light by bounces, analytical model, readings."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import xarray as xr

from data_io import read_model
from pbrdf import Material, MicrofacetModel, load_scene
from pbrdf.derived.bins import on_bins
from pbrdf.derived.elements import mueller
from pbrdf.errors import DataFileError

if TYPE_CHECKING:
    from pbrdf import Scene

__all__ = ["Layers", "fitted_layers", "layers_of", "light"]

_BINS = ("theta_s", "dphi", "stokes_out", "stokes_in")
_PLACES = {"theta_i", "wavelength", "phi_i"}
# Fitted parameters that need no other simulation
_CARRIED = {"specular_gain", "diffuse_albedo", "slope_rms"}


@dataclass(frozen=True)
class Layers:
    """Hemispheres of one result, each with the same dimensions.

    Attributes
    ----------
    bounces : mapping of str to Dataset
        `brdf_total` and its error of all bounces, and of each number of them. [1/sr]
    model : Dataset or None
        `brdf_total` of the analytical model on the same bins. [1/sr]
    words : str
        What is shown, a sentence.
    readings : Dataset or None
        A scan in the plane, in the units of the hemispheres, dim `geometry`.
    """

    bounces: Mapping[str, xr.Dataset]
    model: xr.Dataset | None = None
    words: str = ""
    readings: xr.Dataset | None = field(default=None)


def layers_of(result: xr.Dataset) -> Layers:
    """Return the hemispheres of a result as simulated, and the model of its scene."""
    value, stderr = mueller(result)
    layers = {"all": light(value, stderr)}
    if "brdf" in result and "bounces" in result.brdf.dims:
        for label in map(str, result.bounces.values):
            error = result.get("brdf_stderr")
            layers[label] = light(
                result.brdf.sel(bounces=label, drop=True),
                None if error is None else error.sel(bounces=label, drop=True),
            )
    model = model_of(result)
    found = None if model is None else on_bins(model, value)
    if found is None:
        return Layers(layers)
    return Layers(
        layers,
        found,
        "The analytical model is that of the scene: its slope and index, one reflection, "
        "no gain; averaged over each bin.",
    )


def fitted_layers(result: xr.Dataset) -> Layers | None:
    """Return the hemispheres of a pipeline's result with the values of both fits.

    None where the result holds no fits, or fits of an index other than the one traced.
    """
    fit, text = (result.attrs.get(n) for n in ("monte_carlo_fit", "analytic_model"))
    if not text or not isinstance(fit, Mapping):
        return None
    values = {n: one["value"] for n, one in fit["parameters"].items()}
    if not set(values) <= _CARRIED | {"scale", "background"}:
        return None
    with TemporaryDirectory() as folder:
        file = Path(folder) / "model.toml"
        file.write_text(str(text), encoding="utf-8")
        model = read_model(file)
    plain = layers_of(result)
    gain = values.get("specular_gain", model.specular_gain)
    brightened = model.with_parameters(
        specular_gain=0.0, diffuse_albedo=values.get("diffuse_albedo", model.diffuse_albedo)
    )
    layers = {name: gain * one for name, one in plain.bounces.items()}
    whole = layers["all"]
    rest = on_bins(brightened, whole.brdf_total)
    layers["all"] = whole.assign(brdf_total=whole.brdf_total + rest.brdf_total)
    return Layers(
        layers,
        on_bins(model, whole.brdf_total),
        "Both curves with their fitted values. Light by bounces is without the diffuse "
        "part, which belongs to none of them.",
    )


def model_of(result: xr.Dataset) -> MicrofacetModel | None:
    """Return the analytical model of the scene of a result, None where it has none."""
    scene = _scene(str(result.attrs.get("scene", "")))
    if scene is None or scene.contaminants or not isinstance(scene.substrate, Material):
        return None
    places = set(map(str, mueller(result)[0].dims)) - set(_BINS)
    slope = getattr(scene.surface, "slope_rms", None)
    if not isinstance(slope, float) or not places <= _PLACES:
        return None
    return MicrofacetModel(scene.substrate, slope_rms=slope)


def with_readings(layers: Layers, readings: xr.Dataset | None) -> Layers:
    """Return the layers with a scan to draw beside their cuts."""
    return replace(layers, readings=readings)


def light(value: xr.DataArray, stderr: xr.DataArray | None) -> xr.Dataset:
    """Return a BRDF and its error as a result."""
    found = {"brdf_total": value.drop_attrs()}
    if stderr is not None:
        found["brdf_total_stderr"] = stderr.drop_attrs()
    return xr.Dataset(found)


def _scene(text: str) -> "Scene | None":
    """Read the scene that a result records; None where it needs files of its own."""
    if not text:
        return None
    with TemporaryDirectory() as folder:
        file = Path(folder) / "scene.toml"
        file.write_text(text, encoding="utf-8")
        try:
            return load_scene(file)
        except DataFileError:
            return None

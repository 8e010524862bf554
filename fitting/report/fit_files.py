"""A fit as files: numbers, models, the spectrum of results and figures."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from data_io import in_plane, write_model, write_wave_model
from fitting.models.cuts import plane_curves
from fitting.models.waves import WaveSurface
from fitting.report.spectrum import spectrum_figure, spectrum_table
from pbrdf.plots import scan_figure

if TYPE_CHECKING:
    import xarray as xr

    from fitting.result.fit_result import FitResult

__all__ = ["calibrated", "write_fit"]


def write_fit(
    result: "FitResult",
    measured: "Mapping[str, xr.Dataset]",
    folder: Path,
    *,
    record: Mapping[str, Any],
) -> None:
    """Write fit.json, the models, figures, and of several wavelengths their spectrum.

    Parameters
    ----------
    result : FitResult
        What to write.
    measured : mapping of str to Dataset
        The scans by name, as they were fitted.
    folder : Path
        An existing folder.
    record : mapping
        What went in, see `fitting.report.record`.
    """
    numbers = {**result.as_dict(), "record": dict(record)}
    text = json.dumps(numbers, indent=2)
    (folder / "fit.json").write_text(f"{text}\n", encoding="utf-8")
    notes = {
        "uncertainty": {name: e.as_dict() for name, e in result.estimates.items()},
        "held": result.held,
        "misfit": {"verdict": result.misfit.verdict, "in_words": str(result.misfit)},
        "cautions": {"warnings": list(result.warnings)},
        "made_by": record,
    }
    for name, model in _distinct(result).items():
        if _of_waves(model):
            beside = {"beside": model.beside}
            write_wave_model(model.model, folder / name, notes=notes | beside)
        else:
            write_model(model, folder / name, notes=notes)
    table = spectrum_table(result)
    if len(table):
        table.to_csv(folder / "spectrum.csv")
        if np.isfinite(table.filter(like="_stderr").to_numpy(dtype=float)).any():
            spectrum_figure(result).savefig(folder / "spectrum.png", dpi=140)
    cuts = list(_cuts(result, measured))
    zeniths = np.deg2rad(np.arange(0.5, 90.0))
    for words, key, plane in cuts:
        model = result.models[key]
        curves = plane_curves(
            np.unique(plane.theta_i.values),
            zeniths,
            analytic=_closed_form(model),
            wavelength=plane.wavelength.values[0] if _of_waves(model) else None,
            monte_carlo=model if hasattr(model, "simulation") else None,
            phi_i=float(plane.phi_i.values[0]) - result.values.get("orientation", 0.0),
        )
        name = "scan.png" if len(cuts) == 1 else f"{words}.png"
        scan_figure(plane, curves).savefig(folder / name, dpi=140)


def _distinct(result: "FitResult") -> dict[str, Any]:
    """Return the analytical models that differ, by the name of their file."""
    models: dict[str, Any] = {}
    for key, model in result.models.items():
        analytic = _closed_form(model)
        if not any(_equal(analytic, other) for other in models.values()):
            models[key] = analytic
    if len(models) == 1:
        return {"model.toml": next(iter(models.values()))}
    return {f"model_{_words(key)}.toml": model for key, model in models.items()}


def _equal(one: Any, other: Any) -> bool:
    """Whether two models are the same."""
    if not _of_waves(one):
        return bool(one == other)
    pairs = [(model.beside, model.model.given) for model in (one, other)]
    return pairs[0] == pairs[1]


def _closed_form(model: Any) -> Any:
    """Return the model itself, of a simulated surface the analytical one it corrects."""
    return model if _of_waves(model) else getattr(model, "model", model)


def _of_waves(model: Any) -> bool:
    """Whether it is a surface seen by waves, with gain and base beside the model."""
    return isinstance(model, WaveSurface)


def _words(key: str) -> str:
    """Return the name of a model as part of a file's name."""
    label, _, wave = key.partition(", ")
    return f"{label}_{wave}um" if wave else label


def _cuts(
    result: "FitResult", measured: "Mapping[str, xr.Dataset]"
) -> "Iterator[tuple[str, str, xr.Dataset]]":
    """Yield (file name, model, readings) of each scan, wavelength and source azimuth."""
    for label, scan in measured.items():
        plane = in_plane(scan)
        size = plane.sizes["geometry"]
        columns = {
            name: np.broadcast_to(plane[name].values, (size,)) if name in plane.coords
            else np.full(size, default)
            for name, default in (("wavelength", np.nan), ("phi_i", 0.0))
        }  # fmt: skip
        plane = plane.assign_coords({k: ("geometry", v) for k, v in columns.items()})
        waves = np.nan_to_num(columns["wavelength"].round(9), nan=-1.0)
        azimuths = columns["phi_i"].round(6)
        pairs = np.unique(np.stack([waves, azimuths], axis=1), axis=0)
        for wave, azimuth in pairs:
            key = label if label in result.models else f"{label}, {wave:.9g}"
            if key not in result.models:
                continue
            name = _words(key) if key != label or wave < 0.0 else label
            if len(np.unique(azimuths)) > 1:
                name += f"_phi{np.rad2deg(azimuth):.4g}"
            here = np.flatnonzero((waves == wave) & (azimuths == azimuth))
            yield name, key, calibrated(result, label, wave, plane.isel(geometry=here))


def calibrated(
    result: "FitResult", label: str, wave: float, scan: "xr.Dataset"
) -> "xr.Dataset":
    """Return readings in the units of the model, without fitted scale and background."""
    number = f"{wave:.9g}"

    def of(name: str, default: float) -> float:
        groups = (f"[{label}, {number}]", f"[{label}]", f"[{number}]", "")
        given = {**result.held, **result.values}
        found = (given[name + group] for group in groups if name + group in given)
        value = next(found, default)
        return float(value) if isinstance(value, float) else default

    scale, background = of("scale", 1.0), of("background", 0.0)
    changed = {}
    for name in scan.data_vars:
        element = str(name).removesuffix("_stderr")
        if element[0] not in "MIf":
            continue
        offset = background if name == "M00" else 0.0
        changed[name] = (scan[name] - offset) / scale
    return scan.assign(changed)

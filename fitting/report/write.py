"""The pipeline's results as files: figures, model.toml, result.nc and a report to read."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

import data_io
from data_io.reflectance.model import model_text
from fitting.estimate import Estimate
from fitting.report import explorer, html
from fitting.report.downloads import download_links
from fitting.report.fit_files import calibrated
from fitting.report.layers import Layers, fitted_layers, layers_of, with_readings
from fitting.report.spectrum import draw_spectrum, spectrum_of
from fitting.report.surface import edge_figure, surface_figure
from fitting.report.viewer import hemisphere_view
from fitting.result.misfit import RULE
from pbrdf import __version__
from pbrdf.plots import scan_figure

if TYPE_CHECKING:
    from fitting.pipeline import PipelineResult
    from fitting.prediction.beside_gaussian import MeasuredSlopes
    from fitting.result.fit_result import FitResult

__all__ = ["fit_columns", "result_dataset", "write_report", "write_spectrum"]


def write_report(
    result: "PipelineResult",
    folder: Path,
    *,
    inputs: Mapping[str, str] | None = None,
    seconds: Mapping[str, float] | None = None,
    record: Mapping[str, Any] | None = None,
    picture: Path | None = None,
) -> None:
    """Write model.toml, result.nc, the figures and report.html into a folder.

    Parameters
    ----------
    result : PipelineResult
        What to write.
    folder : Path
        An existing folder.
    inputs : mapping of str to str, optional
        What went in, for the report: surface, scan, index.
    seconds : mapping of str to float, optional
        Time of what came before the pipeline. [s]
    record : mapping, optional
        What it takes to repeat the run, see `fitting.report.record`.
    picture : Path, optional
        The micrograph that the surface was read from, to draw its edge into.
    """
    figures = {
        "surface.png": html.png(surface_figure(result.surface, result.statistics)),
        "scan.png": html.png(
            scan_figure(data_io.in_plane(_in_units(result)), result.curves)
        ),
    }
    if picture is not None and isinstance(result.surface, data_io.EdgeProfile):
        figures["edge.png"] = html.png(edge_figure(picture, result.surface))
    for name, image in figures.items():
        (folder / name).write_bytes(image)
    together = result_dataset(result)
    if record is not None:
        together.attrs["made_by"] = dict(record)
    data_io.write_result(together, folder / "result.nc")
    data_io.write_model(result.model, folder / "model.toml", notes=_notes(result, record))
    times = {**(seconds or {}), **result.seconds}
    sections = [
        *_sections(result, together, figures, inputs or {}, times),
        explorer.origin(record),
    ]
    page = html.page("Reflectance model", [*sections, explorer.glossary(sections)])
    (folder / "report.html").write_text(page, encoding="utf-8")


def write_spectrum(results: "Mapping[float, PipelineResult]", folder: Path) -> None:
    """Write spectrum.csv and spectrum.png: both fits against the wavelength [um]."""
    import pandas as pd

    tables = {
        "analytical": spectrum_of({w: one.analytic for w, one in results.items()}),
        "monte carlo": spectrum_of({w: one.monte_carlo for w, one in results.items()}),
    }
    together = pd.concat(tables, names=["curve"]).swaplevel().sort_index()
    together.to_csv(folder / "spectrum.csv")
    if np.isfinite(together.filter(like="_stderr").to_numpy(dtype=float)).any():
        draw_spectrum(tables).savefig(folder / "spectrum.png", dpi=140)


def _in_units(result: "PipelineResult") -> xr.Dataset:
    """Return the scan in the units of the curves; a relative one by its fitted scale."""
    fit = result.monte_carlo
    return calibrated(fit, next(iter(fit.models)), float("nan"), result.measurement)


def result_dataset(result: "PipelineResult") -> xr.Dataset:
    """Return simulation, curves and scan as one dataset, the fits as its attributes."""
    scan, own, waves = result.measurement, result.measured_slopes, result.waves
    angles = {name: f"scan_{name}" for name in scan.coords}
    measured = scan.rename({**angles, **{name: f"scan_{name}" for name in scan.data_vars}})
    together = xr.merge(
        [
            result.simulation,
            result.curves,
            measured.reset_coords(),
            *([] if own is None else [own.to_dataset()]),
            *([] if waves is None else [waves.coherent.to_dataset(name="waves_coherent")]),
        ],
        combine_attrs="drop",
        compat="no_conflicts",
        join="outer",
    )
    together.attrs = {
        **result.simulation.attrs,
        "statistics": result.statistics.to_dict(),
        "analytic_fit": result.analytic.as_dict(),
        "monte_carlo_fit": result.monte_carlo.as_dict(),
        "analytic_model": model_text(result.model),
        **({} if own is None else {"measured_slopes": own.as_dict()}),
        **({} if waves is None else {"wave_fit": waves.fit.as_dict()}),
    }
    return together


def _estimate_rows(fits: "Mapping[str, FitResult]") -> Iterator[tuple[str, ...]]:
    """Yield (parameter, then value with interval in each fit) for a table."""
    names = dict.fromkeys(name for fit in fits.values() for name in fit.values)
    for name in names:
        yield (name, *(str(fit.estimates.get(name, "held")) for fit in fits.values()))


def fit_columns(result: "PipelineResult") -> "dict[str, FitResult]":
    """Return the fits under the titles that report and terminal give them."""
    held = "slope_rms" not in result.analytic.values
    slope = "slope of the surface" if held else "slope fitted"
    fits = {
        f"Analytical, {slope}": result.analytic,
        f"Monte Carlo, {slope}": result.monte_carlo,
    }
    if result.waves is not None:
        fits["Waves, height and slope of the surface"] = result.waves.fit
    if result.scan_slope is not None:
        fits["Monte Carlo, slope from the scan alone"] = result.scan_slope
    return fits


def _notes(result: "PipelineResult", record: Mapping[str, Any] | None) -> dict[str, object]:
    """Return what model.toml remembers beside the model."""
    return {
        "uncertainty": {
            name: _plain(estimate) for name, estimate in result.analytic.estimates.items()
        }
        | {"slope_rms": _plain(result.statistics.slope_rms)},
        "monte_carlo": {
            name: _plain(estimate)
            for name, estimate in result.monte_carlo.estimates.items()
        },
        "surface": {
            name: _plain(estimate) | {"unit": unit}
            for name, (estimate, unit) in result.statistics.estimates().items()
        },
        "held": result.analytic.held,
        "misfit": {
            title: {"verdict": fit.misfit.verdict, "in_words": str(fit.misfit)}
            for title, fit in fit_columns(result).items()
        },
        "made_by": dict(record or {"program": f"pbrdf {__version__}"}),
    }


def _plain(estimate: Estimate) -> dict[str, object]:
    return dict(estimate.as_dict())


def _sections(
    result: "PipelineResult",
    together: xr.Dataset,
    figures: Mapping[str, bytes],
    inputs: Mapping[str, str],
    seconds: Mapping[str, float],
) -> Iterator[str]:
    statistics, fits = result.statistics, fit_columns(result)
    both = {
        "Analytical": result.analytic.as_dict(), "Monte Carlo": result.monte_carlo.as_dict()
    }  # fmt: skip
    yield html.section(
        "Summary",
        html.paragraph(" ".join(explorer.fit_summary(both))),
        explorer.facts(result.simulation, inputs.get("scan", "not named")),
    )
    yield html.section("What went in", html.table(("", ""), inputs.items()))
    yield html.section(
        "Surface",
        html.table(
            ("quantity", "unit", "value", "standard error", "95 % from", "to"),
            statistics.table(),
        ),
        html.paragraph(
            f"Autocorrelation: {statistics.autocorrelation.description}. "
            f"Heights: {statistics.gaussianity.verdict}."
        ),
        html.bullets(statistics.warnings),
        *(
            html.figure(figures["edge.png"], "The edge as it was read.")
            for _ in range("edge.png" in figures)
        ),
        html.figure(
            figures["surface.png"],
            "The surface without its form, its heights, autocorrelation with the fit, "
            "spectrum with its model, slopes with the model's, slope by the cut-off.",
        ),
    )
    yield _model_section(fits, figures["scan.png"])
    if result.measured_slopes is not None:
        yield _slopes_section(result.measured_slopes)
    yield html.section(
        "Hemisphere",
        hemisphere_view(_layers(result, together)),
        *download_links(result, _notes(result, None)),
    )
    yield html.section("What these data cannot tell", html.told(result.unknown))
    yield html.section(
        "Simulation",
        html.table(
            ("", ""), [(name, str(result.simulation.attrs[name])) for name in _SHOWN]
        ),
    )
    yield html.section(
        "Time",
        html.table(
            ("stage", "seconds"),
            [(stage, f"{elapsed:.1f}") for stage, elapsed in seconds.items()],
        ),
    )


def _slopes_section(own: "MeasuredSlopes") -> str:
    """Return the section of the map's own slope distribution."""
    return html.section(
        "Slopes as measured",
        html.bullets(own.texts),
        html.table(
            ("curve", "M00 off by, rms", "gain", "Lambertian base", "nothing freed"),
            own.table_rows(),
        ),
        html.paragraph(
            "Errors are relative to each reading. The slopes as measured are those that "
            "light sees: of patches that diffract as much as they hide."
        ),
    )


def _model_section(fits: "dict[str, FitResult]", scan: bytes) -> str:
    """Return the section of the fits, with the figure of the scan."""
    return html.section(
        "Model",
        html.table(("parameter", *fits), _estimate_rows(fits)),
        html.paragraph(
            "Value ± standard error and 95 % interval. The errors include the noise of the "
            "scan and, where the slope is held at that of the surface, its uncertainty."
        ),
        html.table(
            ("misfit", *fits),
            [
                ("verdict", *(fit.misfit.verdict for fit in fits.values())),
                ("size of the misfit", *(fit.misfit.size for fit in fits.values())),
                ("chi2 / dof", *(_quality(fit) for fit in fits.values())),
                ("noise of the scan", *(fit.noise for fit in fits.values())),
                *_misfit_rows(fits),
            ],
        ),
        html.paragraph(f"Verdicts: {RULE}."),
        *(
            html.paragraph(title) + explorer.correlations(list(fit.values), fit.correlation)
            for title, fit in fits.items()
        ),
        html.figure(
            scan,
            "Scan, analytical curve (dashed) and Monte Carlo with all bounces (full, band: "
            "95 %). Below: what the scan shows beyond each curve, in standard errors where "
            "the scan gives errors; grey: two of them.",
        ),
    )


def _layers(result: "PipelineResult", together: xr.Dataset) -> Layers:
    layers = fitted_layers(together)
    if layers is None:
        # The values belong to an index or parameters that were not traced alone
        return layers_of(result.simulation)
    return with_readings(layers, data_io.in_plane(_in_units(result)))


_SHOWN = ("n_rays", "realizations", "seed", "max_bounces", "version")


def _quality(fit: "FitResult") -> str:
    if fit.n_estimated:
        return "1 by construction: the noise was estimated from the misfit"
    return f"{fit.chi2 / fit.dof:.3g} ({fit.dof} degrees of freedom, p = {fit.p_value:.2g})"


def _misfit_rows(fits: "Mapping[str, FitResult]") -> Iterator[tuple[str, ...]]:
    """Yield the rms misfit of each observable, as a share of the rms reading."""
    first = next(iter(fits.values()))
    for name in dict.fromkeys(first.readings.observable.values.tolist()):
        row = [f"rms misfit of {name}, over rms {name}"]
        for fit in fits.values():
            here = fit.readings.isel(reading=fit.readings.observable.values == name)
            share = ((here.measured - here.model) ** 2).sum() / (here.measured**2).sum()
            row.append(f"{100 * float(share) ** 0.5:.2g} %")
        yield tuple(row)

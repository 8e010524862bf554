"""A page that explains any result: summary, hemisphere, fits, glossary, origin, data."""

import json
import re
import shlex
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from html import escape
from typing import Any

import numpy as np
import xarray as xr

from fitting.report import html
from fitting.report.layers import fitted_layers, layers_of, light, with_readings
from fitting.report.swept import points, what_was_swept
from fitting.report.viewer import hemisphere_view
from fitting.result.misfit import RULE
from pbrdf import __version__
from pbrdf.derived import element, in_plane
from pbrdf.derived.elements import mueller
from pbrdf.plots.sheet import scene_of

__all__ = [
    "correlations",
    "cuts",
    "facts",
    "fit_summary",
    "glossary",
    "origin",
    "page_of",
    "sections_of",
]

# Symbol, unit, meaning, and what occurs in a page that uses it
_GLOSSARY = (
    ("M00 ... M33", "1/sr", "Mueller BRDF: scattered radiance over irradiance", "M00"),
    ("M10, M20", "1/sr", "polarised parts of what unpolarised light makes: s over "
     "p, and at 45 degrees", "M10|M20"),
    ("DOLP", "1", "degree of linear polarisation, √(M10² + M20²) / M00", "DOLP"),
    ("AOLP", "deg", "angle of polarisation from the direction s towards p", "AOLP"),
    ("theta_i, theta_s", "deg", "zenith angles of source and detector", "theta_i|theta_s"),
    ("dphi", "deg", "azimuth from source to detector: 180 specular, 0 back to the source",
     "dphi"),
    ("view angle", "deg", "zenith of the detector in the plane, positive forward",
     "view"),
    ("slope_rms", "1", "rms slope of the surface along one axis", "slope_rms"),
    ("height_rms, corr_length", "um", "rms height; lag where its correlation is 1/e",
     "height_rms|corr_length"),
    ("specular_gain", "1", "factor on the surface reflection", "specular_gain"),
    ("diffuse_albedo", "1", "Lambertian part: adds diffuse_albedo / π to M00",
     "diffuse_albedo"),
    ("n, kappa", "1", "refractive index n + i kappa", "kappa|index"),
    ("standard error, ±", "", "one standard deviation of the estimate",
     "[Ss]tandard error|±"),
    ("chi2 / dof", "1", "mean square of the residuals in standard errors; 1 is expected",
     "chi2"),
    ("misfit", "", f"verdict on the curve. {RULE}", "misfit|verdict"),
)  # fmt: skip
# What is not read: scripts, and tags with all that they hold
_CODE = re.compile(r"<script>.*?</script>|<[^>]*>", re.DOTALL)


def page_of(result: xr.Dataset, name: str) -> str:
    """Return the whole page of a result that `read_result` gave."""
    sections = list(sections_of(result, name))
    return html.page(f"Report: {name}", [*sections, glossary(sections)])


def sections_of(result: xr.Dataset, name: str) -> Iterator[str]:
    """Yield the sections of the page of a result."""
    fits = {
        title: result.attrs[key]
        for key, title in (
            ("analytic_fit", "Analytical"), ("monte_carlo_fit", "Monte Carlo"),
        )
        if isinstance(result.attrs.get(key), Mapping)
    }  # fmt: skip
    sentences = [_what(result), *what_was_swept(result), _how_sure(result)]
    if fits:
        sentences = [*fit_summary(fits), sentences[-1]]
    yield html.section("Summary", html.paragraph(" ".join(sentences)), facts(result, name))
    if "theta_s" in mueller(result)[0].dims:
        layers = fitted_layers(result)
        if layers is None:
            layers = layers_of(result)
        else:
            layers = with_readings(layers, scan_of(result))
        tables = [cuts(result), *([points(result)] if "design" in result.attrs else [])]
        yield html.section(
            "Hemisphere", hemisphere_view(layers), *(html.download(*one) for one in tables)
        )
    for title, fit in fits.items():
        yield html.section(f"{title} fit", *_fit(fit))
    notes = result.attrs.get("warnings") or []
    if notes:
        yield html.section("Warnings", html.bullets(map(str, notes)))
    yield origin(result.attrs.get("made_by"), result)


def fit_summary(fits: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Return the verdict, the answer and where it is held, a sentence each."""
    title = list(fits)[-1]
    answer = fits[title]
    verdict = answer["misfit"]["verdict"]
    said = [
        f"The {title} curve follows the scan with the verdict “{verdict}”: {_why(answer)} "
        f"({answer['dof']} degrees of freedom; the rule stands below)."
    ]
    values = ", ".join(
        f"{name} {_estimate(one)}" for name, one in answer["parameters"].items()
    )
    said.append(
        f"The answer is the column {title}, which has all bounces: {values}; it is held in "
        "result.nc, attribute monte_carlo_fit."
    )
    if "Analytical" in fits and title != "Analytical":
        other = ", ".join(
            f"{name} {_estimate(one)}"
            for name, one in fits["Analytical"]["parameters"].items()
        )
        said[-1] = said[-1].rstrip(".") + (
            f"; model.toml holds the analytical fit instead, for programs that take a "
            f"formula: {other}."
        )
    return said


def _why(fit: Mapping[str, Any]) -> str:
    """Return how far the readings lie from the curve."""
    size = [
        ("median_deviation", 100, "half of the readings are off by more than {:.2g} %"),
        ("worst_deviation", 100, "the worst by {:.2g} %"),
        ("rms_in_stderr", 1, "the residuals are {:.2g} standard errors rms"),
    ]
    said = [
        words.format(factor * fit["misfit"][name])
        for name, factor, words in size
        if fit["misfit"].get(name) is not None
    ]
    return ", ".join(said) or "its size is not known"


def facts(result: xr.Dataset, name: str) -> str:
    """Return a table of date, sample, incidences and wavelengths."""
    rows = [
        ("sample", name),
        ("report written", f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC"),
        ("scene", scene_of(result) or result.attrs.get("source") or _scene_file(result)),
    ]
    if "theta_i" in result.coords:
        angles = np.rad2deg(np.unique(result.theta_i.values))
        rows.append(("incidence [deg]", ", ".join(f"{a:.4g}" for a in angles)))
    waves = np.atleast_1d(result.coords.get("wavelength", []))
    listed = ", ".join(f"{w:.6g}" for w in waves)
    rows.append(("wavelength [um]", listed or "not given"))
    rows.append(("program", f"pbrdf {result.attrs.get('version', __version__)}"))
    return html.table(("", ""), rows)


def correlations(names: list[str], matrix: Any) -> str:
    """Return the correlations of fitted parameters as a table."""
    rows = [
        (name, *("unknown" if v is None else f"{float(v):.2f}" for v in row))
        for name, row in zip(names, matrix, strict=True)
    ]
    return html.table(("correlation", *names), rows)


def glossary(sections: Sequence[str]) -> str:
    """Return a section with every symbol that these sections use."""
    used = _CODE.sub("", " ".join(sections))
    rows = [row for *row, sign in _GLOSSARY if re.search(sign, used)]
    return html.section("Glossary", html.table(("symbol", "unit", "meaning"), rows))


def _scene_file(result: xr.Dataset) -> str:
    """Name the file of the scene among the inputs, where the scene itself is not held."""
    record = result.attrs.get("made_by")
    inputs = record.get("inputs", ()) if isinstance(record, Mapping) else ()
    names = [str(one["name"]) for one in inputs if one.get("role") == "scene"]
    return f"that of {', '.join(names)}, see below" if names else "not recorded"


def origin(record: Any, result: xr.Dataset | None = None) -> str:
    """Return inputs with their hashes, and the command that makes the result again."""
    if not isinstance(record, Mapping):
        seed = (
            "" if result is None else f" Seed {result.attrs.get('seed', 'not recorded')}."
        )
        scene = "" if result is None else str(result.attrs.get("scene", ""))
        if result is not None and isinstance(result.attrs.get("sweep"), Mapping):
            scene = json.dumps(result.attrs["sweep"], indent=2)
        text = f"<pre>{escape(scene)}</pre>" if scene else ""
        told = html.paragraph(f"Simulated from the scene below.{seed}")
        if result is not None and "design" in result.attrs:
            told = html.paragraph("Computed by `pbrdf sweep` from what stands below.")
        return html.section("How to make it again", told, text)
    files = [
        (one["role"], one["name"], one.get("sha256", "an entry of a database"))
        for one in record["inputs"]
    ]
    told = html.bullets(f"{name}: {value}" for name, value in record["options"].items())
    if record.get("typed"):
        told = f"<pre>{escape(shlex.join(map(str, record['typed'])))}</pre>"
    return html.section(
        "How to make it again",
        html.table(("input", "file", "SHA-256"), files),
        told,
        html.paragraph(
            f"Made by {record['program']}, command {record['command']}. The inputs are "
            "those with the hashes above."
        ),
    )


def _what(result: xr.Dataset) -> str:
    value, _ = mueller(result)
    scene = scene_of(result)
    of = f" of a {scene}" if scene else ""
    count = value.sizes.get("theta_i", 1)
    return f"This is the simulated reflectance{of} at {count} incidence{'s'[: count - 1]}."


def _how_sure(result: xr.Dataset) -> str:
    one = element(result, "M00")
    if one.stderr is None:
        return "The result holds no errors."
    lit = (one.value > 0.1 * float(one.value.max())).values
    part = 100 * one.stderr.values[lit] / one.value.values[lit]
    return (
        f"Above a tenth of its peak M00 is known to {_percent(np.nanmedian(part))} in "
        f"the median bin and {_percent(np.nanmax(part))} in the worst (one standard error)."
    )


def _percent(part: float) -> str:
    """Return a percentage without a power of ten."""
    return f"{part:.2g} %" if part < 99.5 else f"{part:.0f} %"


def _estimate(one: Mapping[str, Any]) -> str:
    value, error = one["value"], one["stderr"]
    if value is None or error is None:
        return "not determined"
    return f"{value:.4g} ± {error:.2g}"


def _fit(fit: Mapping[str, Any]) -> Iterator[str]:
    rows = [(name, _estimate(one)) for name, one in fit["parameters"].items()]
    rows += [("misfit", str(fit["misfit"]["verdict"])), ("noise", str(fit["noise"]))]
    yield html.table(("parameter", "value ± standard error"), rows)
    yield correlations(list(fit["parameters"]), fit["correlation"])
    yield html.paragraph(f"Verdicts: {RULE}.")
    yield html.bullets(map(str, fit["warnings"]))


def scan_of(result: xr.Dataset) -> xr.Dataset | None:
    """Return the scan in the plane that a pipeline's result holds, None where it has none.

    A relative scan is left out: its scale belongs to a fit.
    """
    names = [str(n) for n in result.data_vars if str(n).startswith("scan_")]
    fit = result.attrs.get("monte_carlo_fit")
    relative = isinstance(fit, Mapping) and any(
        name.startswith(("scale", "background")) for name in fit["parameters"]
    )
    if not names or relative:
        return None
    scan = result[names].rename({name: name.removeprefix("scan_") for name in names})
    angles = [n for n in ("theta_i", "theta_s", "dphi", "phi_i") if n in scan]
    return in_plane(scan.drop_vars("theta_view", errors="ignore").set_coords(angles))


def cuts(result: xr.Dataset) -> tuple[str, str, str]:
    """Return name, text and words of a table of the cuts in the plane."""
    value, stderr = mueller(result)
    table = in_plane(light(value, stderr))
    columns = {}
    for name in [n for n in ("M00", "M10", "M20") if _holds(table, n)]:
        columns[name], error = element(table, name)
        if error is not None:
            columns[f"{name}_stderr"] = error
    frame = xr.Dataset(columns).to_dataframe().reset_index()
    for angle in [c for c in ("theta_i", "theta_view", "phi_i") if c in frame]:
        frame[angle] = np.rad2deg(frame[angle])
    frame = frame.rename(
        columns={
            "theta_i": "theta_i_deg", "theta_view": "theta_view_deg", "phi_i": "phi_i_deg",
            "wavelength": "wavelength_um",
        }
    )  # fmt: skip
    text = frame.to_csv(index=False, float_format="%.6g")
    return (
        "in_plane.csv",
        text,
        "Download the simulation in the plane of incidence (CSV)",
    )


def _holds(result: xr.Dataset, name: str) -> bool:
    return "IQUV"[int(name[1])] in mueller(result)[0].stokes_out.values

"""The first look as files: model.toml, figures and a page that says what is missing."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import data_io
from fitting.checks.unread import what_hangs_together, what_is_not_read
from fitting.report import explorer, html
from fitting.report.fit_files import calibrated
from fitting.report.surface import edge_figure, surface_figure
from fitting.result.misfit import RULE
from pbrdf.plots import scan_figure

if TYPE_CHECKING:
    from fitting.quick import QuickResult

__all__ = ["write_quick"]


def write_quick(
    result: "QuickResult",
    folder: Path,
    *,
    record: Mapping[str, Any],
    picture: Path | None = None,
) -> None:
    """Write model.toml, the figures and report.html into an existing folder."""
    fit = result.analytic
    scan = calibrated(fit, next(iter(fit.models)), float("nan"), result.measurement)
    figures = {
        "scan.png": html.png(scan_figure(data_io.in_plane(scan), result.curves)),
        "surface.png": html.png(surface_figure(result.surface, result.statistics)),
    }
    if picture is not None and isinstance(result.surface, data_io.EdgeProfile):
        figures["edge.png"] = html.png(edge_figure(picture, result.surface))
    for name, image in figures.items():
        (folder / name).write_bytes(image)
    notes = {
        "uncertainty": {name: dict(e.as_dict()) for name, e in fit.estimates.items()},
        "held": fit.held,
        "misfit": {"verdict": fit.misfit.verdict, "in_words": str(fit.misfit)},
        "made_by": dict(record),
    }
    data_io.write_model(fit.model, folder / "model.toml", notes=notes)
    sections = list(_sections(result, figures, record))
    page = html.page("First look", [*sections, explorer.glossary(sections)])
    (folder / "report.html").write_text(page, encoding="utf-8")


def _sections(
    result: "QuickResult", figures: Mapping[str, bytes], record: Mapping[str, Any]
) -> Iterator[str]:
    fit = result.analytic
    yield html.section(
        "Summary",
        html.paragraph(
            f"The analytical curve follows the scan with the verdict "
            f"“{fit.misfit.verdict}”: {fit.misfit.size}. Nothing was simulated: light of "
            "several bounces is missing; the gains make up for it. The command without "
            "--quick says how much that matters."
        ),
        html.table(
            ("parameter", "value ± standard error, 95 % interval"),
            [(name, str(estimate)) for name, estimate in fit.estimates.items()],
        ),
        html.paragraph(f"Verdicts: {RULE}."),
        html.figure(figures["scan.png"], "Scan and analytical curve; below, residuals."),
        explorer.correlations(list(fit.values), fit.correlation),
    )
    edge = figures.get("edge.png")
    yield html.section(
        "Surface",
        html.table(
            ("quantity", "unit", "value", "standard error", "95 % from", "to"),
            result.statistics.table(),
        ),
        html.bullets(result.statistics.warnings),
        "" if edge is None else html.figure(edge, "The edge as it was read."),
        html.figure(figures["surface.png"], "The surface and its statistics."),
    )
    yield html.section("What these data cannot tell", html.told(_unknown(result)))
    yield explorer.origin(record)


def _unknown(result: "QuickResult") -> tuple[str, ...]:
    """Name what these data cannot tell."""
    fit = result.analytic
    return (
        *what_is_not_read(result.measurement, result.statistics),
        *what_hangs_together(fit),
        *fit.warnings,
    )

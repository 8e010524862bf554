"""A small sweep computed in memory, without a store."""

from collections.abc import Callable

import xarray as xr

from pbrdf.sweeps.description import Sweep
from pbrdf.sweeps.layout import STATE, Layout
from pbrdf.sweeps.memory import check_sweep
from pbrdf.sweeps.report import Report
from pbrdf.sweeps.store import Mark, said
from pbrdf.sweeps.tasks import compute
from pbrdf.tracer.arguments import worker_count

__all__ = ["computed"]


def computed(
    sweep: Sweep,
    *,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[xr.Dataset, Report]:
    """Compute a sweep into one dataset; the report tells warnings and failures."""
    layout = Layout.of(sweep)
    check_sweep(sweep, layout, 0, worker_count(workers))
    held = layout.empty(tuple(layout.sizes.values()))
    report = Report()
    for group in range(layout.n_groups):
        block, mark = compute(sweep, layout, group, worker_count(workers))
        for name, values in block.items():
            held[name][layout.region(group)] = values
        report.add(Mark(digest="", **mark))
        if progress is not None:
            progress(group + 1, layout.n_groups)
    dataset = xr.Dataset(
        {
            name: ((*layout.sizes, *v.dims), held[name], v.attrs)
            for name, v in layout.variables.items()
            if name != STATE or report.errors
        },
        layout.coords,
        attrs={
            "design": sweep.design.kind,
            "sweep": sweep.document,
            "warnings": said(report.warnings),
        },
    )
    return dataset.reset_coords("projected_solid_angle"), report

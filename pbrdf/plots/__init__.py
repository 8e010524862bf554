"""Figures of results, scans and surfaces, in one orientation and one look.

Forward is to the right, the source on the left. matplotlib is imported when a figure is
drawn. Each function returns a matplotlib Figure that belongs to no window system:
`figure.savefig("name.pdf")` writes it, as vectors where the suffix says so.
"""

from pbrdf.plots.cuts import plane_cuts
from pbrdf.plots.polar import hemisphere
from pbrdf.plots.scans import scan_figure
from pbrdf.plots.sheet import COLOURS, WIDTHS, new_figure

__all__ = [
    "COLOURS", "WIDTHS", "hemisphere", "new_figure", "plane_cuts",
    "scan_figure",
]  # fmt: skip

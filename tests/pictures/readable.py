"""What makes a figure readable as printed: letters on the sheet, none over others."""

from itertools import combinations
from unittest.mock import patch

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

# Letters may touch by so much [pt]
_TOUCH = 1.0


def unreadable(figure) -> list[str]:
    """Return what is wrong with the letters of a figure, nothing where all is well."""
    point, sheet = figure.dpi / 72, figure.bbox
    boxes = drawn(figure)
    found = []
    for words, box in boxes:
        out = max(
            sheet.x0 - box.x0, box.x1 - sheet.x1, sheet.y0 - box.y0, box.y1 - sheet.y1
        )
        if out > _TOUCH * point:
            found.append(f"{words!r} leaves the sheet by {out / point:.0f} pt")
    for (first, a), (second, b) in combinations(boxes, 2):
        wide = min(a.x1, b.x1) - max(a.x0, b.x0)
        high = min(a.y1, b.y1) - max(a.y0, b.y0)
        if min(wide, high) > _TOUCH * point:
            found.append(
                f"{first!r} and {second!r} overlap by {min(wide, high) / point:.0f} pt"
            )
    return found


def drawn(figure) -> list[tuple[str, object]]:
    """Return the words that are drawn, and where [pixel]."""
    canvas = FigureCanvasAgg(figure)
    boxes = []
    draw = Text.draw

    def noted(text, renderer, *rest, **options):
        draw(text, renderer, *rest, **options)
        if text.get_visible() and text.get_text().strip():
            boxes.append((text.get_text(), text.get_window_extent(renderer)))

    with patch.object(Text, "draw", noted):
        canvas.draw()
    return boxes

"""Pieces of a web page that needs no other file: tables, figures, paragraphs."""

import base64
from collections.abc import Iterable, Sequence
from html import escape
from io import BytesIO
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = [
    "bullets",
    "download",
    "figure",
    "page",
    "paragraph",
    "png",
    "section",
    "table",
    "told",
]

# Of figures that are embedded [dots an inch], and how wide an inch is shown [px]: letters
# of 7 pt, the smallest of a figure, are then 12 px high
_DPI = 200
_INCH = 124

_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 62rem; margin: 2rem auto;
       padding: 0 1rem; color: #222; overflow-wrap: anywhere; }
h1 { font-size: 1.6rem; } h2 { font-size: 1.2rem; margin-top: 2.2rem; }
.wide { overflow-x: auto; overflow-wrap: normal; }
.wide.more { border-right: 3px solid #D55E00; }
.wide.more::before { content: "↔ scroll sideways for the rest"; display: block;
       position: sticky; left: 0; width: max-content; color: #8a3d00; font-size: 15px; }
.long { overflow-wrap: anywhere; min-width: 16rem; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: .25rem .9rem .25rem 0; border-bottom: 1px solid #ddd;
         min-width: 4rem; vertical-align: top; }
th { font-weight: 600; } figure { margin: 1rem 0; }
figcaption, .note { color: #444; font-size: 15px; }
pre { font-size: 14px; white-space: pre-wrap; background: #f4f4f4; padding: .6rem; }
.viewer { display: flex; flex-wrap: wrap; gap: 1rem; align-items: center; }
#disc, #cut { touch-action: pan-y; cursor: crosshair; }
.controls label { display: inline-block; margin: 0 1rem .5rem 0; }
select, button { font: inherit; max-width: 100%; }
#value { font-weight: 600; min-height: 3em; }
@media print {
  .wide.more { border: 0; } .wide.more::before { content: none; }
  body { max-width: none; margin: 0; } .controls, button { display: none; }
  img { max-width: 100%; height: auto; }
  h2 { break-after: avoid; } table, figure, .viewer { break-inside: avoid; }
}
"""

# Tables and figures that are wider than the screen say so
_CUE = (
    'const cue = () => document.querySelectorAll(".wide").forEach((e) => '
    'e.classList.toggle("more", e.scrollWidth > e.clientWidth + 1)); '
    'addEventListener("load", cue); addEventListener("resize", cue);'
)
# Longer words, hashes among them, may break
_LONG = 30


def page(title: str, sections: Iterable[str]) -> str:
    """Return a whole HTML page."""
    body = "\n".join([*sections, f"<script>{_CUE}</script>"])
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title><style>{_STYLE}</style></head>\n"
        f"<body><h1>{escape(title)}</h1>\n{body}\n</body></html>\n"
    )


def section(title: str, *parts: str) -> str:
    """Return a heading and what stands under it."""
    return "\n".join([f"<h2>{escape(title)}</h2>", *parts])


def paragraph(text: str) -> str:
    """Return one paragraph of plain text."""
    return f"<p>{escape(text)}</p>"


def bullets(texts: Iterable[str]) -> str:
    """Return a list of plain texts."""
    return "<ul>" + "".join(f"<li>{escape(text)}</li>" for text in texts) + "</ul>"


def told(texts: Iterable[str]) -> str:
    """Return a list of plain texts, or that there is nothing to say."""
    listed = list(texts)
    return bullets(listed) if listed else paragraph("Nothing that this fit can see.")


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table of plain texts."""
    head = "".join(f"<th>{escape(cell)}</th>" for cell in header)
    body = "\n".join("<tr>" + "".join(map(_cell, row)) + "</tr>" for row in rows)
    return (
        f'<div class="wide" tabindex="0"><table><thead><tr>{head}</tr></thead>\n'
        f"<tbody>{body}</tbody></table></div>"
    )


def _cell(text: str) -> str:
    """Return a cell; only words too long for any screen may break in it."""
    long = any(len(word) > _LONG for word in text.split())
    return f"<td{' class=long' if long else ''}>{escape(text)}</td>"


def png(drawing: "Figure") -> bytes:
    """Return a matplotlib figure as the bytes of a PNG file."""
    buffer = BytesIO()
    drawing.savefig(buffer, format="png", dpi=_DPI)
    return buffer.getvalue()


def figure(image: bytes, caption: str) -> str:
    """Return a PNG of `png` embedded with its caption; on a small screen it scrolls."""
    data = base64.b64encode(image).decode("ascii")
    # Bytes 16 to 19 of a PNG are its width
    width = int.from_bytes(image[16:20]) * _INCH // _DPI
    return (
        f'<figure><div class="wide" tabindex="0"><img alt="{escape(caption)}" '
        f'style="width:{width}px" src="data:image/png;base64,{data}"></div>'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
    )


def download(name: str, text: str, words: str) -> str:
    """Return a link that holds a text as a file."""
    data = base64.b64encode(text.encode()).decode("ascii")
    return (
        f'<p><a download="{escape(name)}" href="data:text/plain;base64,{data}">'
        f"{escape(words)}</a></p>"
    )

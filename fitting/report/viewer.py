"""The hemisphere as a viewer in a page: data, controls and the script that draws them."""

import base64
import json
from html import escape
from importlib.resources import files
from itertools import product
from typing import Any

import numpy as np
import xarray as xr

from pbrdf.derived import element
from pbrdf.derived.elements import mueller
from pbrdf.derived.places import in_words
from pbrdf.plots.limits import reach_of

__all__ = ["hemisphere_view"]

_ELEMENTS = ("M00", "M10", "M20", "DOLP")
_BINS = ("theta_s", "dphi", "stokes_out", "stokes_in")
# Bytes that the data of a page may take, before their encoding
_MOST = 2_600_000
_COLOURS = 33


def hemisphere_view(result: xr.Dataset) -> str:
    """Return a section's content: pictures over the hemisphere and in the plane.

    Where a result holds more hemispheres than a page can carry, some are chosen evenly and
    the page says how many are left out.
    """
    value, _ = mueller(result)
    names = _ELEMENTS if value.sizes["stokes_out"] >= 3 else _ELEMENTS[:1]
    dims = [str(d) for d in value.dims if d not in _BINS]
    places = list(product(*(range(value.sizes[d]) for d in dims)))
    size = 8 * value.sizes["theta_s"] * value.sizes["dphi"] * len(names)
    fit = max(1, _MOST // size)
    chosen = places
    if len(places) > fit:
        chosen = [
            places[k] for k in np.linspace(0, len(places) - 1, fit).round().astype(int)
        ]
    held: dict[str, Any] = {
        "n_theta": value.sizes["theta_s"],
        "n_dphi": value.sizes["dphi"],
        "elements": [
            {
                "name": n,
                "unit": "1" if n == "DOLP" else "1/sr",
                "signed": n in ("M10", "M20"),
            }
            for n in names
        ],
        "places": [
            _place(result, dict(zip(dims, at, strict=True)), names) for at in chosen
        ],
        "rising": _colours("cividis"),
        "signed": _colours("RdBu_r"),
    }
    left = len(places) - len(chosen)
    note = f"<p>{left} of {len(places)} hemispheres are left out.</p>" if left else ""
    text = json.dumps(held, allow_nan=False).replace("<", "\\u003c")
    script = (files("fitting.report") / "viewer.js").read_text(encoding="utf-8")
    controls = "".join(
        f'<label>{escape(words)} <select id="pick-{name}">{options}</select></label> '
        for name, words, options in (
            ("element", "Element", ""),
            ("place", "Where", ""),
            (
                "scale",
                "Scale",
                '<option value="linear">linear</option>'
                '<option value="log">logarithmic</option>',
            ),
        )
    )
    return (
        f'<div class="controls">{controls}</div>{note}\n'
        '<div class="viewer"><canvas id="disc" width="420" height="420" role="img" '
        'aria-label="Hemisphere, forward to the right"></canvas>'
        '<canvas id="cut" width="520" height="320" role="img" '
        'aria-label="Cut in the plane of incidence"></canvas></div>\n'
        '<p id="value" aria-live="polite">Point at the hemisphere to read a value.</p>\n'
        '<p class="note">★ source, + specular direction; forward to the right, seen from '
        "above. Striped: below two standard errors; grey: not known. The cut is in the "
        "plane of incidence, forward positive, with bars of two standard errors.</p>\n"
        f'<script type="application/json" id="hemisphere-data">{text}</script>\n'
        f"<script>{script}</script>"
    )


def _place(
    result: xr.Dataset, at: dict[str, int], names: tuple[str, ...]
) -> dict[str, Any]:
    here = result.isel(at)
    layers = []
    for name in names:
        found = element(here, name)
        value = found.value.transpose("theta_s", "dphi").values
        error = None
        if found.stderr is not None:
            error = found.stderr.transpose("theta_s", "dphi").values
        top = reach_of(value, error)
        layers.append([_packed(value), None if error is None else _packed(error), top])
    words = [
        f"{'incidence' if d == 'theta_i' else d} {in_words(d, here[d].values)}" for d in at
    ]
    angle = float(np.rad2deg(here.theta_i)) if "theta_i" in here.coords else 0.0
    return {"name": ", ".join(words) or "all", "theta_i_deg": angle, "layers": layers}


def _packed(values: np.ndarray) -> str:
    """Return single precision, little endian, in base 64."""
    return base64.b64encode(values.astype("<f4").tobytes()).decode("ascii")


def _colours(name: str) -> list[list[int]]:
    from matplotlib import colormaps

    table = colormaps[name](np.linspace(0, 1, _COLOURS))[:, :3]
    return np.round(255 * table).astype(int).tolist()

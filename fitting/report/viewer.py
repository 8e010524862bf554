"""The hemisphere as a viewer in a page: data, controls and the script that draws them."""

import base64
import json
from collections.abc import Iterator
from html import escape
from importlib.resources import files
from typing import Any

import numpy as np
import xarray as xr

from fitting.report.layers import Layers
from pbrdf.derived import element
from pbrdf.derived.places import in_words
from pbrdf.plots.limits import reach_of

__all__ = ["hemisphere_view"]

_ELEMENTS = ("M00", "M10", "M20", "DOLP", "AOLP")
_BINS = ("theta_s", "dphi", "stokes_out", "stokes_in")
_WORDS = {"theta_i": "Incidence", "wavelength": "Wavelength", "phi_i": "Source azimuth"}
# Bytes that the data of a page may take, before their encoding
_MOST = 2_600_000
# A value takes two bytes: 11 bits, three digits
_BYTES = 2
_COLOURS = 33
_READINGS = ("M00", "M10", "M20", "DOLP")


def hemisphere_view(layers: Layers) -> str:
    """Return a section's content: pictures over the hemisphere and in the plane.

    Where a result holds more hemispheres than a page can carry, the light by bounces is
    left out first; then places are chosen evenly. The page says what it leaves out.
    """
    whole = layers.bounces["all"].brdf_total
    names = _ELEMENTS if whole.sizes["stokes_out"] >= 3 else _ELEMENTS[:1]
    places = [str(d) for d in whole.dims if d not in _BINS]
    chosen, bounces, notes = _fitting(layers, places, len(names))
    at = [
        dict(zip(places, index, strict=True))
        for index in np.ndindex(*(len(c) for c in chosen))
    ]
    at = [{d: int(chosen[places.index(d)][k]) for d, k in one.items()} for one in at]
    held: dict[str, Any] = {
        "n_theta": whole.sizes["theta_s"],
        "n_dphi": whole.sizes["dphi"],
        "elements": [_about(name) for name in names],
        "dims": [
            {
                "name": d,
                "words": _WORDS.get(d, d),
                "values": [in_words(d, whole[d].values[k]) for k in picked],
            }
            for d, picked in zip(places, chosen, strict=True)
        ],
        "theta_i_deg": [_incidence(whole, one) for one in at],
        "bounces": bounces,
        "monte_carlo": [
            [_packed(layers.bounces[b].isel(one), names) for b in bounces] for one in at
        ],
        "model": None
        if layers.model is None
        else [_packed(layers.model.isel(one), names) for one in at],
        "readings": [_readings(layers, whole, one) for one in at],
        "rising": _colours("cividis"),
        "signed": _colours("RdBu_r"),
        "angle": _colours("twilight"),
    }
    return _page(held, [*notes, layers.words])


def _fitting(
    layers: Layers, places: list[str], n_names: int
) -> tuple[list[np.ndarray], list[str], list[str]]:
    """Return the places of each dimension and the bounces that a page can carry."""
    whole = layers.bounces["all"].brdf_total
    cell = _BYTES * whole.sizes["theta_s"] * whole.sizes["dphi"] * n_names
    bounces, notes = list(layers.bounces), []
    counts = [whole.sizes[d] for d in places]
    shared = 0 if layers.model is None else 1
    if np.prod(counts) * cell * (2 * len(bounces) + shared) > _MOST and len(bounces) > 1:
        bounces = ["all"]
        notes.append("Light by bounces is left out to keep the page small.")
    one = cell * (2 * len(bounces) + shared)
    while np.prod(counts) * one > _MOST and max(counts, default=1) > 1:
        counts[int(np.argmax(counts))] -= 1
    chosen = []
    for name, count in zip(places, counts, strict=True):
        size = whole.sizes[name]
        chosen.append(np.linspace(0, size - 1, count).round().astype(int))
        if count < size:
            notes.append(f"{count} of {size} values of {name} are shown.")
    return chosen, bounces, notes


def _page(held: dict[str, Any], notes: list[str]) -> str:
    text = json.dumps(held, allow_nan=False).replace("<", "\\u003c")
    script = (files("fitting.report") / "viewer.js").read_text(encoding="utf-8")
    scales = (
        '<option value="auto">automatic</option><option value="linear">linear</option>'
        '<option value="log">logarithmic</option>'
    )
    controls = "".join(
        f'<label>{escape(words)} <select id="pick-{name}">{options}</select></label> '
        for name, words, options in _controls(held, scales)
    )
    note = "".join(f'<p class="note">{escape(one)}</p>' for one in notes if one)
    return (
        f'<div class="controls">{controls}</div>\n'
        '<div class="viewer"><div><canvas id="disc" tabindex="0" role="img" '
        'aria-label="Hemisphere, forward to the right; arrow keys move the mark"></canvas>'
        '<br><canvas id="scale" role="img" aria-label="Colour scale"></canvas></div>'
        '<canvas id="cut" role="img" '
        'aria-label="Cut in the plane of incidence"></canvas></div>\n'
        '<p id="value" aria-live="polite">Point at the hemisphere or the cut to read a '
        "value.</p>\n"
        '<p><button type="button" id="download">Download what is shown (CSV)</button></p>\n'
        '<p class="note">★ source, + specular direction; forward to the right, seen from '
        "above. Striped: below two standard errors; grey: not known. The cut is in the "
        "plane of incidence, forward positive, with bars of two standard errors, cut off "
        f"at the frame where they are longer than the curve is high.{_drawn(held)}</p>\n"
        f'{note}\n<script type="application/json" id="hemisphere-data">{text}</script>\n'
        f"<script>{script}</script>"
    )


def _drawn(held: dict[str, Any]) -> str:
    """Say what else a picture holds."""
    words = []
    if held["model"] is not None:
        words.append("Dashed: the analytical model.")
    if any(held["readings"]):
        words.append("Diamonds: the scan.")
    if any(d["name"] == "state" and "dry" in d["values"] for d in held["dims"]):
        words.append("Choose a wet state, and at Show “minus dry”, for what water changes.")
    return "".join(f" {one}" for one in words)


def _controls(held: dict[str, Any], scales: str) -> Iterator[tuple[str, str, str]]:
    yield "element", "Element", ""
    for number, one in enumerate(held["dims"]):
        yield f"dim{number}", one["words"], ""
    if len(held["bounces"]) > 1:
        yield "bounces", "Bounces", ""
    yield "show", "Show", ""
    yield "scale", "Scale", scales


def _about(name: str) -> dict[str, str]:
    if name == "AOLP":
        return {"name": name, "unit": "deg", "kind": "angle"}
    kind = "signed" if name in ("M10", "M20") else "rising"
    return {"name": name, "unit": "1" if name == "DOLP" else "1/sr", "kind": kind}


def _incidence(value: xr.DataArray, at: dict[str, int]) -> float:
    here = value.isel(at)
    return float(np.rad2deg(here.theta_i)) if "theta_i" in here.coords else 0.0


def _packed(light: xr.Dataset, names: tuple[str, ...]) -> list[Any]:
    """Return [values, errors or null, reach] of each element."""
    layers = []
    for name in names:
        found = element(light, name)
        factor = 180 / np.pi if name == "AOLP" else 1.0
        value, error = (
            None if one is None else factor * one.transpose("theta_s", "dphi").values
            for one in found
        )
        assert value is not None
        layers.append(
            [_half(value), None if error is None else _half(error), reach_of(value, error)]
        )
    return layers


def _half(values: np.ndarray) -> list[Any]:
    """Return [factor, text]: half precision times a factor, little endian, in base 64."""
    known = np.abs(values[np.isfinite(values)])
    top = float(known.max()) if known.size and known.max() > 0 else 1.0
    factor = top / 32768.0
    data = (values / factor).astype("<f2").tobytes()
    return [factor, base64.b64encode(data).decode("ascii")]


def _readings(
    layers: Layers, whole: xr.DataArray, at: dict[str, int]
) -> dict[str, list[list[float | None]]]:
    """Return [view angle in degrees, value, error] of the scan at a place, by element."""
    scan = layers.readings
    if scan is None or set(at) - {"theta_i"}:
        return {}
    theta_i = float(whole.isel(at).theta_i)
    rows = np.flatnonzero(np.isclose(scan.theta_i.values, theta_i, atol=1e-6))
    scan = scan.isel(geometry=rows)
    found = {}
    for name in (n for n in _READINGS if n in scan):
        error = scan.get(f"{name}_stderr")
        table = zip(
            np.rad2deg(scan.theta_view.values).tolist(),
            scan[name].values.tolist(),
            [None] * rows.size if error is None else error.values.tolist(),
            strict=True,
        )
        found[name] = [
            [None if v is None or not np.isfinite(v) else v for v in row] for row in table
        ]
    return found


def _colours(name: str) -> list[list[int]]:
    from matplotlib import colormaps

    table = colormaps[name](np.linspace(0, 1, _COLOURS))[:, :3]
    return np.round(255 * table).astype(int).tolist()

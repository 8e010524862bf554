"""Make the pages that follow from the code: gallery, notebooks, API reference, changelog.

Run by `make docs` before the site is built.
"""

import importlib
import inspect
from pathlib import Path

import numpy as np
import xarray as xr

import data_io
import pbrdf
from docs.name_tables import PAGE, renewed
from docs.notebook_pages import NOTEBOOKS, page
from fitting import surface_statistics
from fitting.models.cuts import plane_curves
from fitting.report.surface import surface_figure
from pbrdf.dew import DRY, compare_dew
from pbrdf.plots import hemisphere, plane_cuts, scan_figure
from pbrdf.plots.bodies import scene_picture

DOCS = Path(__file__).parent
SURFACE = pbrdf.GaussianSurface(
    shape=(64, 64), spacing=1.0, corr_length=8.0, slope_rms=0.25
)
PACKAGES = {
    "pbrdf": "Surfaces, scenes, simulation and the analytical model.",
    "pbrdf.materials": "Optical constants by name or from a file.",
    "pbrdf.accessor": "`ds.pbrdf`: what one wants of a result.",
    "pbrdf.plots": "Figures.",
    "pbrdf.optics.exchange": "Conventions of other programs.",
    "fitting": "Statistics, fits, predictions, the pipeline.",
    "data_io": "Files in and out.",
}


def main() -> None:
    """Write everything that is made."""
    (DOCS / "gallery").mkdir(exist_ok=True)
    entries = []
    for name, (title, command, figure) in pictures().items():
        figure.savefig(DOCS / "gallery" / f"{name}.png", dpi=150)
        entries.append(f"## {title}\n\n`{command}`\n\n![{title}](gallery/{name}.png)\n")
    head = "# Gallery\n\nEvery kind of picture, drawn from small runs with this site.\n"
    (DOCS / "gallery.md").write_text("\n".join([head, *entries]), encoding="utf-8")
    for notebook in sorted(NOTEBOOKS.glob("*.ipynb")):
        text = page(notebook, DOCS / "gallery")
        (DOCS / f"notebook_{notebook.stem}.md").write_text(text, encoding="utf-8")
    (DOCS / "api.md").write_text(reference(), encoding="utf-8")
    PAGE.write_text(renewed(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    log = (DOCS.parent / "CHANGELOG.md").read_text(encoding="utf-8")
    (DOCS / "changelog.md").write_text(log, encoding="utf-8")


def pictures() -> dict:
    """Title, command and figure of each kind of picture."""
    angles = np.deg2rad([30.0, 60.0])
    ds = pbrdf.simulate(
        pbrdf.Scene(SURFACE, pbrdf.Material(1.5)), angles, phi_i="uniform", fold=True,
        n_rays=4000, realizations=16, n_theta=18, n_dphi=36, stokes="linear", seed=4,
    )  # fmt: skip
    dew = compare_dew(
        SURFACE, pbrdf.Material(1.5, diffuse_albedo=0.1), [np.deg2rad(70.0)], angles[:1],
        amount={"volume_per_area": 1.0, "number_density": 2e-3}, runs=4, n_rays=1000,
        n_theta=12, n_dphi=24, water=pbrdf.Material(1.333, name="water"),
    )  # fmt: skip
    heights = SURFACE.sample(3)
    drops = pbrdf.Drops(
        contact_angle=np.deg2rad(80.0), coverage=0.2, number_density=2e-3, seed=2
    )
    first = {"theta_i": angles[1]}
    return {
        "hemisphere": (
            "Hemisphere",
            "pbrdf plot result.nc --theta-i-deg 60",
            hemisphere(ds, ("M00", "M10", "DOLP"), places=first),
        ),
        "errors": (
            "Hemisphere with its errors",
            "pbrdf plot result.nc --errors --elements M00,M10,M20",
            hemisphere(ds, ("M00", "M10", "M20"), errors=True, places=first),
        ),
        "cuts": (
            "Cuts in the plane of incidence, as the paper's Fig. 5",
            "pbrdf plot result.nc --in-plane",
            plane_cuts(ds),
        ),
        "column": (
            "One column of a journal",
            "pbrdf plot result.nc --width-mm 85 --elements M00,DOLP",
            hemisphere(ds, ("M00", "DOLP"), width_mm=85.0, places=first),
        ),
        "dew": (
            "Wet, dry and the difference, as the paper's Fig. 10",
            "pbrdf plot dew.nc --minus dry --elements M00,DOLP",
            hemisphere(dew.isel(theta_i=0), ("M00", "DOLP"), minus=DRY),
        ),
        "scan": (
            "A scan beside its model",
            "pbrdf fit scan.csv ... -o folder",
            scan_figure(*scan()),
        ),
        "surface": (
            "A surface",
            "pbrdf statistics map.npy --figure surface.png",
            surface_figure(heights, surface_statistics(heights)),
        ),
        "drops": (
            "A scene with drops",
            "pbrdf plot scene.toml -o scene.png",
            scene_picture(pbrdf.Scene(SURFACE, "pvc", drops), seed=2),
        ),
    }


def scan() -> tuple[xr.Dataset, xr.Dataset]:
    """Return a scan made of a model and noise, and the curve of another model."""
    view = np.deg2rad(np.arange(-70.0, 71.0, 5.0))
    theta_i = np.deg2rad(np.repeat([30.0, 60.0], view.size))
    view = np.tile(view, 2)
    truth = pbrdf.MicrofacetModel(pbrdf.Material(1.5), 0.25, diffuse_albedo=0.1)
    matrix = truth.brdf(theta_i, np.abs(view), np.where(view > 0, np.pi, 0.0))
    error = 0.03 * matrix[:, 0, 0]
    noise = np.random.default_rng(1).normal(size=(2, view.size)) * error
    columns = {
        "M00": matrix[:, 0, 0] + noise[0], "M00_stderr": error,
        "M10": matrix[:, 1, 0] + noise[1], "M10_stderr": error,
    }  # fmt: skip
    coords = {
        "theta_i": theta_i, "theta_s": np.abs(view), "theta_view": view,
        "dphi": np.where(view > 0, np.pi, 0.0),
    }  # fmt: skip
    measured = xr.Dataset(
        {name: ("geometry", value) for name, value in columns.items()},
        {name: ("geometry", value) for name, value in coords.items()},
    )
    model = truth.with_parameters(slope_rms=0.27)
    zeniths = np.deg2rad(np.arange(0.5, 90.0))
    return data_io.in_plane(measured), plane_curves(
        np.unique(theta_i), zeniths, analytic=model
    )


def reference() -> str:
    """Return signature and docstring of every public name."""
    parts = ["# API reference\n\nFrom the docstrings.\n"]
    for module_name, about in PACKAGES.items():
        module = importlib.import_module(module_name)
        parts.append(f"## {module_name}\n\n{about}\n")
        for name in module.__all__:
            one = getattr(module, name)
            if inspect.isclass(one) or callable(one):
                parts.append(_entry(f"{module_name}.{name}", one))
    return "\n".join(parts)


def _entry(name: str, one: object) -> str:
    try:
        signature = str(inspect.signature(one)).replace("'", "")
    except (TypeError, ValueError):
        signature = ""
    text = [
        f"### {name}\n",
        f"```text\n{name}{signature}\n\n{inspect.getdoc(one) or ''}\n```\n",
    ]
    if inspect.isclass(one) and not issubclass(one, BaseException):
        for key, method in inspect.getmembers(one, inspect.isfunction):
            if not key.startswith("_") and key in vars(one) and inspect.getdoc(method):
                called = f".{key}{inspect.signature(method)}"
                text.append(f"```text\n{called}\n\n{inspect.getdoc(method)}\n```\n")
    return "\n".join(text)


if __name__ == "__main__":
    main()

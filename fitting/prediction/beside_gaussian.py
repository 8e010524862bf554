"""The slopes of a map as they are, beside a Gaussian of their rms: which suits a scan?"""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from fitting.prediction.comparison import Misfit, misfit
from fitting.prediction.density import slope_table
from fitting.prediction.facets import facets_of
from fitting.prediction.prediction import Prediction
from fitting.prediction.random_phases import redrawn
from fitting.statistics.slopes import SlopeDistribution, slope_distribution
from pbrdf import HeightMap, Material, MicrofacetModel, Scene, simulate
from pbrdf.analytic.slope_table import SlopeTable

if TYPE_CHECKING:
    from fitting.result.fit_result import FitResult

__all__ = ["MeasuredSlopes", "measured_slopes"]

Array = np.ndarray

GAUSSIAN = "Gaussian slopes"
MEASURED = "slopes as measured"
ENSEMBLE = "Monte Carlo over Gaussian surfaces"
OVER_MAP = "Monte Carlo over the map"
REDRAWN = "Monte Carlo over a surface of its heights and spectrum"
# Fewer readings tell nothing of a distribution
_FEWEST = 12
# Share of the peak above which bins of both simulations are compared
_SEEN = 0.05


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredSlopes:
    """What the slope distribution of a map makes of a scan, beside the Gaussian.

    Parameters
    ----------
    slopes : SlopeDistribution
        Density of the slopes along each axis, with errors.
    table : SlopeTable
        Density as light sees it, smoothed and blurred by patches where the wavelength is
        known.
    misfits : mapping of str to Misfit
        Of each curve to M00 of the scan, gain and Lambertian base free; empty where the
        scan has too few readings of M00.
    simulation : Dataset
        Monte Carlo over the map itself, holes filled, its mean plane taken off.
    apart, noise : mapping of str to float
        Rms difference of M00 between that and the Gaussian surfaces, and a surface with the
        map's own heights and spectrum, over the latter, in bins above a twentieth of the
        peak; and what the noise of both adds to it. [1]
    """

    slopes: SlopeDistribution
    table: SlopeTable
    misfits: Mapping[str, Misfit]
    simulation: xr.Dataset
    apart: Mapping[str, float]
    noise: Mapping[str, float]

    @property
    def texts(self) -> Iterator[str]:
        """What was found, in words."""
        if self.misfits:
            names = (MEASURED, GAUSSIAN)
            better, worse = sorted(names, key=lambda n: self.misfits[n].gain_free)
            yield (
                f"{better} describe M00 of the scan better: off by "
                f"{self.misfits[better].gain_free:.0%} rms, {worse} by "
                f"{self.misfits[worse].gain_free:.0%} (gain and Lambertian base free)"
            )
        for name, apart in self.apart.items():
            own = np.sqrt(max(apart**2 - self.noise[name] ** 2, 0.0))
            yield (
                f"the {OVER_MAP} differs from the {name} by {own:.0%} rms in M00, beyond "
                f"a noise of {self.noise[name]:.0%}"
            )

    def table_rows(self) -> Iterator[tuple[str, ...]]:
        """Yield curve, error with gain and base free, both, and error as predicted."""
        for name, off in self.misfits.items():
            yield (
                name, f"{off.gain_free:.1%}", f"{off.gain:.3g}", f"{off.gain_base:.3g}",
                f"{off.absolute:.1%}",
            )  # fmt: skip

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers and texts."""
        return {
            "slope_rms": dict(self.slopes.rms),
            "slope_rms_stderr": dict(self.slopes.rms_stderr),
            "slope_rms_seen_by_light": list(self.table.slope_rms),
            "misfit": {name: asdict(off) for name, off in self.misfits.items()},
            "monte_carlo_apart": dict(self.apart),
            "monte_carlo_apart_noise": dict(self.noise),
            "in_words": list(self.texts),
        }

    def to_dataset(self) -> xr.Dataset:
        """Return densities with errors, and the simulation over the map."""
        middle = (self.slopes.edges[1:] + self.slopes.edges[:-1]) / 2
        axes = list(self.slopes.density)
        tables = {
            "slope_density": self.slopes.density, "slope_density_stderr": self.slopes.stderr
        }  # fmt: skip
        found = xr.Dataset(
            {
                name: (("slope_axis", "slope"), np.stack([table[a] for a in axes]))
                for name, table in tables.items()
            },
            coords={"slope_axis": axes, "slope": middle},
        )
        found["seen_slope_density"] = (
            ("seen_slope_x", "seen_slope_y"), self.table.density,
        )  # fmt: skip
        found = found.assign_coords(
            seen_slope_x=self.table.slope_x, seen_slope_y=self.table.slope_y
        )
        found["over_map"] = self.simulation.brdf_total
        found["over_map_stderr"] = _total_stderr(self.simulation)
        return found


def measured_slopes(
    surface: HeightMap,
    fitted: "FitResult",
    ensemble: xr.Dataset,
    *,
    slope_rms: float,
    **tracing: Any,
) -> MeasuredSlopes:
    """Compare the slopes of a mended map, and the Monte Carlo over it, with a Gaussian's.

    Parameters
    ----------
    surface : HeightMap
        As mended. [um]
    fitted : FitResult
        Of the Gaussian to the scan, at one wavelength. Its readings of M00 are those
        compared, its index that of the facets. Without a wavelength patches neither smooth
        nor diffract.
    ensemble : Dataset
        Monte Carlo over Gaussian surfaces, unit gain.
    slope_rms : float
        Of the Gaussian, per axis. [1]
    **tracing
        n_rays, seed, workers and progress of `pbrdf.simulate`.
    """
    slopes = slope_distribution(surface)
    material = Material(*fitted.model.material.index())
    waves = fitted.readings.wavelength.values
    wavelength = float(waves[0]) if np.isfinite(waves[0]) else None
    # Without a wavelength, one that is small against everything
    facets = facets_of(surface, wavelength or 1e-3 * min(surface.spacing))
    table = slope_table(facets)
    model = MicrofacetModel(material, slope_distribution=table)
    seen = Prediction(
        model=model, wavelength=wavelength or 1.0, facets=facets, draws=(), notes=()
    )
    brushed = facets.principal[0][0] != facets.principal[0][1]
    level = _level(surface)
    seed = tracing.get("seed") or 0
    simulation, other = (
        simulate(
            Scene(one, material), ensemble.theta_i.values,
            phi_i=0.0 if brushed else "uniform", n_theta=ensemble.theta_s.size,
            n_dphi=ensemble.dphi.size, stokes="linear", **tracing,
        )
        for one in (level, redrawn(level, seed=seed))
    )  # fmt: skip
    readings = fitted.readings
    readings = readings.isel(reading=readings.observable.values == "M00")
    readings = readings.isel(reading=readings.measured.values > 0)
    misfits = {}
    if readings.sizes["reading"] >= _FEWEST:
        angles = readings.theta_i.values, readings.theta_s.values, readings.dphi.values
        gaussian = MicrofacetModel(material, slope_rms=slope_rms)
        curves = {
            GAUSSIAN: gaussian.brdf(*angles)[..., 0, 0],
            MEASURED: seen.brdf(*angles)[..., 0, 0],
            ENSEMBLE: _read(ensemble, *angles),
            OVER_MAP: _read(simulation, *angles),
            REDRAWN: _read(other, *angles),
        }
        measured = readings.measured.values
        misfits = {name: misfit(curve, measured) for name, curve in curves.items()}
    runs = {ENSEMBLE: ensemble, REDRAWN: other}
    apart = {name: _apart(simulation, run) for name, run in runs.items()}
    return MeasuredSlopes(
        slopes=slopes, table=table, misfits=misfits, simulation=simulation,
        apart={name: both[0] for name, both in apart.items()},
        noise={name: both[1] for name, both in apart.items()},
    )  # fmt: skip


def _level(surface: HeightMap) -> HeightMap:
    """Return the map with holes filled and, if it has rims, its mean plane taken off."""
    whole = surface.filled() if surface.missing else surface
    if whole.periodic:
        return whole
    i, j = np.indices(whole.shape)
    columns = np.stack([np.ones(i.size), i.ravel(), j.ravel()], axis=-1)
    plane = columns @ np.linalg.lstsq(columns, whole.heights.ravel(), rcond=None)[0]
    return HeightMap(whole.heights - plane.reshape(whole.shape), whole.spacing)


def _m00(run: xr.Dataset) -> xr.DataArray:
    total = run.brdf_total.isel(stokes_out=0, stokes_in=0)
    return total.squeeze(drop=True).transpose("theta_i", "theta_s", "dphi")


def _total_stderr(run: xr.Dataset) -> xr.DataArray:
    """Return the error of the sum over bounces, taken as independent. [1/sr]"""
    return np.sqrt((run.brdf_stderr**2).sum("bounces"))


def _read(run: xr.Dataset, theta_i: Array, theta_s: Array, dphi: Array) -> Array:
    """M00 at readings: linear between bins, both sides of the plane together. [1/sr]"""
    from scipy.interpolate import RegularGridInterpolator

    values = _m00(run).values
    # dphi and -dphi are one direction over an isotropic surface
    values = (values + np.roll(values[..., ::-1], 1, axis=-1)) / 2
    views, turns = run.theta_s.values, run.dphi.values
    closed = np.concatenate([values, values[..., :1]], axis=-1)
    around = np.append(turns, turns[0] + 2 * np.pi)
    where = np.stack([np.clip(theta_s, views[0], views[-1]), np.mod(dphi, 2 * np.pi)], -1)
    result = np.empty(theta_i.shape)
    for angle in np.unique(theta_i):
        at = int(np.argmin(np.abs(run.theta_i.values - angle)))
        here = theta_i == angle
        table = RegularGridInterpolator((views, around), closed[at])
        result[here] = table(where[here])
    return result


def _apart(run: xr.Dataset, other: xr.Dataset) -> tuple[float, float]:
    """Rms relative difference of M00 of two simulations, and that of their noise."""
    first, second = _m00(run).values, _m00(other).values
    seen = second > _SEEN * second.max(axis=(1, 2), keepdims=True)
    errors = [
        _total_stderr(one).isel(stokes_out=0, stokes_in=0).squeeze(drop=True)
        .transpose("theta_i", "theta_s", "dphi").values
        for one in (run, other)
    ]  # fmt: skip
    off = (first - second)[seen] / second[seen]
    chance = np.hypot(*errors)[seen] / second[seen]
    return float(np.sqrt(np.mean(off**2))), float(np.sqrt(np.mean(chance**2)))

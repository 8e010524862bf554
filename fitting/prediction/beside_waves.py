"""Waves beside facets: the same surface and scan by wave optics, where that matters."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from fitting.models.waves import WaveSurface
from fitting.readings.wavelengths import one_wavelength
from fitting.result.fit_result import FitResult
from fitting.statistics.result import SurfaceStatistics
from pbrdf import Material, WaveModel
from pbrdf.conventions import RESULT_VARIABLES, STOKES
from pbrdf.validity import gaussian_roughness, judge

__all__ = ["WaveFit", "wave_fit"]

# What stands beside the heights, which are those of the surface
BESIDE = ("specular_gain", "diffuse_albedo", "n", "kappa")


@dataclass(frozen=True, kw_only=True, eq=False)
class WaveFit:
    """Wave optics of the measured surface, brought to a scan.

    Attributes
    ----------
    fit : FitResult
        Of a `WaveModel` with the height and slope of the surface: light of the first bounce
        without the beam.
    coherent : DataArray, dims theta_i, stokes_out, stokes_in
        Mueller reflectance of the beam, as wide as that of the source, for unit gain. [1]
    wavelength : float
        Of the scan. [um]
    """

    fit: FitResult
    coherent: xr.DataArray
    wavelength: float

    @property
    def model(self) -> WaveSurface:
        """The fitted surface."""
        found: WaveSurface = self.fit.model
        return found

    @property
    def text(self) -> str:
        """What a reader should know of it, in a sentence."""
        share = self.coherent.isel(stokes_out=0, stokes_in=0)
        return (
            f"Waves matter at {self.wavelength:.4g} um: the column Waves takes them for "
            "the first bounce. The beam, which no column holds, reflects "
            f"{100 * float(share.min()):.2g} to {100 * float(share.max()):.2g} % of the "
            "light over the incidences of the scan."
        )


def wave_fit(
    statistics: SurfaceStatistics,
    measurement: xr.Dataset,
    bring: Callable[..., FitResult],
    *,
    material: Material,
    free: Sequence[str],
) -> WaveFit | None:
    """Bring waves of the measured heights to the scan; None where facets will do.

    Facets will do where `pbrdf.validity.judge` has nothing to say of the surface at the
    wavelength of the scan, and where that is not known.
    """
    wavelength = one_wavelength(measurement)
    if wavelength is None:
        return None
    height, slope = statistics.height_rms.value, statistics.slope_rms.value
    incidences = np.unique(measurement.theta_i.values)
    if not judge(gaussian_roughness(height, slope), incidences, wavelength).notes:
        return None
    # The Gaussian surface that has the height of this one, and its slope
    model = WaveModel(
        Material(*material.index(wavelength), name=material.name),
        height_rms=height, corr_length=np.sqrt(2.0) * height / slope,
    )  # fmt: skip
    wanted = [name for name in free if name in BESIDE]
    # Index and gains alone vary: a narrow range of heights is enough
    fit = bring(measurement, WaveSurface(model, reach=1.1), free=wanted)
    fitted: WaveModel = fit.model.model
    entry = RESULT_VARIABLES["coherent"]
    beam = xr.DataArray(
        fitted.coherent(incidences, wavelength),
        dims=("theta_i", "stokes_out", "stokes_in"),
        coords={
            "theta_i": incidences, "stokes_out": list(STOKES), "stokes_in": list(STOKES),
        },
        attrs={"units": entry.units, "long_name": entry.long_name},
    )  # fmt: skip
    return WaveFit(fit=fit, coherent=beam, wavelength=wavelength)

"""`ds.pbrdf`: what one wants of a result, by one method.

`import pbrdf` alone registers nothing, so as not to load xarray. What registers it: every
function of the package that returns or reads a result (`data_io.read_result`), and, for
results that `xarray.open_dataset` opens, `import pbrdf.accessor`.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy.typing as npt
import xarray as xr

from pbrdf import derived

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Accessor"]

_UNPOLARISED = (1.0, 0.0, 0.0, 0.0)


@xr.register_dataset_accessor("pbrdf")
class Accessor:
    """Methods of a result of `simulate`, `observe`, `compare_dew` or `read_result`.

    Examples
    --------
    >>> from pbrdf import HeightMap, Material, Scene, simulate
    >>> ds = simulate(Scene(HeightMap.flat(), Material(1.5)), [0.5], n_rays=320)
    >>> mirrored = ds.pbrdf.dolp().isel(theta_i=0).max()
    >>> bool(0 < mirrored < 1)
    True
    """

    def __init__(self, dataset: xr.Dataset) -> None:
        self._dataset = dataset

    def element(self, name: str) -> xr.DataArray:
        """M00 ... M33 [1/sr], DOLP [1] or AOLP [rad], all bounces.

        Examples
        --------
        >>> from pbrdf import HeightMap, Material, Scene, simulate
        >>> glass = Scene(HeightMap.flat(), Material(1.5))
        >>> ds = simulate(glass, [0.5, 0.7], n_rays=320, n_theta=9, n_dphi=4)
        >>> ds.pbrdf.element("M10").sizes["dphi"]
        4
        """
        return derived.element(self._dataset, name).value

    def stderr(self, name: str) -> xr.DataArray | None:
        """Return the standard error of an element; None where the result holds no errors.

        Of DOLP and AOLP it takes the errors of M00, M10 and M20 as independent, which
        overstates it; it is at most 1 and pi/2, and NaN where M00 is below two standard
        errors.
        """
        return derived.element(self._dataset, name).stderr

    def dolp(self, source: npt.ArrayLike = _UNPOLARISED) -> xr.DataArray:
        """Degree of linear polarisation √(Q² + U²) / I of the scattered light. [1]

        Parameters
        ----------
        source : array_like, shape (4,)
            Stokes vector of the source; unpolarised without it.

        Returns
        -------
        DataArray
            NaN where no light was found. Noise lifts it: see `stderr("DOLP")`.

        Examples
        --------
        >>> from pbrdf import HeightMap, Material, Scene, simulate
        >>> glass = Scene(HeightMap.flat(), Material(1.5))
        >>> ds = simulate(glass, [0.5, 0.7], n_rays=320, n_theta=9, n_dphi=4)
        >>> round(float(ds.isel(theta_i=1).pbrdf.dolp().max()), 2)
        0.69
        """
        return derived.element(self._dataset, "DOLP", source).value

    def aolp(self, source: npt.ArrayLike = _UNPOLARISED) -> xr.DataArray:
        """Angle of linear polarisation ½ atan2(U, Q), in (-π/2, π/2]. [rad]

        Measured from e_s, perpendicular to the meridian plane of the scattered light,
        towards e_p; 0 is s-polarised. NaN where the light is not polarised or not there.

        Examples
        --------
        >>> from pbrdf import HeightMap, Material, Scene, simulate
        >>> glass = Scene(HeightMap.flat(), Material(1.5))
        >>> ds = simulate(glass, [0.5, 0.7], n_rays=320, n_theta=9, n_dphi=4)
        >>> float(ds.isel(theta_i=1).pbrdf.aolp().max())
        0.0
        """
        return derived.element(self._dataset, "AOLP", source).value

    def stokes(self, source: npt.ArrayLike = _UNPOLARISED) -> xr.DataArray:
        """Scattered Stokes vector per unit irradiance of a source. [1/sr]

        Parameters
        ----------
        source : array_like, shape (4,)
            (I, Q, U, V) with I > 0, in the meridian frame of the incident beam.

        Examples
        --------
        >>> from pbrdf import HeightMap, Material, Scene, simulate
        >>> glass = Scene(HeightMap.flat(), Material(1.5))
        >>> ds = simulate(glass, [0.5, 0.7], n_rays=320, n_theta=9, n_dphi=4)
        >>> seen = ds.isel(theta_i=1).pbrdf.stokes([1.0, -1.0, 0.0, 0.0])
        >>> bool(seen.sel(stokes_out="Q").min() < 0)
        True
        """
        return derived.light(self._dataset, source)

    def in_plane(self) -> xr.Dataset:
        """Cut in the plane of incidence, dimension `theta_view`, positive forward. [rad]

        Examples
        --------
        >>> from pbrdf import HeightMap, Material, Scene, simulate
        >>> glass = Scene(HeightMap.flat(), Material(1.5))
        >>> ds = simulate(glass, [0.5, 0.7], n_rays=320, n_theta=9, n_dphi=4)
        >>> lit = ds.isel(theta_i=0).pbrdf.in_plane().brdf_total.sel(stokes_out="I")
        >>> brightest = lit.sel(stokes_in="I").idxmax("theta_view")
        >>> round(float(brightest), 2)
        0.44
        """
        return derived.in_plane(self._dataset)

    def at(self, **places: float) -> xr.Dataset:
        """Interpolate linearly between what was computed; refuse to go beyond it.

        Parameters
        ----------
        **places : float
            theta_i, phi_i, theta_s, dphi [rad], wavelength [um], or what a sweep varied.

        Returns
        -------
        Dataset
            Its attribute `interpolation` says what was done. Errors are interpolated like
            values, an upper bound.

        Raises
        ------
        ValueError
            Outside of what was computed.

        Warns
        -----
        AccuracyWarning
            If neighbours differ by more than a tenth of the peak.

        Examples
        --------
        >>> from pbrdf import HeightMap, Material, Scene, simulate
        >>> glass = Scene(HeightMap.flat(), Material(1.5))
        >>> ds = simulate(glass, [0.5, 0.7], n_rays=320, n_theta=9, n_dphi=4)
        >>> ds.pbrdf.at(theta_i=0.7).attrs["interpolation"]
        'theta_i: as computed at 40.107 deg'
        """
        return derived.interpolate(self._dataset, places)

    def beside(self, model: Any, name: str = "model") -> xr.Dataset:
        """Return the result and a model in its bins, along a dimension `state`.

        `polar`, with `minus="model"` too, and `plane` then draw the two beside each other.

        Parameters
        ----------
        model : MicrofacetModel, WaveModel, or other with `brdf`
            Averaged over each bin, with cos(theta) dOmega; its errors are 0.
        name : str
            Of the model; the result is named "simulated".

        Examples
        --------
        >>> from pbrdf import HeightMap, Material, Scene, simulate
        >>> glass = Scene(HeightMap.flat(), Material(1.5))
        >>> ds = simulate(glass, [0.5, 0.7], n_rays=320, n_theta=9, n_dphi=4)
        >>> from pbrdf import MicrofacetModel
        >>> both = ds.pbrdf.beside(MicrofacetModel(Material(1.5), slope_rms=0.1))
        >>> both.state.values.tolist()
        ['simulated', 'model']
        """
        return derived.beside(self._dataset, model, name)

    def polar(
        self,
        elements: str | Sequence[str] = ("M00", "M10", "DOLP"),
        **options: Any,
    ) -> "Figure":
        """Draw elements over the hemisphere; options as of `pbrdf.plots.hemisphere`.

        Raises
        ------
        ValueError
            If a place is asked for that was not computed.
        """
        from pbrdf.plots import hemisphere

        names = (elements,) if isinstance(elements, str) else tuple(elements)
        return hemisphere(self._dataset, names, **options)

    def plane(
        self, elements: str | Sequence[str] = ("M00", "M10", "DOLP"), **options: Any
    ) -> "Figure":
        """Draw the cut in the plane; options as of `pbrdf.plots.plane_cuts`."""
        from pbrdf.plots import plane_cuts

        names = (elements,) if isinstance(elements, str) else tuple(elements)
        return plane_cuts(self._dataset, names, **options)

"""The analytical model: Fresnel facets, slope distribution, shadowing, diffuse terms."""

import os
import warnings
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from math import nan
from typing import Any

import numpy as np
import numpy.typing as npt

from pbrdf.analytic.geometry import checked_zenith, flat_geometry
from pbrdf.analytic.slope_table import SlopeTable
from pbrdf.analytic.tables import (
    GRAZING_FORMS,
    SHADOWING,
    SLOPE_DISTRIBUTIONS,
    VOLUME_FORMS,
    code_of,
)
from pbrdf.errors import AccuracyWarning, one_number, require
from pbrdf.kernels.microfacet import microfacet as kernel
from pbrdf.kernels.microfacet.shadowing import Shadowing
from pbrdf.kernels.microfacet.slopes import GAUSSIAN, Roughness, slope_norm
from pbrdf.kernels.optics.volume import Diffuse
from pbrdf.optics import library
from pbrdf.optics.materials import Material
from pbrdf.validity import Judgement, gaussian_roughness, judge

__all__ = ["MicrofacetModel"]

# Below this many matrices a thread costs more than it saves
CHUNK = 16384


@dataclass(frozen=True)
class MicrofacetModel:
    """Polarised BRDF of a rough surface as a distribution of mirroring facets.

    Parameters
    ----------
    material : Material or str
        Index of the facets, or the name of a material of the library.
    slope_rms : float or (float, float)
        Rms slope PER AXIS, along x and y where they differ. [1]
    slope_distribution : str or SlopeTable
        A key of `pbrdf.analytic.SLOPE_DISTRIBUTIONS`, or measured slopes; these bring their
        own slope_rms.
    shadowing : str
        A key of `pbrdf.analytic.SHADOWING`.
    specular_gain : float
        Factor of the specular term; 1 by physics. [1]
    diffuse_albedo : float
        The paper's additive Lambertian term: brdf[0, 0] += diffuse_albedo/pi. It is not
        `Material.diffuse_albedo`, the base under the interface. [1]
    shadow_omega, shadow_tau : float
        Constants of the Maxwell-Beard factor. [rad]
    volume_albedo, volume_depolarization : float
        Albedo of the scatter under the interface, and how much it depolarises; in [0, 1].
        Takes the place of `Material.diffuse_albedo`: give one or the other. [1]
    grazing_albedo : float
        Strength of the second term of (23), which grows at grazing. [1]
    volume_form, grazing_form : str
        Keys of `pbrdf.analytic.VOLUME_FORMS` and `GRAZING_FORMS`.
    height_rms : float, optional
        Rms height. It changes nothing: with it the model can be judged, see `judge`, and
        `brdf` warns at a wavelength where geometric optics fails. Slopes alone tell neither
        the coherent beam nor the curvature. [um]

    Raises
    ------
    ValueError
        If a value leaves its range or a name is unknown.

    References
    ----------
    .. [1] M. Gartley, S. Brown, J. Schott, Micro-scale surface and contaminate modeling for
       polarimetric signature prediction, section 2. Equations (1), (2), (5), (6), (10),
       (13) and (17) are used in their corrected form.

    Examples
    --------
    Specular reflection of a rough glass is polarised perpendicular to its plane:

    >>> import numpy as np
    >>> model = MicrofacetModel(Material(1.5), slope_rms=0.2)
    >>> model.brdf(0.7, 0.7, np.pi)[:2, :2].round(4)
    array([[0.0779, 0.0538],
           [0.0538, 0.0779]])
    """

    material: Material
    slope_rms: float | tuple[float, float] = nan
    slope_distribution: str | SlopeTable = "gaussian"
    shadowing: str = "smith-correlated"
    specular_gain: float = 1.0
    diffuse_albedo: float = 0.0
    shadow_omega: float = 0.7
    shadow_tau: float = 0.25
    volume_albedo: float = 0.0
    volume_depolarization: float = 1.0
    grazing_albedo: float = 0.0
    volume_form: str = "polarised-base"
    grazing_form: str = "bounded"
    height_rms: float | None = None

    def __post_init__(self) -> None:
        if isinstance(self.material, str):
            object.__setattr__(self, "material", library.get(self.material))
        self._check_slopes()
        code_of(SHADOWING, self.shadowing, "shadowing")
        code_of(VOLUME_FORMS, self.volume_form, "volume_form")
        code_of(GRAZING_FORMS, self.grazing_form, "grazing_form")
        for name in ("volume_albedo", "volume_depolarization"):
            value = getattr(self, name)
            one_number(
                name, value, lambda v: (v >= 0) & (v <= 1), "lie in [0, 1] [1]",
                "It is a fraction.",
            )  # fmt: skip
        if self.volume_albedo and self.material.has_base:
            given = self.material.diffuse_albedo
            base = "from a table" if callable(given) else f"{given:g}"
            msg = (
                f"volume_albedo must be 0 over a material with diffuse_albedo {base}, got "
                f"{self.volume_albedo:g}. Both mean the base under the interface; give "
                "one of them."
            )
            raise ValueError(msg)
        for name in ("specular_gain", "diffuse_albedo", "grazing_albedo"):
            one_number(
                name,
                getattr(self, name),
                lambda v: v >= 0,
                "be >= 0 [1]",
                "It is a gain.",
            )
        if self.height_rms is not None:
            one_number(
                "height_rms", self.height_rms, lambda v: (v > 0) & np.isfinite(v),
                "be > 0 [um]", "Leave it out where heights are not known.",
            )  # fmt: skip
        for name in ("shadow_omega", "shadow_tau"):
            one_number(
                name, getattr(self, name), lambda v: v > 0, "be > 0 [rad]",
                "Angles are radians.",
            )  # fmt: skip

    def _check_slopes(self) -> None:
        """Check slope_rms and slope_distribution against each other."""
        table = self.slope_distribution
        if isinstance(table, SlopeTable):
            if self.slope_rms != table.slope_rms and not np.isnan(self.slope_rms).all():
                msg = "slope_rms must be left out where slope_distribution is a SlopeTable."
                raise ValueError(msg)
            if self.shadowing == "smith":
                msg = (
                    "shadowing must not be 'smith' over a SlopeTable: its numerator is "
                    "that of a Gaussian. Use smith-uncorrelated or smith-correlated."
                )
                raise ValueError(msg)
            object.__setattr__(self, "slope_rms", table.slope_rms)
            return
        code_of(SLOPE_DISTRIBUTIONS, table, "slope_distribution")
        slopes = require(
            "slope_rms", self.slope_rms, lambda v: (v > 0) & (v < 1e3), "be > 0 [1]",
            "A smooth surface has no BRDF; the slope is a tangent, not an angle.",
        )  # fmt: skip
        if slopes.shape not in ((), (2,)):
            msg = f"slope_rms must be one number or (x, y), got shape {slopes.shape}."
            raise ValueError(msg)
        pair = slopes.tolist()
        object.__setattr__(self, "slope_rms", tuple(pair) if slopes.ndim else pair)

    def with_parameters(self, **changes: Any) -> "MicrofacetModel":
        """Copy with some parameters changed.

        Examples
        --------
        >>> MicrofacetModel(Material(1.5), 0.2).with_parameters(specular_gain=0.5).slope_rms
        0.2
        """
        return replace(self, **changes)

    def brdf(
        self,
        theta_i: npt.ArrayLike,
        theta_s: npt.ArrayLike,
        dphi: npt.ArrayLike,
        wavelength: npt.ArrayLike | None = None,
        *,
        phi_i: npt.ArrayLike = 0.0,
        out: np.ndarray | None = None,
    ) -> np.ndarray:
        """Mueller BRDF in the frames of the conventions page; arguments broadcast.

        Parameters
        ----------
        theta_i, theta_s : array_like
            Zeniths of the directions to source and detector, in [0, pi/2]. [rad]
        dphi : array_like
            phi_s - phi_i; specular at pi. [rad]
        wavelength : array_like, optional
            Vacuum wavelength, needed by tabulated materials. [um]
        phi_i : array_like
            Azimuth of the source from the x axis of an anisotropic surface. [rad]
        out : ndarray, shape (..., 4, 4), optional
            Written into and returned. A large array that is used again spares the time in
            which the system would clear a new one. [1/sr]

        Returns
        -------
        ndarray, shape (..., 4, 4)
            f_r = dL/dE, not multiplied by cos(theta_s). [1/sr]

        Raises
        ------
        ValueError
            If an angle leaves its range (degrees?), or the wavelength the material's, or if
            `out` does not fit.

        Warns
        -----
        AccuracyWarning
            If height_rms is known and geometric optics fails at the wavelength. Without
            height_rms that cannot be judged, and nothing is said.
        """
        if wavelength is not None:
            # A material of numbers does not look at it
            require(
                "wavelength", wavelength, lambda v: (v > 0) & np.isfinite(v),
                "be positive [um]", "Wavelengths are micrometres.",
            )  # fmt: skip
        n, kappa = self.material.indices(wavelength)
        if self.height_rms is not None and wavelength is not None:
            for note in self.judge(np.unique(theta_i), np.unique(wavelength)).notes:
                warnings.warn(note, AccuracyWarning, stacklevel=2)
        base = np.asarray(self.volume_albedo or self.material.albedo(wavelength))
        shape, columns = flat_geometry(theta_i, theta_s, dphi, phi_i, n, kappa, base)
        matrices = _writable(out, (*shape, 4, 4))
        *columns, albedos = columns
        if albedos.size == 1:
            self._fill(columns, float(albedos[0]), matrices.reshape(-1))
            return matrices
        # The kernels take one albedo, n and kappa for each geometry
        flat = matrices.reshape(-1, 4, 4)
        for albedo in np.unique(albedos):
            here = albedos == albedo
            part = np.empty((np.count_nonzero(here), 4, 4))
            these = [one if one.size == 1 else one[here] for one in columns]
            self._fill(these, float(albedo), part.reshape(-1))
            flat[here] = part
        return matrices

    def judge(self, theta_i: npt.ArrayLike, wavelength: npt.ArrayLike) -> Judgement:
        """Judge where geometric optics holds: numbers, and what they mean in sentences.

        Parameters
        ----------
        theta_i : array_like
            Zeniths of the source. [rad]
        wavelength : array_like
            Vacuum wavelengths. [um]

        Returns
        -------
        Judgement
            `numbers` by the names of `pbrdf.conventions.RESULT_VARIABLES` and `notes`. The
            surface is taken as Gaussian, of height_rms and slope_rms. Without height_rms
            there are no numbers, and the one note says what cannot be judged.

        Examples
        --------
        >>> model = MicrofacetModel(Material(1.5), slope_rms=0.2, height_rms=0.05)
        >>> model.judge(0.3, 0.55).numbers["coherent_share"].round(2)
        array([[0.3]])
        >>> print(*MicrofacetModel(Material(1.5), slope_rms=0.2).judge(0.3, 0.55).notes)
        The coherent beam and the tangent plane cannot be judged from slopes alone. Give \
height_rms.
        """
        if self.height_rms is None:
            note = (
                "The coherent beam and the tangent plane cannot be judged from slopes "
                "alone. Give height_rms."
            )
            return Judgement(notes=(note,))
        zenith = np.atleast_1d(checked_zenith("theta_i", theta_i)).ravel()
        waves = require(
            "wavelength", wavelength, lambda v: (v > 0) & np.isfinite(v),
            "be positive [um]", "Wavelengths are micrometres.",
        )  # fmt: skip
        slope = float(np.sqrt(np.mean(np.square(self.slope_rms))))
        rough = gaussian_roughness(float(self.height_rms), slope)
        return judge(rough, zenith, np.atleast_1d(waves).ravel())

    def _fill(self, columns: list[np.ndarray], albedo: float, out: np.ndarray) -> None:
        """Fill in matrices over one albedo of the base."""
        if isinstance(self.slope_distribution, SlopeTable):
            self._fill_tabulated(self.slope_distribution, columns, albedo, out)
            return
        # The kernel reads n and kappa with one stride
        if columns[4].size != columns[5].size:
            size = columns[0].size
            columns[4:] = [np.broadcast_to(c, size).copy() for c in columns[4:]]
        _fill(columns, self.surface(albedo), out)

    def _fill_tabulated(
        self,
        table: SlopeTable,
        columns: list[np.ndarray],
        albedo: float,
        out: np.ndarray,
    ) -> None:
        """Fill in matrices over measured slopes: the table gives densities and Lambda."""
        size = columns[0].size
        theta_i, theta_s, dphi, phi_i, n, kappa = (
            np.broadcast_to(c, size).copy() for c in columns
        )
        slopes = np.empty((2, size))
        kernel.fill_facet_slopes(theta_i, theta_s, dphi, phi_i, slopes)
        kernel.fill_tabulated(
            theta_i, theta_s, dphi, n, kappa, table.density_at(*slopes),
            table.overhang(theta_i, phi_i), table.overhang(theta_s, phi_i + dphi),
            self.surface(albedo), out,
        )  # fmt: skip

    def roughness(self) -> Roughness:
        """Slope law as the kernels take it; of a table, the Gaussian of its rms."""
        name = self.slope_distribution
        law = GAUSSIAN if isinstance(name, SlopeTable) else SLOPE_DISTRIBUTIONS[name].code
        slope_x, slope_y = np.broadcast_to(np.asarray(self.slope_rms), 2).tolist()
        norm = slope_norm(law, slope_x, slope_y)
        return Roughness(law, slope_x, slope_y, slope_x == slope_y, norm)

    def surface(self, albedo: float) -> kernel.Surface:
        """Numbers of the model as the kernels take them; `albedo` is that of the base."""
        rule = SHADOWING[self.shadowing].code
        return kernel.Surface(
            self.roughness(),
            Shadowing(rule, self.shadow_omega, self.shadow_tau),
            float(self.specular_gain),
            self._diffuse(albedo),
        )

    def _diffuse(self, volume_albedo: float) -> Diffuse:
        """Numbers of the terms (22) and (23)."""
        return Diffuse(
            float(self.diffuse_albedo),
            float(self.grazing_albedo),
            GRAZING_FORMS[self.grazing_form].code,
            volume_albedo,
            VOLUME_FORMS[self.volume_form].code,
            float(self.volume_depolarization),
            volume_albedo > 0 or self.grazing_albedo > 0,
        )


def _writable(out: np.ndarray | None, shape: tuple[int, ...]) -> np.ndarray:
    """Check the array to write into, or make one."""
    if out is None:
        return np.empty(shape)
    if out.shape != shape or out.dtype != np.float64 or not out.flags.carray:
        order = "contiguous" if out.flags.c_contiguous else "not contiguous"
        msg = (
            f"out must be a contiguous, writable float64 array of shape {shape}, "
            f"got {out.dtype} of shape {out.shape}, {order}. Leave it out to get a new one."
        )
        raise ValueError(msg)
    return out


def _fill(columns: list[np.ndarray], surface: kernel.Surface, out: np.ndarray) -> None:
    """Run the kernel over chunks, on as many threads as pay."""
    size = columns[0].size
    if size <= CHUNK:
        kernel.fill_brdf(*columns, surface, out)
        return

    def fill_part(start: int) -> None:
        part = slice(start, start + CHUNK)
        pieces = [c[part] if c.size > 1 else c for c in columns]
        kernel.fill_brdf(*pieces, surface, out[16 * start : 16 * (start + CHUNK)])

    workers = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 1
    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(fill_part, range(0, size, CHUNK)))

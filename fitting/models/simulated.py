"""A simulated surface in the fit's loop: the analytical model, corrected by traced paths.

    M(n, kappa, ...) = analytical model with specular_gain * ratio
                       + specular_gain * light of several bounces(n, kappa),

where the ratio, for each direction, and the light of several bounces come from one Monte
Carlo run (`fitting.models.simulated_trace`). Nothing is traced again while the solver
varies n, kappa and gains. The slope may vary too, near the one traced: the analytical curve
follows it, the correction stays.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from fitting.models.analytic import AnalyticModel
from fitting.models.index_grid import IndexGrid, Range
from fitting.models.simulated_scene import (
    Run,
    facet_slope,
    middle_index,
    opaque_material,
    range_around,
)
from fitting.models.simulated_trace import group_count
from fitting.readings.observations import Geometry
from pbrdf import MicrofacetModel, Scene
from pbrdf.errors import check_seed, real_array

if TYPE_CHECKING:
    import casadi
    import xarray as xr

__all__ = ["SimulatedModel"]

# Part of the traced slope by which the analytical curve may carry the simulation along
_FAR = 0.1


class SimulatedModel:
    """Mueller BRDF of a simulated surface with the parameters of the analytical model.

    The first question about an incidence traces it; every later one, and every model made
    from this one, uses the same paths. The error of the simulation goes into the weights of
    a fit and, as its own part, into the standard errors.

    Parameters
    ----------
    scene : Scene
        Opaque surface of one material. Its index is where a fit starts.
    model : MicrofacetModel, optional
        Start values of gains, diffuse terms and index; its slope and shadowing are the
        analytical model's that the simulation corrects. Default: unit gain, the scene's
        index, and its slope.
    index_range : ((n, n), (kappa, kappa)), optional
        Lowest and highest index that a fit may ask for. Default: n in 1.15 .. 2.6 and kappa
        in 0 .. 1.5 for a dielectric, about half to twice its constants for a metal. Two
        equal values hold the index, and trace it alone. [1]
    n_rays, realizations, seed, workers, n_theta, n_dphi, stokes, progress
        Of the simulation, see `pbrdf.simulate`.

    Raises
    ------
    ValueError, TypeError
        If the scene is none that keeps its paths when the index changes, or the index lies
        outside `index_range`.

    Examples
    --------
    >>> from pbrdf import GaussianSurface
    >>> surface = GaussianSurface(
    ...     shape=(256, 256), spacing=1.0, corr_length=12.0, slope_rms=0.3
    ... )
    >>> model = SimulatedModel(Scene(surface, "bk7"))  # doctest: +SKIP
    >>> fit(scan, model, free=("n", "kappa", "specular_gain"))  # doctest: +SKIP
    """

    def __init__(  # noqa: PLR0913  (the choices of a simulation)
        self,
        scene: Scene,
        model: MicrofacetModel | None = None,
        *,
        index_range: tuple[Range, Range] | None = None,
        n_rays: int = 10_000,
        realizations: int = 160,
        seed: int = 0,
        workers: int | None = None,
        n_theta: int = 45,
        n_dphi: int = 36,
        stokes: str = "full",
        progress: Callable[[int, int], None] | None = None,
    ) -> None:
        check_seed(seed)
        material = opaque_material(scene)
        if model is None:
            model = MicrofacetModel(material, slope_rms=facet_slope(scene))
        index = middle_index(model.material)
        grid = IndexGrid(*(index_range or range_around(index)))
        for name, value, (low, high) in zip(
            ("n", "kappa"), index, (grid.n, grid.kappa), strict=True
        ):
            if not low <= value <= high:
                msg = (
                    f"index_range must hold the model's {name} {value:g}, got {low:g} .. "
                    f"{high:g}. Widen it."
                )
                raise ValueError(msg)
        companion = model.with_parameters(
            slope_rms=facet_slope(scene),
            specular_gain=1.0,
            diffuse_albedo=0.0,
            volume_albedo=0.0,
            grazing_albedo=0.0,
        )
        group_count(scene, realizations)
        options = {
            "n_rays": n_rays,
            "realizations": realizations,
            "seed": seed,
            "workers": workers,
            "n_theta": n_theta,
            "n_dphi": n_dphi,
            "stokes": stokes,
            "progress": progress,
        }
        self.model = model
        self._run = Run(
            scene=scene, grid=grid, index=index, companion=companion, options=options
        )
        self._group: int | None = None

    # What the fit asks for: see `fitting.objective.forward.MuellerModel`

    @property
    def bounds(self) -> dict[str, Range]:
        """The indices that were, or will be, traced."""
        return {"n": self._run.grid.n, "kappa": self._run.grid.kappa}

    @property
    def replicas(self) -> "tuple[SimulatedModel, ...]":
        """The same model from each of the independent groups of realisations alone."""
        count = group_count(self._run.scene, self._run.options["realizations"])
        return tuple(self._with(group=number) for number in range(count))

    def values(self, geometry: Geometry) -> dict[str, np.ndarray]:
        """Return every parameter at each geometry, shape (N,)."""
        values = AnalyticModel(self.model).values(geometry)
        for name, (low, high) in self.bounds.items():
            outside = (values[name] < low - 1e-9) | (values[name] > high + 1e-9)
            if outside.any():
                msg = (
                    f"index_range must hold every {name} of the scan, {low:g} .. {high:g} "
                    f"does not hold {values[name][outside][0]:g}. Widen it."
                )
                raise ValueError(msg)
        return values

    def mueller(
        self, values: Mapping[str, Any], geometry: Geometry, elements: Sequence[int]
    ) -> "casadi.MX":
        """Return elements of the BRDF, shape (E, N), numbered along the rows. [1/sr]"""
        import casadi

        ratio, multiple = self._read(geometry)
        gain = values["specular_gain"]
        corrected = {**values, "specular_gain": gain * casadi.DM(ratio).T}
        single = AnalyticModel(self.model).mueller(corrected, geometry, elements)
        terms = casadi.vertcat(*self._run.grid.terms(values["n"], values["kappa"]))
        rows = [
            casadi.sum1(casadi.DM(multiple[:, element].T.copy()) * terms)
            for element in elements
        ]
        return single + casadi.repmat(gain, len(elements), 1) * casadi.vertcat(*rows)

    def updated(self, values: Mapping[str, float]) -> "SimulatedModel":
        """Return the model with these values, on the same paths."""
        return self._with(model=AnalyticModel(self.model).updated(values))

    @property
    def remarks(self) -> tuple[str, ...]:
        """What the present values ask of the simulation that it does not give."""
        traced, now = (
            float(np.sqrt(np.mean(np.square(model.slope_rms))))
            for model in (self._run.companion, self.model)
        )
        if abs(now / traced - 1.0) <= _FAR:
            return ()
        return (
            f"the surface was traced with slope_rms {traced:.3g}, far from {now:.3g}: "
            "light of several bounces is that of the former; trace one of the latter",
        )

    # What a user asks for

    def brdf(
        self,
        theta_i: np.ndarray,
        theta_s: np.ndarray,
        dphi: np.ndarray,
        wavelength: np.ndarray | float | None = None,
        *,
        phi_i: np.ndarray | float = 0.0,
    ) -> np.ndarray:
        """Return the Mueller BRDF at directions that broadcast, (..., 4, 4). [1/sr]"""
        geometry, shape = _flat(theta_i, theta_s, dphi, phi_i, wavelength)
        return self._brdf(geometry).reshape(*shape, 4, 4)

    def stderr(
        self,
        theta_i: np.ndarray,
        theta_s: np.ndarray,
        dphi: np.ndarray,
        wavelength: np.ndarray | float | None = None,
        *,
        phi_i: np.ndarray | float = 0.0,
    ) -> np.ndarray:
        """Return the standard error that the simulation leaves, (..., 4, 4). [1/sr]"""
        geometry, shape = _flat(theta_i, theta_s, dphi, phi_i, wavelength)
        groups = np.stack([replica._brdf(geometry) for replica in self.replicas])
        error = groups.std(axis=0, ddof=1) / np.sqrt(len(groups))
        return np.asarray(error.reshape(*shape, 4, 4))

    def simulation(self, theta_i: Iterable[float], phi_i: float = 0.0) -> "xr.Dataset":
        """Return what was simulated at these incidences, for the index of the start."""
        import xarray as xr

        angles = list(theta_i)
        keys = self._run.keys(angles, [phi_i] * len(angles))
        self._run.of(keys)
        parts = [self._run.datasets[key] for key in keys]
        return xr.concat(parts, "theta_i", data_vars="minimal", combine_attrs="override")

    def _with(
        self, *, model: MicrofacetModel | None = None, group: int | None = None
    ) -> "SimulatedModel":
        """Return a model of other values, or of one group, on the same paths."""
        other = object.__new__(SimulatedModel)
        other.model = self.model if model is None else model
        other._run = self._run
        other._group = self._group if group is None else group
        return other

    def _brdf(self, geometry: Geometry) -> np.ndarray:
        """Return the Mueller BRDF, shape (N, 4, 4)."""
        ratio, multiple = self._read(geometry)
        present = self.values(geometry)
        terms = self._run.grid.basis(present["n"], present["kappa"])
        several = np.einsum("nek,nk->ne", multiple, terms).reshape(-1, 4, 4)
        bare = self.model.with_parameters(
            specular_gain=1.0, diffuse_albedo=0.0, volume_albedo=0.0, grazing_albedo=0.0
        )
        wavelength = geometry.wavelength if self.model.material.dispersive else None
        single, whole = (
            model.brdf(
                geometry.theta_i,
                geometry.theta_s,
                geometry.dphi,
                wavelength,
                phi_i=geometry.phi_i,
            )
            for model in (bare, self.model)
        )
        lacking = (ratio - 1.0)[:, None, None] * single + several
        return np.asarray(whole + self.model.specular_gain * lacking)

    def _read(self, geometry: Geometry) -> tuple[np.ndarray, np.ndarray]:
        """Return the ratio (N,) and the coefficients (N, 16, K) at each geometry.

        Both vary slowly with the incidence: in a cone of light they are those of its axis.
        So is the ratio with the detector's direction: averaged over bins, it would weigh
        their noise near the zenith, where they are small. What comes by several bounces is
        read at each ray, for its frame is that of the ray.
        """
        keys = self._run.keys(
            *(geometry.axis(name).tolist() for name in ("theta_i", "phi_i"))
        )
        axis_s, axis_dphi = geometry.axis("theta_s"), geometry.axis("dphi")
        ratio = np.empty(geometry.size)
        multiple = np.empty((geometry.size, 16, len(self._run.grid.nodes)))
        for key, found in dict(zip(keys, self._run.of(keys), strict=True)).items():
            here = np.array([other == key for other in keys])
            one = found.mean if self._group is None else found.groups[self._group]
            multiple[here] = one.read(geometry.theta_s[here], geometry.dphi[here])[1]
            axes, of = np.unique(
                np.stack([axis_s[here], axis_dphi[here]]), axis=1, return_inverse=True
            )
            ratio[here] = one.read(axes[0], axes[1])[0][of.ravel()]
        return ratio, multiple


def _complete(name: str, values: np.ndarray | float) -> np.ndarray:
    """Return numbers of which none is hidden by a mask."""
    if np.ma.is_masked(values):
        msg = f"{name} must not be masked, got masked values. Ask for what is known."
        raise ValueError(msg)
    return real_array(name, values)


def _flat(
    theta_i: np.ndarray | float,
    theta_s: np.ndarray | float,
    dphi: np.ndarray | float,
    phi_i: np.ndarray | float,
    wavelength: np.ndarray | float | None,
) -> tuple[Geometry, tuple[int, ...]]:
    """Return directions in a row, and the shape they came in."""
    given = (theta_i, theta_s, dphi, phi_i, np.nan if wavelength is None else wavelength)
    names = ("theta_i", "theta_s", "dphi", "phi_i", "wavelength")
    columns = np.broadcast_arrays(*map(_complete, names, given))
    return Geometry(*(column.ravel() for column in columns)), columns[0].shape

"""From the free parameters to the numbers a goniometer reads, as one expression."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from fitting.objective.objective import Prediction
from fitting.readings.aperture import Aperture, rays_through
from fitting.readings.mixing import Mixing
from fitting.readings.observations import LINEAR, Geometry, Observations

if TYPE_CHECKING:
    import casadi

__all__ = ["Layout", "MuellerModel", "predict"]

# Parameters of the instrument, which every model has, and their values in a fixed state
INSTRUMENT = {"scale": 1.0, "background": 0.0}


class MuellerModel(Protocol):
    """What the fit needs of a reflectance model, analytical or simulated."""

    @property
    def bounds(self) -> Mapping[str, tuple[float, float]]:
        """Where the model holds, for parameters that it knows less of than others do."""

    @property
    def replicas(self) -> Sequence["MuellerModel"]:
        """Equal models whose spread is the error of a simulation; none of an exact one."""

    def values(self, geometry: Geometry) -> Mapping[str, np.ndarray]:
        """Return the present value of every parameter at each geometry, shape (N,)."""

    def mueller(
        self, values: Mapping[str, Any], geometry: Geometry, elements: Sequence[int]
    ) -> "casadi.MX":
        """Return elements of the BRDF, shape (E, N); `values` are rows (1, N). [1/sr]

        Elements are numbered 0 to 15 along the rows of the matrix.
        """

    def updated(self, values: Mapping[str, float]) -> Any:
        """Return the user's model with these values."""


@dataclass(frozen=True, eq=False)
class Layout:
    """Which entry of the parameter vector each geometry takes.

    Parameters
    ----------
    labels : tuple of str
        Name of each entry: the parameter, with the scan in brackets where it is separate.
    base : tuple of str
        Parameter of each entry.
    column : mapping of str to ndarray of int, shape (N,)
        For each free parameter the entry that holds at each geometry.
    """

    labels: tuple[str, ...]
    base: tuple[str, ...]
    column: Mapping[str, np.ndarray]

    @classmethod
    def of(
        cls,
        free: Sequence[str],
        observations: Observations,
        separate: Sequence[str] | Mapping[str, str] = (),
    ) -> "Layout":
        """Lay out the free parameters, one entry each or one for each group.

        Parameters
        ----------
        free : sequence of str
            Parameters to vary.
        observations : Observations
            The data.
        separate : sequence of str, or mapping of str to {"scan", "wavelength", "theta_i"}
            Parameters with a value of their own in each scan, or in each such group.
        """
        groups = (
            separate if isinstance(separate, Mapping) else dict.fromkeys(separate, "scan")
        )
        strangers = set(groups) - set(free)
        if strangers:
            msg = f"separate must name free parameters, got {sorted(strangers)[0]!r}."
            raise ValueError(msg)
        labels: list[str] = []
        base: list[str] = []
        column = {}
        for name in free:
            if name in groups:
                texts, member = _groups(groups[name], observations)
                column[name] = member + len(labels)
                labels += [f"{name}[{text}]" for text in texts]
                base += [name] * len(texts)
            else:
                column[name] = np.full(observations.geometry.size, len(labels))
                labels.append(name)
                base.append(name)
        return cls(tuple(labels), tuple(base), column)


def _groups(by: str, observations: Observations) -> tuple[list[str], np.ndarray]:
    """Return the group names and the group of each geometry."""
    if by == "scan":
        return list(observations.labels), observations.scan
    if by == "wavelength":
        keys = observations.geometry.wavelength
        texts = [f"{key:g} um" for key in np.unique(keys)]
    elif by == "theta_i":
        keys = observations.geometry.theta_i.round(9)
        texts = [f"{np.rad2deg(key):.4g} deg" for key in np.unique(keys)]
    else:
        msg = f"separate must be by scan, wavelength or theta_i, got {by!r}."
        raise ValueError(msg)
    return texts, np.unique(keys, return_inverse=True)[1]


def predict(
    model: MuellerModel,
    observations: Observations,
    layout: Layout,
    *,
    fixed: Mapping[str, float] | None = None,
    aperture: Aperture | None = None,
) -> Prediction:
    """Return the observations as a function of the free parameters.

    Parameters
    ----------
    model : MuellerModel
        Reflectance model; its present values hold for what is not free.
    observations : Observations
        What is read, and where.
    layout : Layout
        The free parameters.
    fixed : mapping of str to float, optional
        Values of parameters that are not free, in place of the model's.
    aperture : Aperture, optional
        Cones of light.
    """
    import casadi

    rays = rays_through(observations.geometry, aperture)
    x = casadi.MX.sym("x", len(layout.labels))
    here = {**INSTRUMENT, **model.values(rays.geometry), **(fixed or {})}
    values: dict[str, Any] = {}
    for name, value in here.items():
        if name in layout.column:
            entries = x[layout.column[name][rays.parent].tolist()]
            # A slice of a single number comes out as a row, of a column as a column
            values[name] = casadi.reshape(entries, 1, len(rays.parent))
        else:
            row = np.broadcast_to(np.asarray(value, dtype=float), rays.parent.shape)
            values[name] = casadi.DM(row.copy()).T
    brdf = {name: value for name, value in values.items() if name not in INSTRUMENT}
    mixing = Mixing.of(rays, observations.names)
    mueller = casadi.vec(model.mueller(brdf, rays.geometry, mixing.elements))

    first = np.searchsorted(rays.parent, np.arange(observations.geometry.size))
    scale = casadi.MX(values["scale"])[:, first.tolist()].T
    background = casadi.MX(values["background"])[:, first.tolist()].T

    def linear(names: np.ndarray, at: np.ndarray) -> Any:
        weights = mixing.matrix(names, at)
        offset = np.array([LINEAR[name].get("M00", 0.0) for name in names])
        where = at.tolist()
        y = scale[where, :] * (weights @ mueller)
        return y + background[where, :] * casadi.DM(offset)

    y = _readings(observations, linear)
    function = casadi.Function("reading", [x], [y])
    return Prediction(function)


def _readings(observations: Observations, linear: Any) -> Any:
    """Return the column of observables; DOLP is a ratio, all others are linear."""
    import casadi

    is_ratio = observations.name == "DOLP"
    plain, ratio = np.flatnonzero(~is_ratio), np.flatnonzero(is_ratio)
    parts = []
    if plain.size:
        parts.append(linear(observations.name[plain], observations.at[plain]))
    if ratio.size:
        at = observations.at[ratio]
        total, q, u = (
            linear(np.full(at.size, element), at) for element in ("M00", "M10", "M20")
        )
        # The tiny term gives the root a derivative where polarisation vanishes
        parts.append(casadi.sqrt((q**2 + u**2) / total**2 + 1e-24))
    if len(parts) == 1:
        return parts[0]
    order = np.argsort(np.concatenate([plain, ratio]))
    return casadi.vertcat(*parts)[order.tolist(), :]

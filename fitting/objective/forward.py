"""From the free parameters to the numbers a goniometer reads, as one expression."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from fitting.objective.objective import Prediction
from fitting.readings.aperture import Cones, rays_through
from fitting.readings.mixing import Mixing
from fitting.readings.observations import LINEAR, NORMALISED, Geometry, Observations

if TYPE_CHECKING:
    import casadi

__all__ = ["Layout", "MuellerModel", "predict"]

# Parameters of the instrument, which every model has, and their values in a fixed state
INSTRUMENT = {"scale": 1.0, "background": 0.0}
# What may differ from wavelength to wavelength; slopes and shadowing are geometry
SPECTRAL = (
    "specular_gain",
    "diffuse_albedo",
    "volume_albedo",
    "volume_depolarization",
    "grazing_albedo",
    "n",
    "kappa",
    "scale",
    "background",
)
# By what parameters can be told apart
GROUPS = ("scan", "wavelength", "theta_i", "nothing")


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
        For each free parameter the entry that holds at each geometry, -1 where it is held.
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
        *,
        all_scans: bool = True,
    ) -> "Layout":
        """Lay out the free parameters, one entry each or one for each group.

        Parameters
        ----------
        free : sequence of str
            Parameters to vary.
        observations : Observations
            The data.
        separate : sequence of str, or mapping of str to a word of `GROUPS`
            Parameters with a value of their own in each scan, or in each such group. By
            default those of `SPECTRAL` have one for each wavelength, and the scale of
            relative data one for each scan.
        all_scans : bool
            False if only relative scans have a free scale.
        """
        rules = _rules(free, observations, separate)
        read = np.isin(np.arange(observations.geometry.size), observations.at)
        labels: list[str] = []
        base: list[str] = []
        column = {}
        for name in free:
            here = np.ones_like(read)
            if name == "scale" and not all_scans:
                here = observations.relative[observations.scan]
            texts, member = _groups(rules[name], observations, read & here)
            column[name] = np.where(here, member + len(labels), -1)
            labels += [f"{name}[{text}]" if text else name for text in texts]
            base += [name] * len(texts)
        return cls(tuple(labels), tuple(base), column)


def _rules(
    free: Sequence[str],
    observations: Observations,
    separate: Sequence[str] | Mapping[str, str],
) -> dict[str, tuple[str, ...]]:
    """Return by what each free parameter is told apart."""
    asked = separate if isinstance(separate, Mapping) else dict.fromkeys(separate, "scan")
    strangers = set(asked) - set(free)
    if strangers:
        msg = f"separate must name free parameters, got {sorted(strangers)[0]!r}."
        raise ValueError(msg)
    for word in asked.values():
        if word not in GROUPS:
            msg = f"separate must be by {', '.join(GROUPS)}, got {word!r}."
            raise ValueError(msg)
    several = len(observations.wavelengths) > 1
    rules = {}
    for name in free:
        by = asked.get(name)
        if by is None and name == "scale" and observations.relative.any():
            by = "scan" if len(observations.labels) > 1 else None
        if by is None:
            by = "wavelength" if several and name in SPECTRAL else "nothing"
        rule: tuple[str, ...] = () if by == "nothing" else (by,)
        # A group that holds several wavelengths still has a value for each
        crowded = observations.mixes_wavelengths if by == "scan" else several
        if by in ("scan", "theta_i") and name in SPECTRAL and crowded:
            rule += ("wavelength",)
        rules[name] = rule
    return rules


def _groups(
    rule: tuple[str, ...], observations: Observations, within: np.ndarray
) -> tuple[list[str], np.ndarray]:
    """Return the groups that occur `within` by name, and the group of each geometry."""
    geometry = observations.geometry
    member = np.zeros(geometry.size, dtype=int)
    texts = [""]
    for word in rule:
        if word == "scan":
            keys, words = observations.scan, list(observations.labels)
        elif word == "wavelength":
            waves = np.unique(geometry.wavelength.round(9))
            keys = np.searchsorted(waves, geometry.wavelength.round(9))
            words = [f"{wave:.9g}" if np.isfinite(wave) else "?" for wave in waves]
        else:
            angles, keys = np.unique(geometry.theta_i.round(9), return_inverse=True)
            words = [f"{np.rad2deg(angle):.4g} deg" for angle in angles]
        member = member * len(words) + keys
        texts = [f"{one}, {two}" if one else two for one in texts for two in words]
    found = np.unique(member[within])
    group = np.searchsorted(found, np.clip(member, None, found[-1]))
    return [texts[one] for one in found], group


def predict(
    model: MuellerModel,
    observations: Observations,
    layout: Layout,
    *,
    fixed: Mapping[str, float] | None = None,
    cones: Cones | None = None,
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
    cones : Cones, optional
        Cones of light, and how finely each is averaged.
    """
    import casadi

    rays = rays_through(observations.geometry, cones)
    x = casadi.MX.sym("x", len(layout.labels))
    here = {**INSTRUMENT, **model.values(rays.geometry), **(fixed or {})}
    values: dict[str, Any] = {}
    for name, value in here.items():
        row = np.broadcast_to(np.asarray(value, dtype=float), rays.parent.shape).copy()
        if name not in layout.column:
            values[name] = casadi.DM(row).T
            continue
        column = layout.column[name][rays.parent]
        entries = x[np.maximum(column, 0).tolist()]
        # A slice of a single number comes out as a row, of a column as a column
        values[name] = casadi.reshape(entries, 1, len(rays.parent))
        held = column < 0
        if held.any():
            is_free = casadi.DM((~held).astype(float)).T
            values[name] = values[name] * is_free + casadi.DM(np.where(held, row, 0.0)).T
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


def _mean_dolp(square: Any, stderr: np.ndarray) -> Any:
    """Return the mean reading of a DOLP whose square is given, lifted by noise of Q and U.

    A length of two components with noise s is Rice's [1]_: p + s^2 / (2 p) where p is far
    above s, sqrt(pi/2) s where there is no polarisation. In units of s the root of
    p^2 + 1 + (pi/2 - 1) exp(-p^2/3) is its mean to 0.008. A reading without a stated error
    is taken as it is.

    References
    ----------
    .. [1] S. O. Rice, Mathematical analysis of random noise, Bell Syst. Tech. J. 24, 46
       (1945).
    """
    import casadi

    noise = casadi.DM(np.nan_to_num(stderr) ** 2)
    # The tiny term gives the root a derivative where polarisation vanishes
    noise = noise + 1e-24
    return casadi.sqrt(
        square + noise * (1.0 + (np.pi / 2 - 1.0) * casadi.exp(-square / (3.0 * noise)))
    )


def _readings(observations: Observations, linear: Any) -> Any:
    """Return the column of observables: linear ones, normalised elements, DOLP."""
    import casadi

    names, is_dolp = observations.name, observations.name == "DOLP"
    is_normal = np.isin(names, list(NORMALISED))
    groups = [np.flatnonzero(g) for g in (~is_dolp & ~is_normal, is_normal, is_dolp)]

    def of(chosen: np.ndarray, element: Any) -> Any:
        elements = np.broadcast_to(np.asarray(element), chosen.shape)
        return linear(elements, observations.at[chosen])

    plain, normal, dolp = groups
    parts = []
    if plain.size:
        parts.append(of(plain, names[plain]))
    if normal.size:
        divided = np.array([NORMALISED[name] for name in names[normal]])
        parts.append(of(normal, divided) / of(normal, "M00"))
    if dolp.size:
        total, q, u = (of(dolp, element) for element in ("M00", "M10", "M20"))
        parts.append(_mean_dolp((q**2 + u**2) / total**2, observations.stderr[dolp]))
    if len(parts) == 1:
        return parts[0]
    order = np.argsort(np.concatenate(groups))
    return casadi.vertcat(*parts)[order.tolist(), :]

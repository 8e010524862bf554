"""A simulated surface in the fit's loop: the specular curve comes from traced paths.

Over an opaque surface the paths of the light do not depend on the index. Traced once, they
are shaded again for each n and kappa that the solver asks for, with every bounce. Gain and
diffuse albedo stay linear, outside the simulation.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from fitting.observations import Geometry
from fitting.parameters import PARAMETERS

if TYPE_CHECKING:
    import casadi

__all__ = ["SimulatedModel"]

Shade = Callable[[Geometry, Mapping[str, float]], np.ndarray]


class SimulatedModel:
    """Reflectance = specular_gain * simulated curve + Lambertian term of diffuse_albedo.

    Parameters
    ----------
    shade : callable
        (geometry, values) -> BRDF of the simulation at the N geometries, shape (N, 4, 4),
        smooth in the values. [1/sr]
    parameters : mapping of str to float
        Present values of what `shade` depends on, as n and kappa.
    specular_gain, diffuse_albedo : float
        Present values of the linear parameters.
    derivative : callable, optional
        (geometry, values, name) -> derivative of the curve by one parameter, (N, 4, 4).
        Without it, central differences of `shade`.
    """

    def __init__(
        self,
        shade: Shade,
        parameters: Mapping[str, float],
        *,
        specular_gain: float = 1.0,
        diffuse_albedo: float = 0.0,
        derivative: Callable[[Geometry, Mapping[str, float], str], np.ndarray]
        | None = None,
    ) -> None:
        self.shade, self.derivative = shade, derivative
        self.parameters = dict(parameters)
        self.specular_gain, self.diffuse_albedo = specular_gain, diffuse_albedo
        # CasADi does not own its callbacks: they must outlive every expression
        self._callbacks: list[Any] = []

    @property
    def first_order(self) -> frozenset[str]:
        """Parameters by which only first derivatives exist: those of the simulation."""
        return frozenset(self.parameters)

    def values(self, geometry: Geometry) -> dict[str, np.ndarray]:
        """Return every parameter at each geometry, shape (N,)."""
        present = {
            **self.parameters,
            "specular_gain": self.specular_gain,
            "diffuse_albedo": self.diffuse_albedo,
        }
        return {name: np.full(geometry.size, value) for name, value in present.items()}

    def mueller(
        self, values: Mapping[str, Any], geometry: Geometry, elements: Sequence[int]
    ) -> "casadi.MX":
        """Return elements of the BRDF, shape (E, N), numbered along the rows. [1/sr]"""
        import casadi

        names = tuple(self.parameters)
        inputs = [values[name][0, 0] for name in names]
        if all(isinstance(value, casadi.DM) for value in inputs):
            numbers = {n: float(v) for n, v in zip(names, inputs, strict=True)}
            specular = casadi.DM(self.curve(geometry, numbers)[:, list(elements)].T)
        else:
            callback = _shading(self, geometry, names, tuple(elements))
            self._callbacks.append(callback)
            flat = callback(casadi.vertcat(*inputs))
            specular = casadi.reshape(flat, len(elements), geometry.size)
        gain, diffuse = values["specular_gain"], values["diffuse_albedo"]
        lambertian = casadi.DM(
            [1.0 / np.pi if element == 0 else 0.0 for element in elements]
        )
        return casadi.repmat(gain, len(elements), 1) * specular + lambertian @ diffuse

    def updated(self, values: Mapping[str, float]) -> "SimulatedModel":
        """Return the model with these values."""
        present = {
            **self.parameters,
            "specular_gain": self.specular_gain,
            "diffuse_albedo": self.diffuse_albedo,
            **values,
        }
        return SimulatedModel(
            self.shade,
            {name: present[name] for name in self.parameters},
            specular_gain=present["specular_gain"],
            diffuse_albedo=present["diffuse_albedo"],
            derivative=self.derivative,
        )

    def curve(self, geometry: Geometry, values: Mapping[str, float]) -> np.ndarray:
        """Return the simulated curve, shape (N, 16)."""
        return np.asarray(self.shade(geometry, values), dtype=float).reshape(-1, 16)

    def slope(
        self, geometry: Geometry, values: Mapping[str, float], name: str
    ) -> np.ndarray:
        """Return the derivative of the curve by one parameter, shape (N, 16)."""
        if self.derivative is not None:
            slope = self.derivative(geometry, values, name)
            return np.asarray(slope, dtype=float).reshape(-1, 16)
        low, high, scale, *_ = PARAMETERS.get(name, (-np.inf, np.inf, 1.0))
        up = min(values[name] + 1e-4 * scale, high)
        down = max(values[name] - 1e-4 * scale, low)
        above = self.curve(geometry, {**values, name: up})
        return (above - self.curve(geometry, {**values, name: down})) / (up - down)


def _shading(
    model: SimulatedModel,
    geometry: Geometry,
    names: tuple[str, ...],
    elements: tuple[int, ...],
) -> "casadi.Callback":
    """Return the curve as a CasADi function of the parameters, with its Jacobian."""
    columns = list(elements)

    def curve(point: tuple[float, ...]) -> np.ndarray:
        values = dict(zip(names, point, strict=True))
        return model.curve(geometry, values)[:, columns].ravel()

    def jacobian(point: tuple[float, ...]) -> np.ndarray:
        values = dict(zip(names, point, strict=True))
        slopes = [model.slope(geometry, values, name)[:, columns].ravel() for name in names]
        return np.stack(slopes, axis=1)

    size, count = len(elements) * geometry.size, len(names)
    slopes = _callback(jacobian, (count, size), (size, count))
    return _callback(curve, (count,), (size, 1), slopes)


def _callback(
    function: Callable[[tuple[float, ...]], np.ndarray],
    inputs: tuple[int, ...],
    output: tuple[int, int],
    derivative: "casadi.Callback | None" = None,
) -> "casadi.Callback":
    """Wrap a function of one point; a Jacobian is also handed the value there, unused."""
    import casadi

    # The solver asks for cost, gradient and Hessian at one point in turn
    remembered = lru_cache(maxsize=8)(function)

    class Wrapped(casadi.Callback):
        def __init__(self) -> None:
            casadi.Callback.__init__(self)
            self.derivative = derivative
            self.construct("simulated", {})

        def get_n_in(self) -> int:
            return len(inputs)

        def get_sparsity_in(self, index: int) -> Any:
            return casadi.Sparsity.dense(inputs[index], 1)

        def get_sparsity_out(self, index: int) -> Any:
            return casadi.Sparsity.dense(*output)

        def eval(self, arguments: Sequence[Any]) -> list[Any]:
            return [casadi.DM(remembered(tuple(arguments[0].full().ravel().tolist())))]

        def has_jacobian(self) -> bool:
            return derivative is not None

        def get_jacobian(self, *_: Any) -> Any:
            return derivative

    return Wrapped()

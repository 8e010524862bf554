"""The one statement of a fit: predicted curve, data, weights, bounds and prior knowledge.

An objective knows its value and derivatives and no optimiser. With residuals
r = (prediction(x) - data) / stderr it is

    cost(x) = 1/2 sum rho(r^2) + 1/2 sum ((x - prior_value) / prior_stderr)^2,

where rho(z) = z is least squares; other losses let outliers pull less
(`fitting.objective.losses`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import TYPE_CHECKING

import numpy as np

from fitting.objective.losses import LOSSES, loss_functions
from fitting.objective.parameters import Parameter

if TYPE_CHECKING:
    import casadi

__all__ = ["Objective", "Prediction"]


@dataclass(frozen=True, eq=False)
class Prediction:
    """A predicted curve y(x) with derivatives, shared by all objectives built on it.

    Parameters
    ----------
    function : casadi.Function
        Maps x (n) to y (m).
    """

    function: "casadi.Function"

    @cached_property
    def jacobian(self) -> "casadi.Function":
        """The casadi function x -> dy/dx, shape (m, n)."""
        import casadi

        x = casadi.MX.sym("x", self.function.size1_in(0))
        return casadi.Function("jacobian", [x], [casadi.jacobian(self.function(x), x)])

    @cached_property
    def is_linear(self) -> bool:
        """True if y is an affine function of x, so the fit needs no search."""
        import casadi

        x = casadi.MX.sym("x", self.function.size1_in(0))
        weight = casadi.MX.sym("w", self.function.size1_out(0))
        gradient = casadi.gradient(casadi.dot(weight, self.function(x)), x)
        # The Hessian of any weighted sum has no entry at all
        hessian = casadi.Function("gradient", [x, weight], [gradient]).jac_sparsity(0, 0)
        return int(hessian.nnz()) == 0

    # The cache belongs to the prediction and dies with it
    @cached_property
    def expressions(self) -> "Callable[[str], Expressions]":
        """Symbolic cost for a loss, built once for each loss."""
        return cache(lambda loss: Expressions(self, loss))


class Expressions:
    """Cost of a prediction as a casadi expression of x and of the numbers p it depends on.

    Attributes
    ----------
    x, p, cost : casadi.MX
        p stacks data (m), 1/stderr (m), prior values (n) and 1/prior_stderr (n).
    value_gradient : casadi.Function
        (x, p) -> (cost, gradient).
    """

    def __init__(self, prediction: Prediction, loss: str) -> None:
        import casadi

        m, n = prediction.function.size1_out(0), prediction.function.size1_in(0)
        self._prediction, self._rho = prediction, LOSSES[loss]
        self.x = casadi.MX.sym("x", n)
        self.p = casadi.MX.sym("p", 2 * m + 2 * n)
        data, self._weight = self.p[:m], self.p[m : 2 * m]
        prior, self._prior_weight = self.p[2 * m : 2 * m + n], self.p[2 * m + n :]
        self._residual = self._weight * (prediction.function(self.x) - data)
        penalty = self._prior_weight * (self.x - prior)

        misfit = casadi.sum1(self._rho(self._residual**2))
        self.cost = 0.5 * misfit + 0.5 * casadi.sumsqr(penalty)
        gradient = casadi.gradient(self.cost, self.x)
        arguments = [self.x, self.p]
        self.value_gradient = casadi.Function("cost", arguments, [self.cost, gradient])

    @cached_property
    def hessian(self) -> "casadi.Function":
        """(x, p) -> exact Hessian of the cost."""
        import casadi

        hessian, _ = casadi.hessian(self.cost, self.x)
        return casadi.Function("hessian", [self.x, self.p], [hessian])

    @cached_property
    def gauss_newton(self) -> "casadi.MX":
        """J^T D J with D = rho'(r^2), the Hessian without the curvature of the model."""
        import casadi

        m, n = self._residual.numel(), self.x.numel()
        z = casadi.MX.sym("z", m)
        slope = casadi.gradient(casadi.sum1(self._rho(z)), z)
        slope = casadi.substitute(slope, z, self._residual**2)
        half = casadi.sqrt(casadi.fmax(slope, 0.0)) * self._weight
        jacobian = casadi.repmat(half, 1, n) * self._prediction.jacobian(self.x)
        return jacobian.T @ jacobian + casadi.diag(self._prior_weight**2)


@dataclass(frozen=True, kw_only=True, eq=False)
class Objective:
    """A prediction to be brought to data.

    Parameters
    ----------
    prediction : Prediction
        Prediction of the m data from the n parameters.
    data, stderr : ndarray, shape (m,)
        Measured values and their standard errors, finite and stderr > 0.
    parameters : sequence of Parameter
        In the order of the prediction's argument.
    loss : str
        A key of `LOSSES`.
    """

    prediction: Prediction
    data: np.ndarray
    stderr: np.ndarray
    parameters: Sequence[Parameter]
    loss: str = "linear"

    def __post_init__(self) -> None:
        if self.loss not in LOSSES:
            known = ", ".join(LOSSES)
            msg = f"loss must be one of {known}, got {self.loss!r}. Usual is 'linear'."
            raise ValueError(msg)

    @property
    def start(self) -> np.ndarray:
        """Where the search begins, shape (n,)."""
        return np.array([parameter.value for parameter in self.parameters])

    @property
    def low(self) -> np.ndarray:
        """Lower bounds, shape (n,)."""
        return np.array([parameter.low for parameter in self.parameters])

    @property
    def high(self) -> np.ndarray:
        """Upper bounds, shape (n,)."""
        return np.array([parameter.high for parameter in self.parameters])

    @cached_property
    def numbers(self) -> np.ndarray:
        """The p of `Expressions`: data, weights and priors of this objective."""
        prior = [parameter.prior_value for parameter in self.parameters]
        prior_stderr = np.array([parameter.prior_stderr for parameter in self.parameters])
        return np.concatenate([self.data, 1.0 / self.stderr, prior, 1.0 / prior_stderr])

    @property
    def expressions(self) -> Expressions:
        """The symbolic cost, for solvers that want to differentiate it themselves."""
        return self.prediction.expressions(self.loss)

    def cost(self, x: np.ndarray) -> float:
        """Return the cost at x; inf where the curve is not finite."""
        z = self.residuals(x) ** 2
        if self.loss != "linear":
            z = loss_functions(self.loss)[0](z[None, :]).full().ravel()
        penalty = [
            (v - p.prior_value) / p.prior_stderr
            for v, p in zip(x, self.parameters, strict=True)
        ]
        cost = 0.5 * float(z.sum()) + 0.5 * float(np.square(penalty).sum())
        return cost if np.isfinite(cost) else np.inf

    def cost_gradient(self, x: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the cost and its exact gradient at x, shape (n,)."""
        value, gradient = self.expressions.value_gradient(x, self.numbers)
        cost = float(value)
        return (cost if np.isfinite(cost) else np.inf), gradient.full().ravel()

    def hessian(self, x: np.ndarray) -> np.ndarray:
        """Return the exact Hessian of the cost at x, shape (n, n)."""
        return np.asarray(self.expressions.hessian(x, self.numbers).full())

    def predict(self, x: np.ndarray) -> np.ndarray:
        """Return the predicted curve at x, shape (m,)."""
        return self.prediction.function(x).full().ravel()

    def residuals(self, x: np.ndarray) -> np.ndarray:
        """Return (prediction - data) / stderr at x, shape (m,), priors left out."""
        return (self.predict(x) - self.data) / self.stderr

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """Return d residuals / dx at x, shape (m, n), priors left out."""
        return self.prediction.jacobian(x).full() / self.stderr[:, None]

    def influence(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return psi = r rho'(r^2) of each residual at x and its derivative, each (m,)."""
        psi, bend = loss_functions(self.loss)[1](self.residuals(x)[None, :])
        return psi.full().ravel(), bend.full().ravel()

    def sizes(self, x: np.ndarray) -> np.ndarray:
        """Return the parameters' own size, or their natural scale where they are 0."""
        natural = np.array([parameter.scale for parameter in self.parameters])
        return np.where(x == 0.0, natural, np.abs(x))

    def step_sizes(self, x: np.ndarray) -> np.ndarray:
        """Return the change of each parameter that alone changes the fit by its misfit.

        Never more than the larger of its own size and its natural scale: at kappa = 0 the
        effect vanishes, and a step of equal effect would have no end.
        """
        with np.errstate(all="ignore"):
            curvature = np.linalg.norm(self.jacobian(x), axis=0)
            step = np.sqrt(2.0 * self.cost(x)) / curvature
        natural = [parameter.scale for parameter in self.parameters]
        largest = np.maximum(np.abs(x), natural)
        return np.where(
            np.isfinite(step) & (step > 0.0), np.minimum(step, largest), largest
        )

    def whitening(self, x: np.ndarray) -> np.ndarray:
        """Return T, shape (n, n), with T^T J^T J T = 2 cost(x): steps of equal effect.

        Directions without effect are cut at 1e-10 of the strongest.
        """
        jacobian, sizes = self.jacobian(x), self.sizes(x)
        length = np.linalg.norm(jacobian, axis=0)
        if not np.isfinite(length).all() or not length.any():
            return np.diag(sizes)
        length = np.where(length > 0.0, length, 1.0 / sizes)
        unit = jacobian / length
        unit = np.vstack([unit, np.zeros((max(0, len(x) - len(unit)), len(x)))])
        _, singular, basis = np.linalg.svd(unit, full_matrices=False)
        singular = np.maximum(singular, 1e-10 * singular[0])
        return np.sqrt(2.0 * self.cost(x)) * (basis.T / singular) / length[:, None]

    def is_at_rest(self, x: np.ndarray) -> bool:
        """Tell whether a Gauss-Newton step would change the cost by less than rounding."""
        cost, gradient = self.cost_gradient(x)
        pressed = ((x <= self.low) & (gradient > 0)) | ((x >= self.high) & (gradient < 0))
        step = self.whitening(x).T @ np.where(pressed, 0.0, gradient)
        # Data without noise can be met to rounding, which grows with the nodes of a cone's
        # average; then the cost is no measure of itself
        rounding = 1e-12 * float(np.linalg.norm(self.data / self.stderr))
        return float(np.linalg.norm(step)) <= max(1e-7 * cost, rounding)

    def with_data(self, data: np.ndarray, stderr: np.ndarray) -> "Objective":
        """Return the objective for other data or weights on the same prediction."""
        return replace(self, data=data, stderr=stderr)

    def with_parameters(self, parameters: Sequence[Parameter]) -> "Objective":
        """Return the objective with other starts or bounds."""
        return replace(self, parameters=tuple(parameters))

    def started_at(self, x: np.ndarray) -> "Objective":
        """Return the objective with another start, moved inside the bounds."""
        pairs = zip(self.parameters, x, strict=True)
        return self.with_parameters([p.started_at(float(value)) for p, value in pairs])

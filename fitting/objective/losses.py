"""How much an outlier pulls: losses rho(r^2) of a residual [1]_.

References
----------
.. [1] P. J. Huber, E. M. Ronchetti, Robust Statistics, 2nd ed., 2009, chapter 7.
"""

from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import casadi

__all__ = ["LOSSES", "loss_functions"]


def _linear(z: Any) -> Any:
    return z


def _soft_l1(z: Any) -> Any:
    import casadi

    return 2.0 * (casadi.sqrt(1.0 + z) - 1.0)


def _huber(z: Any) -> Any:
    import casadi

    # 1.345 keeps 95 % efficiency on Gaussian noise
    bend = 1.345
    beyond = casadi.sqrt(casadi.fmax(z, bend**2)) - bend
    return casadi.fmin(z, bend**2) + 2.0 * bend * beyond


def _cauchy(z: Any) -> Any:
    import casadi

    # 2.385 keeps 95 % efficiency on Gaussian noise
    return 2.385**2 * casadi.log1p(z / 2.385**2)


LOSSES: dict[str, Callable[[Any], Any]] = {
    "linear": _linear,
    "huber": _huber,
    "soft_l1": _soft_l1,
    "cauchy": _cauchy,
}


@cache
def loss_functions(loss: str) -> "tuple[casadi.Function, casadi.Function]":
    """Return z -> rho(z) and r -> (psi, d psi/dr) of a loss."""
    import casadi

    z, r = casadi.SX.sym("z"), casadi.SX.sym("r")
    psi = casadi.gradient(0.5 * LOSSES[loss](r**2), r)
    return (
        casadi.Function("loss", [z], [LOSSES[loss](z)]),
        casadi.Function("influence", [r], [psi, casadi.gradient(psi, r)]),
    )

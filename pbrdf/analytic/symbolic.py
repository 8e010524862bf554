"""The analytical model on CasADi symbols, from the very source that is compiled.

`rebind` takes a kernel's Python source and lets its names sqrt, exp, ... mean CasADi's
functions, all the way down. So there is one definition of the physics: whatever the
compiled model does, the expression does.
"""

from collections.abc import Callable, Mapping
from types import FunctionType
from typing import Any

from pbrdf.analytic.tables import (
    GRAZING_FORMS,
    SHADOWING,
    SLOPE_DISTRIBUTIONS,
    VOLUME_FORMS,
    code_of,
)
from pbrdf.kernels.microfacet import facet, microfacet, slopes
from pbrdf.kernels.microfacet.shadowing import Shadowing
from pbrdf.kernels.optics import volume

__all__ = ["brdf_expression", "rebind"]


def rebind(
    function: Any, operations: Mapping[str, Any], done: dict[Any, Any] | None = None
) -> Callable[..., Any]:
    """Copy of a kernel that calls `operations` by name, and copies of the kernels it calls.

    Parameters
    ----------
    function : callable
        A compiled kernel or plain function.
    operations : mapping
        Replacement of each named function (sqrt, exp, select, ...).

    Examples
    --------
    >>> from pbrdf.kernels.optics.fresnel import wave_normal
    >>> shown = rebind(wave_normal, {"sqrt": lambda x: 2.0, "select": lambda c, a, b: a})
    >>> shown(0.5, 1.5, 0.0)
    (2.0, 0.0)
    """
    done = {} if done is None else done
    source = getattr(function, "py_func", function)
    if source not in done:
        scope = dict(source.__globals__)
        done[source] = FunctionType(
            source.__code__, scope, source.__name__, source.__defaults__
        )
        for name in source.__code__.co_names:
            value = scope.get(name)
            if name in operations:
                scope[name] = operations[name]
            elif isinstance(getattr(value, "py_func", value), FunctionType):
                scope[name] = rebind(value, operations, done)
    return done[source]


def _casadi_operations() -> dict[str, Any]:
    """CasADi's meaning of the names that the kernels use."""
    import casadi as ca

    def select(condition: Any, value: Any, otherwise: Any) -> Any:
        if isinstance(condition, bool):
            return value if condition else otherwise
        return ca.if_else(condition, value, otherwise)

    names = ("sqrt", "exp", "log", "sin", "cos", "erf", "atan2")
    return {name: getattr(ca, name) for name in names} | {"select": select, "abs": ca.fabs}


def brdf_expression(  # noqa: PLR0913  (one keyword for each choice of the model)
    model_parameters: Mapping[str, Any],
    theta_i: Any,
    theta_s: Any,
    dphi: Any,
    *,
    shadowing: str = "smith-correlated",
    slope_distribution: str = "gaussian",
    volume_form: str = "polarised-base",
    grazing_form: str = "bounded",
    phi_i: Any = 0.0,
) -> Any:
    """Mueller BRDF of `MicrofacetModel` as a CasADi expression.

    Parameters
    ----------
    model_parameters : mapping of str to casadi.SX, casadi.MX or float
        `n` and `slope_rms` (or `slope_rms_x` and `slope_rms_y`) are needed; the other
        numbers of `MicrofacetModel` default as there. Leave out a volume_albedo of 0: it
        costs more than all the rest.
    theta_i, theta_s, dphi, phi_i : casadi.SX, casadi.MX or float
        One geometry; map a `casadi.Function` over many. [rad]
    shadowing, slope_distribution, volume_form, grazing_form : str
        Names as in `MicrofacetModel`.

    Returns
    -------
    casadi.SX or casadi.MX, shape (4, 4)
        Smooth in the parameters, so gradients and Hessians are exact. [1/sr]

    Raises
    ------
    ValueError
        If a parameter is unknown or one that is needed is missing.

    Examples
    --------
    >>> import casadi as ca
    >>> n = ca.SX.sym("n")
    >>> matrix = brdf_expression({"n": n, "slope_rms": 0.2}, 0.7, 0.7, 3.141592653589793)
    >>> f = ca.Function("f", [n], [matrix[0, 0], ca.jacobian(matrix[0, 0], n)])
    >>> [round(float(v), 4) for v in f(1.5)]
    [0.0779, 0.2299]
    """
    import casadi as ca

    given = _with_defaults(model_parameters)
    operations = _casadi_operations()
    copies: dict[Any, Any] = {}
    law = code_of(SLOPE_DISTRIBUTIONS, slope_distribution, "slope_distribution")
    rule = code_of(SHADOWING, shadowing, "shadowing")
    slope_x, slope_y = given["slope_rms_x"], given["slope_rms_y"]
    norm = rebind(slopes.slope_norm, operations, copies)(law, slope_x, slope_y)
    more = (given["volume_albedo"], given["grazing_albedo"])
    diffuse = volume.Diffuse(
        given["diffuse_albedo"],
        given["grazing_albedo"],
        code_of(GRAZING_FORMS, grazing_form, "grazing_form"),
        given["volume_albedo"],
        code_of(VOLUME_FORMS, volume_form, "volume_form"),
        given["volume_depolarization"],
        not all(isinstance(value, float | int) and value == 0 for value in more),
    )
    surface = microfacet.Surface(
        slopes.Roughness(law, slope_x, slope_y, slope_x is slope_y, norm),
        Shadowing(rule, given["shadow_omega"], given["shadow_tau"]),
        given["specular_gain"],
        diffuse,
    )
    cos_phi, sin_phi = operations["cos"](phi_i), operations["sin"](phi_i)
    way = rebind(facet.directions, operations, copies)(
        theta_i, theta_s, dphi, cos_phi, sin_phi
    )
    evaluate = rebind(microfacet.microfacet_brdf, operations, copies)
    inside = rebind(volume.base_radiance, operations, copies)
    radiance = inside(given["n"], given["kappa"], diffuse)
    rows = evaluate(way, given["n"], given["kappa"], surface, radiance)
    return ca.vertcat(*(ca.horzcat(*row) for row in rows))


def _with_defaults(given: Mapping[str, Any]) -> dict[str, Any]:
    """Complete the parameters, or name what is missing or unknown."""
    values: dict[str, Any] = {
        "kappa": 0.0,
        "specular_gain": 1.0,
        "diffuse_albedo": 0.0,
        "shadow_omega": 0.7,
        "shadow_tau": 0.25,
        "volume_albedo": 0.0,
        "volume_depolarization": 1.0,
        "grazing_albedo": 0.0,
    }
    needed = {"n", "slope_rms_x", "slope_rms_y"}
    known = set(values) | needed | {"slope_rms"}
    unknown = sorted(set(given) - known)
    if unknown:
        msg = f"model_parameters has no {unknown[0]!r}. Known: {', '.join(sorted(known))}."
        raise ValueError(msg)
    values |= given
    if "slope_rms" in given:
        values |= {"slope_rms_x": given["slope_rms"], "slope_rms_y": given["slope_rms"]}
    missing = sorted(needed - set(values))
    if missing:
        msg = f"model_parameters must hold {missing[0]!r}. Pass n and slope_rms."
        raise ValueError(msg)
    return values

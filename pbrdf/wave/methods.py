"""The forms that scattering and the mean field can take, by name."""

from dataclasses import dataclass

from pbrdf.kernels.wave import scatter

__all__ = ["METHODS", "Method", "method_of"]


@dataclass(frozen=True)
class Method:
    """One form of the theory.

    Parameters
    ----------
    kernel : int
        Amplitude of an order, a code of `pbrdf.kernels.wave.scatter`.
    shadowed : bool
        Whether Smith's factor applies.
    orders : str
        "all" of the heights, "first" alone, or "slopes" for facets without waves.
    mean_field : str
        "second-order", "kirchhoff", or "none" for facets.
    summary : str
        For documents.
    """

    kernel: int
    shadowed: bool
    orders: str
    mean_field: str
    summary: str


METHODS = {
    "auto": Method(
        scatter.CURVATURE, True, "all", "second-order",
        "order-weighted, with mean and scatter of the local curvature and the phase of the "
        "mean field: the best of these on rigorous solutions",
    ),
    "first-order": Method(
        scatter.RICE, False, "first", "second-order",
        "vector perturbation theory: heights below a fiftieth of the wavelength",
    ),
    "kirchhoff": Method(
        scatter.TANGENT, False, "all", "kirchhoff",
        "Fresnel at the tangent plane: correlation lengths above the wavelength",
    ),
    "small-slope": Method(
        scatter.RICE, False, "all", "kirchhoff",
        "first small-slope approximation: gentle slopes of any height",
    ),
    "order-weighted": Method(
        scatter.ORDER_WEIGHTED, True, "all", "second-order",
        "tangent plane, with 1/n of the way to first order in order n",
    ),
    "local-curvature": Method(
        scatter.CURVATURE, True, "all", "second-order",
        "local curvature correction; of profiles in full, of surfaces as in auto",
    ),
    "geometric": Method(
        scatter.TANGENT, True, "slopes", "none",
        "mirroring facets with Smith's shadowing: heights and lengths above the wavelength",
    ),
}  # fmt: skip


def method_of(name: str) -> Method:
    """Form of a name.

    Examples
    --------
    >>> method_of("rayleigh")
    Traceback (most recent call last):
    ...
    ValueError: method must be one of auto, first-order, kirchhoff, small-slope, \
order-weighted, local-curvature, geometric, got 'rayleigh'.
    """
    if name not in METHODS:
        msg = f"method must be one of {', '.join(METHODS)}, got {name!r}."
        raise ValueError(msg)
    return METHODS[name]

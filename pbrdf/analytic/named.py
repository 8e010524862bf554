"""Models as users know them by name, each a `MicrofacetModel` with its choices made.

| name | slopes | shadowing | further terms | bounded at grazing |
|---|---|---|---|---|
| Torrance-Sparrow | Gaussian | V-groove | Lambertian | yes |
| Beard-Maxwell | modified Cauchy | Maxwell-Beard | rho_D + 2 rho_V/(cos_i + cos_s) | no |
| Priest-Germer | Gaussian | none | none | no |
| generalised | Gaussian | Maxwell-Beard | (22) and (23) | no |

"Bounded" means that a perfect mirror sends out no more light than it gets, at any
incidence; `pbrdf.analytic.reflectance` computes it. At slope 0.3 the others exceed 1 from
about 80 degrees on.
"""

from typing import Any

from pbrdf.analytic.microfacet import MicrofacetModel
from pbrdf.optics.materials import Material

__all__ = ["beard_maxwell", "generalised", "priest_germer", "torrance_sparrow"]


def torrance_sparrow(
    material: Material, slope_rms: float, *, diffuse_albedo: float = 0.0, **changes: Any
) -> MicrofacetModel:
    """V-groove model of K. Torrance and E. Sparrow, J. Opt. Soc. Am. 57, 1105 (1967).

    With polarised Fresnel facets, and the Gaussian of slopes (Blinn 1977; Cook, Torrance
    1982) in place of their Gaussian of tilt angles.

    Examples
    --------
    >>> torrance_sparrow(Material(1.5), 0.2).shadowing
    'torrance-sparrow'
    """
    choices: dict[str, Any] = {
        "shadowing": "torrance-sparrow",
        "diffuse_albedo": diffuse_albedo,
    }
    return MicrofacetModel(material, slope_rms, **(choices | changes))


def beard_maxwell(
    material: Material,
    slope_width: float,
    *,
    shadow_omega: float = 0.7,
    shadow_tau: float = 0.25,
    diffuse_albedo: float = 0.0,
    volumetric: float = 0.0,
    **changes: Any,
) -> MicrofacetModel:
    """Beard-Maxwell model as the NEF data system uses it, with full Mueller facets.

    Parameters
    ----------
    slope_width : float
        Sigma of the modified Cauchy law B/(cos (sigma^2 + tan^2)). [1]
    shadow_omega, shadow_tau : float
        Constants of (21). [rad]
    diffuse_albedo, volumetric : float
        pi times rho_D and rho_V of rho_D + 2 rho_V/(cos_i + cos_s). [1]

    Notes
    -----
    J. Maxwell, J. Beard et al., ERIM report AFAL-TR-73-303 (1973), after H. Westlund and
    G. Meyer, A BRDF database employing the Beard-Maxwell reflection model, Graphics
    Interface 2002. They measure the facet density by a monostatic scan; here it is the
    normalised law, with `specular_gain` for what remains.

    Examples
    --------
    >>> beard_maxwell(Material(1.5), 0.2, volumetric=0.1).slope_distribution
    'modified-cauchy'
    """
    choices: dict[str, Any] = {
        "slope_distribution": "modified-cauchy",
        "shadowing": "maxwell-beard",
        "shadow_omega": shadow_omega,
        "shadow_tau": shadow_tau,
        "diffuse_albedo": diffuse_albedo,
        "grazing_albedo": volumetric,
    }
    return MicrofacetModel(material, slope_width, **(choices | changes))


def priest_germer(material: Material, slope_rms: float, **changes: Any) -> MicrofacetModel:
    """Polarised Gaussian facets without shadowing.

    R. Priest and T. Germer, Polarimetric BRDF in the microfacet model, Proc. 2000 Meeting
    of the Military Sensing Symposia (2000); R. Priest, S. Meier, Opt. Eng. 41, 988 (2002).
    Their exp(-tan^2/(2 sigma^2))/(8 pi sigma^2 cos^4 cos cos) has sigma per axis as here.

    Examples
    --------
    >>> priest_germer(Material(1.37, 7.62), 0.1).shadowing
    'none'
    """
    return MicrofacetModel(material, slope_rms, **({"shadowing": "none"} | changes))


def generalised(
    material: Material,
    slope_rms: float,
    *,
    volume_albedo: float = 0.0,
    diffuse_albedo: float = 0.0,
    grazing_albedo: float = 0.0,
    **changes: Any,
) -> MicrofacetModel:
    """Return the paper's sum (24) of (20), (22) and (23), with (21) and its corrections.

    Parameters
    ----------
    volume_albedo : float
        alpha of (22). [1]
    diffuse_albedo, grazing_albedo : float
        pi times rho_d1 and rho_d2 of (23). [1]

    Examples
    --------
    >>> generalised(Material(1.53), 0.252, diffuse_albedo=0.13).volume_form
    'paper'
    """
    choices: dict[str, Any] = {
        "shadowing": "maxwell-beard",
        "volume_albedo": volume_albedo,
        "volume_form": "paper",
        "diffuse_albedo": diffuse_albedo,
        "grazing_albedo": grazing_albedo,
        "grazing_form": "paper",
    }
    return MicrofacetModel(material, slope_rms, **(choices | changes))

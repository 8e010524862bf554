"""Slope distributions and shadowing rules by name, each with its source.

The two tables are what `MicrofacetModel` accepts and what the documentation prints.
"""

from dataclasses import dataclass

from pbrdf.kernels.microfacet import shadowing, slopes
from pbrdf.kernels.optics import volume

__all__ = [
    "GRAZING_FORMS",
    "SHADOWING",
    "SLOPE_DISTRIBUTIONS",
    "VOLUME_FORMS",
    "Choice",
    "code_of",
]


@dataclass(frozen=True)
class Choice:
    """One named form: its code in the kernels, its equation and where it comes from."""

    code: int
    formula: str
    source: str


SLOPE_DISTRIBUTIONS = {
    "gaussian": Choice(
        slopes.GAUSSIAN,
        "P = exp(-tan^2/(2 s^2)) / (2 pi s^2 cos^4)",
        "the paper's (17) with the cos^4 that (18), (20) need; Beckmann, Spizzichino 1963",
    ),
    "modified-gaussian": Choice(
        slopes.MODIFIED_GAUSSIAN,
        "P = B exp(-tan^2/(2 s^2)) / (2 pi s^2 cos^3), B from (18)",
        "the paper's (17) as printed",
    ),
    "modified-cauchy": Choice(
        slopes.MODIFIED_CAUCHY,
        "P = B / (cos (s^2 + tan^2)), B from (18); s is a width, the tail sets the rms",
        "Beard-Maxwell model of the NEF data system; Westlund, Meyer 2002",
    ),
    "exponential": Choice(
        slopes.EXPONENTIAL,
        "P = 3 exp(-sqrt(3) tan/s) / (2 pi s^2 cos^4)",
        "two-sided exponential law scaled to the per-axis rms s",
    ),
    "trowbridge-reitz": Choice(
        slopes.TROWBRIDGE_REITZ,
        "P = a^2 / (pi (a^2 + tan^2)^2 cos^4), a^2 = 2 s^2; its rms is infinite",
        "Trowbridge, Reitz, J. Opt. Soc. Am. 65, 531 (1975); GGX of Walter et al. 2007",
    ),
}

SHADOWING = {
    "none": Choice(shadowing.NONE, "1", "no facet hides another"),
    "maxwell-beard": Choice(
        shadowing.MAXWELL_BEARD,
        "(1 + (tilt/Omega) exp(-2 beta/tau)) / (1 + tilt/Omega)",
        "the paper's (21); Maxwell, Beard et al., ERIM report 1973",
    ),
    "torrance-sparrow": Choice(
        shadowing.TORRANCE_SPARROW,
        "min(1, 2 cos(tilt) cos(theta)/cos(beta)) of both directions",
        "Torrance, Sparrow, J. Opt. Soc. Am. 57, 1105 (1967); Blinn 1977",
    ),
    "smith": Choice(
        shadowing.SMITH,
        "product of (1 - erfc(nu)/2) / (1 + Lambda)",
        "Smith, IEEE Trans. Antennas Propag. 15, 668 (1967)",
    ),
    "smith-uncorrelated": Choice(
        shadowing.SMITH_UNCORRELATED,
        "1/(1 + Lambda_i) * 1/(1 + Lambda_s)",
        "Smith for visible facets only; Bourlier, Berginc, Saillard 2002",
    ),
    "smith-correlated": Choice(
        shadowing.SMITH_CORRELATED,
        "1/(1 + Lambda_i + Lambda_s): both directions need a high facet",
        "Ross, Dion, Potvin, J. Opt. Soc. Am. A 22, 2442 (2005); Heitz 2014",
    ),
    "smith-direction": Choice(
        shadowing.SMITH_DIRECTION,
        "1/(1 + max + w min), w = 4.41 dphi/(4.41 dphi + 1): at one azimuth only the lower "
        "direction is hidden",
        "van Ginneken, Stavridi, Koenderink, Appl. Opt. 37, 130 (1998); Heitz 2014",
    ),
}

VOLUME_FORMS = {
    "paper": Choice(
        volume.PAPER,
        "(a/pi) T(theta_i) T(theta_s), element 00 only",
        "the paper's (22) with the 1/pi it lacks",
    ),
    "base": Choice(
        volume.BASE,
        "(a/pi) T(theta_i) T(theta_s) / (n^2 (1 - a F_i)), element 00 only",
        "Lambertian base under a smooth interface; Wolff, J. Opt. Soc. Am. A 11, 2956",
    ),
    "polarised-base": Choice(
        volume.POLARISED_BASE,
        "(a/pi) T(theta_s) diag(1, p, p, p) T(theta_i) / (n^2 (1 - a F_i)), matrices T",
        "the same, polarised by its way in and out; p = 1 - volume_depolarization",
    ),
}

GRAZING_FORMS = {
    "paper": Choice(
        volume.PAPER, "(a/pi) / (cos_i cos_s)", "the paper's (23), unbounded at grazing"
    ),
    "bounded": Choice(
        volume.BOUNDED,
        "(2 a/pi) / (cos_i + cos_s)",
        "Beard-Maxwell volume term; Westlund, Meyer 2002",
    ),
}


def code_of(table: dict[str, Choice], name: str, argument: str) -> int:
    """Kernel code of a name, or an error that lists the known ones."""
    if name not in table:
        msg = f"{argument} must be one of {', '.join(table)}, got {name!r}."
        raise ValueError(msg)
    return table[name].code

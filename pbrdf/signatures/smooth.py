"""A surface without roughness: all it reflects stays a beam."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pbrdf.optics import library
from pbrdf.optics.fresnel import specular_mueller
from pbrdf.optics.materials import Material

__all__ = ["SmoothSurface"]


@dataclass(frozen=True)
class SmoothSurface:
    """A polished plane, which has no BRDF but a specular beam.

    Parameters
    ----------
    material : Material or str
        What is below it, or a name of the library.
    """

    material: Material | str

    def brdf(
        self,
        theta_i: npt.ArrayLike,
        theta_s: npt.ArrayLike,
        dphi: npt.ArrayLike,
        wavelength: npt.ArrayLike | None = None,
    ) -> np.ndarray:
        """Nothing: no light leaves the specular beam. [1/sr]"""
        return np.zeros(
            (*np.broadcast_shapes(*map(np.shape, (theta_i, theta_s, dphi))), 4, 4)
        )

    def coherent(
        self, theta_i: npt.ArrayLike, wavelength: npt.ArrayLike | None = None
    ) -> np.ndarray:
        """Mueller matrix of the specular beam, in meridian frames. [1]"""
        material = self.material
        if not isinstance(material, Material):
            material = library.get(material)
        n, kappa = material.indices(wavelength)
        return specular_mueller(np.cos(theta_i), n, kappa)

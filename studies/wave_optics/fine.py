"""Roughness finer than half a wavelength. Run `python -m studies.wave_optics.fine`.

Rigorous solutions by `tests/rigorous_profile.py`, on short pieces with a fine step; some
minutes. Prints the power of "auto" over the true one, and the error that it states.
"""

import warnings

import numpy as np

from pbrdf import AccuracyWarning
from studies.wave_optics.fresh import ALUMINIUM, model_of, spectrum
from tests import rigorous_profile

VIEW = np.deg2rad(np.arange(-60.0, 61.0, 10.0))
THETAS = np.deg2rad([0.0, 30.0])
# Index, height and length in wavelengths, number of surfaces
CASES = (
    (1.5, 0.05, 0.2, 20), (1.5, 0.1, 0.2, 20), (1.5, 0.02, 0.1, 12), (1.5, 0.05, 0.1, 12),
    (ALUMINIUM, 0.05, 0.2, 30), (ALUMINIUM, 0.05, 0.1, 16),
)  # fmt: skip


def compared(index, height, length, count):
    """Power of "auto" over the true one, its standard error, and the stated error.

    Each of shape (incidences, s and p), over all views.
    """
    scales = ((height, length),)
    kept = rigorous_profile.LENGTH, rigorous_profile.WAIST, rigorous_profile.STEP
    # Short lengths need little of a surface, but a sixth of themselves as a step
    rigorous_profile.LENGTH, rigorous_profile.WAIST = 16.0, 3.2
    rigorous_profile.STEP = min(length / 6, kept[2])
    try:
        true, error = rigorous_profile.scattering(
            spectrum(scales), index, THETAS, VIEW, count, many=600
        )
    finally:
        rigorous_profile.LENGTH, rigorous_profile.WAIST, rigorous_profile.STEP = kept
    model = model_of(index, scales, "auto")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AccuracyWarning)
        found = model.profile_scattering(THETAS[:, None], VIEW, 1.0)
        stated = model.profile_error(THETAS[:, None], VIEW, 1.0)
    power = true[..., :2].sum(axis=1)
    noise = np.sqrt((error[..., :2] ** 2).sum(axis=1)) / power
    return found.sum(axis=1) / power, noise, np.median(stated, axis=1)


def main() -> None:
    print("index, height, length | incidence | auto over true for s and p | stated error")
    for index, height, length, count in CASES:
        ratio, noise, stated = compared(index, height, length, count)
        for i, theta in enumerate(np.rad2deg(THETAS)):
            pairs = ", ".join(
                f"{r:.3f} +- {n:.3f}" for r, n in zip(ratio[i], noise[i], strict=True)
            )
            errors = ", ".join(f"{e:.3f}" for e in stated[i])
            print(f"{index}, {height}, {length} | {theta:.0f} | {pairs} | {errors}")


if __name__ == "__main__":
    main()

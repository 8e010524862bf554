"""What a point of a store of drops to 2 % takes, estimated from short runs."""

import time
import warnings

import numpy as np

import pbrdf

INCIDENCES = np.deg2rad([5, 15, 25, 35, 45, 55])
WAVES = np.linspace(0.45, 0.8, 8)
CORNERS = ((0.05, 30.0), (0.15, 60.0), (0.25, 90.0))
AIM = 0.02


def scene(slope: float, contact_angle: float) -> pbrdf.Scene:
    surface = pbrdf.GaussianSurface(
        shape=(64, 64), spacing=2.0, corr_length=20.0, slope_rms=slope
    )
    drops = pbrdf.Drops(
        contact_angle=np.deg2rad(contact_angle), coverage=0.1, number_density=1e-3,
        material="water",
    )  # fmt: skip
    return pbrdf.Scene(surface, "pvc", drops)


def main() -> None:
    warnings.simplefilter("ignore")
    common = {"phi_i": "uniform", "fold": True, "n_theta": 18, "n_dphi": 36, "workers": 1}
    # Kernels compiled and loaded before the clock starts
    pbrdf.simulate(
        scene(0.05, 60.0), 0.1, wavelength=WAVES[:2], n_rays=50, realizations=2, **common
    )
    for slope, contact_angle in CORNERS:
        started = time.process_time()
        result = pbrdf.simulate(
            scene(slope, contact_angle), INCIDENCES, wavelength=WAVES, n_rays=2000,
            realizations=16, **common,
        )  # fmt: skip
        cpu = time.process_time() - started
        m00 = result.brdf_total[..., 0, 0]
        part = result.brdf_total_stderr[..., 0, 0] / m00
        part = part.where(m00 > 0.1 * m00.max(["theta_s", "dphi"]))
        worst, median = float(part.max()), float(part.median())
        print(
            f"slope {slope}, {contact_angle:g} deg: {cpu:.1f} s of CPU to {worst:.3f} at "
            f"worst, {median:.3f} in the median; to {AIM:g} by the worst "
            f"{cpu * (worst / AIM) ** 2:.0f} s, by the median "
            f"{cpu * (median / AIM) ** 2:.0f} s",
            flush=True,
        )


if __name__ == "__main__":
    main()

"""Cases that no form was chosen on. Run `python -m studies.wave_optics.fresh`.

A metal, an index of 1.3, spectra of two and three scales, incidence 0, 30 and 60 degrees:
rigorous solutions by `tests/rigorous_profile.py`, a quarter of an hour.
"""

import argparse
import warnings

import numpy as np

from pbrdf import AccuracyWarning, Material, WaveModel
from tests import rigorous_profile, wave_reference

ALUMINIUM = 1.2 + 6.9j
THETAS = np.array([0.0, 30.0, 60.0])
VIEW = np.deg2rad(np.arange(-80.0, 81.0, 4.0))
METHODS = ("auto", "order-weighted", "local-curvature")
SHARE = 0.05
# Heights and lengths of the scales, in wavelengths
ONE = [((0.1, 0.5),), ((0.2, 1),), ((0.05, 0.7),), ((0.1, 1),), ((0.2, 0.7),), ((0.4, 2),),
       ((0.3, 3),)]  # fmt: skip
SEVERAL = [
    ((0.2, 4), (0.05, 0.5)), ((0.1, 3), (0.03, 0.4)), ((0.4, 4), (0.05, 0.6)),
    ((0.2, 2), (0.1, 1), (0.05, 0.5)), ((0.3, 4), (0.1, 1.4), (0.03, 0.5)),
]  # fmt: skip
CASES = [
    *((ALUMINIUM, scales) for scales in ONE + SEVERAL),
    *((1.5, scales) for scales in SEVERAL[:4]),
    *(
        (1.3, ((h, length),))
        for h, length in ((0.1, 0.7), (0.2, 1), (0.3, 1.5), (0.05, 0.5))
    ),
    (np.inf, SEVERAL[0]),
]


def spectrum(scales):
    """Return the two-sided density of a profile of Gaussian scales."""

    def density(k):
        return sum(
            height**2 * np.sqrt(np.pi) * length * np.exp(-((k * length) ** 2) / 4)
            for height, length in scales
        )

    return density


def model_of(index, scales, method):
    """Return the same heights for a form."""
    material = (
        Material.mirror() if np.isinf(index) else Material(np.real(index), np.imag(index))
    )
    variance = sum(h * h for h, _ in scales)
    given = {"height_rms": np.sqrt(variance), "method": method}
    if len(scales) == 1:
        return WaveModel(material, corr_length=scales[0][1], **given)

    def correlation(x):
        return sum(h * h * np.exp(-((x / length) ** 2)) for h, length in scales) / variance

    return WaveModel(material, autocorrelation=correlation, **given)


def misses(found, true, error):
    """Return errors of s and p [dB] and of the interference [means], less the noise."""
    out = []
    for j in (0, 1):
        counted = true[:, j] > SHARE * true[:, j].max()
        off = 10 * np.log10(found[counted, j] / true[counted, j])
        noise = 10 / np.log(10) * error[counted, j] / true[counted, j]
        out.append(np.sqrt(max(np.mean(off**2 - noise**2), 0.0)))
    mean = true[:, :2].mean(axis=1)
    counted = mean > SHARE * mean.max()
    for j in (2, 3):
        off, noise = (one[counted, j] / mean[counted] for one in (found - true, error))
        out.append(np.sqrt(max(np.mean(off**2 - noise**2), 0.0)))
    return out


def covered(model, theta, found, true, error):
    """Return where the stated error of s and p, and twice it, holds the true one."""
    stated = model.profile_error(theta, VIEW, 1.0)
    counted = true[:, :2] > SHARE * true[:, :2].max(axis=0)
    off = np.abs(np.log(found[:, :2] / true[:, :2]))
    limit = np.hypot(np.log1p(stated), error[:, :2] / true[:, :2])
    return np.stack([off < limit, off < 2 * limit], axis=-1)[counted]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--surfaces", type=int, default=80, help="of each case")
    parser.add_argument("--quick", action="store_true", help="three cases, 10 surfaces")
    asked = parser.parse_args()
    warnings.simplefilter("ignore", AccuracyWarning)
    cases, count = (CASES[:3], 10) if asked.quick else (CASES, asked.surfaces)
    gathered = {method: [] for method in METHODS}
    held = []
    print("index, (height, length)...: form, then s, p [dB], Re, Im at each incidence")
    for index, scales in cases:
        true, error = rigorous_profile.scattering(
            spectrum(scales), index, np.deg2rad(THETAS), VIEW, count
        )
        for method in METHODS:
            model = model_of(index, scales, method)
            rows = []
            for i, theta in enumerate(THETAS):
                found = wave_reference.averaged(model, theta, VIEW)
                rows.append(misses(found, true[i], error[i]))
                if method == "auto":
                    at = np.deg2rad(theta)
                    held.append(covered(model, at, found, true[i], error[i]))
            gathered[method] += rows
            text = " | ".join(" ".join(f"{v:.2f}" for v in row) for row in rows)
            print(f"{index} {scales} {method}: {text}", flush=True)
    for method, rows in gathered.items():
        powers, mixed = np.array(rows)[:, :2].ravel(), np.array(rows)[:, 2:].ravel()
        print(
            f"{method}: {powers.size} cases, median {np.median(powers):.3f} dB, within 1 "
            f"dB {np.mean(powers < 1):.1%}, largest {powers.max():.2f}; interference "
            f"within 0.1 {np.mean(mixed < 0.1):.1%}, largest {mixed.max():.2f}"
        )
    once, twice = np.concatenate(held).mean(axis=0)
    print(
        f"the error that auto states holds {once:.1%} of the directions, twice it "
        f"{twice:.1%}"
    )


if __name__ == "__main__":
    main()

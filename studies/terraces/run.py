"""Print how well slopes and light survive digitisation to bands; see README.md."""

import argparse
import time
import warnings
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from data_io import deterrace, find_bands, mend_map
from fitting import surface_statistics
from pbrdf import HeightMap, Material, Scene, simulate

# How a terraced map came about
KINDS = (
    "plain",
    "jagged surface",
    "rugged surface",
    "noise before",
    "blur before",
    "noise and blur before",
    "blurred picture",
    "blurred picture, 256 colours",
    "noisy picture",
    "uneven bands",
)
ROUGHNESS = {"jagged surface": 1.5, "rugged surface": 0.5}
# Of the source, over which light is averaged: one shows few of the flattest places
AZIMUTHS = 24
SHARES = np.linspace(0.10, 0.95, 18)
SLOPE_LIMIT, QUANTILE_LIMIT, LIGHT_LIMIT = 0.03, 0.08, 0.08


@dataclass(frozen=True)
class Case:
    """A surface and how it was digitised; lengths in pixels, heights in pixels too."""

    kind: str
    slope: float
    length: float
    bands: int
    seed: int


def draw_case(kind: str, seed: int) -> Case:
    """Draw slope, correlation length and bands of the judged range."""
    rng = np.random.default_rng([seed, KINDS.index(kind)])
    bands = int(np.rint(np.exp(rng.uniform(np.log(8), np.log(64)))))
    return Case(kind, rng.uniform(0.15, 0.6), rng.uniform(6, 16), bands, seed)


def slopes(z: np.ndarray) -> np.ndarray:
    """Return the slopes between neighbours along both axes."""
    return np.concatenate([np.diff(z, axis=0).ravel(), np.diff(z, axis=1).ravel()])


def digitise(case: Case, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the true heights, and what the picture of bands tells of them."""
    rng = np.random.default_rng(case.seed)
    f = np.hypot(np.fft.fftfreq(2 * size)[:, None], np.fft.rfftfreq(2 * size))
    if case.kind in ROUGHNESS:
        # Matérn forms: of 1.5 the curvature has no limit but the pixel, of 0.5 the slope
        smooth = ROUGHNESS[case.kind]
        power = (1 + (np.pi * case.length * f) ** 2 / smooth) ** -(smooth + 1)
    else:
        power = np.exp(-((np.pi * case.length * f) ** 2))
    white = np.fft.rfft2(rng.standard_normal((2 * size, 2 * size)))
    true = np.fft.irfft2(white * np.sqrt(power), s=(2 * size, 2 * size))[:size, :size]
    blur = rng.uniform(0.5, 1.5) if "blur before" in case.kind else 0.0
    true = gaussian_filter(true, blur) if blur else true
    true = true * case.slope / np.sqrt(np.mean(slopes(true) ** 2))
    noise = rng.uniform(0.1, 0.4) if case.kind.startswith("noise") else 0.0
    width = np.ptp(true) / case.bands
    noisy = true + noise * width * rng.standard_normal(true.shape)
    edges = np.linspace(true.min(), true.max(), case.bands + 1)
    if case.kind == "uneven bands":
        # The last band is 1.7 times as wide as the first
        scale = np.linspace(0.5, 1, case.bands + 1) ** 1.8
        scale = (scale - scale[0]) / np.ptp(scale)
        edges = true.min() + np.ptp(true) * scale
    place = np.clip(np.searchsorted(edges, noisy) - 1, 0, case.bands - 1)
    raw = ((edges[1:] + edges[:-1]) / 2)[place]
    if case.kind.startswith("blurred picture"):
        raw = gaussian_filter(raw, rng.uniform(0.4, 0.8))
        if "colours" in case.kind:
            fine = np.ptp(true) / 256
            raw = np.rint(raw / fine) * fine
    if case.kind == "noisy picture":
        raw = raw + rng.uniform(0.02, 0.1) * width * rng.standard_normal(raw.shape)
    return true, raw


def light(z: np.ndarray, rays: int) -> tuple[np.ndarray, np.ndarray]:
    """Return M00 of glass over the map, and its standard error, at 20 and 50 degrees."""
    scene = Scene(HeightMap(z, 1.0), Material(1.5))
    azimuths = np.linspace(0, 2 * np.pi, AZIMUTHS, endpoint=False)
    result = simulate(
        scene, np.deg2rad([20.0, 50.0]), phi_i=azimuths, n_rays=rays // AZIMUTHS // 2,
        realizations=2, n_theta=9, n_dphi=18,
    )  # fmt: skip
    order = ("phi_i", "theta_i", "theta_s", "dphi")
    m00, error = (
        result[name].sel(stokes_out="I", stokes_in="I").transpose(*order).values
        for name in ("brdf_total", "brdf_total_stderr")
    )
    m00, error = m00.mean(axis=0), np.sqrt(np.mean(error**2, axis=0) / AZIMUTHS)
    # Averaged over azimuths both sides of the plane of incidence are the same
    return (m00 + m00[..., ::-1]) / 2, error / np.sqrt(2)


def main() -> None:
    """Print a row a map, or a row a kind."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--maps", type=int, default=10, help="of each kind")
    parser.add_argument("--size", type=int, default=256, help="pixels along a side")
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--kinds", default="", help="only these, by semicolons")
    parser.add_argument("--light", type=int, default=0, help="rays; 0 traces none")
    parser.add_argument("--each", action="store_true", help="a row for every map")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    print("kind                           found | slope rms [%]     quantiles [%]  held  | "
          "statistics  | s")  # fmt: skip
    for kind in arguments.kinds.split(";") if arguments.kinds else KINDS:
        rows = []
        for seed in range(arguments.first_seed, arguments.first_seed + arguments.maps):
            rows.append(judge(draw_case(kind, seed), arguments))
        summary(kind, rows)


def judge(case: Case, arguments: argparse.Namespace) -> dict[str, float]:
    """De-terrace one map and return its errors; NaN where no bands were found."""
    true, raw = digitise(case, arguments.size)
    start = time.process_time()
    bands = find_bands(raw)
    mended = raw if bands is None else deterrace(HeightMap(raw, 1.0), bands=bands).surface
    mended = getattr(mended, "heights", mended)
    row = {"found": bands is not None, "seconds": time.process_time() - start}
    of_true, of_mended = (np.abs(slopes(z)) for z in (true, mended))
    rms = [np.sqrt(np.mean(z**2)) for z in (of_true, of_mended)]
    row["slope"] = rms[1] / rms[0] - 1
    quantiles = [np.quantile(z, SHARES) for z in (of_true, of_mended)]
    errors = quantiles[1] / quantiles[0] - 1
    row["quantile"] = errors[np.abs(errors).argmax()]
    row["statistics"] = surface_statistics(mend_map(HeightMap(raw, 1.0))).slope_rms.value
    row["statistics"] = row["statistics"] / rms[0] - 1
    row["M00"], row["noise"], row["beyond"] = np.nan, np.nan, 0
    if arguments.light:
        (m_true, e_true), (m_mended, e_mended) = (
            light(z, arguments.light) for z in (true, mended)
        )
        bright = m_true > 0.1 * m_true.max(axis=(1, 2), keepdims=True)
        difference = m_mended[bright] / m_true[bright] - 1
        noise = np.hypot(e_true, e_mended)[bright] / m_true[bright]
        place = np.abs(difference).argmax()
        row["M00"], row["noise"] = difference[place], noise[place]
        row["beyond"] = np.sum(np.abs(difference) > LIGHT_LIMIT + 2 * noise)
    if arguments.each:
        print(
            f"  seed {case.seed} slope {case.slope:.2f} length {case.length:4.1f} bands "
            f"{case.bands:2d} found {bands.levels.size if bands else 0:3d}: "
            f"slope {row['slope']:+.1%} quantile {row['quantile']:+.1%} "
            f"statistics {row['statistics']:+.1%} "
            f"M00 worst {row['M00']:+.1%} (noise {row['noise']:.1%}), "
            f"{row['beyond']} beyond",
            flush=True,
        )
    return row


def summary(kind: str, rows: list[dict[str, float]]) -> None:
    """Print the row of a kind."""
    slope, quantile, found, seconds, told, m00, beyond = (
        np.array([row[key] for row in rows])
        for key in ("slope", "quantile", "found", "seconds", "statistics", "M00", "beyond")
    )
    held = (np.abs(slope) < SLOPE_LIMIT) & (np.abs(quantile) < QUANTILE_LIMIT)
    line = (
        f"{kind:30}{found.sum():3.0f}/{found.size:<3d}| mean {100 * slope.mean():+5.1f} "
        f"worst {worst(slope):+6.1f}  worst {worst(quantile):+6.1f}  "
        f"{held.sum():3d}/{held.size:<3d}| {100 * told.mean():+5.1f} {worst(told):+6.1f} | "
        f"{seconds.mean():.1f}"
    )
    if np.isfinite(m00).any():
        line += (
            f" | M00 worst {worst(m00):+.1f}, {np.sum(beyond == 0)} of {m00.size} within"
        )
    print(line, flush=True)


def worst(errors: np.ndarray) -> float:
    """Return the largest error with its sign [%]."""
    return 100 * float(errors[np.abs(errors).argmax()])


if __name__ == "__main__":
    main()

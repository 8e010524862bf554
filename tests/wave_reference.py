"""Rigorous scattering of one-dimensional random surfaces, and how far a form is from it.

Tables made by surface integral equations, of a beam with a known spread of incidence; their
headers say how. A form is averaged over that spread before it is compared.
"""

from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd

FOLDER = Path(__file__).parent / "reference"
CASE = ["height_rms_per_wavelength", "corr_length_per_wavelength", "theta_i_deg"]
# Beam of the tables: exp(-x^2/g^2) with g = 8 wavelengths
BEAM = 8.0
# What the error of a case is taken over: share of the peak, and largest zenith
PEAK_SHARE, LARGEST_ZENITH = 0.05, 80.0


@cache
def table(name: str) -> pd.DataFrame:
    """One of the tables, e.g. pec, n1.5, coherent."""
    return pd.read_csv(FOLDER / f"wave_1d_{name}.csv.gz", comment="#")


def beam(theta_i_deg: float, nodes: int = 5) -> tuple[np.ndarray, np.ndarray]:
    """Incidences of the beam's plane waves [rad], signed, and their weights."""
    x, weight = np.polynomial.hermite_e.hermegauss(nodes)
    lateral = np.sin(np.deg2rad(theta_i_deg)) + x / (2 * np.pi * BEAM)
    weight = weight * np.sqrt(np.maximum(1 - lateral**2, 0.0))
    return np.arcsin(np.clip(lateral, -1, 1)), weight / weight.sum()


def averaged(model, theta_i_deg: float, view: np.ndarray) -> np.ndarray:
    """Scattering of a profile by the beam at wavelength 1, (N, 4)."""
    angles, weights = beam(theta_i_deg)
    # Incidence from the other side is the mirror image
    sign = np.where(angles < 0, -1.0, 1.0)[:, None]
    parts = model.profile_scattering(
        np.abs(angles)[:, None], sign * view, 1.0, interference=True
    )
    return np.tensordot(weights, parts, axes=1)


def decibels(found: np.ndarray, case: pd.DataFrame) -> float:
    """Rms error over the bins that count, standard errors taken off in quadrature. [dB]"""
    true = case.mdrc_incoherent.to_numpy()
    counted = (
        (case.quality == 0)
        & (true > PEAK_SHARE * true.max())
        & (np.abs(case.theta_s_deg) <= LARGEST_ZENITH)
    ).to_numpy()
    true, stderr = true[counted], case.stderr.to_numpy()[counted]
    error = 10 * np.log10(np.maximum(found[counted], 1e-300) / true)
    noise = 10 / np.log(10) * stderr / true
    return float(np.sqrt(max(0.0, np.mean(error**2 - noise**2))))


def errors(name: str, make) -> pd.DataFrame:
    """Errors of a model in every case of a table.

    `make(height_rms, corr_length)` gives the model, lengths in wavelengths. Columns s and p
    are in dB; re and im are the rms errors of the interference over the mean of s and p.
    """
    rows = []
    for case, group in table(name).groupby(CASE):
        height, length, incidence = case
        by = {pol: part.sort_values("theta_s_deg") for pol, part in group.groupby("pol")}
        view = np.deg2rad(by["s"].theta_s_deg.to_numpy(dtype=float))
        found = averaged(make(height, length), incidence, view)
        row = dict(zip(CASE, case, strict=True), slope=np.sqrt(2) * height / length)
        row |= {pol: decibels(found[:, i], by[pol]) for i, pol in enumerate("sp")}
        mean = (by["s"].mdrc_incoherent.to_numpy() + by["p"].mdrc_incoherent.to_numpy()) / 2
        counted = (
            (by["s"].quality.to_numpy() == 0)
            & (by["p"].quality.to_numpy() == 0)
            & (mean > PEAK_SHARE * mean.max())
            & (np.abs(np.rad2deg(view)) <= LARGEST_ZENITH)
        )
        for i, part in enumerate(("re", "im"), start=2):
            off = (found[:, i] - by[f"sp_{part}"].mdrc_incoherent.to_numpy()) / mean
            row[part] = float(np.sqrt(np.mean(off[counted] ** 2)))
        rows.append(row)
    return pd.DataFrame(rows)

"""Make the embedded example's goniometer scan of vinyl siding, and add the noise of one.

The specular part comes from the Monte Carlo with every bounce, not from the model that is
then fitted; the diffuse part is the paper's 13 % (section 4.2). The paper's gain of 0.0011
cannot be reproduced with a normalised equation (20), so this sample is given a gain of 0.8:
a fifth of the light is lost on the way, as it is where a surface is partly dull.

Run it:  python examples/scan.py scan.csv --seed 1
"""

import argparse
from pathlib import Path

import numpy as np
import xarray as xr
from micrograph import CORR_LENGTH, HEIGHT_RMS

import pbrdf
from data_io import write_goniometer

N = 1.53
SPECULAR_GAIN = 0.8
DIFFUSE_ALBEDO = 0.13
THETA_I = np.deg2rad(30.0)
# Of M00: what a careful goniometer repeats to, and what its polarisers add
NOISE = {"M00": 0.015, "M10": 0.010}
# The receiver hides the source near retro-reflection
BLOCKED = np.deg2rad(5.0)


def make_scan(path: str | Path, seed: int) -> xr.Dataset:
    """Write a noisy in-plane scan from -75 to 75 degrees and return it without noise.

    Parameters
    ----------
    path : str or Path
        The CSV to write, in the project's own format.
    seed : int
        Makes surfaces, rays and noise reproducible.
    """
    surface = pbrdf.GaussianSurface(
        shape=(256, 256),
        spacing=CORR_LENGTH / 12,
        corr_length=CORR_LENGTH,
        slope_rms=float(np.sqrt(2) * HEIGHT_RMS / CORR_LENGTH),
    )
    # Two degrees a bin, as wide as the receiver's aperture
    simulated = pbrdf.simulate(
        pbrdf.Scene(surface, pbrdf.Material(N)),
        THETA_I,
        phi_i="uniform",
        n_rays=100_000,
        realizations=64,
        seed=seed,
        n_theta=45,
        n_dphi=90,
        stokes="linear",
    )
    truth, error = read_plane(simulated)
    visible = np.abs(truth.theta_view + THETA_I) > BLOCKED
    visible &= np.abs(truth.theta_view) < np.deg2rad(76.0)
    truth, error = truth[{"geometry": visible}], error[{"geometry": visible}]

    rng = np.random.default_rng([seed, 1])
    measured = truth.copy()
    for name, relative in NOISE.items():
        noise = relative * truth.M00
        measured[name] = truth[name] + noise * rng.standard_normal(noise.size)
        # The simulation's own error is in the values too
        measured[f"{name}_stderr"] = np.hypot(noise, error[name])
    write_goniometer(measured, path)
    return truth


def read_plane(simulated: xr.Dataset) -> tuple[xr.Dataset, xr.Dataset]:
    """Return M00 and M10 of the sample, and the errors of the simulation, in the plane."""
    incidence = simulated.isel(theta_i=0)
    # From grazing on the source's side over the normal to grazing on the other
    zenith = incidence.theta_s.values
    view = np.concatenate([-zenith[::-1], zenith])
    coords = {
        "theta_i": ("geometry", np.full(view.size, THETA_I)),
        "theta_s": ("geometry", np.abs(view)),
        "dphi": ("geometry", np.where(view > 0.0, np.pi, 0.0)),
        "theta_view": ("geometry", view),
    }

    def along(element: xr.DataArray) -> np.ndarray:
        sides = [element.sel(dphi=dphi, method="nearest").values for dphi in (0.0, np.pi)]
        return SPECULAR_GAIN * np.concatenate([sides[0][::-1], sides[1]])

    values, errors = {}, {}
    for name, out in (("M00", "I"), ("M10", "Q")):
        element = {"stokes_out": out, "stokes_in": "I"}
        diffuse = DIFFUSE_ALBEDO / np.pi if name == "M00" else 0.0
        values[name] = ("geometry", along(incidence.brdf_total.sel(element)) + diffuse)
        errors[name] = ("geometry", along(incidence.brdf_total_stderr.sel(element)))
    return xr.Dataset(values, coords), xr.Dataset(errors, coords)


def main() -> None:
    """Write a scan and print what is true of its sample."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("path", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    truth = make_scan(arguments.path, arguments.seed)
    print(
        f"{arguments.path}: {truth.geometry.size} angles, n {N}, specular_gain "
        f"{SPECULAR_GAIN}, diffuse_albedo {DIFFUSE_ALBEDO}"
    )


if __name__ == "__main__":
    main()

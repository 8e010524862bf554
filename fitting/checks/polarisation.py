"""Polarised against all light: elements beyond M00, degrees lifted by noise."""

from typing import TYPE_CHECKING

import numpy as np

from data_io.goniometer.scatter import curve_keys, standard_errors
from fitting.checks.curves import brightness, stderr_of
from fitting.checks.finding import Finding

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["check_polarisation"]

# Standard errors that are beyond noise
_FAR = 5.0
# Of all light behind polarisers, and of the same behind others
_APART = 0.02
# About the specular direction [deg], and Q/I there that noise and light from below a rough
# interface do not reach
_LOBE, _ALONG_P = 10.0, 0.1
# Along a curve of so many readings, beyond this incidence [rad], polarised light varies by
# less than this times all light, or this part of it
_SEVERAL, _OBLIQUE, _MORE, _PLAIN = 5, np.radians(20.0), 1.5, 0.05


def check_polarisation(scan: "xr.Dataset") -> list[Finding]:
    """No surface polarises more light than it reflects, but for noise.

    An element may exceed M00 by five standard errors in a reading, and by as many in the
    sum over a curve, where noise averages out and a wrong scale does not.
    """
    found = brightness(scan)
    findings = []
    apart = float(scan.attrs.get("polarisers_apart", 0.0))
    if abs(apart) > _APART:
        findings.append(
            Finding(
                name="polarisers", severity="warning",
                what=f"I45 + I135 is {abs(apart):.1%} "
                f"{'more' if apart > 0 else 'less'} than I0 + I90 in the middle "
                "reading, and both are all light",
                suspects="a drift, or another gain, between settings of the polariser",
                cure="Measure again; or rename I0 to I_s and I90 to I_p, and ignore the "
                "others by --columns.",
            )
        )  # fmt: skip
    for name in (f"M{i}{j}" for i in range(4) for j in range(4)):
        if found is None or name == "M00" or name not in scan:
            continue
        value = np.asarray(scan[name].values, float)
        bright, error, estimated = _errors_of(scan, name, found)
        excess = np.abs(value) - bright
        # Where no error is stated a quarter more, where nothing tells it a dark reading too
        allowed, quarter = _FAR * error, 0.25 * np.abs(bright)
        if estimated:
            allowed = np.maximum(allowed, quarter)
        blind = 0.02 * np.nanmax(bright, initial=0.0) + quarter
        beyond = excess > np.where(error > 0, allowed, blind)
        if beyond.any():
            row = int(np.argmax(np.where(beyond, excess, -np.inf)))
            what = (
                f"{name} exceeds M00 in {beyond.sum()} of {np.isfinite(excess).sum()} "
                f"readings, at worst {value[row]:.4g} beside {bright[row]:.4g} at "
                f"{_place(scan, row)}{_size_of(excess[row], error[row], estimated)}"
            )
        else:
            what = _sum_beyond(scan, name, bright, error, estimated)
        if what:
            findings.append(
                Finding(
                    name="polarisation", severity="error", what=what,
                    suspects="elements divided by M00, or columns exchanged",
                    cure="Give --normalised if they are divided by M00; or "
                    "--accept polarisation.",
                )
            )  # fmt: skip
    return findings + _along_p(scan) + _biased_dolp(scan) + _of_their_own(scan)


def _along_p(scan: "xr.Dataset") -> list[Finding]:
    """Say that the lobe is polarised along p, as no facet leaves it: R_s >= R_p."""
    found = brightness(scan)
    if "m10" in scan:
        degree = np.asarray(scan["m10"].values, float)
    elif "M10" in scan and found is not None:
        degree = np.asarray(scan["M10"].values, float) / np.where(found[0] > 0, found[0], 1)
    elif {"I_s", "I_p"} <= set(scan.data_vars) and found is not None:
        difference = np.asarray((scan["I_s"] - scan["I_p"]).values, float)
        degree = difference / np.where(found[0] > 0.0, found[0], 1.0)
    else:
        return []
    theta_i, theta_s = (np.degrees(scan[name].values) for name in ("theta_i", "theta_s"))
    lobe = np.abs(theta_s - theta_i) < _LOBE
    lobe &= np.abs(np.cos(scan["dphi"].values) + 1.0) < 1e-6
    lobe &= (theta_i > 25.0) & (theta_i < 65.0) & np.isfinite(degree)
    if lobe.sum() < 3 or not (middle := float(np.median(degree[lobe]))) < -_ALONG_P:
        return []
    return [
        Finding(
            name="s-and-p", severity="warning",
            what=f"the {lobe.sum()} readings within {_LOBE:g} degrees of the specular "
            f"direction have a median Q/I of {middle:.2g}: polarised along p, where a "
            "surface reflects more of s",
            suspects="s and p exchanged, or Q of the other sign",
            cure=_exchanged(scan),
        )
    ]  # fmt: skip


def _exchanged(scan: "xr.Dataset") -> str:
    """Return how to exchange s and p, by what the file calls them."""
    pairs = scan.attrs.get("exchange_s_and_p")
    if pairs:
        return f"Exchange the columns, --columns {pairs}."
    name = "m10" if "m10" in scan else "M10" if "M10" in scan else "s and p"
    return f"No option does it: change the sign of {name} in the file, if it is that."


def _of_their_own(scan: "xr.Dataset") -> list[Finding]:
    """Note that elements vary more along a curve than all light does: ratios, mostly."""
    found = brightness(scan)
    names = [name for name in ("M10", "M01", "M11") if name in scan]
    if found is None or not names or scan.attrs.get("quantity") == "relative":
        return []
    if max(float(np.nanmax(np.abs(scan[name].values), initial=0.0)) for name in names) > 1:
        return []
    curve, _ = _curves(scan)
    for name in names:
        value, error = np.asarray(scan[name].values, float), stderr_of(scan, name)
        for k in np.unique(curve):
            here = (curve == k) & np.isfinite(value) & np.isfinite(found[0])
            if here.sum() < _SEVERAL or not scan.theta_i.values[here][0] > _OBLIQUE:
                continue
            light, noise = found[0][here], _FAR * float(np.nan_to_num(error[here]).max())
            own, whole = float(np.ptp(value[here])), float(np.ptp(light))
            if own > _MORE * whole + noise and own > _PLAIN * float(light.max()):
                at = float(np.degrees(scan.theta_i.values[here][0]))
                return [
                    Finding(
                        name="ratios", severity="note",
                        what=f"{name} varies by {own:.3g} at incidence {at:.4g} deg, "
                        f"M00 by {whole:.3g} only",
                        suspects="elements divided by M00",
                        cure="Give --normalised if they are.",
                    )
                ]  # fmt: skip
    return []


def _errors_of(
    scan: "xr.Dataset", name: str, found: tuple[np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray, bool]:
    """Return M00, the error of |element| - M00, and whether the scatter had to tell it."""
    bright, stated = found
    curve, view = _curves(scan)
    value, own = np.asarray(scan[name].values, float), stderr_of(scan, name)
    parts = (
        standard_errors(bright, stated, curve, view),
        standard_errors(value, own, curve, view, brightness=bright),
    )
    estimated = not (np.isfinite(stated).any() and np.isfinite(own).any())
    return bright, np.hypot(*map(np.nan_to_num, parts)), estimated


def _curves(scan: "xr.Dataset") -> tuple[np.ndarray, np.ndarray]:
    """Return the curve and the view of each reading."""
    size = scan.sizes["geometry"]

    def column(name: str) -> np.ndarray | None:
        if name not in scan.coords:
            return None
        return np.broadcast_to(np.asarray(scan[name].values, float), (size,))

    angles = [np.degrees(scan[n].values) for n in ("theta_i", "theta_s", "dphi")]
    return curve_keys(*angles, column("phi_i"), column("wavelength"))


def _size_of(excess: float, error: float, estimated: bool) -> str:
    if error <= 0:
        return ""
    how = ", estimated from the scatter" if estimated else ""
    return f", {excess / error:.3g} standard errors beyond ({error:.2g} 1/sr{how})"


def _sum_beyond(
    scan: "xr.Dataset", name: str, bright: np.ndarray, error: np.ndarray, estimated: bool
) -> str:
    """Say by how much an element exceeds M00 in the sum over one half of a curve."""
    curve, view = _curves(scan)
    value = np.asarray(scan[name].values, float)
    known = np.isfinite(value) & np.isfinite(bright) & (error > 0)
    worst, said = _FAR, ""
    for half in np.unique(2 * curve[known] + (view[known] > 0)):
        here = known & (2 * curve + (view > 0) == half)
        total, light = float(value[here].sum()), float(bright[here].sum())
        far = (abs(total) - light) / max(float(np.linalg.norm(error[here])), 1e-300)
        if far > worst:
            how = ", estimated from their scatter" if estimated else ""
            row = int(np.flatnonzero(here)[0])
            worst, said = far, (
                f"{name} exceeds M00 in the sum of {here.sum()} readings of one side, "
                f"{total:.4g} beside {light:.4g}, by {far:.3g} standard errors{how}, at "
                f"theta_i {np.degrees(float(scan.theta_i.values[row])):.4g} deg"
            )  # fmt: skip
    return said


def _biased_dolp(scan: "xr.Dataset") -> list[Finding]:
    """Say by how much noise lifts a degree of polarisation, which cannot be negative.

    For Q and U of error s the mean of sqrt(Q^2 + U^2)/I at polarisation p is about
    p + s^2 / (2 p), and 1.25 s at none.
    """
    if "DOLP" not in scan or "DOLP_stderr" not in scan:
        return []
    value, stderr = np.asarray(scan["DOLP"].values, float), stderr_of(scan, "DOLP")
    weak = (value < 3.0 * stderr) & np.isfinite(value)
    if not weak.any():
        return []
    true = np.sqrt(np.maximum(value**2 - stderr**2, 0.0))
    bias = float(np.median((value - true)[weak]))
    return [
        Finding(
            name="dolp", severity="warning",
            what=f"{weak.sum()} of {np.isfinite(value).sum()} readings of DOLP lie within "
            f"three standard errors of zero, where noise lifts them, by about {bias:.2g}",
            suspects="a degree of polarisation computed from noisy Q and U",
            cure="Give signed Q/I (column m10) in place of DOLP: it has no such bias.",
        )
    ]  # fmt: skip


def _place(scan: "xr.Dataset", row: int) -> str:
    angles = (
        np.degrees(float(scan[n].values[row])) for n in ("theta_i", "theta_s", "dphi")
    )
    return "theta_i {:.4g}, theta_s {:.4g}, dphi {:.4g} deg".format(*angles)

"""All checks of a scan, and what they mean for a fit."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from fitting.checks.curves import curves_of
from fitting.checks.directions import check_exchange, check_reciprocity
from fitting.checks.energy import check_energy
from fitting.checks.finding import Finding, PhysicsError
from fitting.checks.polarisation import check_polarisation
from fitting.checks.readings import (
    check_limits,
    check_missing,
    check_noise,
    check_repeats,
    check_wavelengths,
)

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["check_scan", "refuse_errors", "remarks"]

_ORDER = {"error": 0, "warning": 1, "note": 2}
ERRORS = ("exchanged", "energy", "polarisation", "reciprocity")


def check_scan(scan: "xr.Dataset") -> list[Finding]:
    """Look at a scan before it is fitted: what physics forbids, what looks like a slip.

    Parameters
    ----------
    scan : Dataset
        As `data_io.read_goniometer` returns it.

    Returns
    -------
    list of Finding
        The worst first. Errors are: the source's side brighter than the forward side
        ("exchanged"), more light than came ("energy"), elements beyond M00
        ("polarisation"), and values that contain a cosine ("reciprocity").

    Examples
    --------
    >>> import numpy as np, xarray as xr
    >>> view = np.deg2rad(np.arange(-75.0, 76.0, 5.0))
    >>> lobe = 0.3 * np.exp(-((view + 0.6) / 0.2) ** 2) + 0.05
    >>> angles = {"theta_i": 0.0 * view + 0.6, "theta_s": abs(view),
    ...           "dphi": np.where(view > 0, np.pi, 0.0)}
    >>> coords = {name: ("geometry", angle) for name, angle in angles.items()}
    >>> print(check_scan(xr.Dataset({"M00": ("geometry", lobe)}, coords))[0].name)
    exchanged
    """
    readings = list(curves_of(scan))
    findings = [*check_wavelengths(scan), *check_repeats(scan), *check_missing(scan)]
    findings += check_polarisation(scan)
    if readings:
        findings += [*check_exchange(readings), *check_reciprocity(readings)]
        findings += [*check_limits(readings), *check_noise(readings)]
        if scan.attrs.get("quantity", "brdf") == "brdf":
            findings += check_energy(readings)
    return sorted(findings, key=lambda finding: _ORDER[finding.severity])


def refuse_errors(
    scans: "Mapping[str, xr.Dataset]", accept: Sequence[str] = ()
) -> dict[str, list[Finding]]:
    """Check scans; raise for the first error that is not accepted, else return findings.

    Raises
    ------
    PhysicsError
        Naming the scan, what was found, what it suspects and the option that mends it.
    ValueError
        If `accept` names no check.
    """
    unknown = [name for name in accept if name not in (*ERRORS, "all")]
    if unknown:
        msg = f"accept must name any of {', '.join(ERRORS)} or all, got {unknown[0]!r}."
        raise ValueError(msg)
    found = {label: check_scan(scan) for label, scan in scans.items()}
    for label, findings in found.items():
        for finding in findings:
            allowed = finding.name in accept or "all" in accept
            if finding.severity == "error" and not allowed:
                text = str(finding).removeprefix("error: ")
                msg = f"{label}: {text}"
                raise PhysicsError(msg)
    return found


def remarks(found: Mapping[str, Sequence[Finding]]) -> list[str]:
    """Return what a result should say of its scans: warnings and accepted errors."""
    return [
        f"{label}: {finding.what} ({finding.suspects or finding.name})"
        for label, findings in found.items()
        for finding in findings
        if finding.severity != "note"
    ]

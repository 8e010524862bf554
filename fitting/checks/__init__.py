"""A look at scans before they are believed: what physics forbids, what looks amiss."""

from fitting.checks.finding import Finding, PhysicsError
from fitting.checks.scan import check_scan, refuse_errors, remarks

__all__ = ["Finding", "PhysicsError", "check_scan", "refuse_errors", "remarks"]

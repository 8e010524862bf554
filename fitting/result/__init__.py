"""What a fit found, and how well the data know it."""

from typing import TYPE_CHECKING

from pbrdf._lazy import loader

if TYPE_CHECKING:
    from fitting.result.fit_result import FitResult

__all__ = ["FitResult"]

_HOME = {"FitResult": "fitting.result.fit_result"}

__getattr__ = loader(__name__, _HOME)

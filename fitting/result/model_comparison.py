"""Which of several models the data prefer, and whether a further term is worth having."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy import stats

from fitting.result.fit_result import FitResult

__all__ = ["Comparison", "FTest", "compare", "f_test"]


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """One model among others.

    Parameters
    ----------
    name : str
        The model.
    n_parameters : int
        Free parameters, those of the noise included.
    chi2, dof : float, int
        Misfit and degrees of freedom.
    aic, bic : float
        Criteria above those of the best model, 0 for the best. A model more than 10 above
        has practically no support.
    weight : float
        Akaike weight: share of the support among the models compared.
    """

    name: str
    n_parameters: int
    chi2: float
    dof: int
    aic: float
    bic: float
    weight: float


@dataclass(frozen=True, kw_only=True)
class FTest:
    """Whether a larger model explains more than its further parameters would by chance.

    Parameters
    ----------
    f : float
        Fall of chi2 for each further parameter over the chi2 for each degree of freedom.
    p_value : float
        Chance of an f this large if the smaller model is right.
    """

    f: float
    p_value: float


def compare(results: Mapping[str, FitResult]) -> list[Comparison]:
    """Rank fits of different models to the same readings, the best first.

    Parameters
    ----------
    results : mapping of str to FitResult
        By the name of the model.

    Raises
    ------
    ValueError
        If the fits are not of the same readings, or one has no minimum.

    References
    ----------
    .. [1] K. P. Burnham, D. R. Anderson, Model Selection and Multimodel Inference, 2nd ed.,
       2002, sections 2.4 (AICc) and 2.9 (weights).
    """
    _check(list(results.values()))
    aic = np.array([result.aic for result in results.values()])
    bic = np.array([result.bic for result in results.values()])
    support = np.exp(-0.5 * (aic - aic.min()))
    rows = [
        Comparison(
            name=name,
            n_parameters=len(result.values) + result.n_estimated,
            chi2=result.chi2,
            dof=result.dof,
            aic=float(aic[i] - aic.min()),
            bic=float(bic[i] - bic.min()),
            weight=float(support[i] / support.sum()),
        )
        for i, (name, result) in enumerate(results.items())
    ]
    return sorted(rows, key=lambda row: row.aic)


def f_test(smaller: FitResult, larger: FitResult) -> FTest:
    """Test whether the further parameters of `larger` are worth having.

    Parameters
    ----------
    smaller, larger : FitResult
        Fits of nested models to the same readings. Both are weighed with the standard
        errors that the larger one was fitted with.

    Raises
    ------
    ValueError
        If the fits are not of the same readings, or `larger` has no more parameters.
    """
    _check([smaller, larger])
    further = len(larger.values) - len(smaller.values)
    if further <= 0:
        msg = (
            f"larger must have more parameters than smaller, got {len(larger.values)} and "
            f"{len(smaller.values)}. Exchange them."
        )
        raise ValueError(msg)
    ratio = smaller.problem.objective.stderr / larger.problem.objective.stderr
    chi2 = float(((smaller.residuals * ratio) ** 2).sum())
    f = (chi2 - larger.chi2) / further / (larger.chi2 / larger.dof)
    return FTest(f=f, p_value=float(stats.f.sf(f, further, larger.dof)))


def _check(results: list[FitResult]) -> None:
    """Reject fits that cannot be compared."""
    data = [result.problem.objective.data for result in results]
    if any(not np.array_equal(data[0], other) for other in data[1:]):
        msg = "results must be fits of the same readings, got different ones. Use one mask."
        raise ValueError(msg)
    for result in results:
        if not result.converged:
            msg = f"results must have a minimum, got {result.status!r}."
            raise ValueError(msg)

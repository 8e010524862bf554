"""Fit a reflectance model to goniometer scans: the one function most users need."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from pbrdf.errors import check_seed

if TYPE_CHECKING:
    import xarray as xr

    from fitting.estimate import Estimate
    from fitting.readings.aperture import Aperture
    from fitting.readings.noise import Noise
    from fitting.readings.observations import Mask
    from fitting.result.fit_result import FitResult

__all__ = ["fit"]


def fit(  # noqa: PLR0913  (each is a choice that the person who fits has to make)
    measurement: "xr.Dataset | Sequence[xr.Dataset] | Mapping[str, xr.Dataset]",
    model: Any,
    free: Sequence[str] = ("specular_gain", "diffuse_albedo"),
    bounds: Mapping[str, tuple[float | None, float | None]] | None = None,
    solver: str = "casadi",
    *,
    fixed: Mapping[str, float] | None = None,
    priors: "Mapping[str, Estimate | tuple[float, float]] | None" = None,
    separate: Sequence[str] | Mapping[str, str] = (),
    use: Sequence[str] | None = None,
    mask: "Mask | Iterable[Mask]" = (),
    noise: "Noise | str | None" = None,
    loss: str = "linear",
    aperture: "Aperture | None" = None,
    search: str | None = None,
    seed: int = 0,
    accept: Sequence[str] = (),
) -> "FitResult":
    """Bring a model to one or several scans and say how well each parameter is known.

    Parameters
    ----------
    measurement : Dataset, or sequence or mapping of them
        Goniometer scans as `data_io.read_goniometer` returns them: dimension `geometry`;
        any of M00..M33, elements divided by M00 (m10..m33), DOLP, and s/p intensities I_s,
        I_p, f_ss, f_sp, f_ps, f_pp; `<name>_stderr` weighs where present. DOLP is left out
        where M00 and M10 are there, from which it was computed. The attribute `quantity` is
        "brdf", or "relative": then every scan gets a free `scale`.
    model : MicrofacetModel, WaveModel or MuellerModel
        Start values, and the values of all that is not free. A simulated surface goes in
        the same way: `fitting.SimulatedModel`. Of a surface seen by waves height_rms and
        corr_length may be free: `fitting.WaveSurface`.
    free : sequence of str
        Parameters to vary: names of `fitting.PARAMETERS`.
    bounds : mapping of str to (low, high), optional
        In place of those of `PARAMETERS`; None leaves an end as it is.
    solver : {"casadi", "nlopt"}
        IPOPT (DAQP where the problem is linear), or SLSQP and Subplex.
    fixed : mapping of str to float, optional
        Values of parameters that are not free, in place of the model's.
    priors : mapping of str to Estimate or (value, stderr), optional
        What is known from elsewhere. For a free parameter it is one more reading of it. For
        one that is not free, as a slope_rms measured on a height map, the parameter takes
        that value and its uncertainty goes into the standard errors of the free ones.
    separate : sequence of str, or mapping to {"scan", "wavelength", "theta_i", "nothing"}
        Free parameters that have a value of their own in each scan, or each such group.
        Where the scans hold several wavelengths, gains, albedos and the index have one for
        each by default, named `diffuse_albedo[0.45]`; slopes are shared.
    use : sequence of str, optional
        Observables to use; default all.
    mask : callable or iterable of callables
        What to leave out: see `fitting.readings.masks`.
    noise : Noise, "relative", "absolute", optional
        Noise of the readings; default the file's columns, and where it has none, estimated
        from the misfit, relative to M00 or absolute, whichever is more likely.
    loss : {"linear", "soft_l1", "huber", "cauchy"}
        Robust losses let outliers pull less.
    aperture : Aperture, optional
        Cones of light of source and detector, folded into the model as finely as the noise
        asks for. Default: the coordinates `source_half_angle` and `detector_half_angle` of
        the scans; `Aperture()` says that both are points.
    search : {None, "multistart", "crs", "mlsl"}
        Search the whole box of the bounds before the solver polishes.
    seed : int
        Seed of that search.
    accept : sequence of str
        Errors of physics to fit in spite of, as `fitting.check_scan` names them, or "all".

    Returns
    -------
    FitResult
        A solver that fails, and parameters that the data cannot determine, are results with
        a reason, not exceptions.

    Raises
    ------
    ValueError, TypeError
        If an argument does not say what to fit.
    PhysicsError
        If a scan contradicts physics as it was read, and this is not accepted.

    Examples
    --------
    >>> import numpy as np, xarray as xr
    >>> from pbrdf import Material, MicrofacetModel
    >>> view = np.deg2rad(np.arange(-70.0, 71.0, 5.0))
    >>> dphi = np.where(view > 0, np.pi, 0.0)
    >>> truth = MicrofacetModel(Material(1.5), 0.25, specular_gain=0.9, diffuse_albedo=0.1)
    >>> brdf = truth.brdf(0.5, abs(view), dphi)
    >>> scan = xr.Dataset(
    ...     {"M00": ("geometry", brdf[:, 0, 0]), "M10": ("geometry", brdf[:, 1, 0])},
    ...     coords={
    ...         "theta_i": ("geometry", np.full(view.size, 0.5)),
    ...         "theta_s": ("geometry", abs(view)),
    ...         "dphi": ("geometry", dphi),
    ...     },
    ... )
    >>> result = fit(scan, MicrofacetModel(Material(1.5), slope_rms=0.25))
    >>> {name: round(value, 6) for name, value in result.values.items()}
    {'specular_gain': 0.9, 'diffuse_albedo': 0.1}
    """
    # Solvers and models load when something is fitted, not when `fitting` is imported
    from fitting.checks import refuse_errors, remarks
    from fitting.problem.assembly import Question, assemble, labelled
    from fitting.problem.refinement import solve_through_cones
    from fitting.result.make_result import result_of
    from fitting.result.other_side import beside_the_other_side, turned_to_the_other_side

    check_seed(seed)
    question = Question(
        free=tuple(free),
        bounds=bounds or {},
        fixed=fixed or {},
        priors=priors or {},
        separate=separate,
        solver=solver,
        loss=loss,
        search=search,
        aperture=aperture,
        seed=seed,
    )
    masks = mask if callable(mask) else tuple(mask)
    given: dict[str, Any] = {"use": use, "mask": masks, "noise": noise}
    problems, uncertain = assemble(measurement, model, question, **given)
    scans = labelled(measurement)
    findings = refuse_errors(scans, accept)
    result = result_of(*solve_through_cones(problems), uncertain)
    turned = turned_to_the_other_side(scans)
    if turned is not None and not {"exchanged", "all"} & set(accept):
        result = beside_the_other_side(
            result,
            lambda: result_of(
                *solve_through_cones(assemble(turned, model, question, **given)[0]),
                uncertain,
            ),
        )
    return replace(result, warnings=(*result.warnings, *remarks(findings)))

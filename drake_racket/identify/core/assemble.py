"""Makes a fit's result from its starts: the best one, its uncertainty, what to be wary of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from drake_racket.identify.core.covariance import Uncertainty, uncertainty
from drake_racket.identify.core.problem import Array, Parameter, Problem, Scale
from drake_racket.identify.core.result import FitResult, StartRecord
from drake_racket.io.errors import InputError
from drake_racket.io.fingerprint import versions

AT_BOUND = 1e-6  # of the way between the bounds: as near as this is at the bound
SAME_MINIMUM = 1e-6  # relative: starts whose sums of squares differ by less found the same RMS
OTHER_PLACE = 0.01  # of the way between the bounds: starts further apart are at other values


@dataclass(frozen=True, eq=False)
class StartOutcome:
    """Holds one start's record with residuals (m,) and Jacobian (m, n) where it ended."""

    record: StartRecord
    residuals: Array
    jacobian: Array


def make_result(
    problem: Problem,
    outcomes: Sequence[StartOutcome],
    *,
    method: str,
    seed: int,
    seconds: float,
    rescale: bool,
) -> FitResult:
    """Gives the result of the best of the starts.

    Raises:
        InputError: the model had no solution at any start.

    """
    # the number decides between equals: the same for any number of workers
    best = min(outcomes, key=lambda o: (o.record.cost, o.record.number))
    if not np.isfinite(best.record.cost):
        start = [p.start for p in problem.parameters]
        raise InputError("start", start, f"a start with a solution ({best.record.status})")
    parameters, x = tuple(problem.parameters), best.record.estimates
    u = Scale(parameters).to_unit(x)
    at_bounds = (u < AT_BOUND) | (u > 1.0 - AT_BOUND)
    found = uncertainty(
        parameters, x, best.residuals, best.jacobian, problem.sigma, at_bounds, rescale=rescale
    )
    names = np.array([p.name for p in parameters])
    records = tuple(o.record for o in outcomes)
    warnings = [
        *found.directions,
        *(f"{name} is at a bound: no interval" for name in names[at_bounds]),
        *_noise_warnings(problem.sigma, found, rescale),
        *_width_warnings(parameters, found.intervals),
        *_minimum_warnings(parameters, records, best.record, found),
    ]
    return FitResult(
        title=problem.title,
        method=method,
        parameters=parameters,
        estimates=x,
        covariance=found.covariance,
        confidence_intervals=found.intervals,
        rms=best.record.rms,
        residuals=best.residuals,
        residual_unit=str(getattr(problem, "residual_unit", "")),
        sigma=problem.sigma,
        residual_sigma=found.residual_sigma,
        degrees_of_freedom=found.degrees_of_freedom,
        undetermined=found.directions,
        undetermined_parameters=tuple(map(str, names[found.undetermined])),
        at_bounds=tuple(map(str, names[at_bounds])),
        convergence=records,
        evaluations=sum(record.evaluations for record in records),
        seconds=seconds,
        seed=seed,
        fingerprint=problem.fingerprint(),
        versions=versions(),
        warnings=tuple(warnings),
        rescaled=rescale,
    )


def _noise_warnings(sigma: Array | None, found: Uncertainty, rescale: bool) -> list[str]:
    """No noise estimate, or residuals that sigma does not explain."""
    freedom = found.degrees_of_freedom
    if freedom <= 0:
        if sigma is not None and not rescale:
            return []
        return ["no more measured values than parameters: the noise cannot be estimated"]
    if sigma is None or rescale:
        return []
    square = found.residual_sigma**2
    for tail, word in ((stats.chi2.sf, "larger"), (stats.chi2.cdf, "smaller")):
        if tail(freedom * square, freedom) < 1e-3:
            text = f"residuals are {word} than sigma allows (reduced chi squared {square:.3g})"
            return [f"{text}: the intervals rest on sigma"]
    return []


def _width_warnings(parameters: Sequence[Parameter], intervals: Array) -> list[str]:
    """Intervals as wide as the bounds."""
    return [
        f"{p.name}: its interval is as wide as its bounds, the data hardly narrow it"
        for p, width in zip(parameters, np.diff(intervals)[:, 0], strict=True)
        if np.isfinite(width) and width > p.upper - p.lower
    ]


def _minimum_warnings(
    parameters: Sequence[Parameter],
    records: Sequence[StartRecord],
    best: StartRecord,
    found: Uncertainty,
) -> list[str]:
    """What puts in doubt that this is the minimum, or the only one."""
    texts = []
    if not best.converged:
        texts.append(f"not converged: {best.status}")
    if (away := found.steps_away.max()) > 0.1:
        text = "away from the least squares minimum: the intervals are not about a minimum"
        texts.append(f"the point found is {away:.2g} standard errors {text}")
        return texts  # nothing that two starts could agree on
    scale = Scale(parameters)
    same = [r for r in records if r.cost <= best.cost * (1.0 + SAME_MINIMUM)]
    if len(records) > 1 and len(same) == 1:
        texts.append(f"only one of {len(records)} starts reached the lowest RMS")
    here = scale.to_unit(best.estimates)
    far = [p.name for p in parameters]
    for record in same:
        off = np.abs(scale.to_unit(record.estimates) - here) > OTHER_PLACE
        if off.any():
            differing = ", ".join(n for n, o in zip(far, off, strict=True) if o)
            texts.append(
                f"start {record.number} reached the same RMS at other values of {differing}"
            )
    return texts

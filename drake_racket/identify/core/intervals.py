"""Computes likelihood profiles and the confidence intervals they give.

Where a problem is strongly curved, or two parameters nearly trade off, the covariance's interval is
poor and the profile's is the better one: the values at which the sum of squares, minimised over all
other parameters, exceeds its minimum by the square of the normal (sigma known) or Student t
quantile.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import optimize

from drake_racket.identify.core.checkpoint import Checkpoint
from drake_racket.identify.core.covariance import CONFIDENCE, quantile
from drake_racket.identify.core.evaluator import Evaluator
from drake_racket.identify.core.problem import Array, Parameter, Problem, Scale
from drake_racket.io.errors import InputError

if TYPE_CHECKING:
    from drake_racket.identify.core.result import FitResult

_TOLERANCE = 1e-10  # of the least squares within a profile
_EVALUATIONS = 200


@dataclass(frozen=True, eq=False)
class Profile:
    """Holds a likelihood profile: one parameter held at values, the others fitted.

    Attributes:
        parameter: the one that is held.
        values: (k,) in ascending order.
        chi2: (k,) sum of squared residuals over sigma (over the estimated one where it is
            unknown or rescaled), less the minimum.
        threshold: chi2 at the ends of the interval of `confidence`.
        rms: (k,) in the measured unit.
        estimates: (k, n) all parameters.

    """

    parameter: Parameter
    estimate: float
    values: Array
    chi2: Array
    threshold: float
    confidence: float
    rms: Array
    estimates: Array


def profile(
    problem: Problem,
    result: FitResult,
    name: str,
    *,
    values: Array | None = None,
    points: int = 15,
    confidence: float = CONFIDENCE,
) -> Profile:
    """Computes the likelihood profile of a parameter.

    Args:
        result: a fit of this problem.
        values: where to hold the parameter, within its bounds; None: `points` of them, over
            twice the interval's width, or all between the bounds where that is infinite.
        confidence: for the threshold, a share: 0.95 for 95 %.

    Raises:
        InputError: an unknown name, another problem's result, values outside the bounds.

    """
    walk = _Walk(problem, result, name, confidence)
    at, held = walk.estimate, problem.parameters[walk.index]
    grid = _grid(result, walk, points) if values is None else np.sort(np.asarray(values, float))
    if not ((grid >= held.lower) & (grid <= held.upper)).all():
        outside = grid[(grid < held.lower) | (grid > held.upper)][0]
        raise InputError(name, float(outside), f"{held.lower:g} to {held.upper:g} {held.unit}")
    found: dict[float, tuple[float, float, Array]] = {}
    for side in (grid[grid >= at], grid[grid < at][::-1]):
        walk.restart()
        for value in side:  # outwards, each from its neighbour's solution
            found[float(value)] = walk.step(float(value))
    rows = [found[float(v)] for v in grid]
    return Profile(
        parameter=held,
        estimate=at,
        values=grid,
        chi2=np.array([r[0] for r in rows]),
        threshold=walk.threshold,
        confidence=confidence,
        rms=np.array([r[1] for r in rows]),
        estimates=np.array([r[2] for r in rows]),
    )


def profile_interval(
    problem: Problem, result: FitResult, name: str, *, confidence: float = CONFIDENCE
) -> tuple[float, float]:
    """Gives the confidence interval from the likelihood profile.

    An end is infinite where the profile stays below the threshold as far as the bound: within the
    bounds the data set no limit on that side.

    Raises:
        InputError: as `profile`.

    """
    walk = _Walk(problem, result, name, confidence)
    lower, upper = (_crossing(walk, result, sign) for sign in (-1.0, 1.0))
    return lower, upper


def _crossing(walk: _Walk, result: FitResult, sign: float) -> float:
    """Where the profile reaches the threshold on one side; infinite if it does not."""
    held = walk.problem.parameters[walk.index]
    bound = held.upper if sign > 0.0 else held.lower
    error = float(result.standard_errors[walk.index])
    step = np.sqrt(walk.threshold) * error if np.isfinite(error) else 0.0
    step = min(step, held.upper - held.lower) or 0.02 * (held.upper - held.lower)
    walk.restart()

    def excess(value: float) -> float:
        return walk.step(value)[0] - walk.threshold

    inside = walk.estimate
    while inside != bound:
        outside = min(max(inside + sign * step, held.lower), held.upper)
        if excess(outside) > 0.0:
            ends = sorted((inside, outside))
            # chi2 is 0 at the estimate, and was below the threshold wherever `inside` moved on to
            width = 1e-7 * abs(outside - walk.estimate)
            return float(optimize.brentq(excess, *ends, xtol=width, rtol=1e-12))
        inside, step = outside, 2.0 * step
    return sign * np.inf


def _grid(result: FitResult, walk: _Walk, points: int) -> Array:
    """Values about the estimate, within the bounds, the estimate among them."""
    held = result.parameters[walk.index]
    half = 2.0 * np.sqrt(walk.threshold) * float(result.standard_errors[walk.index])
    if not (np.isfinite(half) and half > 0.0):
        space = np.geomspace if held.logarithmic else np.linspace
        grid = np.clip(space(held.lower, held.upper, points), held.lower, held.upper)
    else:
        low, high = max(held.lower, walk.estimate - half), min(held.upper, walk.estimate + half)
        grid = np.linspace(low, high, points)
    return np.unique(np.append(grid, walk.estimate))


class _Walk:
    """Least squares with one parameter held, each from where the one before ended."""

    def __init__(self, problem: Problem, result: FitResult, name: str, confidence: float) -> None:
        if not 0.0 < confidence < 1.0:
            raise InputError("confidence", confidence, "between 0 and 1")
        if problem.fingerprint() != result.fingerprint:
            raise InputError("result", result.title, f"a fit of the same problem, {problem.title}")
        self.index = result.index(name)
        self.problem, self.estimate = problem, float(result.estimates[self.index])
        estimated = result.sigma is None or result.rescaled
        freedom = result.degrees_of_freedom if estimated else None
        self.threshold = quantile(confidence, freedom) ** 2
        self._variance = result.residual_sigma**2 if estimated else 1.0
        if not (np.isfinite(self.threshold) and self._variance > 0.0):
            allowed = "a fit with more measured values than parameters and with residuals not 0"
            raise InputError("result", result.title, allowed)
        self._scale = Scale(problem.parameters)
        self._best, self._others = result.estimates, np.arange(len(result.estimates)) != self.index
        self._minimum = min(r.cost for r in result.convergence)
        self.restart()

    def restart(self) -> None:
        """Back to the estimates."""
        self._at = self._scale.to_unit(self._best)

    def step(self, value: float) -> tuple[float, float, Array]:
        """chi2 above the minimum, RMS, and all parameters, with the parameter held at `value`."""
        others, whole = self._others, self._at.copy()
        held = self._best.copy()
        held[self.index] = value
        whole[self.index] = self._scale.to_unit(held)[self.index]
        evaluator = Evaluator(self.problem, Checkpoint(None, {}), lambda count, rms: None)

        def full(u: Array) -> Array:
            point = whole.copy()
            point[others] = u
            return point

        # no solution of the model with the others as they are: far beyond any threshold
        if not np.isfinite(evaluator.residuals(whole)).all():
            return np.inf, np.inf, np.where(others, np.nan, held)
        if others.any():
            optimize.least_squares(
                lambda u: evaluator.residuals(full(u)),
                whole[others],
                jac=lambda u: evaluator.jacobian(full(u))[:, others],
                bounds=(0.0, 1.0),
                x_scale="jac",
                ftol=_TOLERANCE,
                xtol=_TOLERANCE,
                gtol=None,
                max_nfev=_EVALUATIONS,
            )
        assert evaluator.best_x is not None
        self._at = self._scale.to_unit(evaluator.best_x)
        excess = (evaluator.best_cost - self._minimum) / self._variance
        return excess, evaluator.best_rms, evaluator.best_x

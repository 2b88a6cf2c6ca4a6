"""The fits on the clamped head share how they search, and what they say of a result."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drake_racket.identify.core.annealing import TEMPERATURE, anneal
from drake_racket.identify.core.estimate import Estimate
from drake_racket.identify.core.least_squares import fit
from drake_racket.identify.core.problem import Problem
from drake_racket.identify.core.result import FitResult
from drake_racket.io.errors import InputError
from drake_racket.io.progress import Report
from drake_racket.parameters.ball import BallParameters
from drake_racket.parameters.quantities import sourced_fields
from drake_racket.parameters.racket import RacketParameters

METHODS = ("least-squares", "annealing")


@dataclass(frozen=True)
class Search:
    """A Search holds the options of a fit.

    Attributes:
        method: one of METHODS.
        starts: of least squares, or chains of annealing.
        seed: of the starts and of the annealing.
        workers: processes that share the starts.
        evaluations: of each annealing chain, at most.
        temperature: at which an annealing chain begins, in the unit of the sum of squares; see
            `annealing.anneal`.
        polish: finish each annealing chain by least squares.
        rescale: take standard deviations as relative, and scale them by the residuals.
        tolerance: relative change of the sum of squares at which least squares stops. In flat
            valleys a smaller one costs many steps that change nothing.

    Raises:
        InputError: an unknown method.

    """

    method: str = "least-squares"
    starts: int = 4
    seed: int = 0
    workers: int = 1
    evaluations: int = 20_000
    temperature: float = TEMPERATURE
    polish: bool = False
    rescale: bool = False
    tolerance: float = 1e-9

    def __post_init__(self) -> None:
        """Checks the method; the numbers are checked by what takes them."""
        if self.method not in METHODS:
            raise InputError("method", self.method, ", ".join(METHODS))
        if self.polish and self.method != "annealing":
            raise InputError("polish", True, "only with the method annealing")


def search(
    problem: Problem, options: Search, checkpoint: Path | None, progress: Report | None
) -> FitResult:
    """Fits by the method that the options name.

    Raises:
        InputError: as `least_squares.fit` and `annealing.anneal`.

    """
    method: Callable[..., FitResult] = partial(fit, tolerance=options.tolerance)
    if options.method == "annealing":
        method = partial(
            anneal,
            max_evaluations=options.evaluations,
            temperature=options.temperature,
            polish=options.polish,
        )
    # a step where no parameter has any effect is 0 / 0; the result says what is undetermined
    with np.errstate(divide="ignore", invalid="ignore"):
        return method(
            problem,
            starts=options.starts,
            seed=options.seed,
            workers=options.workers,
            checkpoint=checkpoint,
            progress=progress,
            rescale_sigma=options.rescale and problem.sigma is not None,
        )


def estimates(
    result: FitResult, intervals: Sequence[tuple[float, float]] | None = None
) -> dict[str, Estimate]:
    """Gives the result's parameters by name, with other intervals in place of its own if given."""
    own = result.confidence_intervals if intervals is None else np.array(intervals)
    return {
        p.name: Estimate(
            float(result.estimates[i]),
            float(result.standard_errors[i]),
            (float(own[i, 0]), float(own[i, 1])),
            p.unit,
        )
        for i, p in enumerate(result.parameters)
    }


def short_title(racket: RacketParameters, names: Sequence[str]) -> str:
    """Gives the racket's name and what is fitted, short enough for a figure."""
    what = ", ".join(names) if len(names) <= 4 else f"{names[0]} to {names[-1]}"
    return f"{racket.name}: {what}"


def unit_text(unit: str) -> str:
    """Gives a unit as it follows a number; nothing for pure numbers."""
    return "" if unit == "1" else f" {unit}"


def determined(estimate: Estimate) -> bool:
    """Tells whether data determine a positive parameter: its 95 % interval is finite, above 0."""
    low, high = estimate.interval
    return bool(low > 0.0 and np.isfinite(high))


def loose(found: Mapping[str, Estimate]) -> list[str]:
    """Gives one line for each parameter that is fitted but not determined."""
    lines = []
    for name, estimate in found.items():
        if determined(estimate):
            continue
        low, high = estimate.interval
        if not np.isfinite([low, high]).any():
            span = "no finite 95 % interval"
        else:
            span = f"95 % interval {low:.3g} to {high:.3g}{unit_text(estimate.unit)}"
        lines.append(f"{name} is not determined by these data ({span})")
    return lines


def fingerprint(
    racket: RacketParameters,
    ball: BallParameters,
    arrays: Sequence[NDArray[np.generic] | None],
    settings: str,
) -> str:
    """Gives the hash of what a fit rests on: values of racket and ball, data, settings."""
    found = hashlib.sha256(settings.encode())
    for parameters in (racket, ball):
        values = [(key, quantity.value) for key, quantity in sourced_fields(parameters)]
        found.update(repr(values).encode())
    for array in arrays:
        found.update(b"-" if array is None else np.ascontiguousarray(array).tobytes())
    return found.hexdigest()

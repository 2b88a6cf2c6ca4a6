"""Simulated annealing, as the paper fitted its string bed (scipy's dual annealing)."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy import optimize

from drake_racket.errors import InputError
from drake_racket.identify.assemble import Outcome, make_result
from drake_racket.identify.evaluator import Evaluator
from drake_racket.identify.journal import Journal, journal_header, prepare_directory
from drake_racket.identify.least_squares import Progress, Start, random_keyword, run_start
from drake_racket.identify.problem import Problem, Scale, check_count, check_problem
from drake_racket.identify.result import FitResult, StartRecord

_POLISH_TOLERANCE = 1e-12
_POLISH_EVALUATIONS = 500

TEMPERATURE = 500.0
"""Where the cooling begins. scipy's steps shrink with the temperature to the power 2.6: from about
0.4 they are a part of the way between the bounds, from 0.03 they are none to speak of. With eleven
parameters that is from the 3,000th to the 14,000th evaluation; from scipy's own 5230 it would be
from the 12,000th to the 60,000th, but it begins anew at the 29,000th."""

TEMPERATURES = 0.02, 5e4
"""What scipy takes."""


def anneal(
    problem: Problem,
    *,
    seed: int = 0,
    max_evaluations: int = 20_000,
    temperature: float = TEMPERATURE,
    journal: Path | None = None,
    progress: Progress = None,
    polish: bool = False,
    rescale_sigma: bool = False,
) -> FitResult:
    """Estimates the parameters by generalised simulated annealing without local search.

    It begins at the problem's start and moves in `Scale`'s numbers, as `fit` does. The energy is
    the sum of squared residuals over sigma; where sigma is unknown, over the mean square residual
    at the start, since the schedule of temperatures is one of absolute energies. Without `polish`
    the point found is the best of the points tried, not a minimum: a warning says how far from one
    it is where that matters to the intervals.

    Args:
        temperature: at the start, in units of the energy, TEMPERATURES. A lower one narrows the
            search sooner.
        journal: directory that keeps the evaluations. A run that was killed and started again
            with it ends with the same result, bit for bit; a larger `max_evaluations` continues.
        progress: called with the part done (0 to 1) and the lowest RMS so far.
        polish: go on by least squares with exact derivatives from the best point.
        rescale_sigma: as for `fit`.

    Raises:
        InputError: a problem that cannot be fitted, bad options, or another run's journal.

    """
    began = time.monotonic()
    check_problem(problem)
    check_count("seed", seed, 0)
    check_count("max_evaluations", max_evaluations, 1)
    check_temperature("temperature", temperature)
    prepare_directory(journal)

    def report(count: int, rms: float) -> None:
        if progress is not None:
            progress(min(count / max_evaluations, 1.0), rms)

    outcome = _annealed(problem, seed, temperature, max_evaluations, journal, report)
    method = "simulated annealing"
    if polish:
        outcome = _polished(problem, outcome, journal, progress)
        method += " and least squares"
    seconds = time.monotonic() - began
    return make_result(
        problem, [outcome], method=method, seed=seed, seconds=seconds, rescale=rescale_sigma
    )


def check_temperature(key: str, temperature: float) -> None:
    """Raises InputError for a temperature that is not within TEMPERATURES."""
    low, high = TEMPERATURES
    if not low <= temperature <= high:
        raise InputError(key, temperature, f"{low:g} to {high:g}")


def _annealed(
    problem: Problem,
    seed: int,
    temperature: float,
    max_evaluations: int,
    path: Path | None,
    report: Callable[[int, float], None],
) -> Outcome:
    """The annealing run; its journal is read first and then continued."""
    scale = Scale(problem.parameters)
    begin = scale.to_unit(np.array([p.start for p in problem.parameters], float))
    settings = {"method": "simulated annealing", "seed": seed, "temperature": temperature}
    header = journal_header(problem, settings)
    file = None if path is None else path / "annealing.journal"
    with Journal(file, header) as journal:
        evaluator = Evaluator(problem, journal, report)
        # the schedule does not know the budget, so that a journal serves a larger one as well
        random = {random_keyword(optimize.dual_annealing): np.random.default_rng(seed)}
        first = evaluator.cost(begin)
        if not np.isfinite(first):
            raise InputError("start", list(scale.from_unit(begin)), "a start the model can solve")
        unit = 1.0
        if problem.sigma is None and evaluator.best_rms > 0.0:
            unit = evaluator.best_rms**2
        found = optimize.dual_annealing(
            lambda u: first / unit if np.array_equal(u, begin) else evaluator.cost(u) / unit,
            bounds=[(0.0, 1.0)] * len(begin),
            x0=begin,
            maxfun=max_evaluations,
            maxiter=max_evaluations,  # an iteration takes two evaluations or more
            no_local_search=True,
            initial_temp=temperature,
            **random,
        )
    try:
        x, residuals, jacobian = evaluator.best()
    except FloatingPointError as error:
        raise InputError(
            "problem", problem.title, f"one without {error} at the best point"
        ) from None
    record = StartRecord(
        number=0,
        start=scale.from_unit(begin),
        estimates=x,
        cost=evaluator.best_cost,
        rms=evaluator.best_rms,
        evaluations=evaluator.evaluations,
        converged=True,
        status=" ".join(map(str, found.message)),
        history=np.array(evaluator.history),
    )
    return Outcome(record, residuals, jacobian)


def _polished(
    problem: Problem, annealed: Outcome, path: Path | None, progress: Progress
) -> Outcome:
    """Least squares from the best point of the annealing; records of both as one."""
    point, before = Scale(problem.parameters).to_unit(annealed.record.estimates), annealed.record
    # another budget ends at another point: a journal for each
    name = hashlib.blake2b(point.tobytes(), digest_size=4).hexdigest()

    def report(count: int, rms: float) -> None:
        if progress is not None:
            progress(1.0, rms)

    start = Start(
        problem=problem,
        number=0,
        point=point,
        tolerance=_POLISH_TOLERANCE,
        max_evaluations=_POLISH_EVALUATIONS,
        journal=None if path is None else path / f"polish_{name}.journal",
    )
    outcome = run_start(start, report)
    after = outcome.record
    history = np.vstack([before.history, after.history + np.array([before.evaluations, 0.0])])
    record = replace(
        after,
        start=before.start,
        evaluations=before.evaluations + after.evaluations,
        status=f"annealing: {before.status}; least squares: {after.status}",
        history=history,
    )
    return replace(outcome, record=record)

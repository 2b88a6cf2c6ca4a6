"""Anneals as the paper fitted its string bed (scipy's dual annealing)."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy import optimize

from drake_racket.identify.core.assemble import StartOutcome
from drake_racket.identify.core.evaluator import Evaluator
from drake_racket.identify.core.least_squares import Descent
from drake_racket.identify.core.problem import Array, Problem, Scale, check_count
from drake_racket.identify.core.result import FitResult
from drake_racket.identify.core.starts import Start, Starts, Tell, random_keyword
from drake_racket.io.errors import InputError
from drake_racket.io.progress import Report

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
    starts: int = 4,
    seed: int = 0,
    workers: int = 1,
    max_evaluations: int = 20_000,
    temperature: float = TEMPERATURE,
    checkpoint: str | Path | None = None,
    progress: Report | None = None,
    polish: bool = False,
    rescale_sigma: bool = False,
) -> FitResult:
    """Estimates the parameters by generalised simulated annealing, the best of several chains.

    One chain in a few is caught in another valley of the string-bed's landscape
    (docs/identification.md), so there are several, begun where `fit` begins its starts, and moving
    in the same numbers, each with random numbers of its own. The energy is the sum of squared
    residuals over sigma; where sigma is unknown, over the mean square residual at the chain's
    start, since the schedule of temperatures is one of absolute energies. There is no local
    search unless `polish` adds one at the end: without it the point found is the best of the
    points tried, not a minimum, and a warning says how far from one it is where that matters to
    the intervals. The result is the same, bit for bit, for any number of workers.

    Args:
        starts: number of chains.
        workers: processes that share the chains; see `fit`.
        max_evaluations: of the residuals, per chain.
        temperature: at the start, in units of the energy, TEMPERATURES. A lower one narrows the
            search sooner.
        checkpoint: directory that keeps the evaluations. A run that was killed and started again
            with it ends with the same result, bit for bit; a larger `max_evaluations` continues.
        progress: called with how far it is; `total` is 1, `rms` the lowest so far.
        polish: let each chain go on by least squares with exact derivatives from its best point.
        rescale_sigma: as for `fit`.

    Raises:
        InputError: a problem that cannot be fitted, bad options, or another run's checkpoint.

    """
    checkpoint = None if checkpoint is None else Path(checkpoint)
    check_count("max_evaluations", max_evaluations, 1)
    check_temperature("temperature", temperature)
    kind = partial(
        Chain,
        seed=seed,
        temperature=temperature,
        max_evaluations=max_evaluations,
        polish=polish,
    )
    method = "simulated annealing" + (" and least squares" if polish else "")
    several = Starts(starts, seed, workers, checkpoint, progress, rescale_sigma)
    return several.run(problem, kind, method, "chain")


def check_temperature(key: str, temperature: float) -> None:
    """Raises InputError for a temperature that is not within TEMPERATURES."""
    low, high = TEMPERATURES
    if not low <= temperature <= high:
        raise InputError(key, temperature, f"{low:g} to {high:g}")


@dataclass(frozen=True, kw_only=True)
class Chain(Start):
    """Holds one annealing run from one start."""

    seed: int
    temperature: float
    max_evaluations: int
    polish: bool

    def settings(self) -> dict[str, Any]:
        """Tells what decides its steps; the schedule does not know the number of evaluations."""
        random = [self.seed, self.number]
        return {"method": "simulated annealing", "seed": random, "temperature": self.temperature}

    def run(self, report: Tell) -> StartOutcome:
        """Anneals, and goes on by least squares if wanted."""
        annealed = self._annealed(report)
        if not self.polish or not np.isfinite(annealed.record.cost):
            return annealed
        return self._polished(annealed, report)

    def _annealed(self, report: Tell) -> StartOutcome:
        with self.open_checkpoint() as checkpoint:
            evaluator = Evaluator(
                self.problem,
                checkpoint,
                lambda n, rms: report(min(n / self.max_evaluations, 1), rms),
            )
            first = evaluator.cost(self.point)
            if not np.isfinite(first):
                return self.failed(evaluator, "the model has no solution there")
            unit = 1.0
            if self.problem.sigma is None and evaluator.best_rms > 0.0:
                unit = evaluator.best_rms**2

            def energy(u: Array) -> float:
                # scipy asks for the start's again
                return (first if np.array_equal(u, self.point) else evaluator.cost(u)) / unit

            random = np.random.default_rng([self.seed, self.number])
            keywords: dict[str, Any] = {random_keyword(optimize.dual_annealing): random}
            found = optimize.dual_annealing(
                energy,
                bounds=[(0.0, 1.0)] * len(self.point),
                x0=self.point,
                maxfun=self.max_evaluations,
                maxiter=self.max_evaluations,  # an iteration takes two evaluations or more
                no_local_search=True,
                initial_temp=self.temperature,
                **keywords,
            )
        # the checkpoint is closed: what follows depends on max_evaluations, what it holds does not
        try:
            return self.ended(evaluator, " ".join(map(str, found.message)), converged=True)
        except FloatingPointError as error:
            return self.failed(evaluator, f"{error} at the best point")

    def _polished(self, annealed: StartOutcome, report: Tell) -> StartOutcome:
        """Least squares from the best point of the annealing; records of both as one."""
        before = annealed.record
        point = Scale(self.problem.parameters).to_unit(before.estimates)
        # another budget ends at another point: a checkpoint for each
        digest = hashlib.blake2b(point.tobytes(), digest_size=4).hexdigest()
        name = f"polish_{self.number:02d}_{digest}.sqlite"
        descent = Descent(
            problem=self.problem,
            number=self.number,
            point=point,
            checkpoint=None if self.checkpoint is None else self.checkpoint.parent / name,
            tolerance=_POLISH_TOLERANCE,
            max_evaluations=_POLISH_EVALUATIONS,
        )
        outcome = descent.run(lambda _done, rms: report(1.0, rms))
        after = outcome.record
        offset = np.array([before.evaluations, 0.0])
        record = replace(
            after,
            start=before.start,
            evaluations=before.evaluations + after.evaluations,
            status=f"annealing: {before.status}; least squares: {after.status}",
            history=np.vstack([before.history, after.history + offset]),
        )
        return replace(outcome, record=record)

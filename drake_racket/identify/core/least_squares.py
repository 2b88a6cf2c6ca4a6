"""Fits by least squares with exact derivatives from several starts (scipy's trust region)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy import optimize

from drake_racket.identify.core.assemble import StartOutcome
from drake_racket.identify.core.evaluator import Evaluator
from drake_racket.identify.core.problem import Array, Problem, check_count
from drake_racket.identify.core.result import FitResult
from drake_racket.identify.core.starts import Start, Starts, Tell
from drake_racket.io.errors import InputError
from drake_racket.io.progress import Report


def fit(
    problem: Problem,
    *,
    starts: int = 8,
    seed: int = 0,
    workers: int = 1,
    checkpoint: str | Path | None = None,
    progress: Report | None = None,
    tolerance: float = 1e-12,
    max_evaluations: int = 200,
    rescale_sigma: bool = False,
) -> FitResult:
    """Estimates the parameters by least squares, each residual over its sigma where known.

    The search is in `Scale`'s numbers: the way between the bounds, logarithmic where the bounds
    are positive and more than a factor 10 apart. The first start is the problem's own, the others
    are a Latin hypercube between the bounds. The result is the same, bit for bit, for any number
    of workers, and for a run that was killed and started again with the same checkpoint.

    Args:
        workers: processes that share the starts (started by spawn: a script needs the usual
            `if __name__ == "__main__":`).
        checkpoint: directory that keeps the evaluations, one file per start.
        progress: called with how far it is; `total` is 1, `rms` the lowest so far.
        tolerance: relative change of the sum of squares, or of the parameters, at which a start
            stops.
        max_evaluations: of the residuals, per start.
        rescale_sigma: take the problem's sigma as relative, and scale it by the residuals.

    Raises:
        InputError: a problem that cannot be fitted, bad options, or another fit's checkpoint.

    """
    checkpoint = None if checkpoint is None else Path(checkpoint)
    check_count("max_evaluations", max_evaluations, 1)
    if not 1e-15 <= tolerance < 1.0:
        raise InputError("tolerance", tolerance, "from 1e-15 to below 1")
    kind = partial(Descent, tolerance=tolerance, max_evaluations=max_evaluations)
    several = Starts(starts, seed, workers, checkpoint, progress, rescale_sigma)
    return several.run(problem, kind, "least squares", "start")


@dataclass(frozen=True, kw_only=True)
class Descent(Start):
    """Descends by least squares from one start."""

    tolerance: float
    max_evaluations: int

    def settings(self) -> dict[str, Any]:
        """The stopping rule; a checkpoint serves any number of evaluations."""
        return {"method": "least squares", "tolerance": self.tolerance}

    def run(self, report: Tell) -> StartOutcome:
        """To the minimum, or as far as the evaluations go."""
        with self.open_checkpoint() as checkpoint:
            evaluator = Evaluator(
                self.problem, checkpoint, lambda n, rms: report(n / self.max_evaluations, rms)
            )

            def checked(u: Array) -> Array:
                found = evaluator.residuals(u)
                if evaluator.evaluations == 1 and not np.isfinite(found).all():
                    raise FloatingPointError("the model has no solution there")
                return found

            try:
                found = optimize.least_squares(
                    checked,
                    self.point,
                    jac=evaluator.jacobian,
                    bounds=(0.0, 1.0),
                    method="trf",
                    x_scale="jac",
                    ftol=self.tolerance,
                    xtol=self.tolerance,
                    gtol=None,  # absolute, so a matter of units
                    max_nfev=self.max_evaluations,
                )
                return self.ended(evaluator, str(found.message), converged=found.status > 0)
            except FloatingPointError as error:
                return self.failed(evaluator, str(error))

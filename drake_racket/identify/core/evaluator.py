"""Residuals and derivatives on the search's scale, counted, kept, and the best one kept."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from drake_racket.identify.core.checkpoint import Checkpoint
from drake_racket.identify.core.problem import Array, Problem, Scale
from drake_racket.io.errors import InputError
from drake_racket.io.interrupts import raise_interrupts


class Evaluator:
    """Holds residuals and derivatives as functions of u in [0, 1]^n, each residual over its sigma.

    Keeps the best point seen, in the parameters' and the measurement's own units.

    Args:
        report: called after each evaluation of the residuals with their number and the best RMS;
            what it raises ends the run.

    """

    def __init__(
        self, problem: Problem, checkpoint: Checkpoint, report: Callable[[int, float], None]
    ) -> None:
        self.problem = problem
        self.scale = Scale(problem.parameters)
        self.evaluations = 0
        self.best_x: Array | None = None
        self.best_cost, self.best_rms = np.inf, np.inf
        self.best_residuals = np.empty(0)
        self.history: list[tuple[float, float]] = []
        self._checkpoint = checkpoint
        self._report = report
        self._jacobian: tuple[Array, Array] | None = None

    def residuals(self, u: Array) -> Array:
        """Gives (m,) residuals, each over its sigma; not finite where the model has no solution."""
        raise_interrupts()
        x = self.scale.from_unit(u)
        found = self._checkpoint.value("residuals", x, lambda: self._checked_residuals(x))
        weighted = self._weighted(found)
        self._count(x, *_cost_and_rms(weighted, found), found)
        return weighted

    def cost(self, u: Array) -> float:
        """Gives the sum of squares of `residuals`; inf where the model has no solution."""
        raise_interrupts()
        x = self.scale.from_unit(u)

        def compute() -> Array:
            found = self._checked_residuals(x)
            return np.array(_cost_and_rms(self._weighted(found), found))

        cost, rms = map(float, self._checkpoint.value("cost", x, compute))
        self._count(x, cost, rms, np.empty(0))
        return cost if np.isfinite(cost) else np.inf

    def jacobian(self, u: Array) -> Array:
        """Gives (m, n) derivatives of `residuals` by u.

        Raises:
            FloatingPointError: they are not finite.

        """
        x = self.scale.from_unit(u)
        return self._weighted(self._jacobian_at(x) * self.scale.slope(x))

    def best(self) -> tuple[Array, Array, Array]:
        """Gives point (n,), residuals (m,), jacobian (m, n) of the lowest cost, in own units."""
        assert self.best_x is not None
        if not self.best_residuals.size:
            self.best_residuals = self._checked_residuals(self.best_x)
        return self.best_x, self.best_residuals, self._jacobian_at(self.best_x)

    def _weighted(self, values: Array) -> Array:
        sigma = self.problem.sigma
        return values if sigma is None else (values.T / sigma).T

    def _count(self, x: Array, cost: float, rms: float, residuals: Array) -> None:
        self.evaluations += 1
        if cost < self.best_cost:
            self.best_x, self.best_cost, self.best_rms = x, cost, rms
            self.best_residuals = residuals
            self.history.append((float(self.evaluations), rms))
        self._report(self.evaluations, self.best_rms)

    def _checked_residuals(self, x: Array) -> Array:
        found = np.asarray(self.problem.residuals(x), np.float64)
        sigma = self.problem.sigma
        if found.ndim != 1 or not found.size or (sigma is not None and found.shape != sigma.shape):
            shape = "(m,)" if sigma is None else f"{sigma.shape}, as sigma"
            raise InputError("residuals", found.shape, f"an array of shape {shape}")
        return found

    def _jacobian_at(self, x: Array) -> Array:
        if self._jacobian is None or not np.array_equal(self._jacobian[0], x):
            count = len(self.problem.parameters)
            found = self._checkpoint.value("jacobian", x, lambda: self._checked_jacobian(x))
            self._jacobian = x, found.reshape(-1, count)
        return self._jacobian[1]

    def _checked_jacobian(self, x: Array) -> Array:
        found = np.asarray(self.problem.jacobian(x), np.float64)
        count = len(self.problem.parameters)
        if found.ndim != 2 or found.shape[1] != count:
            raise InputError("jacobian", found.shape, f"an array of shape (m, {count})")
        if not np.isfinite(found).all():
            raise FloatingPointError("derivatives that are not finite")
        return found


def _cost_and_rms(weighted: Array, found: Array) -> tuple[float, float]:
    """Sum of squares over sigma, and root mean square.

    Both from the same sum, so that without a sigma the lowest of one is the lowest of the other to
    the last digit, whatever a processor's scalar product does.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        return float(np.sum(weighted**2)), float(np.sqrt(np.mean(found**2)))

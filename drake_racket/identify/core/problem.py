"""A problem has parameters with bounds, and gives residuals and derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from drake_racket.io.errors import InputError

Array: TypeAlias = NDArray[np.float64]

LOG_RATIO = 10.0  # positive bounds further apart than this are searched on a log scale


@dataclass(frozen=True)
class Parameter:
    """A Parameter is one number to estimate, with its bounds and its start.

    Attributes:
        name: of the number, as results call it.
        unit: of the three numbers.
        lower, upper: bounds of the search, in this unit.
        start: where it begins, in this unit.

    Raises:
        InputError: unless the bounds are finite and lower < start < upper.

    """

    name: str
    unit: str
    lower: float
    upper: float
    start: float

    def __post_init__(self) -> None:
        bounds = (self.lower, self.upper)
        if not (np.isfinite(bounds).all() and self.lower < self.upper):
            raise InputError(f"{self.name}: bounds", bounds, "two finite numbers, lower < upper")
        if not self.lower < self.start < self.upper:
            allowed = f"lower < start < upper, between {self.lower:g} and {self.upper:g}"
            raise InputError(f"{self.name}: start", self.start, f"{allowed} {self.unit}".rstrip())

    @property
    def logarithmic(self) -> bool:
        """Tells whether the search scale is the logarithm: 0 < lower and upper/lower > 10."""
        return self.lower > 0.0 and self.upper > LOG_RATIO * self.lower


class Problem(Protocol):
    """Holds a model beside measurements: m measured values, n parameters.

    A problem may also have `residual_unit: str`, the measured quantity's unit. With several
    workers it must pickle. Where the model has no solution, `residuals` returns nan.

    Attributes:
        parameters: n of them, in the order of `x`.
        sigma: (m,) standard deviation of each measured value in its own unit; None where it is
            unknown, and then taken as equal for all and estimated from the residuals.
        title: for reports.

    """

    @property
    def parameters(self) -> tuple[Parameter, ...]: ...  # noqa: D102
    @property
    def sigma(self) -> Array | None: ...  # noqa: D102
    @property
    def title(self) -> str: ...  # noqa: D102

    def residuals(self, x: Array) -> Array:
        """Gives the model minus measured, (m,), in the measured quantity's unit."""
        ...

    def jacobian(self, x: Array) -> Array:
        """Gives the derivatives of the residuals by the parameters, (m, n), exact."""
        ...

    def fingerprint(self) -> str:
        """Hash of data and settings: a checkpoint of another problem is refused."""
        ...


class Scale:
    """Parameters to and from numbers u between 0 (lower bound) and 1 (upper bound).

    Linear, or logarithmic where `Parameter.logarithmic` says so.
    """

    def __init__(self, parameters: Sequence[Parameter]) -> None:
        self.lower = np.array([p.lower for p in parameters])
        self.upper = np.array([p.upper for p in parameters])
        self._log = np.array([p.logarithmic for p in parameters])
        # a plain ratio where the scale is linear would divide by zero or take a negative log
        low, high = (np.where(self._log, b, 1.0) for b in (self.lower, self.upper))
        self._decades = np.log(high / low)

    def to_unit(self, x: Array) -> Array:
        """Gives (n,) parameters as numbers between 0 and 1."""
        linear = (x - self.lower) / (self.upper - self.lower)
        low, value = (np.where(self._log, b, 1.0) for b in (self.lower, x))
        log = np.log(value / low) / np.where(self._log, self._decades, 1.0)
        return np.clip(np.where(self._log, log, linear), 0.0, 1.0)

    def from_unit(self, u: Array) -> Array:
        """Gives (n,) parameters of the numbers between 0 and 1."""
        linear = self.lower + u * (self.upper - self.lower)
        log = self.lower * np.exp(u * self._decades)
        return np.clip(np.where(self._log, log, linear), self.lower, self.upper)

    def slope(self, x: Array) -> Array:
        """Gives (n,) dx/du at the parameters x."""
        return np.where(self._log, x * self._decades, self.upper - self.lower)


def check_problem(problem: Problem) -> None:
    """Refuses what no fit can use, before anything is computed.

    Raises:
        InputError: no parameters, a name twice, or a sigma that is not positive and finite.

    """
    names = [p.name for p in problem.parameters]
    if not names or len(set(names)) < len(names):
        raise InputError("parameters", names, "at least one, each name once")
    sigma = problem.sigma
    if sigma is None:
        return
    if np.ndim(sigma) != 1 or not (np.isfinite(sigma).all() and (sigma > 0.0).all()):
        bad = np.ravel(sigma)
        bad = bad[~(np.isfinite(bad) & (bad > 0.0))]
        value = float(bad[0]) if bad.size else f"an array of shape {np.shape(sigma)}"
        raise InputError("sigma", value, "a positive finite number for each measured value")


def check_count(key: str, value: int, least: int) -> None:
    """Refuses a count that is not a whole number from `least` on.

    Raises:
        InputError: naming `key`.

    """
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
        raise InputError(key, value, f"a whole number from {least} on")

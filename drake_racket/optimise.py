"""Optimises over impacts: gives scipy objectives and constraints with their exact gradients.

    impacts = Impacts(scenario, {"racket.head.mass": (0.14, 0.18)}, ["restitution"])
    best = scipy.optimize.minimize(
        impacts.maximise("restitution"), impacts.start, jac=True, bounds=impacts.bounds
    )

Variables run from 0 to 1 between their bounds, so that kilograms and newtons weigh alike. Numbers
of several cases (places where the ball lands, say) are averaged with weights. One evaluation gives
all numbers with their gradients; objective and constraints share it.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_racket.cases.case import Case, resolve
from drake_racket.cases.keys import NUMBER, Key, find_key, number_of, with_values
from drake_racket.derivatives import Parameter, run_with_derivatives, vary
from drake_racket.io.errors import InputError
from drake_racket.io.progress import Progress, Report
from drake_racket.parameters.scenario import Scenario
from drake_racket.plant.properties import (
    RacketProperties,
    mass_properties,
    racket_properties,
)
from drake_racket.results.outputs import OUTPUTS, Output, find_outputs
from drake_racket.simulation import using_diagram

Array = NDArray[np.float64]

CaseOf = Callable[[Mapping[str, float]], Case]
"""Makes one case from the variables' values, in their units."""


@dataclass(frozen=True)
class CaseNumber:
    """A number that a case has before any impact: its racket's swingweight, a joint's rate.

    Attributes:
        read: a smooth function of the case; its derivatives are short differences.

    """

    name: str
    read: Callable[[Case], float]


def _property(case: Case, *, name: str) -> float:
    return _properties(case, [name])[name]


def _properties(case: Case, names: Sequence[str]) -> dict[str, float]:
    """Some of a racket's properties; frequencies take longest."""
    if any(name.endswith("frequency") for name in names):
        return dataclasses.asdict(racket_properties(case.racket))
    return mass_properties(case.racket)


OF_RACKET = {
    field.name: CaseNumber(field.name, functools.partial(_property, name=field.name))
    for field in dataclasses.fields(RacketProperties)
}
"""Numbers of the racket itself."""


@dataclass(frozen=True)
class _Numbers:
    """Holds all numbers at one place, averaged over the cases, with their gradients."""

    values: dict[str, float]
    gradients: dict[str, Array]


class Impacts:
    """Impacts are one or more cases as functions of variables, for an optimiser.

    Args:
        base: a scenario or several; or functions that make cases from the variables' values, for
            designs that no key has (`add_mass`).
        variables: name -> (least, largest) value, in the unit of the key of that name.
        numbers: outputs of impacts (`OUTPUTS`); of the racket itself (`OF_RACKET`: mass, balance,
            swingweight, twistweight, spinweight, in_plane_frequency, out_of_plane_frequency); or
            your own.
        weights: shares of the cases; equal if not given. They are made to sum to 1.
        start: value by variable; that of the first case's key if not given, else the middle.

    Raises:
        InputError: naming the variable or number, and what is allowed.

    """

    def __init__(
        self,
        base: Scenario | Case | CaseOf | Sequence[Scenario | CaseOf],
        variables: Mapping[str, tuple[float, float]],
        numbers: Sequence[str | Output | CaseNumber],
        *,
        weights: Sequence[float] | None = None,
        start: Mapping[str, float] | None = None,
    ) -> None:
        bases = list(base) if isinstance(base, Sequence) else [base]
        if not bases:
            raise InputError("optimise", "no case", "one scenario or more")
        self.names = tuple(variables)
        self.low, self.high = _ranges(variables)
        units: dict[str, str] = {}
        given = dict(start or {})
        self._cases: list[CaseOf] = []
        for one in bases:
            if isinstance(one, (Scenario, Case)):
                scenario = resolve(one).scenario
                keys = {name: _key(scenario, name) for name in self.names}
                self._cases.append(functools.partial(_with_keys, scenario, keys))
                for name, key in keys.items():
                    units.setdefault(name, key.unit)
                    given.setdefault(name, number_of(scenario, key))
            else:
                self._cases.append(one)
        self.units = tuple(units.get(name, "") for name in self.names)
        self.weights = _weights(weights, len(bases))
        asked = [OF_RACKET.get(n, n) if isinstance(n, str) else n for n in numbers]
        of_impact = [n for n in asked if not isinstance(n, CaseNumber)]
        self._outputs = find_outputs(of_impact, "optimise") if of_impact else ()
        self._of_case = [n for n in asked if isinstance(n, CaseNumber)]
        self.numbers = (*(n.name for n in self._outputs), *(n.name for n in self._of_case))
        if not self.numbers:
            raise InputError("optimise", "no number", ", ".join([*OUTPUTS, *OF_RACKET]))
        self._history = any(o.needs_history for o in self._outputs)
        self.start = self._scaled(given)
        self._kept: tuple[bytes, _Numbers] | None = None
        self.evaluations = 0

    @property
    def bounds(self) -> list[tuple[float, float]]:
        """Gives the bounds of all variables as scipy takes them."""
        return [(0.0, 1.0)] * len(self.names)

    def variables(self, u: Array) -> dict[str, float]:
        """Gives the variables' values, in their units, at a place `u` (n, shares 0 to 1)."""
        x = self.low + np.asarray(u) * (self.high - self.low)
        return {name: float(value) for name, value in zip(self.names, x, strict=True)}

    def place(self, values: Mapping[str, float]) -> Array:
        """Gives the place of the optimiser (n,) for `values` in their units; raises InputError."""
        for name in self.names:
            if name not in values:
                raise InputError("optimise", f"no {name}", ", ".join(self.names))
        return self._scaled(values)

    def values(self, u: Array) -> dict[str, float]:
        """Gives all numbers, means of the cases, at a place `u` (n, shares 0 to 1)."""
        return dict(self._at(u).values)

    def gradient(self, name: str, u: Array) -> Array:
        """Gives the derivatives (n,) of one number by the variables, at `u` (n, shares 0 to 1)."""
        return self._at(u).gradients[self._known(name)].copy()

    def minimise(self, name: str) -> Callable[[Array], tuple[float, Array]]:
        """Gives a function for scipy's `minimize(..., jac=True)`: a number and its gradient."""
        return functools.partial(self._objective, self._known(name), 1.0)

    def maximise(self, name: str) -> Callable[[Array], tuple[float, Array]]:
        """Gives such a function of a number that is to be large: it has the other sign."""
        return functools.partial(self._objective, self._known(name), -1.0)

    def at_most(self, name: str, bound: float) -> dict[str, Any]:
        """Gives a constraint for scipy's SLSQP: a number is not above a `bound` in its unit."""
        return self._constraint(name, bound, -1.0)

    def at_least(self, name: str, bound: float) -> dict[str, Any]:
        """Gives a constraint for scipy's SLSQP: a number is not below a `bound` in its unit."""
        return self._constraint(name, bound, 1.0)

    # ---- inside

    def _known(self, name: str) -> str:
        if name not in self.numbers:
            raise InputError("optimise", name, ", ".join(self.numbers))
        return name

    def _objective(self, name: str, sign: float, u: Array) -> tuple[float, Array]:
        at = self._at(u)
        return sign * at.values[name], sign * at.gradients[name]

    def _constraint(self, name: str, bound: float, sign: float) -> dict[str, Any]:
        self._known(name)
        size = abs(bound) or 1.0  # constraints weigh alike, too

        def room(u: Array) -> float:
            return sign * (self._at(u).values[name] - bound) / size

        def slope(u: Array) -> Array:
            return sign * self._at(u).gradients[name] / size

        return {"type": "ineq", "fun": room, "jac": slope}

    def _scaled(self, given: Mapping[str, float]) -> Array:
        start = np.array(
            [
                given.get(name, 0.5 * (low + high))
                for name, low, high in zip(self.names, self.low, self.high, strict=True)
            ]
        )
        outside = (start < self.low) | (start > self.high)
        if outside.any():
            i = int(np.argmax(outside))
            allowed = f"a start within {self.low[i]:g} to {self.high[i]:g}"
            raise InputError(f"optimise: {self.names[i]}", float(start[i]), allowed)
        return np.asarray((start - self.low) / (self.high - self.low))

    def _at(self, u: Array) -> _Numbers:
        place = np.asarray(u, dtype=float).tobytes()
        if self._kept is None or self._kept[0] != place:
            self._kept = (place, self._evaluate(np.asarray(u, dtype=float)))
        return self._kept[1]

    def _evaluate(self, u: Array) -> _Numbers:
        here, span = self.variables(u), self.high - self.low
        total = np.zeros(len(self.numbers))
        slopes = np.zeros((len(self.numbers), len(self.names)))
        for case_of, weight in zip(self._cases, self.weights, strict=True):
            case = case_of(here)
            parameters = [
                Parameter(
                    name, unit, here[name], functools.partial(_one_changed, case_of, here, name)
                )
                for name, unit in zip(self.names, self.units, strict=True)
            ]
            values, table = self._of_impact(case, parameters)
            own, own_table = self._own(case, parameters)
            total += weight * np.concatenate([values, own])
            slopes += weight * np.concatenate([table, own_table]) * span
        self.evaluations += 1
        return _Numbers(
            dict(zip(self.numbers, map(float, total), strict=True)),
            dict(zip(self.numbers, slopes, strict=True)),
        )

    def _of_impact(self, case: Case, parameters: Sequence[Parameter]) -> tuple[Array, Array]:
        """Numbers of the impact, and their derivatives."""
        if not self._outputs:
            return np.zeros(0), np.zeros((0, len(parameters)))
        for output in self._outputs:
            if not output.available(case.scenario):
                raise InputError("optimise", output.name, "numbers that each case has")
        with using_diagram(case) as system:
            _, found = run_with_derivatives(
                case, system, parameters, self._outputs, history=self._history
            )
        return found.values, found.table

    def _own(self, case: Case, parameters: Sequence[Parameter]) -> tuple[Array, Array]:
        """Numbers of the case itself, and their derivatives."""
        values = self._read(case)
        table = np.zeros((len(values), len(parameters)))
        if len(values) == 0:
            return values, table
        for j, parameter in enumerate(parameters):
            variation = vary(case, parameter)
            for weight, varied in zip(variation.weights, variation.cases, strict=True):
                table[:, j] += weight * self._read(varied)
        return values, table

    def _read(self, case: Case) -> Array:
        names = [n.name for n in self._of_case if OF_RACKET.get(n.name) is n]
        known = _properties(case, names) if names else {}
        return np.array([known[n.name] if n.name in known else n.read(case) for n in self._of_case])


def _with_keys(scenario: Scenario, keys: Mapping[str, Key], values: Mapping[str, float]) -> Case:
    settings = {key: values[name] for name, key in keys.items()}
    return resolve(with_values(scenario, settings, {}), "optimise")


def _one_changed(case_of: CaseOf, here: Mapping[str, float], name: str, value: float) -> Case:
    return case_of({**here, name: value})


def _key(scenario: Scenario, name: str) -> Key:
    key = find_key(name, scenario, "optimise")
    if key.kind != NUMBER:
        raise InputError(f"optimise: {name}", key.kind, "keys that are numbers")
    return key


def _ranges(variables: Mapping[str, tuple[float, float]]) -> tuple[Array, Array]:
    if not variables:
        raise InputError("optimise", "no variable", "name: (least, largest), one or more")
    for name, (low, high) in variables.items():
        if not (np.isfinite(low) and np.isfinite(high) and low < high):
            raise InputError(f"optimise: {name}", (low, high), "(least, largest), finite")
    pairs = np.array(list(variables.values()), dtype=float)
    return pairs[:, 0], pairs[:, 1]


def _weights(given: Sequence[float] | None, count: int) -> Array:
    weights: Array = np.ones(count) if given is None else np.asarray(given, dtype=float)
    if len(weights) != count or not np.isfinite(weights).all() or (weights < 0.0).any():
        raise InputError("optimise: weights", given, f"{count} numbers of 0 or more")
    if not weights.sum() > 0.0:
        raise InputError("optimise: weights", given, "one of them above 0")
    return np.asarray(weights / weights.sum())


_GAIN = 10.0
"""Of the tolerance: a restart that gains less has found the same place."""


@dataclass(frozen=True)
class Optimum:
    """An optimum is what an optimisation over impacts found.

    Attributes:
        variables: name -> value, in its key's unit.  at_bound: those that their bounds hold.
        start, values: numbers at the start and at the end, in their outputs' units.
        active: numbers that a constraint holds.  broken: that are beyond their bound, since no
            design was found that keeps it.
        success, message: of scipy.
        iterations, evaluations: of the search; an evaluation runs all cases once.

    """

    variables: dict[str, float]
    at_bound: tuple[str, ...]
    start: dict[str, float]
    values: dict[str, float]
    active: tuple[str, ...]
    broken: tuple[str, ...]
    success: bool
    message: str
    iterations: int
    evaluations: int


def optimise_impacts(
    impacts: Impacts,
    *,
    maximise: str | None = None,
    minimise: str | None = None,
    at_most: Mapping[str, float] | None = None,
    at_least: Mapping[str, float] | None = None,
    start: Array | None = None,
    iterations: int = 100,
    tolerance: float = 1e-7,
    restarts: int = 5,
    progress: Report | None = None,
) -> Optimum:
    """Finds the best variables with scipy's SLSQP, from one start: a local optimum.

    SLSQP builds up what it knows of curvature as it goes, and may stop short where that is wrong:
    it is begun anew where it ended, until nothing is gained.

    Args:
        maximise, minimise: the number to be large or small; one of the two.
        at_most, at_least: number -> bound, in the number's unit.
        start: (n,) places between the bounds, shares from 0 to 1; the impacts' own if not given.
        iterations: at most.  tolerance: of the objective, as a share of its value at the start.
        restarts: at most.
        progress: called at each iteration.

    Raises:
        InputError: both or neither of maximise and minimise, or an unknown number.

    """
    from scipy.optimize import minimize

    if (maximise is None) == (minimise is None):
        raise InputError("optimise", (maximise, minimise), "one of maximise and minimise")
    name = maximise or minimise
    assert name is not None
    objective = impacts.maximise(name) if maximise else impacts.minimise(name)
    limits = [
        *((number, impacts.at_most(number, bound)) for number, bound in (at_most or {}).items()),
        *((number, impacts.at_least(number, bound)) for number, bound in (at_least or {}).items()),
    ]
    begin = impacts.start if start is None else np.asarray(start, dtype=float)
    before, done = impacts.values(begin), impacts.evaluations - 1
    size = abs(before[name]) or 1.0
    told = 0

    def scaled(u: Array) -> tuple[float, Array]:
        value, gradient = objective(u)
        return value / size, gradient / size

    def tell(_: Array) -> None:
        nonlocal told
        told += 1
        if progress is not None:
            progress(Progress("optimising", told, iterations))

    def descend(u: Array) -> Any:
        return minimize(
            scaled,
            u,
            jac=True,
            bounds=impacts.bounds,
            constraints=[limit for _, limit in limits],
            method="SLSQP",
            callback=tell,
            options={"maxiter": iterations, "ftol": tolerance},
        )

    found = descend(begin)
    for _ in range(restarts):
        if told >= iterations:
            break
        again = descend(np.clip(found.x, 0.0, 1.0))
        gained, found = found.fun - again.fun, again
        if abs(gained) <= _GAIN * tolerance:
            break
    u = np.clip(found.x, 0.0, 1.0)
    return Optimum(
        variables=impacts.variables(u),
        at_bound=tuple(n for n, x in zip(impacts.names, u, strict=True) if min(x, 1.0 - x) < 1e-6),
        start=before,
        values=impacts.values(u),
        active=tuple(n for n, limit in limits if abs(limit["fun"](u)) < 1e-5),
        broken=tuple(n for n, limit in limits if limit["fun"](u) < -1e-5),
        success=bool(found.success),
        message=str(found.message),
        iterations=told,
        evaluations=impacts.evaluations - done,
    )

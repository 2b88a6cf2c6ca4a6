"""States measured impacts as a least-squares problem, with the exact derivatives of each run."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from drake_racket import derivatives
from drake_racket.cases.case import Case, resolve
from drake_racket.cases.keys import Key, with_values
from drake_racket.identify.core.problem import Parameter
from drake_racket.identify.impacts.table import MeasuredImpacts
from drake_racket.io.errors import InputError, SimulationError
from drake_racket.parameters.scenario import Scenario
from drake_racket.results.outputs import Output
from drake_racket.simulation import using_diagram

Array = NDArray[np.float64]


class ImpactsProblem:
    """Fits keys of scenarios to measured numbers of impacts.

    With standard deviations the residuals are in these; without, in the unit of the one output.
    """

    def __init__(
        self,
        data: MeasuredImpacts,
        keys: Sequence[Key],
        parameters: Sequence[Parameter],
        title: str,
    ) -> None:
        """Takes one parameter for each key, in its unit."""
        self.data, self.keys, self.parameters = data, tuple(keys), tuple(parameters)
        self.title = title
        self.measured = np.isfinite(data.values)  # (r, k)
        known = data.sigma is not None
        self.sigma = np.ones(int(self.measured.sum())) if known else None
        self.residual_unit = "standard deviations" if known else data.outputs[0].units
        self._kept: tuple[bytes, Array, Array] | None = None

    def __getstate__(self) -> dict[str, object]:
        """Leaves the last run out: each process has its own."""
        return self.__dict__ | {"_kept": None}

    def residuals(self, x: Array) -> Array:
        """Gives the model less measured, (m,); nan where the model has no number."""
        return self._both(x)[0].copy()

    def jacobian(self, x: Array) -> Array:
        """Gives the residuals' derivatives by the parameters, (m, n)."""
        return self._both(x)[1].copy()

    def modelled(self, x: Array) -> Array:
        """Gives the model's numbers, (r, k), in the outputs' units; NaN where none was measured."""
        out = np.full(self.data.values.shape, np.nan)
        scale = 1.0 if self.data.sigma is None else self.data.sigma[self.measured]
        out[self.measured] = self.data.values[self.measured] + scale * self.residuals(x)
        return out

    def fingerprint(self) -> str:
        """Gives the hash of data, scenarios and parameters."""
        found = hashlib.sha256(self.data.sha256.encode())
        found.update(repr([dataclasses.asdict(s) for s in self.data.scenarios]).encode())
        found.update(repr([dataclasses.astuple(p) for p in self.parameters]).encode())
        return found.hexdigest()

    def _both(self, x: Array) -> tuple[Array, Array]:
        place = np.asarray(x, dtype=float).tobytes()
        if self._kept is None or self._kept[0] != place:
            self._kept = (place, *self._evaluate(np.asarray(x, dtype=float)))
        return self._kept[1], self._kept[2]

    def _evaluate(self, x: Array) -> tuple[Array, Array]:
        values, slopes = [], []
        for i, scenario in enumerate(self.data.scenarios):
            if not self.measured[i].any():
                continue
            found, table = self._row(scenario, x, self.measured[i])
            scale = 1.0 if self.data.sigma is None else self.data.sigma[i, self.measured[i]]
            values.append((found - self.data.values[i, self.measured[i]]) / scale)
            slopes.append(table / np.reshape(scale, (-1, 1)))
        return np.concatenate(values), np.concatenate(slopes)

    def check(self) -> None:
        """Runs the first impact at the start; raises InputError for what no engine here can run."""
        start = np.array([p.start for p in self.parameters])
        self._run(self.data.scenarios[0], start, self.data.outputs)

    def _row(self, scenario: Scenario, x: Array, wanted: NDArray[np.bool_]) -> tuple[Array, Array]:
        """What was measured of one impact as the model has it, and its derivatives."""
        outputs = [o for o, asked in zip(self.data.outputs, wanted, strict=True) if asked]
        try:
            return self._run(scenario, x, outputs)
        except (InputError, SimulationError):  # no racket or run with these values: no solution
            return np.full(len(outputs), np.nan), np.full((len(outputs), len(x)), np.nan)

    def _run(self, scenario: Scenario, x: Array, outputs: Sequence[Output]) -> tuple[Array, Array]:
        here = dict(zip(self.keys, map(float, x), strict=True))
        case = _case(scenario, here)
        own = [
            derivatives.Parameter(
                key.name, key.unit, value, functools.partial(_changed, scenario, here, key)
            )
            for key, value in here.items()
        ]
        with using_diagram(case) as system:
            _, found = derivatives.run_with_derivatives(
                case, system, own, outputs, history=any(o.needs_history for o in outputs)
            )
        return found.values, found.table


def _changed(scenario: Scenario, here: Mapping[Key, float], key: Key, value: float) -> Case:
    return _case(scenario, {**here, key: value})


def _case(scenario: Scenario, values: Mapping[Key, float]) -> Case:
    return resolve(with_values(scenario, values, {}), "identify")

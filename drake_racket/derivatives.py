"""Gives exact derivatives of an impact's numbers by keys of its scenario, in the compiled engine.

How the start of a run depends on a key (masses, springs, initial state) comes from resolving the
scenario a little to either side; how the path depends on its start comes from its tangents
(`engines.compiled.tangents`), no second run is made; and how a number depends on the path comes
from reading it on paths a little to either side. So differences are taken of short smooth formulas
alone, to some ten digits, and the impact itself is differentiated exactly: through all steps, touch
and release.
"""

from __future__ import annotations

import dataclasses
import functools
import weakref
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from drake_racket.cases.case import Case, resolve, with_engine
from drake_racket.cases.diagram import ImpactDiagram, make_impact_diagram
from drake_racket.cases.keys import NUMBER, Key, find_key, number_of, with_values
from drake_racket.io.errors import InputError
from drake_racket.results.impact import ImpactResult, make_result
from drake_racket.results.outputs import OUTPUTS, Output, read_outputs

if TYPE_CHECKING:
    from drake_racket.engines.compiled.engine import CompiledImpact, Samples, Start
    from drake_racket.engines.compiled.tangents.path import Directions, Tangents

Array = NDArray[np.float64]

STEP = 1e-5
"""Length of the short differences: a share of a value, absolute (degrees: 1e-4) where it is 0."""

_SAME_SLOPE = 1e-3
"""Share by which two differences of a start may disagree."""

SHORTENINGS = 6
"""How often the steps of a run may be shortened for its derivatives."""

NOT_BY = ("integrator.", "time_step")
"""Beginnings of keys that say how a run is computed: nothing is differentiated by them."""


@dataclass(frozen=True)
class Derivatives:
    """Holds the derivatives of an impact's numbers by keys.

    Attributes:
        outputs: names of the numbers (m).  keys: names of the parameters (n).
        units: of the parameters (n).
        values: (m,) the numbers, in the units of `results.outputs`.
        table: (m, n) derivatives, per unit of each parameter; NaN where there is no number.
        error: largest error of a step as a share of the derivative, out of contact.

    """

    outputs: tuple[str, ...]
    keys: tuple[str, ...]
    units: tuple[str, ...]
    values: Array
    table: Array
    error: float

    def of(self, output: str, key: str) -> float:
        """Gives the derivative of one number by one key; raises InputError."""
        for name, known, kind in ((output, self.outputs, "output"), (key, self.keys, "key")):
            if name not in known:
                raise InputError(f"derivatives: {kind}", name, ", ".join(known))
        return float(self.table[self.outputs.index(output), self.keys.index(key)])

    def to_json(self) -> dict[str, Any]:
        """Gives number -> key -> derivative as JSON's own types; NaN becomes null."""
        return {
            output: {
                key: None if np.isnan(x) else float(x)
                for key, x in zip(self.keys, row, strict=True)
            }
            for output, row in zip(self.outputs, self.table, strict=True)
        }


@dataclass(frozen=True)
class Parameter:
    """A parameter is a number that an impact depends on.

    Attributes:
        name, unit: to show.  value: in that unit.
        at: the case with another value of it; raises InputError where that is not valid.

    """

    name: str
    unit: str
    value: float
    at: Callable[[float], Case]


@dataclass(frozen=True)
class Variation:
    """One parameter a little beside its value, with the weights of a derivative's formula."""

    steps: tuple[float, ...]
    weights: tuple[float, ...]
    cases: tuple[Case, ...]


_models: weakref.WeakKeyDictionary[ImpactDiagram, CompiledImpact] = weakref.WeakKeyDictionary()


def compiled_model(system: ImpactDiagram) -> CompiledImpact:
    """Gives the compiled model of a Diagram, made once."""
    from drake_racket.engines.compiled.engine import CompiledImpact

    if system not in _models:
        _models[system] = CompiledImpact(system)
    return _models[system]


def parameters_of(case: Case, names: Sequence[str], where: str = "derivatives") -> list[Parameter]:
    """Gives the keys of these names as parameters of a case.

    Raises:
        InputError: none, one twice, no such key, or one that holds no number of physics.

    """
    if isinstance(names, str) or not names:
        raise InputError(where, names, "a list of keys: racket.head.mass, speed, ...")
    found: list[Parameter] = []
    for name in names:
        key = find_key(name, case.scenario, where)
        if key.kind != NUMBER or name.startswith(NOT_BY):
            raise InputError(f"{where}: {name}", key.kind, "keys that are numbers of the impact")
        if name in [other.name for other in found]:
            raise InputError(where, name, "each key once")
        at = functools.partial(_with, case, key)
        found.append(Parameter(name, key.unit, number_of(case.scenario, key), at))
    return found


def run_with_derivatives(
    case: Case,
    system: ImpactDiagram,
    parameters: Sequence[Parameter],
    outputs: Sequence[Output] | None = None,
    *,
    history: bool = True,
) -> tuple[ImpactResult, Derivatives]:
    """Runs a case in the compiled engine, and gives derivatives of outputs by parameters.

    Args:
        case: with the topology of `system`.
        parameters: of `parameters_of`, or your own.
        outputs: numbers to differentiate; None: all that a case of this kind has.
        history: label the time history; outputs that are read from it need it.

    Raises:
        InputError: the compiled engine cannot run the case, or a parameter has one value only.
        SimulationError: the run could not be finished.

    """
    case = with_engine(case, "compiled")
    chosen = [
        output
        for output in (OUTPUTS.values() if outputs is None else outputs)
        if output.available(case.scenario)
        and (history or not output.needs_history)
        and not output.of_engine
    ]
    model = compiled_model(system)
    variations = [vary(case, parameter) for parameter in parameters]
    starts = list(_starts(model, variations))
    if case.scenario.support == "limb":
        _check_starts(case, model, parameters, variations, starts)
    start = model.start(case)
    kept, tangents = _path(case, model, start, variations, starts)
    table = np.empty((len(chosen), len(parameters)))
    for j, variation in enumerate(variations):
        table[:, j] = 0.0
        for i, step in enumerate(variation.steps):
            varied, here = _model_of(model, variation.cases[i])
            beside = here.trajectory(
                here.start(varied), _beside(kept, tangents, j, step), every_sample=history
            )
            result = make_result(varied, beside, history=history)
            table[:, j] += variation.weights[i] * np.array(read_outputs(result, chosen))
    start = model.start(case)  # its Context again
    result = make_result(case, model.trajectory(start, kept, every_sample=history), history=history)
    names = tuple(output.name for output in chosen)
    found = Derivatives(
        names,
        tuple(parameter.name for parameter in parameters),
        tuple(parameter.unit for parameter in parameters),
        np.array(read_outputs(result, chosen)),
        table,
        tangents.error,
    )
    return dataclasses.replace(result, derivatives=found), found


def vary(case: Case, parameter: Parameter) -> Variation:
    """The case a little to either side; to one side where the other is not allowed."""
    value = parameter.value
    step = STEP * abs(value) if value else (1e-4 if parameter.unit == "degrees" else STEP)
    refused: InputError | None = None
    for formula in _FORMULAS:
        try:
            cases = [parameter.at(value + k * step) if k else case for k in formula]
        except InputError as error:
            refused = refused or error
            continue
        places = tuple(k * step for k in formula)
        return Variation(places, tuple(w / step for w in formula.values()), tuple(cases))
    assert refused is not None
    raise refused


_FORMULAS: tuple[dict[float, float], ...] = (
    {-1.0: -0.5, 1.0: 0.5},
    {0.0: -1.5, 1.0: 2.0, 2.0: -0.5},
    {0.0: 1.5, -1.0: -2.0, -2.0: 0.5},
)
"""Places -> weights of a first derivative: central, and to either side where only that is valid."""


def _with(case: Case, key: Key, value: float) -> Case:
    return resolve(with_values(case.scenario, {key: value}, {}), "derivatives")


def _model_of(model: CompiledImpact, case: Case) -> tuple[Case, CompiledImpact]:
    """The model that a case runs in: another where the key is a length of the Diagram."""
    if case.topology == model.system.case.topology:
        return case, model
    other = compiled_model(make_impact_diagram(case))
    if not np.array_equal(other.model.ints, model.model.ints):
        raise InputError("derivatives", repr(case), "keys that leave the mechanism what it is")
    return case, other


def _starts(model: CompiledImpact, variations: Sequence[Variation]) -> Iterator[list[Start]]:
    for variation in variations:
        yield [_model_of(model, case)[1].start(case) for case in variation.cases]


def _check_starts(
    case: Case,
    model: CompiledImpact,
    parameters: Sequence[Parameter],
    variations: Sequence[Variation],
    starts: Sequence[Sequence[Start]],
) -> None:
    """Refuses parameters that move the limb's posture: a search finds it, and not to round-off.

    The slope of the start must be the same with steps twice as long.
    """
    for parameter, variation, own in zip(parameters, variations, starts, strict=True):
        wider = [
            parameter.at(parameter.value + 2.0 * step) if step else case for step in variation.steps
        ]
        slope = _slope(variation, [start.y for start in own])
        other = 0.5 * _slope(variation, [_model_of(model, c)[1].start(c).y for c in wider])
        if np.max(np.abs(slope - other)) > _SAME_SLOPE * np.max(np.abs(slope)):
            raise InputError(
                f"derivatives: {parameter.name}",
                parameter.value,
                "keys that leave the limb's posture as it is (a search finds it, which is too"
                " coarse to differentiate)",
            )


def _path(
    case: Case,
    model: CompiledImpact,
    start: Start,
    variations: Sequence[Variation],
    starts: Sequence[Sequence[Start]],
) -> tuple[Samples, Tangents]:
    """The run and its tangents, with steps that are short enough for both."""
    from drake_racket.engines.compiled.engine import blank_records
    from drake_racket.engines.compiled.tangents.path import tangents_of

    directions = directions_of(variations, starts)
    ints, accuracy = model.model.ints, case.scenario.integrator.accuracy
    longest = case.scenario.integrator.maximum_step
    for _ in range(SHORTENINGS):
        kept = model.samples(case, start, longest)
        tangents = tangents_of(
            ints,
            start.floats,
            kept.values,
            kept.records,
            blank_records(ints),
            start.scale,
            directions,
        )
        if not tangents.error > accuracy:
            break
        longest = min(longest, float(np.max(np.diff(kept.values[:, 0]))))
        longest *= max(0.1, 0.8 * (accuracy / tangents.error) ** 0.2)
    return kept, tangents


def directions_of(variations: Sequence[Variation], starts: Sequence[Sequence[Start]]) -> Directions:
    """Gives how the start of a run depends on parameters, from its starts beside them."""
    from drake_racket.engines.compiled.tangents.path import Directions

    pairs = list(zip(variations, starts, strict=True))
    return Directions(
        np.array([_slope(v, [start.floats for start in own]) for v, own in pairs]),
        np.array([_slope(v, [start.y for start in own]) for v, own in pairs]),
        np.array([_slope(v, [_end(c) for c in v.cases]) for v in variations]),
    )


def _end(case: Case) -> Array:
    return np.array(case.scenario.approach_time + case.scenario.after)


def _slope(variation: Variation, values: Sequence[Array]) -> Array:
    total = np.zeros_like(values[0])
    for weight, value in zip(variation.weights, values, strict=True):
        total += weight * value
    return total


def _beside(kept: Samples, tangents: Tangents, j: int, step: float) -> Samples:
    """The samples of the path that a key `step` beside its value has."""
    values, records = kept.values.copy(), kept.records + step * tangents.record[j]
    values[:, 0] += step * tangents.time[j]
    values[:, 1:] += step * tangents.state[j]
    return dataclasses.replace(kept, values=values, records=records)

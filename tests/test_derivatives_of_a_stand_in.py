"""How derivatives are put together, on a path that is known: nothing is compiled.

The stand-in's ball moves on x(t) = x0 + v t with x0 = the offset and v = speed / mass of the head;
the run ends at approach_time + after, and a record keeps v squared.
"""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import drake_racket as dr
from drake_racket import derivatives
from drake_racket.derivatives import Derivatives, Parameter, run_with_derivatives, vary
from drake_racket.engines.compiled import engine
from drake_racket.engines.compiled.engine import Samples, Start
from drake_racket.engines.compiled.tangents import path
from drake_racket.engines.compiled.tangents.path import Tangents
from drake_racket.results.outputs import Output

BASE = dr.Scenario(speed=20.0, offset_x=0.03, after=0.006, audit=False, engine="compiled")
MASS = dr.load_racket().head.mass.value
SPEED = 20.0 / MASS


class Model:
    """Stands for a CompiledImpact."""

    def __init__(self, case: Any) -> None:
        self.system = SimpleNamespace(case=case)
        self.model = SimpleNamespace(ints=np.array([1, 2]))
        self.longest: list[float] = []

    def start(self, case: Any) -> Start:
        """Speed over mass in floats, the place in y."""
        s, mass = case.scenario, case.racket.head.mass.value
        y = np.array([s.offset_x])
        return Start(None, np.array([s.speed / mass]), y, np.ones(1), ())

    def samples(self, case: Any, start: Start, longest: float) -> Samples:
        """Five samples on the path."""
        self.longest.append(longest)
        s = case.scenario
        time = (s.approach_time + s.after) * np.array([0.0, 0.1, 0.3, 0.6, 1.0])
        values = np.column_stack([time, start.y[0] + start.floats[0] * time])
        return Samples(values, np.full((5, 1, 1), start.floats[0] ** 2), 4, 9)

    def trajectory(self, start: Start, kept: Samples, every_sample: bool) -> Any:
        """What is read: place and time at the end, the record, and whether all is kept."""
        return SimpleNamespace(
            place=kept.values[-1, 1],
            time=kept.values[-1, 0],
            record=kept.records[-1, 0, 0],
            twice=start.floats[0] * 2.0,
            every=every_sample,
        )


ERRORS = [0.0]


def tangents_of(ints, floats, values, records, blank, scale, directions) -> Tangents:
    """Of the path above: exact."""
    share = values[:, 0] / values[-1, 0]
    time = np.outer(directions.end, share)
    speed, place = directions.floats[:, :1], directions.y[:, :1]
    state = place + speed * values[None, :, 0] + floats[0] * time
    record = 2.0 * floats[0] * speed[:, :, None, None] * np.ones((1, 5, 1, 1))
    return Tangents(ERRORS.pop(0) if len(ERRORS) > 1 else ERRORS[0], time, state[..., None], record)


@dataclasses.dataclass
class Result:
    """Stands for an ImpactResult."""

    read: Any
    case: Any
    history: bool
    derivatives: Derivatives | None = None


def number(name: str, **more: Any) -> Output:
    return Output(name, "m", name, lambda result: float(getattr(result.read, name)), **more)


OUTPUTS = [
    number("place"),
    number("time"),
    number("record"),
    number("twice"),
    number("every", needs_history=True),
    number("loss", needs="audit"),
    number("steps", of_engine=True),
]


@pytest.fixture
def model(monkeypatch):
    made = Model(dr.resolve(BASE))
    monkeypatch.setattr(derivatives, "compiled_model", lambda system: made)
    monkeypatch.setattr(
        derivatives, "make_result", lambda case, read, history: Result(read, case, history)
    )
    monkeypatch.setattr(path, "tangents_of", tangents_of)
    monkeypatch.setattr(engine, "blank_records", lambda ints: np.zeros((1, 1)))
    ERRORS[:] = [0.0]
    return made


def run(keys, *, history=True, outputs=OUTPUTS, base=BASE):
    case = dr.resolve(base)
    parameters = derivatives.parameters_of(case, keys)
    return run_with_derivatives(case, None, parameters, outputs, history=history)


def test_numbers_by_start_model_record_and_end(model):
    keys = ["speed", "racket.head.mass", "offset_x", "after", "approach_time"]
    result, found = run(keys)
    assert result.derivatives is found
    assert result.history
    assert found.outputs == ("place", "time", "record", "twice", "every")
    assert found.units == ("m/s", "kg", "m", "s", "s")
    end = BASE.approach_time + BASE.after
    assert found.values == pytest.approx(
        [0.03 + SPEED * end, end, SPEED**2, 2.0 * SPEED, 1.0], rel=1e-12
    )
    expected = [
        [end / MASS, -SPEED / MASS * end, 1.0, SPEED, SPEED],
        [0.0, 0.0, 0.0, 1.0, 1.0],
        [2.0 * SPEED / MASS, -2.0 * SPEED**2 / MASS, 0.0, 0.0, 0.0],
        [2.0 / MASS, -2.0 * SPEED / MASS, 0.0, 0.0, 0.0],
        [0.0] * 5,
    ]
    assert found.table == pytest.approx(np.array(expected), rel=1e-6, abs=1e-7)
    assert found.to_json()["place"]["offset_x"] == found.of("place", "offset_x")
    with pytest.raises(dr.InputError, match="output: got 'plac'"):
        found.of("plac", "speed")
    with pytest.raises(dr.InputError, match="key: got 'sped'"):
        found.of("place", "sped")


def test_without_a_history_its_numbers_are_left_out(model):
    result, found = run(["speed"], history=False)
    assert not result.history
    assert not result.read.every
    assert found.outputs == ("place", "time", "record", "twice")


def test_all_outputs_of_such_a_case_where_none_is_named(model, monkeypatch):
    monkeypatch.setattr(derivatives, "OUTPUTS", {one.name: one for one in OUTPUTS})
    assert run(["speed"], outputs=None)[1].outputs == ("place", "time", "record", "twice", "every")


def test_no_number_becomes_null(model):
    nothing = Output("none", "m", "none", lambda result: np.nan)
    assert run(["speed"], outputs=[nothing])[1].to_json() == {"none": {"speed": None}}


def test_steps_are_shortened_until_the_tangents_are_as_good_as_the_run(model):
    accuracy = BASE.integrator.accuracy
    ERRORS[:] = [100.0 * accuracy, 2.0 * accuracy, accuracy, 5.0 * accuracy]
    _, found = run(["speed"])
    assert found.error == accuracy
    end = BASE.approach_time + BASE.after
    longest = BASE.integrator.maximum_step
    widest = min(longest, 0.4 * end)
    second = widest * 0.8 * 100.0**-0.2
    third = min(second, 0.4 * end) * 0.8 * 2.0**-0.2
    assert model.longest == pytest.approx([longest, second, third], rel=1e-12)


def test_steps_are_not_shortened_for_ever_nor_by_much(model):
    ERRORS[:] = [1e9]
    run(["speed"])
    assert len(model.longest) == derivatives.SHORTENINGS == 6
    assert model.longest[2] == pytest.approx(0.1 * model.longest[1])


def parameter(value: float, low: float, high: float, unit: str = "m") -> Parameter:
    def at(x: float) -> Any:
        if not low <= x <= high:
            raise dr.InputError("x", x, f"{low} to {high}")
        return x

    return Parameter("x", unit, value, at)


@pytest.mark.parametrize(
    ("value", "unit", "step"),
    [
        (2.0, "m", 2e-05),
        (-4.0, "m", 4e-05),
        (0.0, "m", 1e-05),
        (0.0, "degrees", 0.0001),
        (5.0, "degrees", 5e-05),
    ],
)
@pytest.mark.parametrize("side", [0, 1, -1])
def test_differences_to_both_sides_or_to_the_one_that_is_allowed(value, unit, step, side):
    low, high = (value if side > 0 else -9.0), (value if side < 0 else 9.0)
    found = vary("case", parameter(value, low, high, unit))
    expected = {0: [-1.0, 1.0], 1: [0.0, 1.0, 2.0], -1: [0.0, -1.0, -2.0]}[side]
    assert found.steps == pytest.approx([k * step for k in expected])
    values = [value if one == "case" else one for one in found.cases]
    assert values == pytest.approx([value + k * step for k in expected], rel=1e-12)
    slope = sum(w * x**2 for w, x in zip(found.weights, values, strict=True))
    assert slope == pytest.approx(2.0 * value, abs=1e-4)
    assert sum(found.weights) * step == pytest.approx(0.0, abs=1e-9)


def test_a_value_without_others_beside_it_is_refused_as_it_was_first():
    with pytest.raises(dr.InputError, match=r"x: got 1\.99998"):
        vary("case", parameter(2.0, 2.0, 2.0))


@pytest.mark.parametrize(("noise", "good"), [(0.0, True), (2.0e-3, True), (6.0e-3, False)])
def test_a_start_whose_slope_depends_on_the_step_is_refused(model, monkeypatch, noise, good):
    """Cubic in the key: the slopes over one and two steps differ by 3 times its share."""
    base = dr.Scenario(support="limb", engine="compiled")
    case = dr.resolve(base)
    step = 1e-5

    def at(value: float) -> Any:
        z = (value - 1.0) / step
        y = np.array([z + noise / 6.0 * z**3])
        return SimpleNamespace(y=y, topology=model.system.case.topology)

    one = Parameter("x", "m", 1.0, at)
    model.start = lambda case: case
    variation = vary(case, one)
    starts = [[at(1.0 - step), at(1.0 + step)]]
    check = lambda: derivatives._check_starts(case, model, [one], [variation], starts)  # noqa: E731
    if good:
        check()
        return
    with pytest.raises(dr.InputError, match="limb's posture"):
        check()


def test_keys_of_the_diagram_run_in_a_model_of_their_own(model, monkeypatch):
    made = []

    def another(case: Any) -> Any:
        made.append(Model(case))
        return made[-1]

    monkeypatch.setattr(derivatives, "make_impact_diagram", lambda case: case)
    first = derivatives.compiled_model
    monkeypatch.setattr(
        derivatives,
        "compiled_model",
        lambda system: first(system) if system is None else another(system),
    )
    _, found = run(["racket.handle.length"])
    assert len(made) >= 2
    assert found.table[:, 0] == pytest.approx(0.0)

    def other_mechanism(case: Any) -> Any:
        one = another(case)
        one.model.ints = np.array([1, 3])
        return one

    monkeypatch.setattr(
        derivatives,
        "compiled_model",
        lambda system: model if system is None else other_mechanism(system),
    )
    with pytest.raises(dr.InputError, match="leave the mechanism what it is"):
        run(["racket.handle.length"])


@pytest.mark.parametrize(
    ("names", "told"),
    [
        ("speed", "a list of keys"),
        ([], "a list"),
        (["support"], "numbers of the impact"),
        (["time_step"], "numbers"),
        (["speed", "after", "speed"], "each key once"),
    ],
)
def test_what_cannot_be_differentiated_by(names, told):
    with pytest.raises(dr.InputError, match=told):
        derivatives.parameters_of(dr.resolve(BASE), names)

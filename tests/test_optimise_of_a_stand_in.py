"""Objectives, constraints and searches over numbers with known gradients: nothing is run."""

from __future__ import annotations

import contextlib
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import drake_racket as dr
from drake_racket import CaseNumber, Impacts, InputError, optimise, optimise_impacts

BASE = dr.Scenario(speed=25.0, offset_x=0.02)
VARIABLES = {"speed": (20.0, 40.0), "offset_x": (0.0, 0.08)}
HEAVY = dr.Scenario(speed=30.0, overrides={"racket.head.mass": 0.2})


def read(case: Any, name: str) -> float:
    """Quadratic in both variables; other for the heavy racket."""
    s = case.scenario
    factor = 2.0 if s.overrides else 1.0
    if name == "restitution":
        return factor * (0.4 - 1e-4 * (s.speed - 31.0) ** 2 - 20.0 * (s.offset_x - 0.05) ** 2)
    return factor * 0.1 * s.speed


@pytest.fixture(autouse=True)
def asked(monkeypatch):
    """Stands for runs with derivatives; gives whether each kept a history."""
    found: list[bool] = []

    def run(case, system, parameters, outputs, history):
        found.append(history)
        table = np.zeros((len(outputs), len(parameters)))
        values = np.array([read(case, one.name) for one in outputs])
        for i, output in enumerate(outputs):
            for j, parameter in enumerate(parameters):
                h = 1e-4
                ahead, behind = (
                    read(parameter.at(parameter.value + k * h), output.name) for k in (1, -1)
                )
                table[i, j] = (ahead - behind) / (2.0 * h)
        return None, SimpleNamespace(values=values, table=table)

    monkeypatch.setattr(optimise, "run_with_derivatives", run)
    monkeypatch.setattr(optimise, "using_diagram", lambda case: contextlib.nullcontext("system"))
    return found


TWICE = CaseNumber("twice", lambda case: 2.0 * case.scenario.speed**2)


def test_values_and_gradients_are_means_over_the_cases(asked):
    impacts = Impacts([BASE, HEAVY], VARIABLES, ["restitution", "mass", TWICE], weights=[1, 3])
    assert impacts.numbers == ("restitution", "mass", "twice")
    assert impacts.units == ("m/s", "m")
    assert impacts.weights == pytest.approx([0.25, 0.75])
    assert impacts.start == pytest.approx([0.25, 0.25])  # the first case's
    assert impacts.bounds == [(0.0, 1.0)] * 2
    u = np.array([0.5, 0.25])
    assert impacts.variables(u) == pytest.approx({"speed": 30.0, "offset_x": 0.02})
    assert impacts.place({"speed": 30.0, "offset_x": 0.02}) == pytest.approx(u)
    own = 0.4 - 1e-4 - 20.0 * 0.03**2
    values = impacts.values(u)
    assert values["restitution"] == pytest.approx((0.25 + 2.0 * 0.75) * own)
    plain, heavy = (dr.racket_properties(dr.resolve(s).racket).mass for s in (BASE, HEAVY))
    assert values["mass"] == pytest.approx(0.25 * plain + 0.75 * heavy)
    assert values["twice"] == pytest.approx(1800.0)
    slopes = 1.75 * np.array([2e-4 * 20.0, 40.0 * 0.03 * 0.08])
    assert impacts.gradient("restitution", u) == pytest.approx(slopes, rel=1e-6)
    assert impacts.gradient("twice", u) == pytest.approx([4.0 * 30.0 * 20.0, 0.0], rel=1e-6)
    assert impacts.evaluations == 1
    impacts.values(np.array([0.5, 0.26]))
    impacts.values(u)
    assert impacts.evaluations == 3  # one place is kept
    assert asked == [False] * 6


def test_a_history_is_kept_for_numbers_that_are_read_from_it(asked):
    Impacts(BASE, VARIABLES, ["handle_ringing"]).values(np.array([0.5, 0.5]))
    assert asked == [True]


def test_a_gradient_is_ones_own():
    impacts = Impacts(BASE, VARIABLES, ["restitution"])
    impacts.gradient("restitution", impacts.start)[:] = 0.0
    assert impacts.gradient("restitution", impacts.start).any()


def test_a_number_that_a_case_has_not(asked):
    with pytest.raises(InputError, match="numbers that each case has"):
        Impacts(BASE, VARIABLES, ["peak_hand_force"]).values(np.array([0.5, 0.5]))
    with pytest.raises(InputError, match="optimise: got 'mas'; allowed: restitution"):
        Impacts(BASE, VARIABLES, ["restitution"]).gradient("mas", np.zeros(2))
    with pytest.raises(InputError, match="no offset_x"):
        Impacts(BASE, VARIABLES, ["restitution"]).place({"speed": 30.0})


def test_what_scipy_is_given():
    impacts = Impacts(BASE, VARIABLES, ["restitution", TWICE])
    u = np.array([0.5, 0.25])
    value, slope = impacts.values(u)["twice"], impacts.gradient("twice", u)
    for sign, given in ((1.0, impacts.minimise("twice")), (-1.0, impacts.maximise("twice"))):
        found, gradient = given(u)
        assert found == sign * value
        assert gradient == pytest.approx(sign * slope)
    for sign, made in ((-1.0, impacts.at_most), (1.0, impacts.at_least)):
        for bound, size in ((1500.0, 1500.0), (-10.0, 10.0), (0.0, 1.0)):
            limit = made("twice", bound)
            assert limit["type"] == "ineq"
            assert limit["fun"](u) == pytest.approx(sign * (value - bound) / size)
            assert limit["jac"](u) == pytest.approx(sign * slope / size)


@pytest.mark.parametrize("start", [None, {"speed": 35.0}])
def test_where_a_design_without_keys_starts(start):
    def design(values):
        return dr.resolve(dr.Scenario(speed=values["speed"], offset_x=values["offset_x"]))

    impacts = Impacts(design, VARIABLES, ["restitution"], start=start)
    assert impacts.units == ("", "")
    assert impacts.start == pytest.approx([0.75 if start else 0.5, 0.5])


@pytest.mark.parametrize(("value", "good"), [(20.0, True), (40.0, True), (40.1, False)])
def test_a_start_may_be_at_a_bound(value, good):
    if good:
        assert Impacts(BASE, VARIABLES, ["restitution"], start={"speed": value}).start[0] in (0, 1)
        return
    with pytest.raises(InputError, match="a start within 20 to 40"):
        Impacts(BASE, VARIABLES, ["restitution"], start={"speed": value})


@pytest.mark.parametrize(
    ("weights", "told"),
    [([1.0, -1.0], "2 numbers"), ([1.0, np.inf], "2 numbers"), ([0.0, 0.0], "above 0")],
)
def test_weights_that_are_none(weights, told):
    with pytest.raises(InputError, match=told):
        Impacts([BASE, HEAVY], VARIABLES, ["restitution"], weights=weights)
    assert Impacts([BASE, HEAVY], VARIABLES, ["restitution"], weights=[0.0, 2.0]).weights[0] == 0.0


@pytest.mark.parametrize("ends", [(20.0, 20.0), (-np.inf, 30.0), (20.0, np.inf), (30.0, 20.0)])
def test_ranges_that_are_none(ends):
    with pytest.raises(InputError, match="least, largest"):
        Impacts(BASE, {"speed": ends}, ["restitution"])


def test_a_search_finds_the_top_and_says_how(asked):
    impacts = Impacts(BASE, VARIABLES, ["restitution", TWICE])
    impacts.values(np.array([0.1, 0.1]))  # asked before, and not the search's
    told = []
    found = optimise_impacts(impacts, maximise="restitution", progress=told.append)
    assert found.success
    assert found.variables == pytest.approx({"speed": 31.0, "offset_x": 0.05}, rel=1e-3)
    assert found.values["restitution"] == pytest.approx(0.4, abs=1e-6)
    assert found.start == impacts.values(impacts.start)
    assert (found.at_bound, found.active, found.broken) == ((), (), ())
    assert [now.done for now in told] == list(range(1, found.iterations + 1))
    assert {now.total for now in told} == {100}
    assert found.evaluations == impacts.evaluations - 1 - 1  # less the one before, and `start`


def test_what_holds_an_optimum():
    impacts = Impacts(BASE, VARIABLES, ["restitution", TWICE])
    held = optimise_impacts(impacts, maximise="restitution", at_most={"twice": 1250.0})
    assert held.variables["speed"] == pytest.approx(25.0, rel=1e-4)
    assert (held.at_bound, held.active, held.broken) == ((), ("twice",), ())
    low = optimise_impacts(impacts, minimise="twice", at_least={"restitution": 0.1})
    assert low.variables["speed"] == pytest.approx(20.0)
    assert (low.at_bound, low.active, low.broken) == (("speed",), (), ())
    none = optimise_impacts(impacts, maximise="restitution", at_least={"twice": 4000.0})
    assert none.broken == ("twice",)


@pytest.mark.parametrize(("maximise", "minimise"), [(None, None), ("twice", "restitution")])
def test_one_of_two_aims(maximise, minimise):
    impacts = Impacts(BASE, VARIABLES, ["restitution", TWICE])
    with pytest.raises(InputError, match="one of maximise and minimise"):
        optimise_impacts(impacts, maximise=maximise, minimise=minimise)


class Searches:
    """Stands for scipy's minimize: objectives at the end of each search are given."""

    def __init__(self, ends: list[float], steps: int) -> None:
        self.ends, self.steps, self.asked = ends, steps, []

    def __call__(self, scaled, u, *, callback, options, **more):
        self.asked.append((np.array(u), scaled(u)[0], options, more["bounds"], more["method"]))
        for _ in range(self.steps):
            callback(u)
        x = np.array([1.0 + 1e-9, 1e-7])
        return SimpleNamespace(x=x, fun=self.ends.pop(0), success=1, message="m")


@pytest.mark.parametrize(
    ("ends", "steps", "searches"),
    [
        ([1.0, 1.0 - 2e-6, 1.0 - 2.5e-6, 0.0], 3, 3),  # 2e-6 is more than 10 tolerances of 1e-7
        ([1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4], 3, 6),  # five restarts
        ([1.0, 0.9, 0.8], 50, 2),  # a hundred iterations in all
        ([1.0, 0.9, 0.8], 100, 1),
        ([1.0, 1.1, 1.1], 3, 3),
    ],
)
def test_a_search_is_begun_anew_until_nothing_is_gained(ends, steps, searches, monkeypatch):
    stand = Searches(ends, steps)
    monkeypatch.setattr("scipy.optimize.minimize", stand)
    impacts = Impacts(BASE, VARIABLES, ["restitution"])
    found = optimise_impacts(impacts, maximise="restitution", start=np.array([0.5, 0.5]))
    assert len(stand.asked) == searches
    assert found.iterations == searches * steps
    first, size, options, bounds, method = stand.asked[0]
    assert first == pytest.approx([0.5, 0.5])
    assert size == pytest.approx(-1.0)  # over its size at the start
    assert (options, method) == ({"maxiter": 100, "ftol": 1e-7}, "SLSQP")
    assert bounds == [(0.0, 1.0)] * 2
    assert all((one[0] >= 0.0).all() and (one[0] <= 1.0).all() for one in stand.asked)
    assert found.variables["speed"] == 40.0
    assert found.at_bound == ("speed", "offset_x")
    assert found.success is True

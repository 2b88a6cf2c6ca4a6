"""Objectives and constraints for optimisers, and what an optimisation says of its result."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from drake_racket import (
    CaseNumber,
    Impacts,
    InputError,
    IntegratorSettings,
    Scenario,
    add_mass,
    optimise_impacts,
    racket_properties,
    resolve,
)

BASE = Scenario(
    after=0.006,
    approach_time=2e-4,
    engine="compiled",
    integrator=IntegratorSettings(accuracy=1e-2, error_control=False, maximum_step=2e-5),
)
VARIABLES = {
    "racket.string_bed.initial_tension": (400.0, 900.0),
    "racket.head.mass": (0.14, 0.18),
}


def with_tip_mass(values):
    """A design that no key has: grams at the tip."""
    case = resolve(BASE)
    return dataclasses.replace(case, racket=add_mass(case.racket, 1e-3 * values["tip"], "tip"))


@pytest.mark.slow
def test_gradients_against_differences():
    aims = [dataclasses.replace(BASE, point="auto", offset_x=x) for x in (0.0, 0.04)]
    numbers = ["restitution", "contact_time", "swingweight", "balance"]
    impacts = Impacts(aims, VARIABLES, numbers, weights=[1.0, 3.0])
    u, step = np.array([0.4, 0.6]), 1e-4
    for name in numbers:
        found = impacts.gradient(name, u)
        for i in range(2):
            e = step * np.eye(2)[i]
            slope = (impacts.values(u + e)[name] - impacts.values(u - e)[name]) / (2.0 * step)
            assert found[i] == pytest.approx(slope, rel=1e-5, abs=1e-9)
    one = Impacts(aims[0], VARIABLES, numbers).values(u)["restitution"]
    other = Impacts(aims[1], VARIABLES, numbers).values(u)["restitution"]
    assert impacts.values(u)["restitution"] == pytest.approx(0.25 * one + 0.75 * other, rel=1e-12)


@pytest.mark.slow
def test_objective_and_constraints_are_what_scipy_wants():
    impacts = Impacts(BASE, VARIABLES, ["restitution", "mass"])
    u = impacts.start
    value, gradient = impacts.maximise("restitution")(u)
    assert value == -impacts.values(u)["restitution"]
    assert gradient == pytest.approx(-impacts.gradient("restitution", u))
    assert impacts.minimise("mass")(u)[0] == impacts.values(u)["mass"]
    limit = impacts.at_most("mass", 0.3)
    assert limit["fun"](u) == pytest.approx((0.3 - impacts.values(u)["mass"]) / 0.3)
    assert limit["jac"](u) == pytest.approx(-impacts.gradient("mass", u) / 0.3)
    assert impacts.at_least("mass", 0.3)["fun"](u) == -limit["fun"](u)
    assert impacts.evaluations == 1  # all of them share one
    assert impacts.place(impacts.variables(u)) == pytest.approx(u)


@pytest.mark.slow
def test_an_optimum_lies_where_its_constraint_holds_it():
    """More mass in the head returns the ball faster, up to the swingweight that is allowed."""
    bound = racket_properties(BASE.load_racket()).swingweight * 1.02
    impacts = Impacts(BASE, VARIABLES, ["restitution", "swingweight"])
    found = optimise_impacts(impacts, maximise="restitution", at_most={"swingweight": bound})
    assert found.success, found.message
    assert found.active == ("swingweight",)
    assert found.at_bound == ("racket.string_bed.initial_tension",)
    assert found.variables["racket.string_bed.initial_tension"] == pytest.approx(400.0)
    assert found.values["swingweight"] == pytest.approx(bound, rel=1e-5)
    assert found.values["restitution"] > found.start["restitution"]
    assert found.broken == ()
    hopeless = optimise_impacts(
        impacts, maximise="restitution", at_most={"swingweight": 0.02}, iterations=5
    )
    assert hopeless.broken == ("swingweight",)


@pytest.mark.slow
def test_a_design_of_ones_own():
    """Ten grams at the tip make the racket heavier by as much, and the ball faster there."""
    impacts = Impacts(with_tip_mass, {"tip": (1.0, 20.0)}, ["restitution", "mass", "swingweight"])
    low, high = impacts.values(np.array([0.0])), impacts.values(np.array([1.0]))
    assert high["mass"] - low["mass"] == pytest.approx(0.019, rel=1e-9)
    assert high["restitution"] > low["restitution"]
    assert impacts.gradient("mass", np.array([0.5]))[0] == pytest.approx(0.019, rel=1e-6)
    assert impacts.gradient("restitution", np.array([0.5]))[0] > 0.0


def test_numbers_of_the_case_alone_need_no_impact():
    twice = CaseNumber("twice", lambda case: 2.0 * case.racket.head.mass.value)
    impacts = Impacts(BASE, {"racket.head.mass": (0.14, 0.18)}, ["swingweight", twice])
    assert impacts.values(impacts.start)["twice"] == pytest.approx(0.321)
    assert impacts.gradient("twice", impacts.start) == pytest.approx([0.08])


@pytest.mark.parametrize(
    ("variables", "numbers", "more", "told"),
    [
        ({}, ["restitution"], {}, "no variable"),
        ({"racket.head.mas": (0.1, 0.2)}, ["restitution"], {}, "racket.head.mass"),
        ({"support": (0.1, 0.2)}, ["restitution"], {}, "keys that are numbers"),
        ({"speed": (30.0, 20.0)}, ["restitution"], {}, "least, largest"),
        ({"speed": (30.0, 40.0)}, ["restitution"], {}, "a start within 30 to 40"),
        ({"speed": (20.0, 40.0)}, ["restitutio"], {}, "restitution"),
        ({"speed": (20.0, 40.0)}, [], {}, "no number"),
        ({"speed": (20.0, 40.0)}, ["restitution"], {"weights": [1.0, 2.0]}, "1 numbers"),
        ({"speed": (20.0, 40.0)}, ["restitution"], {"weights": [0.0]}, "one of them above 0"),
    ],
)
def test_bad_problems_are_refused(variables, numbers, more, told):
    with pytest.raises(InputError, match=told):
        Impacts(BASE, variables, numbers, **more)


def test_bad_searches_are_refused():
    impacts = Impacts(BASE, {"speed": (20.0, 40.0)}, ["restitution"])
    with pytest.raises(InputError, match="one of maximise and minimise"):
        optimise_impacts(impacts)
    with pytest.raises(InputError, match="restitution"):
        impacts.at_most("peak_hand_force", 1.0)
    held = Impacts(BASE, {"speed": (20.0, 40.0)}, ["peak_hand_force"])
    with pytest.raises(InputError, match="numbers that each case has"):
        held.values(held.start)

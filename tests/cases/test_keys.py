"""Keys of a scenario: their kinds and units, numbers that a case has, values and factors."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from drake_racket import InputError, LimbSettings, Scenario, load_racket
from drake_racket.cases.case import resolve
from drake_racket.cases.keys import (
    NUMBER,
    SWITCH,
    TEXT,
    Key,
    find_key,
    number_of,
    scenario_keys,
    with_settings,
    with_values,
)
from tests.recorded import check_record

SPRING = "racket.string_bed.spring."
RACKET = load_racket()


def key(name: str, base: Scenario | None = None) -> Key:
    return find_key(name, base or Scenario(), "test")


def spring(name: str, base: Scenario | None = None) -> float:
    return number_of(base or Scenario(), key(SPRING + name))


def test_every_key_of_a_scenario_with_its_kind_and_unit():
    found = {name: [one.kind, one.unit] for name, one in scenario_keys().items()}
    check_record(found, Path(__file__).parent / "records" / "keys.json")


@pytest.mark.parametrize(
    ("name", "unit", "parameter"),
    [
        ("speed", "m/s", False),
        ("limb.initial_deg.elbow", "degrees", False),
        ("racket.head.mass", "kg", True),
        (f"{SPRING}4-5", "N/m", True),
    ],
)
def test_numbers_are_found(name, unit, parameter):
    assert key(name) == Key(name, NUMBER, unit, parameter)


@pytest.mark.parametrize("name", ["limb.initial_deg.", "racket.head.mas", "sped"])
def test_what_is_no_key(name):
    with pytest.raises(InputError, match="a key of the scenario or a parameter"):
        key(name)
    assert key("audit").kind == SWITCH
    assert key("racket").kind == TEXT


def test_numbers_that_a_case_has():
    base = Scenario(
        speed=31.0,
        gravity=(0.1, 0.2, -9.0),
        limb=LimbSettings(initial_deg={"elbow": 40.0}),
        overrides={"racket.head.mass": 0.17},
    )
    for name, value in {
        "speed": 31.0,
        "gravity.y": 0.2,
        "integrator.accuracy": base.integrator.accuracy,
        "limb.initial_deg.elbow": 40.0,
        "racket.head.mass": 0.17,
        "racket.handle.mass": RACKET.handle.mass.value,
    }.items():
        assert number_of(base, key(name)) == value


@pytest.mark.parametrize("name", ["limb.initial_deg.wrist", "audit", "racket"])
def test_what_holds_no_number_is_not_multiplied(name):
    with pytest.raises(InputError, match="a number in the base"):
        number_of(Scenario(), key(name))


def test_springs_of_their_own():
    """A spring's own k is its line's unless it is overridden; then the others stay as they are."""
    plain, own = spring("4-5"), 1.0e5
    base = Scenario(overrides={SPRING + "4-5": own, "racket.string_bed.initial_tension": 500.0})
    assert spring("4-5", base) == own
    assert spring("5-6", base) == spring("5-6")
    assert number_of(base, key("racket.string_bed.stiffness.k1")) == pytest.approx(
        RACKET.string_bed.stiffness.value[0]
    )
    assert number_of(base, key("racket.string_bed.initial_tension")) == 500.0
    doubled = with_values(
        Scenario(),
        {},
        {key(SPRING + "4-5"): 3.0, key(f"racket.string_bed.stiffness.{line()}"): 2.0},
    )
    assert doubled.overrides[SPRING + "4-5"] == pytest.approx(6.0 * plain)
    both = with_values(base, {}, {key(SPRING + "4-5"): 3.0, key(SPRING + "5-6"): 0.5})
    assert both.overrides[SPRING + "4-5"] == pytest.approx(3.0 * own)
    assert both.overrides[SPRING + "5-6"] == pytest.approx(0.5 * spring("5-6"))


def line() -> str:
    """The line's k that spring 4-5 has."""
    return RACKET.string_bed.springs.value["4-5"].split("*")[-1].strip()


def test_values_then_factors():
    base = Scenario(speed=20.0, overrides={"racket.head.mass": 0.17})
    found = with_values(
        base,
        {key("speed"): 30.0, key("gravity.z"): -3.0, key("integrator.accuracy"): 1e-6}
        | {key("limb.initial_deg.elbow"): 30.0, key("racket.handle.mass"): 0.2},
        {key("speed"): 1.5, key("racket.head.mass"): 2.0, key("racket.handle.mass"): 0.5},
    )
    assert found.speed == 45.0
    assert found.gravity == (*base.gravity[:2], -3.0)
    assert found.integrator == dataclasses.replace(base.integrator, accuracy=1e-6)
    assert found.limb.initial_deg == {"elbow": 30.0}
    assert found.overrides == pytest.approx({"racket.head.mass": 0.34, "racket.handle.mass": 0.1})
    assert base.speed == 20.0


def test_settings_of_every_kind():
    found = with_settings(
        Scenario(), ["speed = 56mph", "audit=false", "racket=recreational", "spin.y=3"]
    )
    assert found.speed == pytest.approx(25.03424)
    assert (found.audit, found.racket, found.spin) == (False, "recreational", (0.0, 3.0, 0.0))
    assert with_settings(Scenario(audit=False), ["audit=true"]).audit is True
    for bad, said in (
        (["speed"], "KEY=VALUE"),
        (["=3"], "KEY=VALUE"),
        (["audit=yes"], "true or false"),
        (["speed=3", "speed=4"], "each key once"),
    ):
        with pytest.raises(InputError, match=said):
            with_settings(Scenario(), bad)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"spin_rpm": 1.0}, "spin_rpm: got 1.0; allowed: 0 with contact paper"),
        ({"spin": (0.0, 0.0, 1.0)}, "0 with contact paper"),
        ({"contact": "surface", "time_step": 1e-5}, "time_step.*0 with contact surface"),
        ({"contact": "surface", "friction_reading": "displacement"}, "velocity with contact"),
        ({"contact": "surface", "reaction_point": "string_mass"}, "ball with contact surface"),
        ({"friction_reading": "element", "time_step": 1e-5}, "friction_reading element"),
        ({"engine": "compiled", "time_step": 1e-5}, "drake with a discrete plant"),
        ({"offset_x": 0.164, "point": "auto"}, "an aim within the rim"),
        ({"offset_y": -0.1231, "point": "auto"}, "an aim within the rim"),
        ({"point": "10"}, "1, 2, 3"),
        ({"support": "grip", "grip_kind": "hand"}, "hand has mass"),
        ({"overrides": {"grip.force_stiffness.x": 1.0}}, "no grip's numbers with support free"),
        ({"overrides": {"racket.head.mas": 1.0}}, "racket.head.mass"),
    ],
)
def test_cases_that_are_none(changes, said):
    with pytest.raises(InputError, match=said):
        resolve(Scenario(**changes))


GRIP = {"grip.force_stiffness.x": 1000.0}
PALM = {"grip.hand.mass": 0.3}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"support": "grip", "grip_kind": "weld", "overrides": GRIP}, "grip_kind weld"),
        ({"support": "grip", "grip_kind": "torsional", "overrides": GRIP}, "torques alone"),
        ({"support": "grip", "overrides": GRIP}, ""),
        (
            {"support": "grip", "grip_kind": "torsional"}
            | {"overrides": {"grip.torque_stiffness.x": 9.0}},
            "",
        ),
        ({"support": "grip", "grip": "hand_light", "overrides": PALM}, "grip_kind hand alone"),
        (
            {"support": "grip", "grip": "hand_light", "grip_kind": "hand", "overrides": PALM},
            "",
        ),
        (
            {"support": "limb", "grip": "hand_light", "grip_kind": "hand", "overrides": PALM},
            "a limb's own hand has mass",
        ),
        ({"offset_x": 0.1639, "point": "auto"}, ""),
        ({"contact": "surface", "spin_rpm": 500.0}, ""),
    ],
)
def test_numbers_of_grips_that_are_looked_at(changes, said):
    scenario = Scenario(**changes)
    if not said:
        assert resolve(scenario).scenario.support == scenario.support
        return
    with pytest.raises(InputError, match=said):
        resolve(scenario)

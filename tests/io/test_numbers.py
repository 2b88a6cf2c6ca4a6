"""Numbers from outside: NumPy's count as Python's, equal ones give equal cases."""

from __future__ import annotations

import copy
import dataclasses
import json
import math
import pickle
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_racket.cases.case import changed, check_scenario
from drake_racket.io.errors import InputError
from drake_racket.io.numbers import finite_number, number_between
from drake_racket.limbs.upper_limb_sdf import upper_limb_sdf
from drake_racket.parameters.ball import load_ball
from drake_racket.parameters.limb import load_upper_limb
from drake_racket.parameters.limb_settings import LimbSettings
from drake_racket.parameters.overrides import apply_overrides
from drake_racket.parameters.racket import check_racket, load_racket
from drake_racket.parameters.scenario import IntegratorSettings, Scenario
from drake_racket.parameters.stroke import Stroke, check_stroke
from drake_racket.plant.sdf import racket_sdf
from drake_racket.rigs.input_checks import check_positive
from drake_racket.sweep.identity import scenario_hash

WHOLE = (int, np.int8, np.uint8, np.int16, np.int32, np.uint32, np.int64, np.uint64)
BINARY = (float, np.float16, np.float32, np.float64, np.longdouble)

NOT_FINITE = [
    10**400,
    -(10**400),
    10**5000,  # more digits than Python writes
    Fraction(10**400, 3),
    math.nan,
    np.float32("inf"),
    np.longdouble("1e4000") * np.longdouble(2.0),
    True,
    np.True_,
    np.complex128(3.0),
    np.timedelta64(5, "ns"),  # Python's float() makes 5.0 of it
    np.array(5.0),
    "5",
    None,
    [5.0],
]


def kind(value: object) -> str:
    """A short name of a test case: some values are long."""
    return type(value).__name__


def refused(call: Callable[[], object], key: str, allowed: str) -> None:
    with pytest.raises(InputError) as caught:
        call()
    assert (caught.value.key, caught.value.allowed) == (key, allowed)
    assert "\n" not in str(caught.value)


# numbers of each kind, exact in all of them: quarters are so in 16 bits
numbers = st.one_of(
    st.builds(lambda scalar, n: scalar(n), st.sampled_from(WHOLE), st.integers(1, 60)),
    st.builds(lambda scalar, n: scalar(0.25 * n), st.sampled_from(BINARY), st.integers(4, 240)),
    st.builds(Fraction, st.integers(4, 240), st.just(4)),
)


@settings(deadline=None)
@given(numbers)
def test_every_kind_of_number_is_its_float(number: Any) -> None:
    for found in (finite_number("key", number), number_between("key", number, 1.0, 60.0)):
        assert type(found) is float
        assert found == number
    check_positive(key=number)


def test_a_limit_is_met_as_a_float() -> None:
    # NumPy compares a float32 with a float in 32 bits, where both are the same
    nearly = np.float32(0.1)
    assert float(nearly) > 0.1
    refused(lambda: number_between("key", nearly, 0.0, 0.1, "m"), "key", "0 to 0.1 m")
    assert number_between("key", np.float32(0.5), 0.0, 0.5) == 0.5


@pytest.mark.parametrize("value", NOT_FINITE, ids=kind)
def test_what_is_no_finite_number_is_refused(value: Any) -> None:
    refused(lambda: finite_number("key", value), "key", "a finite number")
    refused(lambda: check_positive(key=value), "key", "a finite number")
    refused(lambda: changed(Scenario(), speed=value), "scenario: speed", "a finite number")
    gravity = [0.0, value, 0.0]
    refused(lambda: changed(Scenario(), gravity=gravity), "scenario: gravity[1]", "a finite number")
    steps = IntegratorSettings(maximum_step=value)
    key = "scenario: integrator.maximum_step"
    refused(lambda: changed(Scenario(), integrator=steps), key, "a finite number")
    limb = LimbSettings(mass=value)
    refused(lambda: changed(Scenario(), limb=limb), "scenario: limb.mass", "a finite number")
    stroke = Stroke(guess_deg={"elbow": value})
    refused(lambda: check_stroke(stroke), "stroke: guess_deg.elbow", "a finite number")
    overrides = {"ball.mass": value}
    key, allowed = "overrides.ball.mass", "a finite number (kg)"
    refused(lambda: apply_overrides(load_ball(), overrides), key, allowed)


@pytest.mark.parametrize("value", [10**400, -(10**400), None, True, np.complex128(300.0)], ids=kind)
def test_a_tension_that_is_no_number_is_refused(value: Any) -> None:
    allowed = "low, high or a stringing tension in N between 150 and 450"
    refused(lambda: load_racket("tour", value), "tension", allowed)


def scenario_of(number: Any) -> Scenario:
    """A scenario with this number wherever it fits: in lists, dicts and dataclasses as well."""
    return Scenario(
        speed=number,
        gravity=[0, number, 0.0],
        overrides={"racket.string_bed.initial_tension": number},
        limb=LimbSettings(
            mass=number,
            place=[number, 0, 1],
            stroke=Stroke(
                position=[None, number / 16, None], speed=number, guess_deg={"elbow": number}
            ),
        ),
    )


def texts(scenario: Scenario) -> list[str]:
    """What is kept of a scenario."""
    tree = dataclasses.asdict(scenario)
    return [
        json.dumps(tree),
        yaml.safe_dump(tree),
        scenario_hash(scenario, {}),
    ]


@settings(max_examples=40, deadline=None)
@given(numbers)
def test_equal_numbers_give_equal_scenarios(number: Any) -> None:
    plain, scenario = scenario_of(float(number)), scenario_of(number)
    assert texts(scenario) == texts(plain)
    check_scenario(scenario)
    assert scenario == plain
    np.testing.assert_array_equal(scenario.ball_velocity(), plain.ball_velocity())


def test_a_scenario_cannot_be_changed() -> None:
    scenario = scenario_of(25.0)
    with pytest.raises(dataclasses.FrozenInstanceError):
        scenario.speed = 30.0  # type: ignore[misc]
    with pytest.raises(TypeError, match="frozen"):
        scenario.overrides["ball.mass"] = 0.06
    with pytest.raises(TypeError):
        scenario.gravity[1] = 1.0  # type: ignore[index]
    for again in (copy.deepcopy(scenario), pickle.loads(pickle.dumps(scenario))):
        assert again == scenario
        with pytest.raises(TypeError, match="frozen"):
            again.limb.stroke.guess_deg.clear()


def test_no_container_of_the_caller_is_changed() -> None:
    gravity, overrides = [0, 0, -9], {"ball.mass": np.float32(0.0625)}
    scenario = Scenario(gravity=gravity, overrides=overrides)
    check_scenario(scenario)
    assert [type(x) for x in gravity] == [int] * 3
    assert type(overrides["ball.mass"]) is np.float32


@pytest.mark.parametrize("scalar", [np.int64, np.float32, np.float64])
def test_a_subject_of_numpy_numbers_has_the_same_sdf(scalar: Callable[[float], Any]) -> None:
    found = load_upper_limb(mass=scalar(70), height=scalar(2))
    plain = load_upper_limb(mass=70.0, height=2.0)
    assert upper_limb_sdf(found, "limb") == upper_limb_sdf(plain, "limb")
    assert found == plain


@pytest.mark.parametrize("value", [0.0, -1, math.nan, 10**400, True, "70"], ids=kind)
def test_a_subject_of_no_size_is_refused(value: Any) -> None:
    for key in ("mass", "height"):
        allowed = "a finite number above 0"
        refused(lambda key=key: load_upper_limb(**{key: value}), f"load_upper_limb: {key}", allowed)


def test_quantities_of_numpy_numbers_give_the_same_racket() -> None:
    plain = load_racket()
    mass = dataclasses.replace(plain.head.mass, value=np.float64(plain.head.mass.value))
    values = [np.float64(x) for x in plain.friction.coefficients.value]
    coefficients = dataclasses.replace(plain.friction.coefficients, value=values)  # type: ignore[arg-type]
    other = dataclasses.replace(
        plain,
        head=dataclasses.replace(plain.head, mass=mass),
        friction=dataclasses.replace(plain.friction, coefficients=coefficients),
    )
    check_racket(other)
    assert other == plain
    assert racket_sdf(other) == racket_sdf(plain)
    assert yaml.safe_dump(dataclasses.asdict(other)) == yaml.safe_dump(dataclasses.asdict(plain))
    for value in (10**400, np.nan, True, "1"):
        mass = dataclasses.replace(other.head.mass, value=value)  # type: ignore[arg-type]
        with pytest.raises(InputError, match=r"head\.mass\.value"):
            check_racket(
                dataclasses.replace(other, head=dataclasses.replace(other.head, mass=mass))
            )

"""YAML is read by the core schema of YAML 1.2, and written so that it reads back equal."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_racket import InputError, Scenario
from drake_racket.cases.case import parse_scenario
from drake_racket.io.numbers import FrozenDict
from drake_racket.io.yaml_files import dump_text, parse_tree

SCALARS = {
    # what YAML 1.1 reads otherwise
    "025": 25,
    "08": 8,
    "0o17": 15,
    "0x19": 25,
    "0:25": "0:25",
    "1:30.5": "1:30.5",
    "2_5": "2_5",
    "0b101": "0b101",
    "1e-2": 0.01,
    "1E3": 1000.0,
    "+25": 25,
    ".5": 0.5,
    "25.": 25.0,
    "-.5e1": -5.0,
    "yes": "yes",
    "No": "No",
    "off": "off",
    "y": "y",
    "2024-01-01": "2024-01-01",
    "=": "=",
    # what both read alike
    "true": True,
    "False": False,
    "null": None,
    "~": None,
    "": None,
    "25": 25,
    "-2.5": -2.5,
    "'25'": "25",
    "tour#1": "tour#1",
    "1.2.3": "1.2.3",
    "e5": "e5",
    ".": ".",
    "+": "+",
}


@pytest.mark.parametrize("text", SCALARS)
def test_scalars_are_those_of_yaml_1_2(text: str) -> None:
    found, wanted = parse_tree(f"key: {text}\n", "file")["key"], SCALARS[text]
    assert found == wanted
    assert type(found) is type(wanted)


def test_not_a_number_and_infinity_are_floats() -> None:
    found = parse_tree("[.nan, .inf, -.INF, nan, inf]", "file")
    assert math.isnan(found[0])
    assert found[1:] == [math.inf, -math.inf, "nan", "inf"]


SPEEDS = {
    "25": 25.0,
    "+25": 25.0,
    "025": 25.0,
    "25.": 25.0,
    "2.5e1": 25.0,
    "0x19": 25.0,
    '"25"': 25.0,
    "!!float 25": 25.0,
}


@pytest.mark.parametrize("text", SPEEDS)
def test_a_speed_may_be_written_like_this(text: str) -> None:
    assert parse_scenario(f"speed: {text}\n").speed == SPEEDS[text]


@pytest.mark.parametrize(
    "text",
    ["25,5", "25 kg", "2_5", '"2_5"', "0:25", ".nan", "nan", ".inf", "null", "", "1e999", "[25]"],
)
def test_a_speed_may_not_be_written_like_this(text: str) -> None:
    with pytest.raises(InputError, match=r"scenario: speed: got .*; allowed: a finite number"):
        parse_scenario(f"speed: {text}\n")


@pytest.mark.parametrize("text", ["yes", "No", "off", '"false"', "0", "1.0"])
def test_a_switch_is_true_or_false(text: str) -> None:
    with pytest.raises(InputError, match=r"scenario: audit: got .*; allowed: true or false"):
        parse_scenario(f"audit: {text}\n")


def test_a_point_is_a_whole_number() -> None:
    assert parse_scenario("point: 8").point == "8"
    assert parse_scenario("point: 08").point == "8"
    with pytest.raises(InputError, match=r"point: got '5\.0'"):
        parse_scenario("point: 5.0")


texts = st.one_of(
    st.sampled_from(list(SCALARS)),
    st.text(st.characters(exclude_categories=("Cs", "Cc")), max_size=12),
)
trees = st.recursive(
    st.one_of(st.none(), st.booleans(), st.integers(), st.floats(allow_nan=False), texts),
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(texts, inner, max_size=4)),
    max_leaves=12,
)


@given(trees)
def test_what_is_written_reads_back_equal(tree: object) -> None:
    assert parse_tree(dump_text({"tree": tree}), "file") == {"tree": tree}


def test_frozen_mappings_are_written_as_mappings() -> None:
    scenario = Scenario(overrides={"ball.mass": 0.06})
    assert isinstance(scenario.overrides, FrozenDict)
    assert dump_text({"o": scenario.overrides}) == "o:\n  ball.mass: 0.06\n"

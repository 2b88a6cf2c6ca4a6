"""Bad input: generated parameter files, scenarios and command lines, each certain to be wrong.

Whatever is wrong, the answer is one InputError (a ValueError) whose message is one printable line
with the key or the file and what is allowed; on the command line, that line and exit status 2.
"""

from __future__ import annotations

import contextlib
import copy
import dataclasses
import io
import json
import math
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest import mock

import pytest
import typer
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drake_racket import cli, simulation
from drake_racket.cases.case import changed, load_scenario, parse_scenario
from drake_racket.io.errors import InputError
from drake_racket.io.shipped import data_directory
from drake_racket.io.yaml_files import MAX_BYTES, load_text
from drake_racket.parameters.ball import BallParameters, check_ball, load_ball
from drake_racket.parameters.quantities import STATUSES, Quantities, Quantity, sourced_fields
from drake_racket.parameters.racket import RacketParameters, check_racket, load_racket
from drake_racket.parameters.scenario import IntegratorSettings, Scenario


def cases(count: int) -> Callable[..., Any]:
    """Hypothesis without its clock and its database: the same `count` cases on every machine."""
    return settings(
        max_examples=count,
        deadline=None,
        derandomize=True,
        database=None,
        suppress_health_check=list(HealthCheck),
    )


def check_message(error: InputError, *fragments: str) -> None:
    message = str(error)
    assert isinstance(error, ValueError)
    assert message.isprintable(), message  # so it is a single line, too
    assert len(message) < 1500
    assert ": got " in message
    assert "; allowed: " in message
    assert not message.endswith("allowed: ")
    for fragment in fragments:
        assert fragment in message, (fragment, message)


def refused(call: Callable[[], object], *fragments: str) -> InputError:
    """Calls, and returns the InputError that must come; its message holds the fragments."""
    try:
        value = call()
    except InputError as error:
        check_message(error, *fragments)
        return error
    raise AssertionError(f"accepted, but {fragments} is wrong: {value!r}")


# --- parameter files ------------------------------------------------------------------------------

RACKET_TREES = [
    yaml.safe_load((data_directory() / f"{name}.yaml").read_text(encoding="utf-8"))
    for name in ("tour_low", "recreational_high")
]
BALL_TREE = yaml.safe_load(
    (data_directory() / "ball_penn_titanium.yaml").read_text(encoding="utf-8")
)
RACKET_LEAVES = dict(sourced_fields(load_racket()))
BALL_LEAVES = dict(sourced_fields(load_ball()))
ZERO_ALLOWED = {
    "throat_joint.damping_in",
    "throat_joint.damping_out",
    "landmarks.grip",
    "landmarks.accelerometer",
    "string_bed.damping",
    "friction.coefficients",
    "damping_low",
}
GROWTHS = {"stiffness_growth", "damping_growth"}  # negative ones are possible

words = st.from_regex(r"[a-z][a-z_]{0,11}", fullmatch=True)
texts = st.text(st.characters(exclude_categories=["Cc", "Cs"]), max_size=20)
not_numbers = st.one_of(words, texts, st.sampled_from(["1,5", "0.1 kg", "1e", "--1", "1 2", ""]))


def is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


wrong_for_a_number = st.one_of(
    not_numbers.filter(lambda text: not is_number(text)),
    st.booleans(),
    st.none(),
    st.lists(st.floats(0.1, 1.0), max_size=3),
    st.dictionaries(words, st.floats(0.1, 1.0), max_size=2),
    st.sampled_from([math.nan, math.inf, -math.inf, "nan", "-inf", "1e999", 10**400]),
)
wrong_for_a_text = st.one_of(
    st.booleans(),
    st.none(),
    st.lists(words, max_size=2),
    st.dictionaries(words, words, max_size=2),
    st.sampled_from(["\0", "bell\a", "\x1b[31mred", "\x85"]),
)
wrong_for_a_mapping = st.one_of(st.none(), st.booleans(), st.floats(0, 1), words, st.lists(words))


def at(tree: Any, path: str) -> Any:
    for key in path.split(".") if path else ():
        tree = tree[key]
    return tree


def mappings(tree: dict[str, Any], path: str = "") -> list[str]:
    """Dotted paths of all mappings in a tree, itself included."""
    found = [path]
    for key, value in tree.items():
        if isinstance(value, dict):
            found += mappings(value, f"{path}.{key}" if path else key)
    return found


# A mutation changes the tree in place and returns what the message must name.
Mutation = Callable[[Any, dict[str, Any], dict[str, Any]], str]


def numeric(leaves: dict[str, Any]) -> list[str]:
    return [key for key, value in leaves.items() if isinstance(value, (Quantity, Quantities))]


def unknown_key(draw, tree, leaves):
    path = draw(st.sampled_from(mappings(tree)))
    key = draw(words.filter(lambda word: word not in at(tree, path)))
    at(tree, path)[key] = draw(st.sampled_from([1.0, "k1", None, {}]))
    return key


def missing_key(draw, tree, leaves):
    path = draw(st.sampled_from(mappings(tree)))
    key = draw(st.sampled_from(sorted(at(tree, path))))
    del at(tree, path)[key]
    return f"{path}.{key}" if path else key


def wrong_unit(draw, tree, leaves):
    path = draw(st.sampled_from(numeric(leaves)))
    right = leaves[path].unit
    units = ["", "g", "mm", "lb", "N m", "kg/m^2", "rad", "2", right + " ", right * 2]
    wrong = st.one_of(st.sampled_from(units), texts, wrong_for_a_text)
    at(tree, path)["unit"] = draw(wrong.filter(lambda u: u != right))
    return f"{path}.unit"


def wrong_sign(draw, tree, leaves):
    path = draw(st.sampled_from(numeric(leaves)))
    if path in GROWTHS:
        number = draw(st.floats(-1e6, -1.0))
    elif path in ZERO_ALLOWED:
        number = draw(st.floats(-1e6, -1e-9))
    else:
        number = draw(st.floats(-1e6, 0.0))
    if isinstance(leaves[path], Quantities):
        numbers = at(tree, path)["value"]
        numbers[draw(st.integers(0, len(numbers) - 1))] = number
    else:
        at(tree, path)["value"] = number
    return f"{path}.value"


def not_a_number(draw, tree, leaves):
    path = draw(st.sampled_from(numeric(leaves)))
    wrong = draw(wrong_for_a_number)
    if isinstance(leaves[path], Quantities):
        numbers = at(tree, path)["value"]
        i = draw(st.integers(0, len(numbers) - 1))
        numbers[i] = wrong
        return f"{path}.value[{i}]"
    at(tree, path)["value"] = wrong
    return f"{path}.value"


def wrong_status(draw, tree, leaves):
    path = draw(st.sampled_from(sorted(leaves)))
    statuses = st.one_of(texts, st.sampled_from(["Printed", "guessed", "", "1"]), wrong_for_a_text)
    wrong = draw(statuses.filter(lambda s: s not in STATUSES))
    at(tree, path)["status"] = wrong
    return f"{path}.status"


def no_source(draw, tree, leaves):
    path = draw(st.sampled_from(sorted(leaves)))
    at(tree, path)["source"] = draw(st.one_of(st.text(" \t\n", max_size=4), wrong_for_a_text))
    return f"{path}.source"


def not_a_mapping(draw, tree, leaves):
    path = draw(st.sampled_from([p for p in mappings(tree) if p]))
    *parents, last = path.split(".")
    at(tree, ".".join(parents))[last] = draw(wrong_for_a_mapping)
    return path


def wrong_name(draw, tree, leaves):
    wrong = st.one_of(
        wrong_for_a_text,
        st.sampled_from(["", "my racket", "1st", "a.b", "a-b", "schläger", "3", "<b>"]),
    )
    tree["name"] = draw(wrong)
    return "name"


def wrong_title_or_notes(draw, tree, leaves):
    key = draw(st.sampled_from(["title", "notes"]))
    if key == "title":
        tree[key] = draw(wrong_for_a_text)
    else:
        tree[key] = draw(st.one_of(words, st.none(), st.lists(wrong_for_a_text, min_size=1)))
    return key


def unknown_spring(draw, tree, leaves):
    names = ["1-5", "2-1", "tip-4", "left-3", "tip1", "0", "9-10", "TIP-1", "throat-7 "]
    name = draw(st.sampled_from(names))
    tree["string_bed"]["springs"]["value"][name] = "k1"
    return f"string_bed.springs.value.{name}"


def unknown_spring_parameter(draw, tree, leaves):
    springs = tree["string_bed"]["springs"]["value"]
    name = draw(st.sampled_from(sorted(springs)))
    formulas = ["k5", "k0", "k", "p7*k1", "p0*k1", "p1", "k1*p1", "p1*p2", "k1+k2", "1.5*k1", "K1"]
    formula = st.one_of(st.sampled_from([*formulas, "", "k01", "T0", "k१", "-k1", 5]), texts)
    springs[name] = draw(formula.filter(lambda f: str(f).replace(" ", "") not in VALID_FORMULAS))
    return f"string_bed.springs.value.{name}"


VALID_FORMULAS = {f"k{k}" for k in range(1, 5)} | {
    f"p{p}*k{k}" for k in range(1, 5) for p in range(1, 7)
}


def unused_spring_parameter(draw, tree, leaves):
    bed = tree["string_bed"]
    springs = bed["springs"]["value"]
    letter, field = draw(st.sampled_from([("k", "stiffness"), ("p", "rim_factors")]))
    if draw(st.booleans()):
        bed[field]["value"].append(draw(st.floats(0.5, 2.0)))
    else:  # give the springs of one parameter another one
        count = len(bed[field]["value"])
        number, other = draw(st.lists(st.integers(1, count), min_size=2, max_size=2, unique=True))
        for name in springs:
            springs[name] = springs[name].replace(f"{letter}{number}", f"{letter}{other}")
    return f"string_bed.{field}.value"


def too_few_spring_parameters(draw, tree, leaves):
    field = draw(st.sampled_from(["stiffness", "rim_factors"]))
    numbers = tree["string_bed"][field]["value"]
    del numbers[draw(st.integers(0, len(numbers) - 1)) :]
    return "string_bed."


def wrong_friction(draw, tree, leaves):
    friction = tree["friction"]
    points = friction["points"]["value"]
    kind = draw(st.sampled_from(["point", "coefficient", "unused", "too few", "none"]))
    if kind == "point":
        point = draw(st.sampled_from(["0", "10", "-1", "01", "1.0", "centre", ""]))
        points[point] = "mu1"
        return f"friction.points.value.{point}"
    if kind == "coefficient":
        point = draw(st.sampled_from(sorted(points)))
        points[point] = draw(st.sampled_from(["mu4", "mu0", "mu", "MU1", "0.35", "mu01", "", 1]))
        return f"friction.points.value.{point}"
    if kind == "unused":
        friction["coefficients"]["value"].append(draw(st.floats(0.0, 1.0)))
        return "friction.coefficients.value"
    friction["coefficients"]["value"] = [0.3] if kind == "too few" else []
    return "friction."


def com_outside_its_part(draw, tree, leaves):
    part = draw(st.sampled_from(["handle", "head"]))
    length = tree[part]["length"]["value"]
    tree[part]["com"]["value"] = length * draw(st.floats(1.001, 1e3))
    return f"{part}.com.value"


def impossible_inertia(draw, tree, leaves):
    """One moment above the sum of the other two: no body has that."""
    part = draw(st.sampled_from(["handle", "head"]))
    keys = draw(st.permutations(["moi_longitudinal", "moi_frontal", "moi_transverse"]))
    large, *others = keys
    total = sum(tree[part][key]["value"] for key in others)
    tree[part][large]["value"] = total * draw(st.floats(1.0001, 1e6))
    return f"{part}.moi_"


def rim_too_small(draw, tree, leaves):
    bed = tree["string_bed"]
    axis = draw(st.sampled_from(["rim_semi_axis_x", "rim_semi_axis_y"]))
    if draw(st.booleans()):
        bed[axis]["value"] = bed["spacing"]["value"] * draw(st.floats(1e-3, 1.0))
    else:  # a circle through the corner points has the radius sqrt(2) spacings
        radius = bed["spacing"]["value"] * draw(st.sampled_from([0.1, 1.0, 1.4, 1.414]))
        bed["rim_semi_axis_x"]["value"] = bed["rim_semi_axis_y"]["value"] = radius
    return "string_bed.rim_semi_axis_x.value"


def landmark_beyond_the_handle(draw, tree, leaves):
    key = draw(st.sampled_from(["grip", "accelerometer"]))
    length = tree["handle"]["length"]["value"]
    tree["landmarks"][key]["value"] = length * draw(st.floats(1.0001, 1e3))
    return f"landmarks.{key}.value"


def wrong_reading(draw, tree, leaves):
    readings = st.one_of(texts, st.sampled_from(["", "by axis", "printed", "BY_AXIS"]))
    reading = draw(st.one_of(readings, wrong_for_a_text))
    tree["throat_joint"]["reading"]["value"] = reading
    return "throat_joint.reading.value"


def speeds_in_the_wrong_order(draw, tree, leaves):
    tree["speed_high"]["value"] = tree["speed_low"]["value"] * draw(st.floats(0.01, 1.0))
    return "speed_high.value"


COMMON: list[Mutation] = [
    unknown_key,
    missing_key,
    wrong_unit,
    wrong_sign,
    not_a_number,
    wrong_status,
    no_source,
    not_a_mapping,
    wrong_name,
    wrong_title_or_notes,
]
OF_RACKETS: list[Mutation] = [
    unknown_spring,
    unknown_spring_parameter,
    unused_spring_parameter,
    too_few_spring_parameters,
    wrong_friction,
    com_outside_its_part,
    impossible_inertia,
    rim_too_small,
    landmark_beyond_the_handle,
    wrong_reading,
]


@st.composite
def bad_rackets(draw, mutations=(*COMMON, *OF_RACKETS)):
    """(YAML text, what the message must name) of a racket file with one thing wrong."""
    tree = copy.deepcopy(draw(st.sampled_from(RACKET_TREES)))
    named = draw(st.sampled_from(mutations))(draw, tree, RACKET_LEAVES)
    return json.dumps(tree), named  # JSON is YAML, and quick to write


@st.composite
def bad_balls(draw):
    tree = copy.deepcopy(BALL_TREE)
    mutation = draw(st.sampled_from([*COMMON, speeds_in_the_wrong_order]))
    named = mutation(draw, tree, BALL_LEAVES)
    return json.dumps(tree), named


def read_racket_text(text: str) -> RacketParameters:
    racket = load_text(text, RacketParameters, where="a.yaml")
    check_racket(racket, "a.yaml")
    return racket


def read_ball_text(text: str) -> BallParameters:
    ball = load_text(text, BallParameters, where="a.yaml")
    check_ball(ball, "a.yaml")
    return ball


def test_the_files_that_the_mutations_start_from_are_good():
    for tree in RACKET_TREES:
        read_racket_text(json.dumps(tree))
    read_ball_text(json.dumps(BALL_TREE))


@cases(300)
@given(bad_rackets())
def test_bad_racket_files(case):
    text, named = case
    error = refused(lambda: read_racket_text(text), named.strip())
    assert "a.yaml" in str(error)


@pytest.mark.parametrize("mutation", [*COMMON, *OF_RACKETS], ids=lambda m: m.__name__)
def test_each_kind_of_bad_racket_file(mutation):
    # the test above draws the kinds at random: here every kind has its turn
    @cases(6)
    @given(bad_rackets((mutation,)))
    def run(case):
        text, named = case
        refused(lambda: read_racket_text(text), "a.yaml", named.strip())

    run()


@pytest.mark.parametrize("unit", ["kg ", " kg", "KG", "Kg", "g", "kg*m", "", "1"])
def test_a_unit_is_right_only_as_it_is_spelt(unit):
    text = GOOD_TEXT.replace("value: 0.13350, unit: kg,", f"value: 0.13350, unit: '{unit}',")
    refused(lambda: read_racket_text(text), f"handle.mass.unit: got {unit!r}; allowed: 'kg'")


@cases(120)
@given(bad_balls())
def test_bad_ball_files(case):
    text, named = case
    refused(lambda: read_ball_text(text), "a.yaml", named.strip())


GOOD_TEXT = (data_directory() / "tour_low.yaml").read_text(encoding="utf-8")
NOT_A_RACKET = {
    "empty": b"",
    "only a comment": b"# nothing\n",
    "null": b"~\n",
    "a number": b"3.14\n",
    "a list": b"- 1\n- 2\n",
    "an empty mapping": b"{}\n",
    "open bracket": b"handle: [1, 2\n",
    "tab": b"handle:\n\tmass: 1\n",
    "two documents": GOOD_TEXT.encode() + b"---\nname: again\n",
    "stray text": GOOD_TEXT.encode() + b"\nthis is not a key\n",
    "repeated key": GOOD_TEXT.encode() + b"\nname: again\n",
    "repeated inner key": GOOD_TEXT.replace("unit: kg,", "unit: kg, unit: kg,", 1).encode(),
    "repeated key, another way to write it": GOOD_TEXT.replace('{"1":', "{1: mu3, 0x1:").encode(),
    "merged key": GOOD_TEXT.replace('{"1": mu3,', '{<<: {"1": mu1}, "1": mu3,').encode(),
    "alias": GOOD_TEXT.replace("handle:", "handle: &a", 1)
    .replace("landmarks:", "more: *a")
    .encode(),
    "alias, where all else is good": GOOD_TEXT.replace("title: ", "title: &t ").encode()
    + b"  - *t\n",
    "recursive alias": b"name: &a [*a]\n",
    "unknown alias": b"name: *nobody\n",
    "many aliases": b"a: &a [1]\nb: &b [*a, *a]\nc: &c [*b, *b]\nd: [*c, *c]\n",
    "key that is a list": b"? [a, b]\n: 1\n",
    "key that is a mapping": b"? {a: b}\n: 1\n",
    "key that is a huge number": b"? 0x" + b"f" * 6000 + b"\n: 1\n",
    "value that is a huge number": GOOD_TEXT.replace("0.13350", "0x" + "f" * 6000).encode(),
    "a tag of Python": b"name: !!python/object/apply:os.getcwd []\n",
    "an unknown tag": b"name: !thing x\n",
    "an empty integer": b"name: !!int ''\n",
    "an empty float": b"name: !!float ''\n",
    "a bad boolean": b"name: !!bool maybe\n",
    "a bad date": b"name: !!timestamp now\n",
    "no such day": b"name: 2001-99-99\n",
    "bad base64": b"name: !!binary ///\n",
    "another YAML": b"%YAML 3.0\n---\nname: x\n",
    "nested deeply": b"name: " + b"[" * 400,
    "nested deeply, closed": b"name: " + b"{a: " * 400 + b"}" * 400,
    "NUL": b"name: a\0b\n",
    "Latin-1": GOOD_TEXT.replace("title: ", "title: é ").encode("latin-1"),
    "UTF-16": GOOD_TEXT.encode("utf-16"),
    "zip": b"PK\x03\x04\x14\x00\x00\x00\x08\x00",
    "huge": b"# " + b"x" * MAX_BYTES + b"\n",
    "huge, one line": b"[" + b"0," * MAX_BYTES + b"0]",
    "XML": (data_directory().parent / "racket.py").read_bytes(),
}


@pytest.mark.parametrize("content", NOT_A_RACKET.values(), ids=NOT_A_RACKET.keys())
def test_files_that_are_no_parameter_file(tmp_path, content):
    path = tmp_path / "mine.yaml"
    path.write_bytes(content)
    for read in (load_racket, load_ball):
        refused(lambda read=read: read(str(path)), "mine.yaml")
    if content != b"{}\n":  # a scenario may leave everything out
        refused(lambda: load_scenario(path), "mine.yaml")


@cases(150)
@given(
    st.one_of(
        st.binary(max_size=300), st.text(max_size=200).map(lambda t: t.encode("utf-8", "replace"))
    )
)
def test_garbage(content):
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "garbage.yaml"
        path.write_bytes(content)
        refused(lambda: load_racket(str(path)), "garbage.yaml")


@cases(100)
@given(st.integers(0, len(GOOD_TEXT) - 1), st.sampled_from(list("\0\t{}[]:,&*!|>'\"%@`\x80\ud800")))
def test_a_damaged_character_never_raises_anything_else(place, character):
    # a change inside a source or comment may leave a good file: then it loads
    text = GOOD_TEXT[:place] + character + GOOD_TEXT[place + 1 :]
    try:
        read_racket_text(text)
    except InputError as error:
        check_message(error, "a.yaml")


def test_files_that_cannot_be_read(tmp_path):
    directory = tmp_path / "directory.yaml"
    directory.mkdir()
    loop = tmp_path / "loop.yaml"
    loop.symlink_to(loop)
    for path in (
        directory,
        loop,
        tmp_path / "none.yaml",
        tmp_path / "none" / "none.yaml",
        tmp_path / ("long" * 100 + ".yaml"),
    ):
        # what is wrong with the file is in brackets; a long name is cut
        refused(lambda path=path: load_racket(str(path)), "file: got ", "a readable YAML file (")
        refused(lambda path=path: load_scenario(path), "file: got ", "a readable YAML file (")
    refused(lambda: load_racket("nul\0.yaml"), "file: got ", "not a file's name")
    refused(lambda: load_racket("line\nbreak.yaml"), "file: got ")


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="no /dev/zero here")
def test_a_file_without_end_is_not_read_to_its_end():
    refused(lambda: load_scenario(Path("/dev/zero")), "/dev/zero", f"at most {MAX_BYTES} bytes")


# --- scenarios ------------------------------------------------------------------------------------

# key: (least, most), written once more here
RANGES = {
    "offset_x": (-0.2, 0.2),
    "offset_y": (-0.2, 0.2),
    "speed": (0.1, 100.0),
    "incidence_deg": (0.0, 80.0),
    "azimuth_deg": (-360.0, 360.0),
    "approach_time": (0.0, 0.1),
    "after": (1e-4, 2.0),
    "time_step": (0.0, 1e-3),
}
INTEGRATOR_RANGES = {"accuracy": (1e-12, 0.1), "maximum_step": (1e-7, 2e-4)}
CHOICES = {
    "joint_reading": ["by_axis", "as_printed"],
    "friction_reading": ["velocity", "displacement"],
    "reaction_point": ["ball", "string_mass"],
    "support": ["free", "clamped_head", "clamped_handle"],
    "point": [*"123456789", "auto"],
    "racket": ["tour", "recreational"],
    "tension": ["low", "high", "150", "300.5", "450"],
    "ball": ["penn_titanium"],
}
SCHEMES = ["runge_kutta2", "runge_kutta3", "runge_kutta5"]
SCENARIO_KEYS = {f.name for f in dataclasses.fields(Scenario)}
INTEGRATOR_KEYS = {f.name for f in dataclasses.fields(IntegratorSettings)}


def within(least: float, most: float) -> st.SearchStrategy[float]:
    return st.floats(least, most)


def outside(least: float, most: float) -> st.SearchStrategy[float]:
    return st.one_of(
        st.floats(max_value=least, exclude_max=True, allow_infinity=False),
        st.floats(min_value=most, exclude_min=True, allow_infinity=False),
    )


small_offsets = st.floats(-0.01, 0.01)  # from any of the nine points, still within the rim
valid_values: dict[str, st.SearchStrategy[Any]] = {
    **{key: within(*limits) for key, limits in RANGES.items()},
    **{key: st.sampled_from(values) for key, values in CHOICES.items()},
    "offset_x": small_offsets,
    "offset_y": small_offsets,
    "joint_reading": st.sampled_from(["", "by_axis", "as_printed"]),
    "time_step": st.one_of(st.just(0.0), st.floats(1e-7, 1e-3)),
    "gravity": st.lists(st.floats(-100.0, 100.0), min_size=3, max_size=3),
    "audit": st.booleans(),
    "integrator": st.fixed_dictionaries(
        {},
        optional={
            "scheme": st.sampled_from(SCHEMES),
            "error_control": st.booleans(),
            **{key: within(*limits) for key, limits in INTEGRATOR_RANGES.items()},
        },
    ).filter(
        # runge_kutta2 has no error estimate
        lambda i: i.get("scheme") != "runge_kutta2" or not i.get("error_control", True)
    ),
}
valid_scenarios = st.fixed_dictionaries({}, optional=valid_values)


def bad_unknown_key(draw, tree):
    key = draw(words.filter(lambda word: word not in SCENARIO_KEYS))
    tree[key] = 1.0
    return key


def bad_range(draw, tree):
    key = draw(st.sampled_from(sorted(RANGES)))
    tree[key] = draw(outside(*RANGES[key]))
    return key


def bad_number(draw, tree):
    key = draw(st.sampled_from(sorted(RANGES)))
    tree[key] = draw(wrong_for_a_number)
    return key


def bad_choice(draw, tree):
    key = draw(st.sampled_from(sorted(CHOICES)))
    right = {*CHOICES[key], ""} if key == "joint_reading" else {*CHOICES[key]}
    wrong = st.one_of(wrong_for_a_text, texts, words, st.sampled_from(["0", "10", "5.0", "Tour"]))
    if key == "tension":  # a number is right there
        wrong = wrong.filter(lambda t: not (isinstance(t, str) and is_number(t)))
    tree[key] = draw(wrong.filter(lambda t: not (isinstance(t, str) and t in right)))
    return key


def bad_tension(draw, tree):
    tree["tension"] = draw(outside(150.0, 450.0))
    return "tension"


def bad_gravity(draw, tree):
    numbers = st.lists(st.floats(-10.0, 10.0), max_size=6)
    kind = draw(st.sampled_from(["length", "number", "range", "type"]))
    if kind == "length":
        tree["gravity"] = draw(numbers.filter(lambda g: len(g) != 3))
    elif kind == "type":
        tree["gravity"] = draw(st.one_of(st.none(), words, st.floats(-10, 10), st.booleans()))
    else:
        wrong = wrong_for_a_number if kind == "number" else outside(-100.0, 100.0)
        gravity = [0.0, 0.0, -9.81]
        gravity[draw(st.integers(0, 2))] = draw(wrong)
        tree["gravity"] = gravity
    return "gravity"


def bad_audit(draw, tree):
    tree["audit"] = draw(st.one_of(st.none(), st.floats(0, 1), st.sampled_from(["", "true"])))
    return "audit"


def bad_integrator(draw, tree):
    kinds = ["key", "scheme", "range", "number", "control", "type"]
    kind = draw(st.sampled_from(kinds))
    if kind == "type":
        tree["integrator"] = draw(wrong_for_a_mapping)
        return "integrator"
    tree["integrator"] = settings_ = {}
    if kind == "key":
        key = draw(words.filter(lambda word: word not in INTEGRATOR_KEYS))
        settings_[key] = 1.0
    elif kind == "scheme":
        key = "scheme"
        wrong = st.one_of(texts, wrong_for_a_text, st.sampled_from(["euler", "runge_kutta4"]))
        settings_[key] = draw(wrong)
    elif kind == "control":
        key = "error_control"
        settings_[key] = draw(st.sampled_from(["", 1, 0.5, None, []]))
    else:
        key = draw(st.sampled_from(sorted(INTEGRATOR_RANGES)))
        wrong = wrong_for_a_number if kind == "number" else outside(*INTEGRATOR_RANGES[key])
        settings_[key] = draw(wrong)
    return f"integrator.{key}"


RIMS = {"tour": (0.164, 0.123), "recreational": (0.175, 0.132)}


def bad_aim(draw, tree):
    """On the rim or beyond it, but each offset within its range."""
    racket = tree.get("racket", "tour")
    a, b = RIMS[racket]
    angle = draw(st.floats(0.0, 2.0 * math.pi))
    size = draw(st.floats(1.0001, 1.1))
    x, y = a * size * math.cos(angle), b * size * math.sin(angle)
    number = draw(st.integers(0, 9))
    row, column = divmod(number - 1, 3) if number else (1, 1)  # 0: auto, aimed from the centre
    x -= (1 - row) * 0.0685
    y -= (1 - column) * 0.0685
    if max(abs(x), abs(y)) > 0.2:  # the range would be named instead: aim from the centre
        x, y, number = x + (1 - row) * 0.0685, y + (1 - column) * 0.0685, 5
    tree.update(point=str(number) if number else "auto", offset_x=x, offset_y=y)
    return "offset_x, offset_y"


def bad_time_step(draw, tree):
    tree["time_step"] = draw(st.floats(0.0, 1e-7, exclude_min=True, exclude_max=True))
    return "time_step"


BAD_SCENARIOS = [
    bad_unknown_key,
    bad_range,
    bad_number,
    bad_choice,
    bad_tension,
    bad_gravity,
    bad_audit,
    bad_integrator,
    bad_aim,
    bad_time_step,
]


@st.composite
def bad_scenarios(draw):
    """(YAML text, what the message must name) of an otherwise valid scenario."""
    tree = draw(valid_scenarios)
    named = draw(st.sampled_from(BAD_SCENARIOS))(draw, tree)
    return json.dumps(tree), named


@cases(600)
@given(bad_scenarios())
def test_bad_scenarios(case):
    text, named = case
    refused(lambda: parse_scenario(text), named)


@cases(30)
@given(bad_scenarios())
def test_bad_scenario_files(case):
    text, named = case
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "case.yaml"
        path.write_text(text, encoding="utf-8")
        error = refused(lambda: load_scenario(path), named)
        # a racket, ball or tension is named by itself: the rest with its file
        assert "case.yaml" in str(error) or error.key in ("racket", "ball", "tension", "file")


@cases(100)
@given(valid_scenarios)
def test_good_scenarios_load_and_come_back(tree):
    scenario = parse_scenario(json.dumps(tree))
    for key, value in tree.items():
        found = getattr(scenario, key)
        if key == "integrator":
            assert found == IntegratorSettings(**value)
        else:
            assert found == (tuple(value) if isinstance(value, list) else value), key
    again = parse_scenario(yaml.safe_dump(dataclasses.asdict(scenario)))
    assert again == scenario


def test_defaults_are_a_good_scenario():
    assert parse_scenario("{}") == Scenario()
    assert parse_scenario(yaml.safe_dump(dataclasses.asdict(Scenario()))) == Scenario()


def test_numbers_for_point_and_tension():
    scenario = parse_scenario("{point: 7, tension: 300}")
    assert (scenario.point, scenario.tension) == ("7", "300")
    assert Scenario(point=7, tension=300) == scenario
    assert changed(Scenario(), point=7, tension=300) == scenario


def test_changed_checks():
    refused(lambda: changed(Scenario(), spede=3.0), "spede", "an unknown key")
    refused(lambda: changed(Scenario(), speed=3000.0), "speed", "0.1 to 100 m/s")
    refused(lambda: changed(Scenario(), speed=math.nan), "speed", "finite")
    refused(lambda: changed(Scenario(), speed="25"), "speed")
    refused(lambda: changed(Scenario(), speed=True), "speed")


def test_a_scenario_names_the_parameter_file_that_is_wrong(tmp_path):
    text = GOOD_TEXT.replace("value: 0.13350", "value: -0.13350")
    (tmp_path / "mine.yaml").write_text(text, encoding="utf-8")
    refused(
        lambda: parse_scenario(f"racket: {tmp_path / 'mine.yaml'}"),
        "mine.yaml: handle.mass.value: got -0.1335; allowed: more than 0",
    )


# --- the command line -----------------------------------------------------------------------------


@dataclasses.dataclass
class Outcome:
    status: object
    out: str
    err: str


def run_main(*arguments: str, simulate: Callable[..., Any] | None = None) -> Outcome:
    """cli.main in this process. A simulation would be a failure, unless one is given."""
    simulate = simulate or mock.Mock(side_effect=AssertionError("a simulation was started"))
    out, err = io.StringIO(), io.StringIO()
    status: object = 0
    with (
        mock.patch.object(sys, "argv", ["drake-racket", *arguments]),
        mock.patch.object(simulation, "simulate", simulate),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        try:
            cli.main()
        except SystemExit as stop:
            status = stop.code
    return Outcome(status, out.getvalue(), err.getvalue())


def check_refusal(outcome: Outcome, *fragments: str) -> None:
    assert outcome.status == 2, outcome
    assert outcome.out == ""
    assert outcome.err.startswith("drake-racket: ")
    assert outcome.err.endswith("\n")
    line = outcome.err[:-1]
    assert line.isprintable(), line
    assert "Traceback" not in line
    for fragment in fragments:
        assert fragment in line, (fragment, line)


OPTIONS = {
    "--speed": ["speed", "-5", "0", "1e9", "nan", "inf", "-inf"],
    "--incidence": ["incidence_deg", "-1", "80.5", "90", "nan"],
    "--azimuth": ["azimuth_deg", "361", "-1e9", "nan"],
    "--after": ["after", "0", "-1", "3", "1e-9", "nan"],
    "--point": ["point", "0", "10", "centre", "", "5.0", "Auto"],
    "--support": ["support", "hand", "", "Free"],
    "--racket": ["racket", "wooden", "", "tour.sdf", "../tour"],
    "--tension": ["tension", "tight", "0", "1000", "nan", "", "254N", "250,5"],
}
TYPING_ERRORS = [
    ["--speed", "abc"],
    ["--speed", ""],
    ["--speed", "25 kg"],
    ["--incidence", "1,5"],
    ["--after", "--json"],
    ["--speed"],
    ["--spede", "25"],
    ["--js"],
    ["-s", "25"],
    ["one.yaml", "two.yaml"],
    ["--json=yes"],
    ["--nope\nbroken", "x"],
    ["--nope\x1b[31m"],
]


@st.composite
def bad_commands(draw):
    """Arguments of `impact` with one bad option among good ones."""
    good = draw(
        st.lists(
            st.sampled_from(
                [
                    ["--json"],
                    ["--incidence", "10"],
                    ["--azimuth", "-90"],
                    ["--after", "0.01"],
                    ["--racket", "recreational"],
                ]
            ),
            unique_by=lambda option: option[0],
        )
    )
    if draw(st.integers(0, 3)) == 0:
        bad = draw(st.sampled_from(TYPING_ERRORS))
        good = [o for o in good if o[0] != bad[0]]  # of an option given twice, the last counts
        options = [*good, bad] if bad[-1] == "--speed" else draw(st.permutations([*good, bad]))
        return [word for option in options for word in option], ""
    option = draw(st.sampled_from(sorted(OPTIONS)))
    key, *wrong = OPTIONS[option]
    bad = [option, draw(st.sampled_from(wrong))]
    rest = [o for o in good if o[0] != option]
    options = draw(st.permutations([*rest, bad]))
    return [word for option in options for word in option], key


@cases(120)
@given(bad_commands())
def test_bad_command_lines(case):
    arguments, named = case
    with tempfile.TemporaryDirectory() as directory:
        out = Path(directory) / "results"
        check_refusal(run_main("impact", "--out", str(out), *arguments), named)
        assert not out.exists()


@cases(40)
@given(bad_scenarios())
def test_bad_scenario_files_on_the_command_line(case):
    text, named = case
    with tempfile.TemporaryDirectory() as directory:
        path, out = Path(directory) / "case.yaml", Path(directory) / "results"
        path.write_text(text, encoding="utf-8")
        check_refusal(run_main("impact", str(path), "--out", str(out), "--json"), named)
        assert not out.exists()


@cases(25)
@given(bad_rackets())
def test_bad_racket_files_on_the_command_line(case):
    text, named = case
    with tempfile.TemporaryDirectory() as directory:
        path, out = Path(directory) / "mine.yaml", Path(directory) / "results"
        path.write_text(text, encoding="utf-8")
        check_refusal(run_main("show", str(path)), named.strip())
        check_refusal(run_main("impact", "--racket", str(path), "--out", str(out)), named.strip())
        assert not out.exists()


@pytest.mark.parametrize("arguments", TYPING_ERRORS, ids=" ".join)
def test_typing_errors_are_one_line_too(arguments):
    outcome = run_main("impact", *arguments)
    check_refusal(outcome, "drake-racket --help")


@pytest.mark.parametrize(
    ("arguments", "fragment"),
    [
        (["frobnicate"], "frobnicate"),
        (["--versions"], "--versions"),
        (["show"], "racket"),
        (["show", "wooden"], "racket: got 'wooden'"),
        (["show", "tour", "--tension", "9"], "tension: got '9'"),
        (["show", "tour", "--joint-reading", "both"], "joint_reading: got 'both'"),
        (["show", "no.yaml", "--tension", "high"], "tension: got 'high'"),
        (["impact", "no.yaml"], "file: got 'no.yaml'"),
        (["impact", "--racket", "no.yaml"], "file: got 'no.yaml'"),
    ],
)
def test_other_commands(arguments, fragment):
    check_refusal(run_main(*arguments), fragment)


@pytest.mark.parametrize("arguments", [[], ["--help"], ["impact", "--help"], ["show", "--help"]])
def test_help(arguments):
    outcome = run_main(*arguments)
    assert outcome.status == 0
    assert outcome.err == ""
    assert "Usage" in outcome.out


@pytest.mark.parametrize("interruption", [KeyboardInterrupt, typer.Abort])
def test_ctrl_c_ends_with_130(interruption):
    outcome = run_main("impact", simulate=mock.Mock(side_effect=interruption))
    assert outcome.status == 130
    assert "Traceback" not in outcome.err


def test_an_unfinished_simulation_ends_with_1():
    stopped = mock.Mock(side_effect=cli.SimulationError("stopped at t = 1 s:\nno reason"))
    outcome = run_main("impact", simulate=stopped)
    assert (outcome.status, outcome.out) == (1, "")
    assert outcome.err == "drake-racket: stopped at t = 1 s: no reason\n"


@pytest.mark.parametrize(
    ("arguments", "fragment"),
    [
        (["--speed", "-1"], "scenario: speed: got -1.0; allowed: 0.1 to 100 m/s"),
        (["--speed", "abc"], "--speed"),
        (["garbage.yaml"], "garbage.yaml"),
        (["--racket", "garbage.yaml", "--json"], "garbage.yaml"),
    ],
    ids=["range", "usage", "scenario", "racket"],
)
def test_as_its_own_process(tmp_path, arguments, fragment):
    (tmp_path / "garbage.yaml").write_bytes(b"\x00\xff\xfe: [\n")
    command = [sys.executable, "-m", "drake_racket.cli", "impact", "--out", "out", *arguments]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120)
    check_refusal(Outcome(done.returncode, done.stdout, done.stderr), fragment)
    assert not (tmp_path / "out").exists()

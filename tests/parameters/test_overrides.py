"""Single numbers of racket, ball and grip set by a scenario, through the Context of one Diagram.

The other side of each comparison is a parameter file that a user wrote with the number in it, and a
Diagram that was built from that file.
"""

from __future__ import annotations

import dataclasses
import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import example, given, settings
from hypothesis import strategies as st

from drake_racket import InputError, Scenario, load_ball, load_racket, make_impact_diagram, simulate
from drake_racket.cases.case import changed, parse_scenario, resolve
from drake_racket.io.shipped import data_directory
from drake_racket.parameters.grip import load_grip
from drake_racket.parameters.overrides import apply_overrides, parameter_keys
from drake_racket.parameters.quantities import sourced_fields
from drake_racket.plant.properties import SWINGWEIGHT_AXIS, racket_properties
from drake_racket.plant.string_bed import string_bed_model
from drake_racket.plant.systems.string_bed import spring_constants
from drake_racket.results.outputs import REBOUND_SPEED
from drake_racket.sweep import make_sweep, run_grid
from tests.conftest import BED, clamped_problem
from tests.oracles.clamped_impact import simulate as oracle

# off the axes and oblique: every number of the racket counts
BASE = Scenario(
    point=4, incidence_deg=30, azimuth_deg=60, speed=28, approach_time=1e-4, after=0.0045
)
HELD = dataclasses.replace(BASE, support="grip")
FILES = {"racket": "tour_low", "ball": "ball_penn_titanium", "grip": "grip_normal"}
KEYS = parameter_keys(load_racket(), load_ball(), load_grip())
TOPOLOGY = {
    "racket.handle.length": 0.35,
    "racket.head.length": 0.34,
    "racket.landmarks.grip": 0.09,
    "racket.landmarks.accelerometer": 0.17,
    "racket.string_bed.gsc": 0.16,
    "racket.string_bed.spacing": 0.07,
    "racket.string_bed.rim_semi_axis_x": 0.17,
    "racket.string_bed.rim_semi_axis_y": 0.13,
    "ball.radius": 0.033,
}
"""What a Context cannot change, and another value for each."""


def other(key: str) -> float:
    """Another value for `key` that is valid by itself."""
    if key in TOPOLOGY:
        return TOPOLOGY[key]
    value = KEYS[key].value
    if ".moi_" in key:  # no moment may exceed the others' sum
        return (0.99 if key.endswith("frontal") else 1.01) * value
    share = 0.01 * (1 + list(KEYS).index(key) % 7)
    return (1.0 + share) * value if value else 0.4


EVERY = {
    key: other(key)
    for key in KEYS
    if key not in TOPOLOGY
    and ".spring." not in key
    and not key.startswith(("ball.surface.", "ball.hunt_crossley."))
    and not key.startswith("racket.frame.")  # tests/parameters/test_frame.py
    and not key.endswith(("_plane_stiffness", "_plane_damping"))
}
"""All numbers of the files that a Context takes, each changed by its own share."""
ON_SURFACE = {
    key: other(key)
    for key in KEYS
    if key.startswith(("ball.", "racket.friction."))
    and key not in TOPOLOGY
    and not key.startswith(("ball.sliding_", "ball.hunt_crossley."))
}
"""Of contact surface, likewise: what the ball and the friction have."""


def file_with(directory: Path, values: dict[str, float], kind: str) -> str:
    """A shipped parameter file with some numbers replaced as a user would; its path."""
    tree: Any = yaml.safe_load((data_directory() / f"{FILES[kind]}.yaml").read_text())
    for key, value in values.items():
        first, *parents, last = key.split(".")
        if first != kind:
            continue
        if last[-1].isdigit() or last in ("x", "y", "z"):
            place = "xyz".index(last) if last in "xyz" else int(last.strip("kpmu")) - 1
            parents, last = parents[:-1], parents[-1]
        else:
            place = None
        item = tree
        for name in (*parents, last):
            item = item[name]
        if place is None:
            item["value"] = value
        else:
            item["value"][place] = value
    path = directory / f"{kind}.yaml"
    path.write_text(yaml.safe_dump(tree), encoding="utf-8")
    return str(path)


def from_files(directory: Path, base: Scenario, values: dict[str, float]) -> Scenario:
    named = {kind: file_with(directory, values, kind) for kind in FILES}
    return changed(base, **named)


def parameters_of(scenario: Scenario) -> tuple[Any, ...]:
    return scenario.load_racket(), scenario.load_ball(), scenario.load_grip()


def numbers(context: Any) -> list[list[float]]:
    """All that a Context holds; a NaN (the world's inertia, times not latched) as a number."""
    parameters, discrete = context.get_parameters(), context.get_discrete_state()
    groups = [
        *map(parameters.get_numeric_parameter, range(parameters.num_numeric_parameter_groups())),
        *map(discrete.get_vector, range(discrete.num_groups())),
        context.get_continuous_state_vector(),
    ]
    return [np.nan_to_num(group.CopyToVector(), nan=-1e99).tolist() for group in groups]


def outcome(result: Any) -> dict[str, Any]:
    """The numbers of a result, history included."""
    data = result.to_json()
    del data["scenario"]
    if result.history is not None:
        data |= {str(k): v.to_numpy().tolist() for k, v in result.history.data_vars.items()}
    return data


@pytest.fixture(scope="module")
def free():
    return make_impact_diagram(BASE)


@pytest.fixture(scope="module")
def held():
    return make_impact_diagram(HELD)


# --- the shared Diagram ---------------------------------------------------------------------------


def test_a_shared_context_holds_what_a_diagram_from_the_files_holds(tmp_path, held):
    """The same parameters and state, to the last bit; the inertias are those of the SDF."""
    here, there = changed(HELD, overrides=EVERY), from_files(tmp_path, HELD, EVERY)
    fresh = make_impact_diagram(there)
    context = held.create_context(here)
    assert numbers(context) == numbers(fresh.create_context())
    plant = held.plant.GetMyContextFromRoot(context)
    bodies = [*held.impact.racket.bodies(), held.impact.ball.body]
    parsed = [*fresh.impact.racket.bodies(), fresh.impact.ball.body]
    for body, same in zip(bodies, parsed, strict=True):
        inertia = body.CalcSpatialInertiaInBodyFrame(plant).CopyToFullMatrix6()
        sdf = same.default_spatial_inertia().CopyToFullMatrix6()
        assert np.array_equal(inertia, sdf), body.name()


def test_each_key_reaches_the_shared_context_or_takes_another_diagram(held):
    nominal = numbers(held.create_context())
    built = resolve(HELD).topology
    for key in (*EVERY, *TOPOLOGY):
        here = changed(HELD, overrides={key: other(key)})
        shared = resolve(here).topology == built
        assert shared == (key in EVERY), key
        if shared:
            assert numbers(held.create_context(here)) != nominal, key
    assert numbers(held.create_context()) == nominal  # nothing is left behind


def test_each_key_of_contact_surface_reaches_the_shared_context():
    base = dataclasses.replace(BASE, contact="surface")
    system = make_impact_diagram(base)
    nominal = numbers(system.create_context())
    assert len(ON_SURFACE) == 14
    for key, value in ON_SURFACE.items():
        here = changed(base, overrides={key: value})
        assert numbers(system.create_context(here)) != nominal, key
    assert numbers(system.create_context()) == nominal


@pytest.mark.parametrize("name", ["stiffness", "stiffness_rise", "damping", "damping_rise"])
def test_each_key_of_a_ball_that_stiffens_reaches_the_shared_context(name):
    base = dataclasses.replace(BASE, normal="hunt_crossley")
    key = f"ball.hunt_crossley.{name}"
    system = make_impact_diagram(base)
    here = changed(base, overrides={key: 1.05 * KEYS[key].value})
    assert numbers(system.create_context(here)) != numbers(system.create_context())


@pytest.mark.parametrize(
    ("changes", "key", "law"),
    [
        ({"contact": "paper"}, "ball.surface.flattening", "contact paper"),
        ({"contact": "surface"}, "ball.sliding_speed_scale", "contact surface"),
        ({"friction_reading": "element"}, "ball.surface.flattening", "friction_reading element"),
        ({"friction_reading": "element"}, "ball.sliding_speed_scale", "friction_reading element"),
        ({"normal": "linear"}, "ball.hunt_crossley.damping", "normal linear"),
        ({"normal": "hunt_crossley"}, "ball.damping_growth", "normal hunt_crossley"),
    ],
)
def test_a_number_of_another_law_is_refused(changes, key, law):
    with pytest.raises(InputError, match=f"{key}.*no such number with {law}"):
        resolve(Scenario(**changes, overrides={key: KEYS[key].value}))


CASES = {
    "masses": {"racket.handle.mass": 0.15, "racket.head.mass": 0.15, "ball.mass": 0.057},
    "everything": EVERY,
}


@pytest.mark.parametrize(
    ("base", "case"), [(BASE, "masses"), (BASE, "everything"), (HELD, "everything")]
)
def test_an_impact_is_that_of_the_file(tmp_path, request, base, case):
    system = request.getfixturevalue("free" if base is BASE else "held")
    values = {k: v for k, v in CASES[case].items() if base is HELD or not k.startswith("grip.")}
    here, there = changed(base, overrides=values), from_files(tmp_path, base, values)
    history = base is BASE and case == "everything"
    found, expected = simulate(here, system, history=history), simulate(there, history=history)
    assert outcome(found) == outcome(expected)
    unchanged = 3.2712 if base is BASE else 3.3885  # m/s, the normal rebound of the files' numbers
    assert abs(found.rebound_velocity[2] - unchanged) > 1e-3
    assert found.energy_error < 1e-4
    assert found.momentum_error < 1e-6
    assert found.impulse == pytest.approx(found.balance.impulse_on_ball, abs=1e-6)  # as metered
    if base is BASE:
        assert found.angular_momentum_error < 1e-6
        racket = here.load_racket()
        mass = sum(p.mass.value for p in (racket.handle, racket.head, racket.string_bed))
        assert mass * found.racket_velocity == pytest.approx(-found.impulse, abs=1e-6)


@pytest.mark.parametrize(
    "base",
    [
        dataclasses.replace(BASE, support="clamped_handle", audit=False),
        dataclasses.replace(BASE, time_step=2e-5, after=0.003),
    ],
    ids=["clamped", "discrete"],
)
def test_the_other_topologies_share_as_well(tmp_path, base):
    values = {"racket.head.com": 0.16, "racket.string_bed.mass": 0.017, "ball.mass": 0.055}
    found = simulate(changed(base, overrides=values), make_impact_diagram(base), history=False)
    expected = simulate(from_files(tmp_path, base, values), history=False)
    assert outcome(found) == outcome(expected)


def test_geometry_takes_another_diagram(tmp_path, free):
    base = dataclasses.replace(BASE, after=0.002)
    scenario = changed(base, overrides=TOPOLOGY)
    with pytest.raises(InputError, match="topology"):
        free.create_context(scenario)
    expected = simulate(from_files(tmp_path, base, TOPOLOGY))
    assert outcome(simulate(scenario)) == outcome(expected)


def test_the_torques_of_a_limb_are_those_of_the_changed_racket(tmp_path):
    """`carry` bears the racket's weight: it must come from the Context."""
    from studies.impact_location_and_grip.runs import backhand_scenario

    base = backhand_scenario()
    base = changed(base, limb=dataclasses.replace(base.limb, joint_torques="carry"))
    values = {"racket.head.mass": 0.2, "racket.head.com": 0.17, "grip.torque_damping.z": 0.1}
    there = from_files(tmp_path, base, values)
    system = make_impact_diagram(base)
    nominal = numbers(system.create_context())
    found = numbers(system.create_context(changed(base, overrides=values)))
    assert found == numbers(make_impact_diagram(there).create_context())
    torques = system.limb.torques.source.GetMyContextFromRoot(system.create_context())
    changed_torques = system.limb.torques.source.GetMyContextFromRoot(
        system.create_context(changed(base, overrides=values))
    )
    difference = (
        changed_torques.get_numeric_parameter(0).CopyToVector()
        - torques.get_numeric_parameter(0).CopyToVector()
    )
    assert np.max(np.abs(difference)) > 0.1
    assert found != nominal


def test_a_changed_ball_and_bed_against_the_clamped_oracle():
    """The 20-state equations of a head-clamped impact, derived without Drake."""
    base = Scenario(support="clamped_head", audit=False, approach_time=1e-4, speed=20.0, point=2)
    problem = dataclasses.replace(
        clamped_problem("tour", "low", 2, 20.0), ball_mass=0.045, string_mass=0.021 / 9.0, T0=500.0
    )
    values = {
        "ball.mass": 0.045,
        "racket.string_bed.mass": 0.021,
        "racket.string_bed.initial_tension": 500.0,
    }
    found = simulate(
        changed(base, after=0.008, overrides=values), make_impact_diagram(base), history=False
    )
    speed = np.linalg.norm(found.rebound_velocity)
    assert speed == pytest.approx(oracle(problem).rebound_speed, abs=2e-5)


def test_a_grid_over_a_mass_is_labelled_and_differs():
    axis = {"key": "racket.head.mass", "values": [0.15, 0.17], "unit": "kg"}
    sweep = make_sweep(dataclasses.replace(BASE, audit=False), {"head": axis}, [REBOUND_SPEED])
    grid = run_grid(sweep, title="")
    for mass in axis["values"]:
        overrides = {"racket.head.mass": mass}
        scenario = changed(BASE, audit=False, overrides=overrides, engine="compiled")
        expected = simulate(scenario, history=False)
        speed = float(grid["rebound_speed"].sel(head=mass))
        assert speed == np.linalg.norm(expected.rebound_velocity)


def test_warnings_are_about_the_scenarios_ball(free):
    values = {"ball.speed_low": 10.0, "ball.speed_high": 20.0}
    result = simulate(changed(BASE, overrides=values), free, history=False)
    (warning,) = result.warnings
    assert "10-20 m/s" in warning


# --- names ----------------------------------------------------------------------------------------


def test_every_key_may_be_given_its_own_value():
    racket, ball, grip = load_racket(), load_ball(), load_grip()
    before = [values_of(p) for p in (racket, ball, grip)]
    springs = spring_constants(string_bed_model(racket))
    for key, parameter in KEYS.items():
        own = {key: parameter.value}
        new = [apply_overrides(p, own) for p in (racket, ball, grip)]
        assert np.array_equal(spring_constants(string_bed_model(new[0])), springs), key
        assert parameter_keys(*new)[key] == parameter
        if ".spring." not in key:  # which take the bed apart
            assert [values_of(p) for p in new] == before, key
        (touched,) = [p for p, old in zip(new, (racket, ball, grip), strict=True) if p is not old]
        notes = [q.source for _, q in sourced_fields(touched, idle=True) if "overrides" in q.source]
        assert len(notes) == 1, key
        assert f"the file has {parameter.value:.10g}" in notes[0]
    assert [values_of(p) for p in (racket, ball, grip)] == before


def values_of(parameters: object) -> dict[str, Any]:
    return {key: q.value for key, q in sourced_fields(parameters)}


def test_the_keys_are_the_numbers_of_the_files():
    """Counted on the raw files: one key a number; four names by bending, and 24 springs."""
    expected = 4 + len(BED.names) - 1  # the stringing tension is a label
    expected += 8  # of the frame's distribution, which the files leave out
    for name in FILES.values():
        tree: Any = yaml.safe_load((data_directory() / f"{name}.yaml").read_text())
        stack = [tree]
        while stack:
            item = stack.pop()
            if isinstance(item, dict) and "unit" in item:
                value = item["value"]
                expected += len(value) if isinstance(value, list) else 1
            elif isinstance(item, dict):
                stack += item.values()
    assert len(KEYS) == expected
    assert all(p.unit for p in KEYS.values())
    assert KEYS["racket.string_bed.rim_factors.p6"].value == 1.4
    assert KEYS["racket.string_bed.spring.tip-2"].value == pytest.approx(1.4 * 7.91e5)
    assert KEYS["grip.torque_damping.x"].value == 0.026


@pytest.mark.parametrize(("reading", "out", "inside"), [("by_axis", 0, 1), ("as_printed", 1, 0)])
def test_names_by_bending_set_what_bends_that_way(reading, out, inside):
    values = {
        "racket.throat_joint.out_of_plane_stiffness": 777.0,
        "racket.throat_joint.in_plane_damping": 0.123,
    }
    joint = Scenario(joint_reading=reading, overrides=values).load_racket().throat_joint
    printed = (910.0, 0.03), (1650.0, 0.09)
    assert joint.out_of_plane() == (777.0, printed[out][1])
    assert joint.in_plane() == (printed[inside][0], 0.123)


def test_one_spring_of_24(tmp_path):
    base = dataclasses.replace(BASE, support="clamped_head", audit=False)
    named = {"racket.string_bed.stiffness.k3": 6e5, "racket.string_bed.rim_factors.p6": 1.3}
    values = {"racket.string_bed.spring.left-4": 5e5} | named
    scenario = changed(base, overrides=values)
    constants = spring_constants(string_bed_model(scenario.load_racket()))
    expected = spring_constants(string_bed_model(apply_overrides(load_racket(), named)))
    row = BED.names.index("left-4")
    lengths = np.sqrt(expected[2])
    expected[:2, row] = 5e5, 648.2 - 5e5 * lengths[row]
    assert constants == pytest.approx(expected, rel=1e-14)
    # one Diagram for all single springs, and it runs
    other_spring = changed(base, overrides={"racket.string_bed.spring.5-6": 5e5})
    system = make_impact_diagram(other_spring)
    result = simulate(scenario, system, history=False)
    tree: Any = yaml.safe_load((data_directory() / "tour_low.yaml").read_text())
    bed = tree["string_bed"]
    bed["stiffness"]["value"] += [5e5]
    bed["stiffness"]["value"][2], bed["rim_factors"]["value"][5] = 6e5, 1.3
    bed["springs"]["value"]["left-4"] = "k5"
    path = tmp_path / "mine.yaml"
    path.write_text(yaml.safe_dump(tree), encoding="utf-8")
    same = simulate(changed(base, racket=str(path)), history=False)
    assert result.rebound_velocity == pytest.approx(same.rebound_velocity, abs=1e-12)
    # without rim factors it still travels to another scalar type
    autodiff = system.diagram.ToAutoDiffXd().CreateDefaultContext()
    autodiff.SetTimeStateAndParametersFrom(system.create_context(scenario))


def test_swingweight_follows():
    racket = load_racket("recreational")
    before = racket_properties(racket)
    heavier = apply_overrides(racket, {"racket.head.mass": racket.head.mass.value + 0.010})
    after = racket_properties(heavier)
    arm = racket.handle.length.value + racket.head.com.value - SWINGWEIGHT_AXIS
    assert after.mass - before.mass == pytest.approx(0.010, abs=1e-12)
    assert after.swingweight - before.swingweight == pytest.approx(0.010 * arm**2, rel=1e-9)
    assert after.twistweight == pytest.approx(before.twistweight, rel=1e-12)
    assert after.out_of_plane_frequency < before.out_of_plane_frequency


def test_overrides_in_a_scenario_file():
    text = "{support: grip, overrides: {racket.head.mass: 0.17, grip.force_stiffness.x: 4e4}}"
    scenario = parse_scenario(text)
    assert scenario.load_racket().head.mass.value == 0.17
    assert scenario.load_racket().head.mass.status == "inferred"
    assert scenario.load_grip().force_stiffness.value == (4e4, 3e4, 3e4)
    assert parse_scenario(yaml.safe_dump(dataclasses.asdict(scenario))) == scenario


# --- bad input ------------------------------------------------------------------------------------


def refused(overrides: Any, *said: str, **scenario: Any) -> None:
    with pytest.raises(InputError) as error:
        changed(Scenario(**scenario), overrides=overrides)
    text = str(error.value)
    assert "\n" not in text
    for part in ("overrides", *said):
        assert part in text, text


@pytest.mark.parametrize(
    ("overrides", "said"),
    [
        ({"racket.handle.mas": 0.1}, ("racket.handle.mas", "unknown", "racket.handle.mass")),
        ({"racquet.handel.weight": 0.1}, ("unknown", "racket, ball, grip")),
        ({"racket.head": 0.1}, ("racket.head.mass, length, com", "moi_transverse")),
        ({"racket.string_bed.stiffness": 1e5}, ("stiffness.k1, k2, k3, k4",)),
        ({"racket.string_bed.stiffness.k5": 1e5}, ("unknown", "stiffness.k4")),
        ({"racket.string_bed.spring.left-5": 1e5}, ("unknown", "spring.left-4")),
        ({"racket.string_bed.stringing_tension": 260}, ("unknown", "initial_tension")),
        ({"racket.throat_joint.reading": 1.0}, ("unknown",)),
        ({"": 1.0}, ("unknown",)),
        ({7: 1.0}, ("7", "texts")),
        ([("ball.mass", 1.0)], ("keys and numbers",)),
        ({"ball.mass": "0.06"}, ("ball.mass", "finite number (kg)")),
        ({"ball.mass": 10**400}, ("ball.mass", "finite number (kg)")),
        ({"racket.head.mass": -0.1}, ("racket.head.mass: got -0.1", "more than 0")),
        ({"racket.string_bed.damping": -1.0}, ("string_bed.damping: got -1.0", "0 or more")),
        ({"racket.friction.coefficients.mu2": -0.1}, ("coefficients.mu2: got -0.1",)),
        ({"racket.string_bed.spring.4-5": 0.0}, ("spring.4-5: got 0.0", "more than 0")),
        ({"racket.head.moi_frontal": 0.0047}, ("racket.head.moi_frontal: got 0.0047", "sum")),
        ({"racket.handle.com": 0.4}, ("racket.handle.com: got 0.4", "at most 0.356")),
        ({"racket.landmarks.grip": 0.4}, ("landmarks.grip: got 0.4", "at most")),
        ({"racket.string_bed.rim_semi_axis_y": 0.05}, ("rim_semi_axis_y: got 0.05", "corner")),
        ({"ball.speed_low": 40.0}, ("ball.speed_low: got 40.0", "above 40")),
        ({"ball.damping_growth": -1.5}, ("ball.damping_growth: got -1.5", "more than -1")),
        ({"ball.stiffness_growth": -1.0}, ("ball.stiffness_growth: got -1.0", "more than -1")),
        (
            {"ball.mass": 0.06, "racket.head.com": -1.0, "racket.head.mass": 0.2},
            ("racket.head.com: got -1.0",),
        ),
        (
            {"racket.head.com": -1.0, "racket.handle.mass": -2.0},
            ("overrides.racket.handle.mass: got -2.0",),
        ),
        (
            {"racket.head.moi_frontal": 0.3, "racket.head.moi_transverse": 0.1},
            ("moi_frontal, overrides.racket.head.moi_transverse: got [0.3, 0.1]",),
        ),
        (
            {
                "racket.throat_joint.stiffness_in": 900.0,
                "racket.throat_joint.out_of_plane_stiffness": 900.0,
            },
            ("one key for one number", "racket.throat_joint.stiffness_in"),
        ),
    ],
    ids=itertools.count(),
)
def test_bad_overrides_get_one_clear_line(overrides, said):
    refused(overrides, *said)


@pytest.mark.parametrize(
    ("key", "scenario"),
    [
        ("grip.force_stiffness.x", {"support": "free"}),
        ("grip.torque_stiffness.x", {"support": "clamped_handle"}),
        ("grip.torque_stiffness.x", {"support": "grip", "grip_kind": "weld"}),
        ("grip.force_damping.z", {"support": "grip", "grip_kind": "torsional"}),
    ],
)
def test_a_grips_number_that_nothing_looks_at_is_refused(key, scenario):
    refused({key: 20.0}, key, "20.0", *scenario.values(), **scenario)


def test_a_grips_number_that_counts_is_taken():
    for kind in ("compliant", "torsional"):
        scenario = Scenario(support="grip", grip_kind=kind)
        changed(scenario, overrides={"grip.torque_stiffness.x": 20.0})


not_numbers = st.one_of(
    st.none(), st.booleans(), st.text(max_size=5), st.sampled_from([np.nan, np.inf, -np.inf])
)
garbled = st.builds(
    lambda key, i, c: key[: i % len(key)] + c + key[i % len(key) + 1 :],
    st.sampled_from(sorted(KEYS)),
    st.integers(0, 100),
    st.characters(),
).filter(lambda key: key not in KEYS)


@settings(max_examples=60, deadline=None)
@given(st.dictionaries(st.sampled_from(sorted(KEYS)), not_numbers, min_size=1, max_size=3))
def test_values_that_are_no_numbers(overrides):
    refused(overrides, "finite number", support="grip")


@settings(max_examples=60, deadline=None)
@given(st.one_of(garbled, st.text(max_size=30).filter(lambda key: key not in KEYS)))
def test_unknown_keys(key):
    refused({key: 1.0}, "unknown")


@settings(max_examples=60, deadline=None)
@given(st.dictionaries(st.sampled_from(sorted(KEYS)), st.floats(-10, 10), max_size=4))
@example({"racket.string_bed.rim_semi_axis_x": 3.7e-156})
def test_whatever_is_accepted_is_what_the_model_gets(overrides):
    scenario, error = None, ""
    try:
        scenario = changed(Scenario(support="grip"), overrides=overrides)
    except InputError as refusal:
        error = str(refusal)
    if scenario is None:
        assert "\n" not in error
        assert any(key in error for key in overrides)
        return
    new = parameter_keys(*parameters_of(scenario))
    own_springs = any(".spring." in key for key in overrides)  # then k and p are others
    for key, value in overrides.items():
        if not (own_springs and (".stiffness.k" in key or ".rim_factors." in key)):
            assert new[key].value == value, key

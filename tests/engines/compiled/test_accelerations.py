"""The compiled engine's rates against Drake's, at random states."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drake_racket import InputError, Scenario, make_impact_diagram, resolve
from drake_racket.engines.compiled.dynamics import layout
from drake_racket.engines.compiled.engine import CompiledImpact, _wiring, weights_of
from drake_racket.engines.compiled.extract.model import Wiring, extract
from drake_racket.laws.phases import PHASE, RELEASE, SIZE, TOUCH
from tests.conftest import BEDS
from tests.engines.compiled.helpers import rates_at
from tests.engines.compiled.random_trees import KINDS, make_tree, random_state

CASES = {
    "free": {},
    "clamped head": {"support": "clamped_head"},
    "clamped handle": {"support": "clamped_handle"},
    **{f"hand, {k}": {"support": "grip", "grip_kind": k} for k in ("compliant", "torsional")},
    "hand, weld": {"support": "grip", "grip_kind": "weld"},
    **{f"limb, {k}": {"support": "limb", "grip_kind": k} for k in ("compliant", "torsional")},
    "limb, weld": {"support": "limb", "grip_kind": "weld"},
    "recreational": {"racket": "recreational", "tension": "high"},
    "damped strings": {"overrides": {"racket.string_bed.damping": 2.0}},
    "six segments, hand with mass": {
        "overrides": {"racket.frame.segments": 6, "racket.string_bed.damping": 2.0},
        "support": "grip",
        "grip": "hand_medium",
        "grip_kind": "hand",
    },
    "twelve segments": {"overrides": {"racket.frame.segments": 12, "racket.frame.density": 1.0}},
    "segments, limb": {"overrides": {"racket.frame.segments": 4}, "support": "limb"},
}


def record_at(rng, points, friction_reading, reaction_at_ball):
    """A contact that has latched all it can, on one of the points."""
    record = np.zeros(SIZE)
    record[[TOUCH, RELEASE]] = np.nan
    latched = [1.0, rng.integers(1, points + 1), 25.0, 5e4, 15.0, 0.35, *rng.normal(0, 1e-3, 2)]
    record[: len(latched)] = latched
    record[8:13] = 0.02, friction_reading, *rng.choice([0.0, 1e6], 2), reaction_at_ball
    return record


def compare(system, model, floats, states, records):
    """Largest differences from the Diagram: of q' and v', and of the totals, relative."""
    plant, contact = system.plant, system.impact.contact
    root = system.create_context()
    context = plant.GetMyMutableContextFromRoot(root)
    own = contact.GetMyMutableContextFromRoot(root)
    n = plant.num_multibody_states()
    motion = lost = 0.0
    for state, record in zip(states, records, strict=True):
        plant.SetPositionsAndVelocities(context, state)
        own.SetDiscreteState(record)
        expected = system.diagram.EvalTimeDerivatives(root).CopyToVector()
        if record[PHASE] and contact.GetOutputPort("contact_state").Eval(own)[4] == 0.0:
            continue  # past the release, where a step of the compiled engine looks further
        totals = len(expected) - n
        found = rates_at(model, floats, [*state, *np.zeros(totals)], record[None])
        theirs = expected[:n]
        motion = max(motion, np.max(np.abs(found[:n] - theirs)) / np.max(np.abs(theirs)))
        ours = expected[n:]
        if system.limb is not None:  # Drake has the limb's totals first
            ours = np.concatenate([ours[3:], ours[:3]])
        lost = max(lost, np.max(np.abs(found[n:] - ours)) / max(1.0, np.max(np.abs(ours))))
    return motion, lost


def check_rates(changes):
    scenario = Scenario(gravity=(0.3, -1.0, -9.81), **changes)
    case = resolve(scenario)
    system = make_impact_diagram(case)
    compiled = CompiledImpact(system)
    start = compiled.start(case)
    rng = np.random.default_rng(7)
    states, records = [], []
    nq, plant = system.plant.num_positions(), system.plant
    initial = start.y[: plant.num_multibody_states()]
    for trial in range(100):
        state = initial + rng.normal(size=len(initial)) * np.where(
            np.arange(len(initial)) < nq, 0.02, 3.0
        )
        for joint in (plant.get_joint(i) for i in plant.GetJointIndices()):
            if joint.type_name() == "quaternion_floating":
                q = slice(joint.position_start(), joint.position_start() + 4)
                state[q] /= np.linalg.norm(state[q])
        states.append(state)
        touching = record_at(rng, 9, trial % 4 < 2, trial % 8 < 4)
        records.append(touching if trial % 2 else np.zeros(SIZE))
    motion, lost = compare(system, compiled.model, start.floats, states, records)
    assert motion < 1e-12
    assert lost < 1e-11


@pytest.mark.parametrize("name", CASES)
def test_rates_are_the_diagrams(name):
    check_rates(CASES[name])


def test_axes_taken_together_move_as_one_by_one():
    """Three axes through one point are one run, unless something holds on between them."""
    case = resolve(Scenario(**CASES["six segments, hand with mass"]))
    compiled = CompiledImpact(make_impact_diagram(case))
    start, ints = compiled.start(case), compiled.model.ints
    apart = start.floats.copy()
    layout.open_model(ints, apart)[layout.NODE_NUMBERS][:, layout.RUN] = 1.0
    runs = start.tables[layout.NODE_NUMBERS][:, layout.RUN]
    assert runs.tolist() == [1.0] * 3 + [3.0, 0.0, 0.0] * 5
    tables = layout.one_by_one(start.tables)
    assert np.all(
        tables[layout.NODE_NUMBERS] == layout.open_model(ints, apart)[layout.NODE_NUMBERS]
    )
    assert runs.tolist() == start.tables[layout.NODE_NUMBERS][:, layout.RUN].tolist()
    state = start.y + np.random.default_rng(3).normal(size=len(start.y)) * 0.02
    one, other = (rates_at(compiled.model, floats, state) for floats in (start.floats, apart))
    assert np.max(np.abs(one - other)) < 1e-12 * np.max(np.abs(one))
    plant = compiled.system.plant
    context = plant.GetMyMutableContextFromRoot(start.root)
    inner = next(n for n in compiled.model.tree.nodes if n.joint.name() == "out_of_plane_1")
    between = inner.joint.child_body()
    assert between.get_mass(context) == 0.0
    between.SetMass(context, 0.01)
    held = compiled.model.numbers.read(start.root, _wiring(compiled.system, start.root))
    runs = layout.open_model(ints, held)[layout.NODE_NUMBERS][:, layout.RUN]
    assert runs.tolist()[3:6] == [2.0, 0.0, 1.0]


def test_an_error_weighs_the_energy_it_takes_at_least():
    """Half of 1 / (M^-1)_ii: all of a body that is free, less of a joint in a chain."""
    case = resolve(Scenario(overrides={"racket.frame.segments": 6}))
    system = make_impact_diagram(case)
    plant = system.plant
    context = plant.GetMyContextFromRoot(system.create_context(case))
    mass = plant.CalcMassMatrix(context)
    weights = weights_of(plant, context, 2.0) ** 2 * 2.0
    joint = system.impact.racket.joints_of("out_of_plane")[0].velocity_start()
    others = [i for i in range(len(mass)) if i != joint]
    give = np.linalg.solve(mass[np.ix_(others, others)], mass[others, joint])
    assert weights[joint] == pytest.approx(mass[joint, joint] - mass[joint, others] @ give)
    assert weights[joint] < 0.1 * mass[joint, joint]
    ball = system.impact.ball.body.floating_velocities_start_in_v() + 3
    assert weights[ball : ball + 3] == pytest.approx(case.ball.mass.value)


@pytest.mark.slow
@pytest.mark.parametrize("bed", BEDS)
@pytest.mark.parametrize("support", ["free", "grip", "limb"])
def test_rates_of_every_bed(bed, support):
    check_rates({"racket": bed[0], "tension": bed[1], "support": support})


trees = st.integers(1, 6).flatmap(
    lambda n: st.tuples(
        st.lists(st.sampled_from(KINDS), min_size=n, max_size=n),
        st.lists(st.integers(0, 5), min_size=n, max_size=n),
        st.lists(st.booleans(), min_size=n, max_size=n),
        st.integers(0, 2**31),
    )
)


def check_tree(kinds, parents, reverse, seed):
    plant = make_tree(kinds, parents, reverse, seed)
    context = plant.CreateDefaultContext()
    model = extract(plant, context, Wiring())
    rng = np.random.default_rng(seed)
    for _ in range(3):
        state = random_state(plant, rng)
        plant.SetPositionsAndVelocities(context, state)
        if plant.get_actuation_input_port().size():
            plant.get_actuation_input_port().FixValue(context, np.zeros(plant.num_actuated_dofs()))
        expected = plant.EvalTimeDerivatives(context).CopyToVector()
        found = rates_at(model, model.floats, state)
        if not len(expected):
            continue
        scale = max(1.0, np.max(np.abs(expected)))
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * scale)


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(trees)
def test_any_tree_is_drakes(tree):
    check_tree(*tree)


@pytest.mark.slow
@settings(max_examples=400, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(trees)
def test_many_trees_are_drakes(tree):
    check_tree(*tree)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("reverse", [False, True])
def test_each_joint_in_a_chain(kind, reverse):
    check_tree([kind, kind, "revolute"], [0, 1, 2], [reverse] * 3, 11)


def test_bodies_in_a_loop_or_locked_joints_are_refused():
    plant = make_tree(["revolute", "prismatic"], [0, 1], [False, False], 3)
    context = plant.CreateDefaultContext()
    plant.GetJointByName("joint_1").Lock(context)
    with pytest.raises(InputError, match=r"joint joint_1: got 'locked'"):
        extract(plant, context, Wiring())

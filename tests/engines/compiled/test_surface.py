"""Contact surface in both engines against an independent derivation, and against each other."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity

from drake_racket import (
    IntegratorSettings,
    Scenario,
    make_impact_diagram,
    resolve,
    run_drake,
    simulate,
)
from drake_racket.cases.keys import find_key, number_of, with_values
from drake_racket.engines.compiled.dynamics import layout as at
from drake_racket.engines.compiled.engine import CompiledImpact
from drake_racket.laws.contact import CONTACT
from drake_racket.laws.phases import CB, DB, HB, KB, MU, PHASE, POINT, RELEASE, TOUCH
from drake_racket.laws.places import bed_weights
from drake_racket.laws.surface import (
    CT,
    FLATTENING,
    GRIPS,
    KT,
    POINT_0,
    RADIUS,
    SURFACE_SIZE,
    WEIGHT_0,
)
from drake_racket.results.impact import make_result
from drake_racket.results.outputs import OUTPUTS
from tests.conftest import free_parameters
from tests.engines.compiled.helpers import rates_at
from tests.oracles.free_racket import FreeRacketState
from tests.oracles.spinning_ball import SpinningBall, State, friction_at, impact, rates, weights_at
from tests.plant.test_accelerations import random_state, set_state

BASE = Scenario(contact="surface", after=0.006, approach_time=0.0)
SPIN = {"incidence_deg": 40.0, "spin_rpm": -3820.0}


@pytest.fixture(scope="module")
def model():
    """A Diagram with contact surface, and the compiled engine on it."""
    system = make_impact_diagram(resolve(BASE))
    return system, CompiledImpact(system)


def numbers(case) -> SpinningBall:
    """The oracle's numbers of a case's ball and bed."""
    ball, bed, surface = case.ball, case.racket.string_bed, case.ball.surface
    return SpinningBall(
        radius=ball.radius.value,
        chi=surface.flattening.value,
        kt=surface.tangential_stiffness.value,
        ct=surface.tangential_damping.value,
        inertia=surface.inertia_factor.value * ball.mass.value * ball.radius.value**2,
        rim=(bed.rim_semi_axis_x.value, bed.rim_semi_axis_y.value),
        mu=np.array(case.racket.friction_coefficients()),
    )


def hunt_crossley(case) -> dict[str, float]:
    """The oracle's names of the constants that grow with compression."""
    own = case.ball.hunt_crossley
    names = {"kb": "stiffness", "cb": "damping", "hb": "stiffness_rise", "db": "damping_rise"}
    return {name: getattr(own, theirs).value for name, theirs in names.items()}


def latched(par, ball: SpinningBall, state: State, place) -> np.ndarray:
    """The record that the oracle's state stands for."""
    record = np.zeros(SURFACE_SIZE)
    record[[TOUCH, RELEASE]] = 0.0, np.nan
    record[[PHASE, POINT, KB, CB, MU]] = CONTACT, 1, par.kb, par.cb, state.mu
    record[[HB, DB]] = par.hb, par.db
    points, weights, _ = bed_weights(par.grid_xy, ball.rim, *place)
    record[WEIGHT_0 : WEIGHT_0 + 4], record[POINT_0 : POINT_0 + 4] = weights, np.add(points, 1)
    record[[RADIUS, FLATTENING, KT, CT]] = ball.radius, ball.chi, ball.kt, ball.ct
    record[GRIPS] = float(state.grips)
    return record


@pytest.mark.parametrize("seed", range(20))
def test_accelerations_are_the_oracles(seed, model):
    system, compiled = model
    case = system.case
    rng = np.random.default_rng(seed)
    par = free_parameters("tour", "low", 5, 25.0, "velocity", "ball")
    if seed % 3 == 0:
        par = dataclasses.replace(par, hb=2e6, db=1500.0)
    ball = numbers(case)
    racket = random_state(rng, par, True, (0.0, 0.0))
    place = rng.uniform(-1.0, 1.0, 2) * 0.65 * np.array(ball.rim)
    state = State(
        racket=dataclasses.replace(racket, p_WQ=racket.p_WQ + 0.02 * rng.normal(size=3)),
        spin=rng.normal(0.0, 300.0, 3),
        shear=rng.normal(0.0, 0.003, 2),
        weights=weights_at(par, ball, *place),
        mu=friction_at(par, ball, *place),
        grips=bool(seed % 2),
    )
    expected = rates(par, ball, state)
    root = system.create_context()
    plant, contact = system.plant, system.impact.contact
    own = contact.GetMyMutableContextFromRoot(root)
    set_racket_and_ball(system, root, state, par)
    record = latched(par, ball, state, place)
    own.SetDiscreteState(record)
    own.SetContinuousState(state.shear)
    found = plant.EvalTimeDerivatives(plant.GetMyContextFromRoot(root))
    v = found.get_generalized_velocity().CopyToVector()
    shear = contact.EvalTimeDerivatives(own).CopyToVector()
    y = plant.GetPositionsAndVelocities(plant.GetMyContextFromRoot(root))
    start = compiled.start(case)
    totals = len(start.y) - len(y) - 2
    ours = rates_at(
        compiled.model, start.floats, [*y, *state.shear, *np.zeros(totals)], record[None]
    )
    n = plant.num_positions()
    for speeds, u in ((v, shear), (ours[n : n + len(v)], ours[len(y) : len(y) + 2])):
        check(system, speeds, u, expected)


def set_racket_and_ball(system, root, state: State, par) -> None:
    """Puts the oracle's state into a Context."""
    off = dataclasses.replace(state.racket, in_contact=False)
    contact = system.impact.contact
    own = contact.GetMyMutableContextFromRoot(root)
    record = own.get_discrete_state_vector().CopyToVector()
    set_state(_Unlatched(system), root, off, par, 5)
    own.SetDiscreteState(record)
    context = system.plant.GetMyMutableContextFromRoot(root)
    ball = system.impact.ball.body
    system.plant.SetFreeBodyPose(context, ball, RigidTransform(state.racket.p_WQ))
    velocity = SpatialVelocity(state.spin, state.racket.v_WQ)
    system.plant.SetFreeBodySpatialVelocity(context, ball, velocity)


class _Unlatched:
    """A system whose contact takes the record of contact paper and drops it."""

    class _Drop:
        def SetDiscreteState(self, record) -> None:
            pass

        def GetMyMutableContextFromRoot(self, root):
            return self

    def __init__(self, system) -> None:
        self.plant = system.plant
        self.impact = dataclasses.replace(system.impact, contact=self._Drop())


def check(system, v, shear, expected) -> None:
    """Compares accelerations, relative to the largest of their kind."""
    racket, ball = system.impact.racket, system.impact.ball.body
    w = racket.handle.floating_velocities_start_in_v()
    q = ball.floating_velocities_start_in_v()
    strings = [j.velocity_start() for j in racket.string_joints]
    a = expected.speeds
    joints = [racket.in_plane.velocity_start(), racket.out_of_plane.velocity_start()]
    pairs = [
        (v[w : w + 3], a[0:3]),
        (v[w + 3 : w + 6], a[3:6]),
        (v[joints], a[6:8]),
        (v[strings], a[8:17]),
        (v[q + 3 : q + 6], a[17:20]),
        (v[q : q + 3], expected.spin),
        (shear, expected.shear),
    ]
    for found, theirs in pairs:
        np.testing.assert_allclose(found, theirs, rtol=0, atol=1e-9 * np.max(np.abs(theirs)))


TIGHT = IntegratorSettings(accuracy=1e-9)
PLACES = {"offset_x": -0.03, "offset_y": 0.02}


def compiled_result(model, **changes):
    """The result of a case, far below default errors."""
    system, compiled = model
    case = resolve(dataclasses.replace(BASE, integrator=TIGHT, **changes))
    if case.topology != system.case.topology:
        compiled = CompiledImpact(make_impact_diagram(case))
    return make_result(case, compiled.run(case), history=True)


@pytest.mark.parametrize(
    "changes",
    [
        {**SPIN, **PLACES},
        {"incidence_deg": 17.0, "azimuth_deg": 60.0, "speed": 31.0, **PLACES},
        {"incidence_deg": 25.0, "spin_rpm": -900.0, "normal": "hunt_crossley", **PLACES},
        {"incidence_deg": 20.0, "contact": "paper", "friction_reading": "element"},
        pytest.param(
            {"incidence_deg": 45.0, "speed": 30.0, "spin_rpm": 4000.0}, marks=pytest.mark.slow
        ),
        pytest.param({"spin_rpm": 3000.0, "offset_x": 0.1}, marks=pytest.mark.slow),
    ],
    ids=str,
)
def test_rebounds_are_the_oracles(changes, model):
    found = compiled_result(model, **changes)
    case = resolve(dataclasses.replace(BASE, **changes))
    par = free_parameters("tour", "low", 5, found.normal_approach_speed, "velocity", "ball")
    if case.ball.normal == "hunt_crossley":
        par = dataclasses.replace(par, **hunt_crossley(case))
    ball = numbers(case)
    if case.scenario.contact == "paper":  # friction reading element: a point
        ball = dataclasses.replace(ball, radius=0.0, chi=0.0)
    place = [case.scenario.offset_x, case.scenario.offset_y]
    still = FreeRacketState(
        R_WH=np.eye(3),
        p_WHo=np.zeros(3),
        theta_z=0.0,
        theta_y=0.0,
        z=np.zeros(9),
        p_WQ=case.scenario.aim(case.racket) + np.array([0.0, 0.0, ball.radius]),
        w_WH=np.zeros(3),
        v_WHo=np.zeros(3),
        theta_z_dot=0.0,
        theta_y_dot=0.0,
        z_dot=np.zeros(9),
        v_WQ=case.scenario.ball_velocity(),
        in_contact=True,
    )
    state = State(
        racket=still,
        spin=case.scenario.ball_spin(),
        shear=np.zeros(2),
        weights=weights_at(par, ball, *place),
        mu=friction_at(par, ball, *place),
        grips=False,
    )
    state = dataclasses.replace(state, grips=rates(par, ball, state).margin >= 0.0)
    final, time, slid = impact(par, ball, state)
    np.testing.assert_allclose(found.rebound_velocity, final.racket.v_WQ, rtol=0, atol=1e-9)
    np.testing.assert_allclose(found.spin_after, final.spin, rtol=0, atol=1e-7)
    assert found.contact_time == pytest.approx(time, abs=1e-9)
    assert found.sliding_fraction == pytest.approx(slid / time, abs=1e-6)


@pytest.mark.parametrize(
    "changes",
    [
        {**SPIN, **PLACES},
        {"incidence_deg": 17.0, "speed": 31.0},
        {"incidence_deg": 17.0, "speed": 31.0, "normal": "hunt_crossley"},
    ],
    ids=str,
)
def test_balances_close_with_the_turns_located(changes, model):
    found = compiled_result(model, **changes)
    assert found.energy_error < 1e-6
    assert found.momentum_error < 1e-10
    assert found.angular_momentum_error < 1e-10
    assert 0.0 < found.sliding_fraction < 1.0 or changes.get("spin_rpm")
    default = dataclasses.replace(BASE, **changes)
    case = resolve(default)
    assert make_result(case, model[1].run(case), history=True).energy_error < 1e-4


def test_drake_gives_the_same(model):
    system, _ = model
    changes = {"incidence_deg": 17.0, "speed": 31.0, **PLACES}
    ours = compiled_result(model, **changes)
    fine = IntegratorSettings("runge_kutta5", maximum_step=1e-5, error_control=False)
    case = resolve(dataclasses.replace(BASE, integrator=fine, **changes))
    theirs = make_result(case, run_drake(case, system), history=True)
    np.testing.assert_allclose(theirs.rebound_velocity, ours.rebound_velocity, atol=1e-6)
    np.testing.assert_allclose(theirs.spin_after, ours.spin_after, rtol=0, atol=1e-4)
    assert theirs.sliding_fraction == pytest.approx(ours.sliding_fraction, abs=1e-5)
    assert theirs.energy_error < 1e-6
    assert theirs.angular_momentum_error < 1e-10
    assert list(theirs.history.variables) == list(ours.history.variables)


@pytest.mark.parametrize("point", [1, 5, 8])
def test_without_radius_spin_and_friction_it_is_the_papers(point, model):
    """To 1e-12: on the same steps, so that nothing else differs."""
    _, compiled = model
    mu = {f"racket.friction.coefficients.mu{i}": 0.0 for i in (1, 2, 3)}
    steps = IntegratorSettings(maximum_step=2e-5, error_control=False)
    paper = dataclasses.replace(
        BASE,
        contact="paper",
        point=str(point),
        overrides=mu,
        integrator=steps,
        friction_reading="displacement",
    )
    other = resolve(paper)
    expected = make_result(
        other, CompiledImpact(make_impact_diagram(other)).run(other), history=True
    )
    case = resolve(dataclasses.replace(paper, contact="surface", friction_reading="velocity"))
    start = compiled.start(case)
    place = len(start.floats) - _after_contacts(compiled) + at.SURFACE
    assert start.floats[place] == case.ball.radius.value
    start.floats[place] = 0.0
    ball = compiled.system.impact.ball.body.floating_positions_start() + 4
    start.y[ball + 2] -= case.ball.radius.value
    found = make_result(case, compiled.run_from(case, start), history=True)
    np.testing.assert_allclose(
        found.rebound_velocity, expected.rebound_velocity, rtol=0, atol=1e-12
    )
    assert found.contact_time == pytest.approx(expected.contact_time, abs=1e-14)
    np.testing.assert_allclose(found.racket_velocity, expected.racket_velocity, rtol=0, atol=1e-12)


def _after_contacts(compiled) -> int:
    """How many floats stand from the contacts' table on."""
    ints = compiled.model.ints
    tables = at.open_model(ints, np.zeros(len(compiled.model.floats)))
    places = range(at.CONTACT_NUMBERS, at.TORQUES + 1)
    return sum(int(tables[i].size) for i in places)


@pytest.mark.parametrize("spin", [-3000.0, 2000.0])
def test_left_is_right_mirrored(spin, model):
    one = compiled_result(model, incidence_deg=30.0, spin_rpm=spin, azimuth_deg=70.0, **PLACES)
    mirrored = {"offset_x": PLACES["offset_x"], "offset_y": -PLACES["offset_y"]}
    two = compiled_result(model, incidence_deg=30.0, spin_rpm=spin, azimuth_deg=-70.0, **mirrored)
    np.testing.assert_allclose(two.rebound_velocity, one.rebound_velocity * [1, -1, 1], atol=1e-9)
    np.testing.assert_allclose(two.spin_after, one.spin_after * [-1, 1, -1], rtol=0, atol=1e-7)
    angular = one.angular_impulse * [-1, 1, -1]
    np.testing.assert_allclose(two.angular_impulse, angular, rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    "support",
    ["free", *(pytest.param(s, marks=pytest.mark.slow) for s in ("grip", "clamped_head"))],
)
def test_it_takes_no_more_evaluations_than_the_papers_contact(support, model):
    """By how the steps happen to fall one case may take 1 % more; all of them together less."""
    taken = {}
    for contact in ("paper", "surface"):
        scenario = Scenario(contact=contact, support=support)
        ours = contact == "surface" and support == "free"
        engine = model[1] if ours else CompiledImpact(make_impact_diagram(resolve(scenario)))
        cases = [
            resolve(dataclasses.replace(scenario, incidence_deg=angle))
            for angle in (0.0, 20.0, 40.0, 60.0)
        ]
        taken[contact] = [engine.samples(c, engine.start(c)).evaluations for c in cases]
    ratios = np.array(taken["surface"]) / np.array(taken["paper"])
    assert np.max(ratios) < 1.01
    assert sum(taken["surface"]) < 0.99 * sum(taken["paper"])


@pytest.mark.parametrize(
    ("x", "y", "dx", "dy"),
    [
        (0.0, 0.0685, 0.0, 1.0),
        (0.0685, 0.02, 1.0, 0.0),
        (0.03, 0.0, 0.0, 1.0),
        (0.0, 0.0, 1.0, 0.0),
    ],
)
def test_restitution_is_continuous_across_the_grids_lines(x, y, dx, dy, model):
    step = 1e-8
    ends = [
        compiled_result(model, offset_x=x + s * dx, offset_y=y + s * dy, support="free")
        for s in (-step, step)
    ]
    assert abs(ends[0].apparent_restitution - ends[1].apparent_restitution) < 1e-6


def errors(model, changes, steps):
    """Errors of rebound velocity and spin with fixed steps, against a fine run."""
    exact = compiled_result(model, **changes)
    found = []
    for step in steps:
        fixed = IntegratorSettings(maximum_step=step, error_control=False)
        case = resolve(dataclasses.replace(BASE, integrator=fixed, **changes))
        result = make_result(case, model[1].run(case), history=False)
        difference = np.concatenate(
            [
                result.rebound_velocity - exact.rebound_velocity,
                0.03 * (result.spin_after - exact.spin_after),
            ]
        )
        found.append(float(np.linalg.norm(difference)))
    return found


def test_the_order_is_kept_through_grip_and_slide(model):
    changes = {"incidence_deg": 17.0, "speed": 31.0}
    coarse, fine = errors(model, changes, (1.6e-4, 4e-5))
    assert np.log(coarse / fine) / np.log(4.0) > 4.0


@pytest.mark.parametrize(
    "key",
    [
        "ball.surface.tangential_damping",
        "racket.friction.coefficients.mu1",
        "spin_rpm",
        "offset_x",
        "ball.hunt_crossley.damping_rise",
    ],
)
def test_exact_derivatives_are_those_of_differences(key):
    """Through touch, the turns between gripping and sliding, and release."""
    scenario = dataclasses.replace(
        BASE, incidence_deg=40.0, spin_rpm=-1500.0, audit=False, integrator=TIGHT, **PLACES
    )
    if "hunt_crossley" in key:
        scenario = dataclasses.replace(scenario, normal="hunt_crossley")
    found = simulate(scenario, derivatives=[key], history=False, engine="compiled")
    assert 0.1 < found.sliding_fraction < 0.9
    varied = find_key(key, scenario, "")
    value = number_of(scenario, varied)
    h = 1e-4 * abs(value)
    ends = [
        simulate(
            with_values(scenario, {varied: value + s * h}, {}), history=False, engine="compiled"
        )
        for s in (1.0, -1.0)
    ]
    for name in ("spin_after_rpm", "rebound_speed", "sliding_fraction"):
        one, two = (OUTPUTS[name].read(end) for end in ends)
        difference = (one - two) / (2.0 * h)
        assert found.derivatives.of(name, key) == pytest.approx(difference, rel=1e-5)


@pytest.mark.parametrize(
    "changes",
    [
        {"support": "grip"},
        {"support": "grip", "grip_kind": "weld"},
        {"overrides": {"racket.frame.segments": 4.0}},
        pytest.param({"support": "limb"}, marks=pytest.mark.slow),
        pytest.param({"racket": "recreational", "point": "auto"}, marks=pytest.mark.slow),
    ],
    ids=str,
)
def test_every_support_in_both_engines(changes):
    scenario = dataclasses.replace(BASE, incidence_deg=30.0, spin_rpm=-1000.0, **PLACES, **changes)
    drake, ours = (simulate(scenario, engine=engine) for engine in ("drake", "compiled"))
    np.testing.assert_allclose(ours.rebound_velocity, drake.rebound_velocity, rtol=0, atol=1e-4)
    np.testing.assert_allclose(ours.spin_after, drake.spin_after, rtol=0, atol=1e-2)
    assert max(ours.energy_error, drake.energy_error) < 1e-4
    assert ours.warnings == drake.warnings

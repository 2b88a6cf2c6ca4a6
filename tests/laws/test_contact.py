"""The contact law and the phases of the contact."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialVelocity
from pydrake.systems.analysis import Simulator

from drake_racket import Scenario, configure_integrator, make_impact_diagram
from drake_racket.laws.contact import (
    CONTACT,
    FREE,
    PASSED,
    ball_constants,
    contact_law,
    contact_powers,
    normal_force,
    normal_slopes,
    stored_energy,
)
from tests.conftest import kb_cb

numbers = st.floats(-1.0, 1.0)


@given(v=st.floats(18.0, 33.0))
def test_ball_constants_are_lines_through_the_identified_speeds(v):
    from drake_racket import load_ball

    kb, cb = kb_cb(load_ball(), v)
    assert ball_constants(v, 18.0, 33.0, 45000.0, 0.52) == pytest.approx(kb, rel=1e-12)
    assert ball_constants(v, 18.0, 33.0, 14.0, 0.97) == pytest.approx(cb, rel=1e-12)


@pytest.mark.parametrize(("v", "held"), [(0.1, 18.0), (17.9, 18.0), (33.1, 33.0), (90.0, 33.0)])
def test_ball_constants_hold_their_end_values(v, held):
    outside = ball_constants(v, 18.0, 33.0, 14.0, 0.97)
    assert outside == ball_constants(held, 18.0, 33.0, 14.0, 0.97) > 0.0


@settings(max_examples=200, deadline=None)
@given(p=st.tuples(*[numbers] * 3), v=st.tuples(*[numbers] * 3), reading=st.sampled_from([0, 1]))
def test_law_never_pulls_and_friction_stays_in_the_cone(p, v, reading):
    constants = (5e4, 20.0, 0.36, 0.001, -0.002, 0.02, reading, 0.0, 0.0)
    fx, fy, normal, raw = contact_law(p, v, constants)
    assert normal == max(0.0, raw) == pytest.approx(max(0.0, -5e4 * p[2] - 20.0 * v[2]))
    assert math.hypot(fx, fy) <= 0.36 * normal * (1 + 1e-12)
    lost_ball, lost_friction, _ = contact_powers(p, v, (fx, fy, normal), 20.0, (0.0, 0.0, 0.0))
    assert lost_ball >= 0.0
    if reading == 0:  # against sliding, so that friction only takes
        assert lost_friction >= 0.0
        assert fx * v[1] == pytest.approx(fy * v[0], abs=1e-9 * max(1.0, normal))


def test_both_readings_agree_while_the_ball_slides_outward():
    """Along one line, well past both scales, the direction is the same."""
    p, v = (0.003, 0.004, -0.005), (3.0, 4.0, -10.0)
    by_velocity = contact_law(p, v, (5e4, 20.0, 0.36, 0.0, 0.0, 0.02, 0, 0.0, 0.0))
    by_displacement = contact_law(p, v, (5e4, 20.0, 0.36, 0.0, 0.0, 1e-4, 1, 0.0, 0.0))
    assert by_velocity == pytest.approx(by_displacement, rel=1e-3)


def test_friction_at_full_sliding_is_mu_n():
    constants = (5e4, 0, 0.4, 0, 0, 0.02, 0, 0, 0)
    fx, fy, normal, _ = contact_law((0, 0, -0.01), (10.0, 0.0, 0.0), constants)
    assert fx == pytest.approx(-0.4 * normal, rel=1e-5)
    assert fy == 0.0


@settings(max_examples=50, deadline=None)
@given(x=st.floats(1e-4, 0.03), rate=st.floats(-30.0, 30.0))
def test_a_ball_that_stiffens_stores_and_loses_what_its_force_does(x, rate):
    constants = 2e4, 5.0, 2e6, 1500.0
    force, h = normal_force(x, rate, *constants), 1e-6
    assert force == pytest.approx(2e4 * x + 2e6 * x**2 + (5.0 + 1500.0 * x) * rate, rel=1e-12)
    by_x, by_rate = normal_slopes(x, rate, *constants)
    ends = [normal_force(x + s * h, rate, *constants) for s in (1, -1)]
    assert by_x == pytest.approx((ends[0] - ends[1]) / (2 * h), rel=1e-6, abs=1e-4)
    ends = [normal_force(x, rate + s * h, *constants) for s in (1, -1)]
    assert by_rate == pytest.approx((ends[0] - ends[1]) / (2 * h), rel=1e-6, abs=1e-4)
    ends = [stored_energy(x + s * h, 2e4, 2e6) for s in (1, -1)]
    elastic = normal_force(x, 0.0, *constants)
    assert (ends[0] - ends[1]) / (2 * h) == pytest.approx(elastic, rel=1e-5)


def run(start, velocity, until, *, point=0, **changes):
    """A run of the free racket with the ball anywhere; returns records at each step and root."""
    system = make_impact_diagram(Scenario(audit=False, **changes))
    root = system.create_context(Scenario(audit=False, point="auto" if point == 0 else point))
    simulator = Simulator(system.diagram, root)
    root = simulator.get_mutable_context()
    configure_integrator(simulator, Scenario().integrator)
    context = system.plant.GetMyMutableContextFromRoot(root)
    ball = system.impact.ball.body
    gsc = np.array(system.impact.racket.parameters.point(5))
    system.plant.SetFreeBodyPose(context, ball, RigidTransform(gsc + start))
    system.plant.SetFreeBodySpatialVelocity(context, ball, SpatialVelocity([0, 0, 0], velocity))
    phases = []
    contact = system.impact.contact

    def record(r):
        state = contact.GetMyContextFromRoot(r).get_discrete_state_vector().CopyToVector()
        if not phases or phases[-1] != state[0]:
            phases.append(state[0])

    simulator.set_monitor(record)
    simulator.Initialize()
    simulator.AdvanceTo(until)
    return phases, system.impact.record(root)


def test_phases_of_an_impact():
    phases, record = run([0.0, 0.0, 0.02], [0.0, 0.0, -25.0], 0.01)
    assert phases == [FREE, CONTACT, PASSED, FREE]
    assert record.touches == 1
    assert record.touch_time == pytest.approx(0.02 / 25.0, abs=2e-9)
    assert record.release_time > record.touch_time
    assert record.approach_speed == pytest.approx(25.0, rel=1e-9)


@pytest.mark.parametrize("point", range(1, 10))
def test_auto_takes_the_nearest_point(point):
    row, column = divmod(point - 1, 3)
    start = [(1 - row) * 0.0685 + 0.01, (1 - column) * 0.0685 - 0.01, 0.001]
    _, record = run(start, [0.0, 0.0, -25.0], 0.001)
    assert record.phase == CONTACT
    assert record.point == point


@pytest.mark.parametrize("place", [(0.0, 0.2), (0.125, 0.1), (-0.17, 0.0)])
def test_a_ball_outside_the_rim_goes_past(place):
    phases, record = run([*place, 0.01], [0.0, 0.0, -25.0], 0.005)
    assert phases == [FREE, PASSED]
    assert record.touches == 0


def test_a_ball_that_moves_away_does_not_touch():
    phases, record = run([0.0, 0.0, 0.01], [0.0, 0.0, 5.0], 0.005)
    assert phases == [FREE]
    assert math.isnan(record.touch_time)


def test_a_run_may_start_at_touch():
    _, late = run([0.0, 0.0, 0.02], [0.0, 0.0, -25.0], 0.01)
    _, now = run([0.0, 0.0, 0.0], [0.0, 0.0, -25.0], 0.01)
    assert now.touch_time == 0.0
    late_contact = late.release_time - late.touch_time
    assert now.release_time == pytest.approx(late_contact, rel=1e-5)


def test_powers_are_those_of_vectors():
    """Damper: cb x'^2 in contact; friction: -F_t . v_t; couple: f . (w x p)."""
    rng = np.random.default_rng(5)
    p, v, w = rng.normal(size=(3, 3))
    for normal in (3.0, 0.0):
        force = np.array([*rng.normal(size=2), normal])
        in_ball, in_friction, couple = contact_powers(p, v, force, 7.0, w)
        assert in_ball == pytest.approx(7.0 * v[2] ** 2 if normal else 0.0)
        assert in_friction == pytest.approx(-force[:2] @ v[:2])
        assert couple == pytest.approx(force @ np.cross(w, p))

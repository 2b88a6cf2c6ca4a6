"""The steps: coefficients, order with and without friction, and what is split off of it."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from drake_racket import IntegratorSettings, Scenario, make_impact_diagram, resolve
from drake_racket.engines.compiled import steps
from drake_racket.engines.compiled.dynamics import layout
from drake_racket.engines.compiled.dynamics.friction import friction_at, linearise, solve_sliding
from drake_racket.engines.compiled.dynamics.rates import rates
from drake_racket.engines.compiled.engine import CompiledImpact
from drake_racket.engines.compiled.integrate import longer
from drake_racket.laws.phases import AT_BALL, CONSTANTS
from tests.engines.compiled.test_accelerations import record_at


def test_dormand_and_princes_pair_has_orders_five_and_four():
    a = np.zeros((7, 7))
    a[:, :6] = steps.DP_A
    b, error = a[6], steps.DP_ERROR
    c = a.sum(axis=1)
    for power in range(5):
        assert b @ c**power == pytest.approx(1.0 / (power + 1), abs=1e-15)
        assert error @ c**power == pytest.approx(0.0 if power < 4 else error @ c**4, abs=1e-15)
    assert abs(error @ c**4) > 1e-4
    assert b @ a @ c**3 == pytest.approx(1.0 / 20.0, abs=1e-15)
    assert b @ a @ a @ a @ c == pytest.approx(1.0 / 120.0, abs=1e-15)


def test_the_additive_pair_meets_all_conditions_of_order_four():
    explicit, implicit = np.zeros((6, 6)), np.zeros((6, 6))
    explicit[:, :5], implicit[:, :5] = steps.ARK_E, steps.ARK_I
    implicit[1:, 1:] += steps.ARK_GAMMA * np.eye(5)
    b, c = steps.ARK_B, steps.ARK_C
    for matrix in (explicit, implicit):
        np.testing.assert_allclose(matrix.sum(axis=1), c, atol=1e-13)
        # both weigh alike: a condition mixes the two in any order
        for power in range(4):
            assert b @ c**power == pytest.approx(1.0 / (power + 1), abs=1e-13)
        assert b @ matrix @ c == pytest.approx(1.0 / 6.0, abs=1e-13)
        assert b @ (c * (matrix @ c)) == pytest.approx(1.0 / 8.0, abs=1e-13)
        assert b @ matrix @ c**2 == pytest.approx(1.0 / 12.0, abs=1e-13)
        for other in (explicit, implicit):
            assert b @ matrix @ other @ c == pytest.approx(1.0 / 24.0, abs=1e-13)
    np.testing.assert_allclose(implicit[5], b, atol=1e-15)  # stiffly accurate
    embedded = b - steps.ARK_ERROR
    for power in range(3):
        assert embedded @ c**power == pytest.approx(1.0 / (power + 1), abs=1e-10)


@pytest.fixture(scope="module", params=[("free", 1.0), ("limb", 1.0), ("limb", 0.0)])
def touching(request):
    """A state in contact, off centre and sliding: what the kernel knows of it, and the plant."""
    support, reaction_at_ball = request.param
    scenario = Scenario(support=support, point="3", incidence_deg=20.0, approach_time=0.0)
    case = resolve(scenario)
    system = make_impact_diagram(case)
    model = CompiledImpact(system).model
    rng = np.random.default_rng(5)
    root = system.create_context(case)
    context = system.plant.GetMyMutableContextFromRoot(root)
    state = system.plant.GetPositionsAndVelocities(context)
    nq = system.plant.num_positions()
    state[nq:] += rng.normal(size=len(state) - nq)
    ball = system.impact.ball.body.floating_positions_start() + 4
    state[ball : ball + 3] += 0.004, -0.003, -0.001  # beside its mass, which the force is lent to
    record = record_at(rng, 9, 0.0, reaction_at_ball)
    record[1] = 3.0
    tables = layout.open_model(model.ints, model.floats)
    nv = len(state) - nq
    work = [np.zeros(layout.ORIGIN_WORK), *layout.work_of(model.ints), np.zeros(nv)]
    out = np.zeros(len(state))
    rates(tables, state, record[None], *work, out)
    columns, rows, law = np.zeros((2, nv)), np.zeros((2, nv)), np.zeros(9)
    linearise(tables, 0, record, work[1], work[2], out[nq:], columns, rows, law)
    system.plant.SetPositionsAndVelocities(context, state)
    contact = system.impact.contact
    contact.GetMyMutableContextFromRoot(root).SetDiscreteState(record)
    return system, root, state, record, columns, rows, law, out[nq:], tables


def sliding(system, root, state):
    context = system.plant.GetMyMutableContextFromRoot(root)
    system.plant.SetPositionsAndVelocities(context, state)
    contact = system.impact.contact
    return contact.GetOutputPort("contact_state").Eval(contact.GetMyContextFromRoot(root)).copy()


def test_rows_give_the_sliding_velocity(touching):
    system, root, state, _, _, rows, law, _, _ = touching
    nq = system.plant.num_positions()
    seen = sliding(system, root, state)
    np.testing.assert_allclose(rows @ state[nq:], seen[7:9], atol=1e-12)
    np.testing.assert_allclose(law[:2], seen[7:9], atol=1e-12)
    assert law[4] == pytest.approx(seen[4], rel=1e-12)


def test_columns_are_what_friction_does_to_the_accelerations(touching):
    system, root, state, record, columns, rows, _, vdot, tables = touching
    model_work = [
        np.zeros(layout.ORIGIN_WORK),
        *layout.work_of(tables[layout.HEAD]),
        np.zeros(len(vdot)),
    ]
    smooth = record.copy()
    smooth[CONSTANTS.start + 2] = 0.0  # mu
    out = np.zeros(len(state))
    rates(tables, state, smooth[None], *model_work, out)
    nq = len(state) - len(vdot)
    fx, fy = sliding(system, root, state)[5:7]
    np.testing.assert_allclose(
        vdot - out[nq:], columns.T @ [fx, fy], atol=1e-10 * np.max(np.abs(vdot))
    )
    if record[AT_BALL] < 0.5:
        return
    # action and reaction at one point: the columns are M^-1 times the rows
    M = system.plant.CalcMassMatrix(system.plant.GetMyContextFromRoot(root))
    np.testing.assert_allclose(M @ columns.T, rows.T, atol=1e-11)


def test_rates_of_sliding_and_of_the_normal_force(touching):
    system, root, state, _, _, rows, law, vdot, _ = touching
    context = system.plant.GetMyMutableContextFromRoot(root)
    system.plant.SetPositionsAndVelocities(context, state)
    qdot = system.plant.MapVelocityToQDot(context, state[len(state) - len(vdot) :])
    direction = np.concatenate([qdot, vdot])
    step = 1e-7
    ahead, behind = (sliding(system, root, state + s * step * direction) for s in (1.0, -1.0))
    slope = (ahead - behind) / (2.0 * step)
    np.testing.assert_allclose(law[2:4] + rows @ vdot, slope[7:9], rtol=1e-5, atol=1e-3)
    assert law[5] == pytest.approx(slope[4], rel=1e-5)


@pytest.mark.parametrize("start", [(0.0, 0.0), (1e-3, 0.0), (-0.03, 0.05), (4.0, -9.0)])
@pytest.mark.parametrize("h", [1e-7, 1e-5, 3e-4])
def test_a_stage_solves_for_the_sliding_velocity(start, h):
    constants = np.array([5e4, 15.0, 0.35, 0.0, 0.0, 0.02, 0.0])
    inner = np.array([[20.0, 1.5], [1.5, 23.0]])
    f0, f1, x0, x1 = solve_sliding(*start, h, inner, 800.0, constants)
    f = np.array([f0, f1])
    np.testing.assert_allclose([x0, x1], np.array(start) + h * inner @ f, rtol=0, atol=1e-13)
    speed = np.hypot(x0, x1)
    limit = 0.35 * 800.0 * speed / np.hypot(speed, 0.02)
    assert np.hypot(f0, f1) == pytest.approx(limit, rel=1e-12, abs=1e-12)
    assert friction_at(x0, x1, -5.0, constants)[:2] == (0.0, 0.0)


@pytest.mark.parametrize(
    "change",
    [{}, {"incidence_deg": 25.0, "point": "4"}, {"support": "grip", "grip_kind": "torsional"}],
    ids=["centre", "sliding", "hand"],
)
def test_order_of_convergence(change):
    """Fixed steps, halved twice: the error falls by 2^4 each time, stiff friction and all."""
    base = Scenario(after=0.003, approach_time=0.0, audit=False, **change)
    case = resolve(base)
    compiled = CompiledImpact(make_impact_diagram(case))
    reference = compiled.run(with_steps(case, 5e-7), every_sample=False).state[-1]
    errors = []
    for step in (2e-5, 1e-5, 5e-6):
        state = compiled.run(with_steps(case, step), every_sample=False).state[-1]
        errors.append(np.max(np.abs(state - reference)))
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert orders[-1] > 3.5
    assert errors[-1] < 1e-5


def with_steps(case, step):
    fixed = IntegratorSettings(maximum_step=step, error_control=False)
    return dataclasses.replace(
        case, scenario=dataclasses.replace(case.scenario, integrator=fixed, engine="compiled")
    )


def test_the_next_step_goes_by_two_errors():
    """DOPRI5's control, with its 0.04: 0.9 used^(0.03 - 1 / order) before^0.04."""
    assert longer(1.0, 1.0, 5.0, False) == 0.9
    assert longer(0.3, 0.02, 5.0, False) == pytest.approx(0.9 * 0.3**-0.17 * 0.02**0.04)
    assert longer(0.01, 1.0, 4.0, True) == 1.0
    assert longer(0.0, 1.0, 5.0, False) == longer(1e-9, 1.0, 5.0, False) == 5.0


def test_few_steps_are_refused_near_the_border_of_stability():
    """Six slopes a step, and some for events; 7.2 without the last error."""
    case = resolve(
        Scenario(
            support="grip",
            grip="hand_medium",
            grip_kind="hand",
            approach_time=0.0,
            overrides={"racket.frame.segments": 6},
        )
    )
    compiled = CompiledImpact(make_impact_diagram(case))
    samples = compiled.samples(case, compiled.start(case))
    assert samples.evaluations < 6.6 * samples.steps

"""Whole impacts: conservation, convergence, symmetry, re-use, warnings."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from drake_racket import InputError, IntegratorSettings, Scenario, make_impact_diagram, simulate
from tests.conftest import BEDS, free_parameters
from tests.oracles.free_impact import simulate as oracle_impact
from tests.oracles.free_racket import FreeRacketState

SUPPORTS = ("free", "clamped_head", "clamped_handle")
TIGHT = IntegratorSettings(accuracy=1e-7, maximum_step=2e-5)


AIMS = (5, 0.0), (1, 0.0), (6, 40.0)  # point, incidence


@pytest.mark.parametrize(
    ("support", "point", "incidence"),
    [
        pytest.param(support, *aim, marks=[pytest.mark.slow] if i != j else [])
        for i, support in enumerate(SUPPORTS)
        for j, aim in enumerate(AIMS)
    ],
)
def test_tight_settings_close_energy_and_momentum(support, point, incidence):
    scenario = Scenario(
        support=support,
        point=point,
        incidence_deg=incidence,
        azimuth_deg=70.0,
        after=0.008,
        integrator=TIGHT,
    )
    result = simulate(scenario, history=False)
    assert result.energy_error < 1e-6
    assert result.momentum_error < 1e-10
    if support == "free":
        assert result.angular_momentum_error < 1e-9
    assert result.warnings == []


def test_reaction_at_the_string_mass_is_a_couple_and_the_audit_says_so():
    """Two forces on different points: linear momentum holds, angular momentum cannot."""
    scenario = Scenario(point=4, incidence_deg=40.0, after=0.006, reaction_point="string_mass")
    result = simulate(scenario, history=False)
    assert result.momentum_error < 1e-6
    assert result.angular_momentum_error > 1e-3
    assert abs(result.balance.couple) > 1e-3 * 18.0
    assert result.energy_error < 1e-4  # closes only because the couple is metered
    assert any("couple" in warning for warning in result.warnings)


@pytest.mark.parametrize("case", [0, 1, *(pytest.param(i, marks=pytest.mark.slow) for i in (2, 3))])
def test_defaults_are_within_1e_4_of_the_converged_value(case):
    _check_defaults(BEDS[case % 4], SUPPORTS[case % 3], 1 + (5 * case) % 9)


@pytest.mark.slow
@pytest.mark.parametrize("point", [1, 2, 5, 6])
def test_defaults_at_points_of_each_kind_and_every_bed(bed, point):
    # corner, edges and centre; each bed meets every support
    _check_defaults(bed, SUPPORTS[(BEDS.index(bed) + point) % 3], point)


@pytest.mark.exhaustive
@pytest.mark.parametrize("support", SUPPORTS)
@pytest.mark.parametrize("point", range(1, 10))
def test_defaults_in_every_case(bed, support, point):
    _check_defaults(bed, support, point)


def _check_defaults(bed, support, point):
    scenario = Scenario(racket=bed[0], tension=bed[1], support=support, point=point)
    system = make_impact_diagram(scenario)
    default = simulate(scenario, system, history=False)
    tight = dataclasses.replace(
        scenario,
        after=0.007,
        integrator=IntegratorSettings(accuracy=1e-6, maximum_step=5e-5),
    )
    converged = simulate(tight, system, history=False).rebound_velocity
    error = np.linalg.norm(default.rebound_velocity - converged) / np.linalg.norm(converged)
    assert error < 1e-4
    assert default.energy_error < 1e-4
    assert default.contact_time is not None


@pytest.mark.parametrize(("scheme", "order"), [("runge_kutta2", 2), ("runge_kutta3", 3)])
def test_convergence_order(scheme, order):
    """Fixed steps from touch to a time within contact: no event, no kink, no friction.

    The time is one at which the leading error term is not just changing its sign.
    """
    scenario = Scenario(support="clamped_head", approach_time=0.0, after=0.003, audit=False)
    system = make_impact_diagram(scenario)

    def speed(step, scheme=scheme):
        settings = IntegratorSettings(scheme, maximum_step=step, error_control=False)
        case = dataclasses.replace(scenario, integrator=settings)
        return simulate(case, system, history=False).rebound_velocity[2]

    steps = [4e-5, 2e-5, 1e-5]
    exact = speed(1e-6, "runge_kutta3")
    errors = [abs(speed(h) - exact) for h in steps]
    slopes = np.diff(np.log(errors)) / np.diff(np.log(steps))
    assert slopes[-1] == pytest.approx(order, abs=0.25)


@pytest.mark.parametrize("point", [5, 3])
def test_free_rebound_equals_the_oracle(point):
    """The oracle's DOP853 on its own equations, started at touch, frictionless."""
    params = free_parameters("tour", "low", point, 25.0, "velocity", "ball")
    params = dataclasses.replace(params, mu=0.0)
    x, y = params.gsc + params.grid_xy[point - 1, 0], params.grid_xy[point - 1, 1]
    start = FreeRacketState(
        R_WH=np.eye(3),
        p_WHo=np.zeros(3),
        theta_z=0.0,
        theta_y=0.0,
        z=np.zeros(9),
        p_WQ=np.array([params.handle_length + x, y, 0.0]),
        w_WH=np.zeros(3),
        v_WHo=np.zeros(3),
        theta_z_dot=0.0,
        theta_y_dot=0.0,
        z_dot=np.zeros(9),
        v_WQ=np.array([0.0, 0.0, -25.0]),
        in_contact=True,
    )
    expected = oracle_impact(params, start, 0.01, rtol=1e-9, atol=1e-11)
    assert expected.released
    scenario = Scenario(point=point, approach_time=0.0, after=0.007, integrator=TIGHT, audit=False)
    system = make_impact_diagram(scenario)
    rebound = _without_friction(system, scenario)
    assert rebound == pytest.approx(expected.final.v_WQ, abs=2e-6)


def _without_friction(system, scenario):
    """The ball's velocity after a run with mu = 0, set in the Context as a study would."""
    from pydrake.systems.analysis import Simulator

    from drake_racket import BallContact, configure_integrator

    contact = system.impact.contact
    root = system.create_context(scenario)
    context = contact.GetMyMutableContextFromRoot(root)
    context.get_mutable_numeric_parameter(BallContact.FRICTION).SetFromVector(np.zeros(9))
    simulator = Simulator(system.diagram, root)
    configure_integrator(simulator, scenario.integrator)
    simulator.AdvanceTo(scenario.after)
    plant = system.plant
    context = plant.GetMyContextFromRoot(simulator.get_context())
    return system.impact.ball.body.EvalSpatialVelocityInWorld(context).translational()


def test_left_and_right_mirror_each_other():
    left, right = (
        simulate(Scenario(point=p, azimuth_deg=a, incidence_deg=30.0, after=0.006), history=False)
        for p, a in ((1, 90.0), (3, -90.0))
    )
    mirror = np.array([1.0, -1.0, 1.0])
    assert right.rebound_velocity == pytest.approx(mirror * left.rebound_velocity, abs=1e-9)
    spin = np.array([-1.0, 1.0, -1.0])
    assert right.racket_angular_velocity == pytest.approx(
        spin * left.racket_angular_velocity, abs=1e-7
    )


def test_one_diagram_serves_many_cases_in_any_order_bit_for_bit():
    base = Scenario(after=0.005)
    cases = [
        base,
        dataclasses.replace(base, point="7", speed=30.0),
        dataclasses.replace(base, tension="high", incidence_deg=20.0),
    ]
    system = make_impact_diagram(base)
    forward = [simulate(c, system, history=False) for c in cases]
    backward = [simulate(c, system, history=False) for c in reversed(cases)][::-1]
    fresh = [simulate(c, history=False) for c in cases]
    for a, b, c in zip(forward, backward, fresh, strict=True):
        assert np.array_equal(a.rebound_velocity, b.rebound_velocity)
        assert np.array_equal(a.rebound_velocity, c.rebound_velocity)
        assert (a.steps, a.evaluations, a.energy_error) == (c.steps, c.evaluations, c.energy_error)


def test_another_topology_needs_another_diagram():
    system = make_impact_diagram(Scenario())
    for other in (Scenario(racket="recreational"), Scenario(support="clamped_head")):
        with pytest.raises(InputError, match="topology"):
            simulate(other, system)


def _speeds(base: Scenario, step: float, points: range | tuple[int, ...]) -> np.ndarray:
    """Rebound speeds at `points`; touch falls 0.3 of a step after one of a discrete plant's."""
    base = dataclasses.replace(base, audit=False, time_step=step, approach_time=5e-4 + 0.3 * step)
    system = make_impact_diagram(base)
    results = [
        simulate(dataclasses.replace(base, point=str(p)), system, history=False) for p in points
    ]
    return np.array([np.linalg.norm(r.rebound_velocity) for r in results])


@pytest.mark.parametrize("incidence", [pytest.param(0.0, marks=pytest.mark.slow), 17.0])
def test_a_discrete_plant_agrees(incidence):
    """Rebound speed within 0.1 % with a step of 1e-5 s, at every kind of point of a free racket."""
    base = Scenario(after=0.006, incidence_deg=incidence)
    points = (1, 2, 4, 5, 7, 8)
    np.testing.assert_allclose(_speeds(base, 1e-5, points), _speeds(base, 0.0, points), rtol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("racket", "tension", "support"),
    [
        ("tour", "high", "free"),
        ("tour", "low", "clamped_head"),
        ("recreational", "high", "clamped_handle"),
    ],
)
def test_a_discrete_plant_agrees_everywhere(racket, tension, support):
    _check_discrete(racket, tension, support)


@pytest.mark.exhaustive
@pytest.mark.parametrize("support", SUPPORTS)
def test_a_discrete_plant_agrees_in_every_case(bed, support):
    _check_discrete(*bed, support)


def _check_discrete(racket, tension, support):
    base = Scenario(racket=racket, tension=tension, support=support, after=0.007, speed=28.0)
    points = range(1, 10)
    np.testing.assert_allclose(_speeds(base, 1e-5, points), _speeds(base, 0.0, points), rtol=1e-3)


@pytest.mark.parametrize("support", ["free", "clamped_head"])
def test_a_discrete_result_does_not_hang_on_the_simulator_s_steps(support):
    """The audit's meter, and pieces of an AdvanceTo, make steps between those of the plant."""
    base = Scenario(support=support, time_step=1e-5, approach_time=1.03e-4, after=0.006)
    audited = simulate(base, history=False)
    plain = dataclasses.replace(base, audit=False)
    system = make_impact_diagram(plain)
    alone = simulate(plain, system, history=False)
    np.testing.assert_allclose(audited.rebound_velocity, alone.rebound_velocity, rtol=1e-12)
    assert audited.touch_time == alone.touch_time
    simulator = Simulator(system.diagram, system.create_context(plain))
    simulator.Initialize()
    for time in np.arange(0.0, base.approach_time + base.after, 3.7e-6):
        simulator.AdvanceTo(time)
    ball = system.impact.ball.body
    context = system.plant.GetMyContextFromRoot(simulator.get_context())
    velocity = ball.EvalSpatialVelocityInWorld(context).translational()
    np.testing.assert_allclose(velocity, alone.rebound_velocity, rtol=1e-12, atol=1e-12)


def test_a_discrete_plant_s_impulse_is_what_the_ball_receives():
    base = Scenario(support="clamped_head", time_step=1e-5, after=0.006, incidence_deg=20.0)
    for approach_time in (1.01e-4, 1.06e-4, 0.0):
        scenario = dataclasses.replace(base, approach_time=approach_time)
        assert simulate(scenario, history=False).momentum_error < 1e-12


@pytest.mark.slow
def test_a_discrete_contact_is_of_second_order():
    base = Scenario(support="clamped_head", after=0.0065, speed=28.0)
    tight = dataclasses.replace(base, integrator=TIGHT)
    exact = _speeds(tight, 0.0, (2, 8))
    errors = {h: np.abs(_speeds(base, h, (2, 8)) / exact - 1.0) for h in (4e-5, 2e-5, 1e-5)}
    assert np.all(errors[1e-5] < 2e-5)
    for coarse, fine in ((4e-5, 2e-5), (2e-5, 1e-5)):
        assert np.all(errors[coarse] > 2.8 * errors[fine])


@pytest.mark.parametrize("lag", [0.01, 0.5, 0.99])
def test_a_discrete_result_does_not_hang_on_when_the_touch_falls(lag):
    base = Scenario(support="clamped_head", audit=False, time_step=1e-5, after=0.0065, speed=28.0)
    early = dataclasses.replace(base, approach_time=5e-4 + 1e-5 * lag)
    late = dataclasses.replace(base, approach_time=5e-4 + 0.3e-5)
    a, b = (simulate(c, history=False) for c in (early, late))
    assert a.rebound_velocity[2] == pytest.approx(b.rebound_velocity[2], rel=2e-5)


def test_result_is_consistent():
    result = simulate(Scenario(speed=28.0, incidence_deg=25.0, azimuth_deg=30.0, after=0.02))
    history = result.history
    assert result.approach_velocity == pytest.approx(
        28.0
        * np.array(
            [
                math.sin(math.radians(25)) * math.cos(math.radians(30)),
                math.sin(math.radians(25)) * math.sin(math.radians(30)),
                -math.cos(math.radians(25)),
            ]
        )
    )
    assert result.apparent_restitution == pytest.approx(
        -result.rebound_velocity[2] / result.approach_velocity[2]
    )
    tangential = np.hypot(*result.rebound_velocity[:2])
    assert math.tan(result.rebound_angle) == pytest.approx(tangential / result.rebound_velocity[2])
    assert result.impulse == pytest.approx(result.balance.impulse_on_ball, rel=1e-9)
    assert result.peak_normal_force == pytest.approx(float(history["normal_force"].max()), rel=1e-3)
    deflection = float(np.abs(history["string_deflection"]).max())
    assert result.peak_string_deflection == pytest.approx(deflection, rel=1e-3)
    assert history["time"].values[0] == pytest.approx(-0.001, abs=1e-8)
    assert history["normal_force"].sel(time=0.0, method="nearest") > 100.0  # jumps at touch
    assert np.all(np.diff(history["time"]) > 0.0)
    assert np.all(history["string_tension"] >= 648.2 - 1e-9)
    for variable in history.data_vars.values():
        assert variable.attrs["units"]
        assert variable.attrs["long_name"]


def test_impulse_is_the_integral_of_the_logged_force():
    """The head is clamped, so that the normal keeps its direction."""
    result = simulate(Scenario(support="clamped_head", after=0.007))
    logged = np.trapezoid(result.history["normal_force"], result.history["time"])
    assert logged == pytest.approx(result.impulse[2], rel=1e-4)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"speed": 10.0}, "outside the identified"),
        ({"speed": 40.0}, "outside the identified"),
        ({"after": 0.002}, "ended in contact"),
    ],
)
def test_warnings(changes, text):
    result = simulate(Scenario(**({"after": 0.006} | changes)), history=False)
    assert any(text in warning for warning in result.warnings)
    assert (result.contact_time is None) == ("contact" in text)


def test_gravity_keeps_the_energy_balance():
    scenario = Scenario(gravity=[0.0, -9.81, -3.0], after=0.02)
    result = simulate(scenario, history=False)
    assert result.energy_error < 1e-4
    assert abs(result.balance.gravity) > 0.0


def test_string_damping_is_metered(tmp_path):
    from drake_racket.io.shipped import data_directory

    text = (data_directory() / "tour_low.yaml").read_text()
    path = tmp_path / "damped.yaml"
    path.write_text(text.replace("damping: {value: 0.0", "damping: {value: 5.0"))
    result = simulate(Scenario(racket=str(path), after=0.02), history=False)
    assert result.balance.lost_strings > 0.0
    assert result.energy_error < 1e-4
    assert result.balance.strings < simulate(Scenario(after=0.02), history=False).balance.strings


def test_restitution_is_realistic_and_falls_with_speed():
    """Not a fit: the centre of a free racket near 0.4, the throat higher, the tip lower."""
    system = make_impact_diagram(Scenario())
    centre, throat, tip = (
        simulate(Scenario(point=p, after=0.006), system, history=False).apparent_restitution
        for p in (5, 8, 2)
    )
    assert 0.35 < centre < 0.50
    assert throat > centre > tip > 0.0
    slow, fast = (
        simulate(Scenario(speed=v, after=0.006), system, history=False).apparent_restitution
        for v in (18.0, 33.0)
    )
    assert slow > fast


@pytest.mark.parametrize(
    "changes",
    [{"gravity": 5}, {"racket": 5}, {"integrator": None}, {"audit": "yes"}, {"speed": "fast"},
     {"racket": True}, {"racket": ["tour"]}],
)  # fmt: skip
def test_wrong_types_in_python_are_input_errors(changes):
    (key,) = changes
    with pytest.raises(InputError, match=key) as error:
        simulate(Scenario(**changes))
    if changes[key] in (True, ["tour"]):
        assert "allowed: a text" in str(error.value)


def test_a_scheme_without_error_estimate_needs_fixed_steps():
    settings = IntegratorSettings("runge_kutta2")
    with pytest.raises(InputError, match="error_control"):
        simulate(Scenario(integrator=settings))

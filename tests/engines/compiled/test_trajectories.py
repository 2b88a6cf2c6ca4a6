"""The compiled engine's trajectories, and the results read from them, against Drake's."""

from __future__ import annotations

import dataclasses
import itertools
import os
import subprocess
import sys

import numpy as np
import pytest

from drake_racket import (
    InputError,
    IntegratorSettings,
    Scenario,
    make_impact_diagram,
    resolve,
    run_drake,
    simulate,
)
from drake_racket.engines.compiled.dynamics.events import dips
from drake_racket.engines.compiled.engine import CompiledImpact
from drake_racket.engines.compiled.integrate import first_event
from drake_racket.laws.contact import CONTACT, FREE, PASSED
from drake_racket.laws.phases import PHASE, SIZE
from drake_racket.results.impact import make_result
from tests.conftest import BEDS, ROOT

OBLIQUE = {"incidence_deg": 20.0, "azimuth_deg": 70.0, "gravity": (0.0, 0.0, -9.81)}
CASES = {
    "free": {},
    "clamped": {"support": "clamped_head", "point": "3"},
    "hand": {"support": "grip"},
    "hand, weld": {"support": "grip", "grip_kind": "weld"},
    "limb, torsional": {"support": "limb", "grip_kind": "torsional"},
}
OF_AN_ENGINE = {"steps", "evaluations", "energy_error", "momentum_error", "angular_momentum_error"}


@pytest.fixture(scope="module", params=CASES)
def both(request):
    """One impact in both engines, in one Diagram."""
    case = resolve(Scenario(**OBLIQUE, **CASES[request.param], after=0.005))
    system = make_impact_diagram(case)
    found = CompiledImpact(system).run(case)
    return case, make_result(case, run_drake(case, system), history=True), found


def test_results_are_drakes(both):
    case, drake, trajectory = both
    result = make_result(case, trajectory, history=True)
    assert trajectory.engine == "compiled"
    for name in (f.name for f in dataclasses.fields(drake)):
        ours, theirs = getattr(result, name), getattr(drake, name)
        if isinstance(theirs, (float, np.ndarray)) and name not in OF_AN_ENGINE:
            scale = max(1e-3, float(np.max(np.abs(theirs))))
            # of the handle the peak is where friction turns round, within a step of either engine
            near = 1e-2 if name == "peak_handle_acceleration" else 2e-3
            np.testing.assert_allclose(ours, theirs, rtol=0, atol=near * scale, err_msg=name)
    assert np.max(np.abs(result.rebound_velocity - drake.rebound_velocity)) < 5e-5
    assert (result.point, result.touches, result.warnings) == (
        drake.point,
        drake.touches,
        drake.warnings,
    )
    assert result.energy_error < 1e-4
    for field in dataclasses.fields(drake.balance):
        ours, theirs = getattr(result.balance, field.name), getattr(drake.balance, field.name)
        np.testing.assert_allclose(ours, theirs, rtol=1e-4, atol=2e-3, err_msg=field.name)


def test_histories_have_the_same_variables_and_ends(both):
    case, drake, trajectory = both
    result = make_result(case, trajectory, history=True)
    ours, theirs = result.history, drake.history
    assert list(ours.variables) == list(theirs.variables)
    for name, variable in theirs.data_vars.items():
        if variable.dims[:1] != ("time",) or variable.dtype.kind != "f":
            continue
        size = float(np.nanmax(np.abs(variable.to_numpy()))) + 1e-9
        for at in (0, -1):
            np.testing.assert_allclose(
                ours[name].to_numpy()[at],
                variable.to_numpy()[at],
                rtol=0,
                atol=2e-3 * size,
                err_msg=name,
            )


def test_without_a_history_the_numbers_are_the_same(both):
    case, _, trajectory = both
    system = make_impact_diagram(case)
    short = CompiledImpact(system).run(case, every_sample=False)
    assert np.array_equal(short.state, trajectory.state)
    assert np.array_equal(short.contact, trajectory.contact)
    assert short.motion.samples.tolist() == [0, len(trajectory) - 1]
    assert np.array_equal(short.motion.poses[-1], trajectory.motion.poses[-1])


TIGHT = IntegratorSettings("runge_kutta5", maximum_step=2e-6, error_control=False)


def tight(**changes):
    """Rebound velocities in both engines, far below their default errors."""
    scenario = Scenario(**({"after": 0.0065, "approach_time": 0.0, "audit": False} | changes))
    system = make_impact_diagram(scenario)
    fine = dataclasses.replace(scenario, integrator=TIGHT)
    drake = run_drake(resolve(fine), system, every_sample=False)
    exact = dataclasses.replace(scenario, integrator=IntegratorSettings(accuracy=1e-9))
    ours = CompiledImpact(system).run(resolve(exact), every_sample=False)
    return (
        make_result(resolve(fine), drake, history=False),
        make_result(resolve(exact), ours, history=False),
    )


def distance(**changes):
    drake, ours = tight(**changes)
    return float(np.max(np.abs(drake.rebound_velocity - ours.rebound_velocity)))


def test_a_rebound_at_tight_settings():
    assert distance(point="4", incidence_deg=20.0, azimuth_deg=70.0) < 1e-9


GRID = list(itertools.product(BEDS, ("free", "clamped_head", "grip"), (0.0, 17.0, 60.0)))


@pytest.mark.parametrize(
    ("bed", "support", "incidence"),
    [
        pytest.param(*case, marks=pytest.mark.exhaustive if i % 7 else pytest.mark.slow)
        for i, case in enumerate(GRID)
    ],
    ids=lambda value: "-".join(value) if isinstance(value, tuple) else str(value),
)
def test_rebounds_at_tight_settings(bed, support, incidence):
    place = {"point": "5", "offset_x": -0.02, "offset_y": 0.01}
    name = {"racket": bed[0], "tension": bed[1], "support": support, "incidence_deg": incidence}
    assert distance(**name, **place) < 1e-9


@pytest.mark.exhaustive
@pytest.mark.parametrize(
    ("support", "speed"), [("clamped_head", 18.0), ("clamped_head", 33.0), ("free", 25.0)]
)
@pytest.mark.parametrize("bed", BEDS, ids="-".join)
def test_default_impacts(bed, support, speed):
    """All points of all beds, to 1e-6 m/s, with error control finer than by default."""
    for point in range(1, 10):
        scenario = Scenario(
            racket=bed[0],
            tension=bed[1],
            support=support,
            speed=speed,
            point=str(point),
            after=0.008,
            audit=False,
            integrator=IntegratorSettings(accuracy=1e-6, maximum_step=5e-5),
        )
        drake = simulate(scenario, history=False, engine="drake")
        ours = simulate(scenario, history=False, engine="compiled")
        np.testing.assert_allclose(
            ours.rebound_velocity, drake.rebound_velocity, rtol=0, atol=1e-6, err_msg=str(point)
        )


@pytest.mark.parametrize("support", ["free", "limb"])
def test_energy_and_momentum_close_at_tight_settings(support):
    settings = IntegratorSettings(accuracy=1e-7)
    scenario = Scenario(
        support=support, incidence_deg=30.0, point="1", after=0.01, integrator=settings
    )
    result = simulate(scenario, engine="compiled")
    assert result.energy_error < 1e-6
    assert result.momentum_error < 1e-10
    if support == "free":
        assert result.angular_momentum_error < 1e-10


def test_a_ball_beside_the_strings_passes_by():
    case = resolve(Scenario(point="auto", offset_y=0.1, after=0.004))
    system = make_impact_diagram(case)
    compiled = CompiledImpact(system)
    start = compiled.start(case)
    ball = system.impact.ball.body
    start.y[ball.floating_positions_start() + 5] += 0.03  # beyond the rim
    trajectory = compiled.run_from(case, start)
    assert trajectory.record[-1, PHASE] == PASSED
    assert trajectory.contact[:, 4].max() == 0.0
    result = make_result(case, trajectory, history=False)
    assert "the ball did not touch the strings" in result.warnings


def test_a_run_may_start_at_touch_and_end_in_contact():
    scenario = Scenario(approach_time=0.0, after=0.002)
    result = simulate(scenario, engine="compiled", history=False)
    assert result.touch_time == 0.0
    assert result.contact_time is None
    assert "ended in contact" in result.warnings[-1]


def test_phases_follow_drakes():
    """Touch, release and leaving come at the same times."""
    case = resolve(Scenario(after=0.006, integrator=IntegratorSettings(accuracy=1e-6)))
    system = make_impact_diagram(case)
    changes = []
    for trajectory in (CompiledImpact(system).run(case), run_drake(case, system)):
        phase = trajectory.record[:, PHASE]
        at = np.flatnonzero(np.diff(phase)) + 1
        changes.append((phase[at].tolist(), trajectory.time[at]))
    assert changes[0][0] == changes[1][0]
    assert changes[0][0][-1] == FREE
    np.testing.assert_allclose(changes[0][1], changes[1][1], rtol=0, atol=2e-7)


def test_a_graze_is_not_stepped_over():
    """A string mass swings up to a ball at rest: the gap closes and opens within one step."""
    settings = IntegratorSettings(maximum_step=2e-4, error_control=False)
    scenario = Scenario(support="clamped_head", after=0.0012, audit=False, integrator=settings)
    case = resolve(dataclasses.replace(scenario, approach_time=0.0, engine="compiled"))
    system = make_impact_diagram(case)
    compiled = CompiledImpact(system)
    start = compiled.start(case)
    nq, ball = system.plant.num_positions(), system.impact.ball.body
    mass = system.impact.racket.string_joints[4].velocity_start()
    height = ball.floating_positions_start() + 6
    start.y[nq:] = 0.0
    start.y[nq + mass] = 3.0
    start.y[height] += 1.0
    fine = dataclasses.replace(settings, maximum_step=1e-6)
    far = dataclasses.replace(case, scenario=dataclasses.replace(case.scenario, integrator=fine))
    heights = compiled.run_from(far, start).state[:, mass_position(system)]
    start.y[height] -= 1.0
    touched = []
    for below in (1e-6, 2e-6, 5e-6, 1e-5):
        near = dataclasses.replace(start, y=start.y.copy())
        near.y[height] += heights.max() - below
        touched.append(compiled.run_from(case, near).record[-1, -1])
    assert touched == [1.0, 1.0, 1.0, 1.0]


def test_the_first_of_several_events():
    """By straight lines: of a touch, a release and a leaving; and of what is left beside it."""
    records = np.zeros((4, SIZE))
    records[:, PHASE] = [FREE, CONTACT, PASSED, FREE]
    gaps = np.array([[2.0, 9.0, -1.0, 1.0], [-2.0, -1.0, 3.0, 0.5]])
    assert first_event(records, gaps, -1) == 2  # after 1/4 of the step; the touch after 1/2
    assert first_event(records, gaps, 2) == 0
    assert first_event(records, gaps[::-1], -1) == -1  # each the other way: none is an event
    assert first_event(records[3:], gaps[:, 3:], -1) == -1


def mass_position(system):
    return system.impact.racket.string_joints[4].position_start()


@pytest.mark.parametrize("height", [0.1, 0.4999, 0.5001, 2.0])
def test_a_parabola_dips_below_its_tangents(height):
    """Gap = height - t (1 - t) over one unit of time; its tangents meet at height - 1/2."""
    gaps, slopes = np.array([[height], [height]]), np.array([[-1.0], [1.0]])
    assert dips(gaps, slopes, 0, 1.0) == (height < 0.5)
    assert not dips(gaps, -slopes, 0, 1.0)


def test_fixed_steps_have_the_length_asked_for():
    settings = IntegratorSettings(maximum_step=5e-5, error_control=False)
    scenario = Scenario(approach_time=0.0, after=0.001, audit=False, integrator=settings)
    case = resolve(dataclasses.replace(scenario, engine="compiled"))
    trajectory = CompiledImpact(make_impact_diagram(case)).run(case)
    np.testing.assert_allclose(np.diff(trajectory.time), 5e-5, rtol=1e-9)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"time_step": 1e-5}, "engine: got 'compiled'; allowed: drake with a discrete plant"),
        ({"integrator": IntegratorSettings("runge_kutta5")}, "integrator.scheme: got"),
    ],
)
def test_what_only_drake_can_do_is_refused(changes, message):
    with pytest.raises(InputError, match=message):
        simulate(Scenario(**changes), engine="compiled")
    with pytest.raises(InputError, match="engine: got 'fast'; allowed: auto, drake, compiled"):
        simulate(Scenario(), engine="fast")


def test_torques_from_outside_are_refused():
    system = make_impact_diagram(Scenario(support="limb"), export_torques=True)
    with pytest.raises(InputError, match="joint torques from outside"):
        CompiledImpact(system)


@pytest.mark.slow
def test_the_same_without_the_compiler():
    """The same source as plain Python."""
    code = (
        "import numpy as np, drake_racket as dr\n"
        "s = dr.Scenario(approach_time=0.0, after=0.0008, incidence_deg=20.0)\n"
        "r = dr.simulate(s, engine='compiled', history=False)\n"
        "print(*(float(x).hex() for x in (*r.rebound_velocity, *r.racket_velocity)))\n"
    )
    found = []
    for off in ("0", "1"):
        environment = os.environ | {"NUMBA_DISABLE_JIT": off, "PYTHONPATH": str(ROOT)}
        done = subprocess.run(
            [sys.executable, "-c", code],
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        )
        found.append([float.fromhex(x) for x in done.stdout.split()])
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9, atol=1e-12)


def test_a_model_gives_each_case_its_own_numbers():
    """What a case stores in frame, strings and bodies does not depend on the case before it."""
    first = Scenario(after=0.006)
    changes = {
        "racket.throat_joint.out_of_plane_stiffness": 700.0,
        "racket.string_bed.initial_tension": 500.0,
        "racket.head.mass": 0.15,
    }
    case = resolve(dataclasses.replace(first, overrides=changes))
    used = CompiledImpact(make_impact_diagram(resolve(first)))
    used.run(resolve(first))
    again, fresh = used.run(case), CompiledImpact(make_impact_diagram(case)).run(case)
    assert np.array_equal(again.mechanism.frame.stiffness, fresh.mechanism.frame.stiffness)
    assert np.array_equal(again.mechanism.strings.constants, fresh.mechanism.strings.constants)
    assert np.array_equal(again.mechanism.bodies.mass, fresh.mechanism.bodies.mass)
    assert make_result(case, again, history=False).energy_error < 1e-4

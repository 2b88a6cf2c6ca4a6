"""What makes a run slow or unstable is said before it, by the number that does it."""

from __future__ import annotations

import math
import sys

import pytest

from drake_racket import IntegratorSettings, Scenario, SimulationError, cli, resolve, simulate
from drake_racket.cases.effort import SLOW, effort, rates, unstable

FIXED = IntegratorSettings(error_control=False)


def of(**changes):
    return resolve(Scenario(**changes))


def over(**changes):
    return of(overrides={key.replace("__", "."): value for key, value in changes.items()})


@pytest.mark.parametrize(
    ("case", "words"),
    [
        (of(after=2.0), ("200,000 steps", "2.001 s", "strings")),
        (over(racket__string_bed__mass=1e-6), ("racket.string_bed.mass 1e-06 kg", "rad/s")),
        (over(ball__damping_low=1e6), ("the ball's damping", "N s/m")),
        (
            over(racket__throat_joint__out_of_plane_stiffness=1e13),
            ("out of plane stiffness 1e+13 N m/rad",),
        ),
        (over(racket__string_bed__damping=1e6), ("racket.string_bed.damping 1e+06",)),
    ],
)
def test_slow_cases_are_named(case, words):
    text = effort(case).slow()
    assert all(word in text for word in words), text


@pytest.mark.parametrize("case", [of(), of(support="grip"), of(after=0.2), of(time_step=2e-5)])
def test_ordinary_cases_are_not(case):
    assert effort(case).slow() == unstable(case) == ""
    assert effort(case).steps < SLOW


def test_the_estimate_is_of_the_right_size():
    """Against the integrator's own count, within a factor of 5, over more than a decade."""
    for mass in (0.0149, 1e-3):
        case = resolve(Scenario(after=0.002, overrides={"racket.string_bed.mass": mass}))
        steps = simulate(case, history=False).steps
        assert 0.2 < effort(case).steps / steps < 5.0, mass


def rate(case, words):
    (found,) = [each for each in rates(case) if words in each.cause]
    return found


def test_rates_by_hand():
    """From the numbers of the file, of the tour racket in a tight hand, each its own way."""
    case = of(support="grip", grip="tight", overrides={"racket.string_bed.damping": 3.0})
    m = 0.0149 / 9.0
    assert case.ball.stiffness_growth.value > 0.0
    assert rate(case, "ball's stiffness").value ** 2 == pytest.approx(
        case.ball.stiffness_low.value * (1.0 + case.ball.stiffness_growth.value) / m
    )
    assert rate(case, "ball's damping").value == pytest.approx(
        case.ball.damping_low.value * (1.0 + case.ball.damping_growth.value) / m
    )
    springs = 4.0 * (648.2 / 0.0685 + 791e3 * 1.4 * 0.04)
    assert rate(case, "648 N").value == pytest.approx(math.sqrt(springs / m))
    assert rate(case, "string_bed.damping").value == pytest.approx(4.0 * 0.04 * 3.0 / m)
    # about the throat, 0.356 m from the butt: out of plane turns about y (transverse)
    handle = 0.00172 + 0.1335 * (0.356 - 0.11365) ** 2
    head = 0.00331 + 0.1605 * 0.15032**2
    both = 1.0 / (1.0 / handle + 1.0 / head)
    joint = {j.name: j for j in case.racket.frame_joints()}["out_of_plane"]
    assert rate(case, "out of plane stiffness").value ** 2 == pytest.approx(joint.stiffness / both)
    assert rate(case, "out of plane damping").value == pytest.approx(joint.damping / both)
    mass, along = 0.1335 + 0.1605 + 0.0149, 0.00004 + 0.00137
    force, turn = case.grip.force_stiffness.value, case.grip.torque_stiffness.value
    assert rate(case, "grip.force_stiffness").value ** 2 == pytest.approx(max(force) / mass)
    assert rate(case, "torque_stiffness.x").value ** 2 == pytest.approx(turn[0] / along)
    assert rate(case, "torque_stiffness.z").value ** 2 == pytest.approx(turn[2] / (mass * 0.356**2))
    damping = case.grip.torque_damping.value
    assert rate(case, "torque_damping.x").value == pytest.approx(damping[0] / along)
    assert rate(case, "grip.force_damping").value == pytest.approx(
        max(case.grip.force_damping.value) / mass
    )
    excited = {each.cause for each in rates(case) if each.excited}
    assert excited == {rate(case, "648 N").cause, rate(case, "ball's stiffness").cause}


@pytest.mark.parametrize(
    ("changes", "held"),
    [
        ({}, 0),
        ({"support": "grip"}, 8),
        ({"support": "grip", "grip_kind": "torsional"}, 6),
        ({"support": "grip", "grip_kind": "weld"}, 0),
        ({"support": "clamped_handle"}, 0),
    ],
)
def test_only_what_is_there_counts(changes, held):
    assert len([each for each in rates(of(**changes)) if "grip." in each.cause]) == held


def test_steps_of_each_way_to_run():
    assert effort(of(after=0.009, time_step=1e-4)).steps == pytest.approx(100.0)
    fixed = IntegratorSettings(error_control=False, maximum_step=5e-5)
    assert effort(of(after=0.009, integrator=fixed)).steps == pytest.approx(200.0)
    assert effort(of(after=0.199)).steps == pytest.approx(
        max(2e4, 10.0 * 0.2 * rate(of(), "648 N").value)
    )
    assert effort(of(after=0.199)).seconds == pytest.approx(0.2)


def test_where_a_fixed_step_becomes_too_long():
    """At 1.5 rad of the fastest motion."""
    fastest = max(each.value for each in rates(of()))
    assert unstable(of(time_step=1.49 / fastest)) == ""
    assert "time_step" in unstable(of(time_step=1.51 / fastest))
    step = IntegratorSettings(error_control=False, maximum_step=1.51 / fastest)
    assert "integrator.maximum_step" in unstable(of(integrator=step))
    assert unstable(of(integrator=IntegratorSettings(maximum_step=2e-4))) == ""


@pytest.mark.parametrize(
    "changes",
    [
        {"integrator": IntegratorSettings(scheme="runge_kutta2", error_control=False)},
        {"time_step": 1e-3},
        {"time_step": 3e-4},
    ],
    ids=str,
)
def test_a_long_step_ends_in_words(changes):
    assert "unstable unless it is below" in unstable(of(**changes))
    with pytest.raises(SimulationError, match="unstable: shorter step") as caught:
        simulate(Scenario(after=0.006, **changes), history=False)
    assert "mass matrix" not in str(caught.value)


def test_a_fixed_step_that_does_not_blow_up_still_says_so():
    warnings = simulate(Scenario(after=0.006, integrator=FIXED), history=False).warnings
    assert any("unstable" in text and "integrator.maximum_step" in text for text in warnings)


def test_progress_of_a_run():
    seen = []
    simulate(Scenario(after=0.003), history=False, progress=seen.append)
    assert len(seen) >= 2
    assert [p.done for p in seen] == sorted(p.done for p in seen)
    assert {(p.task, p.total) for p in seen} == {("simulating", 4.0)}
    assert 0.0 < seen[-1].done <= 4.0


def test_a_slow_command_says_so_first(monkeypatch, capfd):
    """The first words on standard error come before the run."""

    class Stop(Exception):
        pass

    def stop(*arguments, **keywords):
        raise Stop

    import drake_racket.simulation

    monkeypatch.setattr(drake_racket.simulation, "simulate", stop)
    monkeypatch.setattr(sys, "argv", ["drake-racket", "impact", "--after", "2"])
    with pytest.raises(Stop):
        cli.main()
    assert "about 200,000 steps for 2.001 s" in capfd.readouterr().err

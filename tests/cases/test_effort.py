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
    """Against the integrator's own count, within a factor of 5, over two decades."""
    for mass in (0.0149, 1e-3, 2e-4):
        case = resolve(Scenario(after=0.003, overrides={"racket.string_bed.mass": mass}))
        steps = simulate(case, history=False).steps
        assert 0.2 < effort(case).steps / steps < 5.0, mass


def test_rates_by_hand():
    """The ball on a string mass: sqrt(kb / m), with kb at the higher speed."""
    case = of()
    ball, bed = case.ball, case.racket.string_bed
    kb = ball.stiffness_low.value * (1.0 + ball.stiffness_growth.value)
    wanted = math.sqrt(kb / (bed.mass.value / 9.0))
    assert any(rate.value == pytest.approx(wanted) for rate in rates(case))
    soft = resolve(Scenario(support="grip", grip="tight"))
    names = " ".join(rate.cause for rate in rates(soft))
    assert "grip.force_stiffness" in names
    assert "grip.torque_damping.z" in names


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

"""Where a run leaves what the model holds for, it says so; and what would close its balance."""

from __future__ import annotations

import pytest

from drake_racket import IntegratorSettings, Scenario, load_ball, simulate
from drake_racket.results.warnings import SECOND_ORDER


def warned(**changes) -> str:
    case = {"after": 0.004} | changes
    return "\n".join(simulate(Scenario(**case), history=True).warnings)


def test_an_ordinary_impact_has_none():
    assert warned(after=0.007) == warned(after=0.007, point="1") == ""


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"speed": 100.0}, "compressed by 57 mm of its radius of 34 mm"),
        ({"overrides": {"ball.stiffness_low": 1.0}}, "compressed by"),
        ({"offset_x": 0.14}, "reaches over the rim"),
        ({"point": "1", "offset_y": 0.025}, "reaches over the rim"),
        (
            {
                "overrides": {"racket.throat_joint.out_of_plane_stiffness": 300.0},
                "support": "clamped_handle",
                "point": "2",
                "after": 0.02,
            },
            "degrees at the throat",
        ),
        (
            {
                "overrides": {
                    "racket.handle.moi_frontal": 0.0272,
                    "racket.handle.moi_transverse": 0.0272,
                }
            },
            "more than a body of 0.1335 kg",
        ),
        ({"overrides": {"racket.head.moi_longitudinal": 0.003}}, "racket.head.moi_longitudinal"),
        ({"speed": 0.1, "after": 0.012}, "integrator.accuracy of 2e-05 or less closes it"),
    ],
    ids=str,
)
def test_a_run_beyond_the_model(changes, words):
    assert words in warned(**changes)


def test_what_is_said_to_close_a_slow_balls_balance_does():
    tight = IntegratorSettings(accuracy=2e-5)
    result = simulate(Scenario(speed=0.1, after=0.02, integrator=tight), history=False)
    assert result.energy_error < 1e-3


@pytest.mark.parametrize(("support", "speed"), [("free", 40.0), ("clamped_head", 10.0)])
def test_a_discrete_balance_is_of_second_order_within_the_bound_that_is_said(support, speed):
    errors = []
    for step in (4e-5, 2e-5):
        case = Scenario(support=support, speed=speed, time_step=step, after=0.007)
        result = simulate(case)
        assert result.energy_error < SECOND_ORDER * step**2
        errors.append(result.energy_error)
        initial = 0.5 * load_ball().mass.value * speed**2
        assert abs(result.balance.total() / initial - 1.0) < 0.25 * SECOND_ORDER * step**2
        assert abs(result.balance.lost_friction) < 0.01  # the ball comes along the normal
    assert 3.0 < errors[0] / errors[1] < 5.0
    if errors[1] > 1e-3:
        bound = f"second order in its step: up to {SECOND_ORDER * step**2:.1g} at 2e-05 s"
        assert bound in "\n".join(result.warnings)

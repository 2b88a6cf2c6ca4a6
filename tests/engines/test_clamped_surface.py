"""Batches of spinning balls on a clamped head, against the compiled engine of any plant."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from drake_racket import InputError, IntegratorSettings, Scenario, load_ball, load_racket, simulate
from drake_racket.engines import make_bed, run_spinning, spinning_impacts
from drake_racket.plant.contacts import surface_model

CASES = [
    {"incidence_deg": 40.0, "spin_rpm": -3820.0, "offset_x": 0.02, "offset_y": -0.03},
    {"incidence_deg": 17.0, "speed": 31.0, "azimuth_deg": 30.0},
    {"incidence_deg": 60.0, "spin_rpm": 2000.0, "offset_x": -0.1},
    {"offset_y": 0.09},
]
BASE = Scenario(
    contact="surface",
    support="clamped_head",
    after=0.012,
    approach_time=0.0,
    audit=False,
    integrator=IntegratorSettings(accuracy=1e-8),
)


def batch(cases, step=5e-6):
    racket, ball = load_racket(), load_ball()
    scenarios = [dataclasses.replace(BASE, **case) for case in cases]
    impacts = spinning_impacts(
        racket,
        ball,
        [(s.offset_x, s.offset_y) for s in scenarios],
        [s.ball_velocity() for s in scenarios],
        [s.ball_spin() for s in scenarios],
    )
    bed, model = make_bed(racket), surface_model(racket, ball)
    return run_spinning(bed, model, ball.mass.value, impacts, step=step)


def test_a_batch_is_the_compiled_engines():
    found = batch(CASES)
    assert found.ended.all()
    for i, case in enumerate(CASES):
        one = simulate(dataclasses.replace(BASE, **case), history=False, engine="compiled")
        np.testing.assert_allclose(found.velocities[i], one.rebound_velocity, rtol=0, atol=1e-7)
        np.testing.assert_allclose(found.spins[i], one.spin_after, rtol=0, atol=1e-5)
        assert found.contact_time[i] == pytest.approx(one.contact_time, abs=1e-9)
        share = found.sliding_time[i] / found.contact_time[i]
        assert share == pytest.approx(one.sliding_fraction, abs=1e-6)
        assert found.touches[i] == one.touches


def test_the_default_step_leaves_little():
    coarse, fine = batch(CASES, step=2e-5), batch(CASES)
    assert np.max(np.abs(coarse.velocities - fine.velocities)) < 1e-5
    assert np.max(np.abs(coarse.spins - fine.spins)) < 1e-3


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"places": np.array([[0.2, 0.0]])}, "places: got .*; allowed: places within the rim"),
        ({"velocities": np.array([[0.0, 0.0, 1.0]])}, "velocities: got 'z of 0 or more'"),
        ({"spins": np.zeros((2, 3))}, r"spins: got .*; allowed: shape \(1, 3\)"),
        ({"surfaces": np.full((1, 5), np.nan)}, "surfaces: got 'a number that is not finite'"),
    ],
)
def test_bad_batches_in_one_line(changes, text):
    racket, ball = load_racket(), load_ball()
    good = spinning_impacts(racket, ball, [[0.0, 0.0]], [[0.0, 0.0, -20.0]])
    bad = dataclasses.replace(good, **changes)
    model = surface_model(racket, ball)
    with pytest.raises(InputError, match=text):
        run_spinning(make_bed(racket), model, ball.mass.value, bad)
    with pytest.raises(InputError, match="step: got 1"):
        run_spinning(make_bed(racket), model, ball.mass.value, good, step=1.0)

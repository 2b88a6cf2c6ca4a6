"""Balls that spin, over incidence and friction: rig, limits of slipping, the section's numbers."""

from __future__ import annotations

import math
import sys
from dataclasses import replace

import numpy as np
import pytest
import xarray

from drake_racket.io.progress import Progress
from drake_racket.parameters.ball import load_ball
from drake_racket.parameters.overrides import apply_overrides
from drake_racket.rigs.spin import rigid_slip_limit, rolling_limit, slip_limit, spin_over_incidence
from drake_racket.validation.outcome import Plan
from drake_racket.validation.spin import TESTED, spin, spin_after


def test_spin_over_incidence_is_what_one_impact_gives():
    found = spin_over_incidence(spin_rpm=-3820.0, incidences=[40.0], frictions=[0.4325])
    one = found.isel(friction=0, incidence=0)
    assert float(one["spin"]) == pytest.approx(spin_after(TESTED, 0.4325), abs=0.05)
    assert one["spin"].attrs["units"] == "rpm"
    assert 0.0 < float(one["sliding"]) < 1.0
    angle = math.radians(float(one["angle"]))
    normal = float(one["speed"]) * math.cos(angle) / (25.0 * math.cos(math.radians(40.0)))
    assert float(one["restitution"]) == pytest.approx(normal)


def test_a_ball_that_slides_throughout_follows_friction_alone():
    """Then impulse and spin are mu times the normal impulse, whatever the shear."""
    found = spin_over_incidence(incidences=[70.0], frictions=[0.25]).isel(friction=0, incidence=0)
    assert float(found["sliding"]) == pytest.approx(1.0, abs=1e-12)
    v = 25.0 * np.array([math.sin(math.radians(70.0)), math.cos(math.radians(70.0))])
    angle = math.radians(float(found["angle"]))
    after = float(found["speed"]) * np.array([math.sin(angle), math.cos(angle)])
    assert v[0] - after[0] == pytest.approx(0.25 * (v[1] + after[1]), rel=1e-9)
    # with the lever R - chi x: between R and R less a few millimetres
    ball = load_ball()
    gained = float(found["spin"]) * math.pi / 30.0 * 0.55 * ball.radius.value**2
    lever = gained / (v[0] - after[0])
    assert 0.85 * ball.radius.value < lever < ball.radius.value


def test_slip_limits_grow_with_friction_and_are_near_the_rigid_ones():
    limits = [slip_limit(mu, within=0.5) for mu in (0.25, 0.35)]
    rigid = [rigid_slip_limit(mu, 0.88, 0.55) for mu in (0.25, 0.35)]
    assert limits[0] + 5.0 < limits[1]
    assert np.max(np.abs(np.subtract(limits, rigid))) < 5.0
    assert rigid_slip_limit(0.4, 1.0, 2.0 / 3.0) == pytest.approx(math.degrees(math.atan(2.0)))
    # before it has come to roll the ball leaves from Cross's angle on, but for its flattening
    ball = apply_overrides(load_ball(), {"ball.surface.flattening": 0.0})
    at = rolling_limit(0.35, ball=ball, within=0.2)
    near = spin_over_incidence(ball=ball, incidences=[at], frictions=[0.35])
    e = float(near["restitution"][0, 0])
    assert at == pytest.approx(rigid_slip_limit(0.35, e, 0.55), abs=0.4)
    assert limits[1] < rolling_limit(0.35, within=0.2) < at
    # the limit is one: just below it the ball grips, just above it does not
    near = spin_over_incidence(incidences=[limits[0] - 0.5, limits[0] + 0.5], frictions=[0.25])
    below, above = near["sliding"].to_numpy()[0]
    assert below < 1.0 - 1e-9 < above


@pytest.mark.parametrize("limit", [20.0, 30.001, 47.3, 61.2, 79.9, 90.0])
@pytest.mark.parametrize("within", [0.05, 2.0])
def test_a_limit_is_found_wherever_it_is(monkeypatch, limit, within):
    """In the middle of an interval as narrow as was asked, between 30 and 80 degrees."""
    asked = []

    def made(racket, ball, *, speed, incidences, frictions):
        asked.append((speed, frictions, incidences[0], incidences[-1]))
        beyond = np.array([incidences]) >= limit
        sliding = np.where(beyond, 1.0, 0.98)
        data = {"sliding": sliding, "surface_speed": np.where(beyond, 1.0, -1.0)}
        return xarray.Dataset({k: (("friction", "incidence"), v) for k, v in data.items()})

    monkeypatch.setattr(sys.modules[slip_limit.__module__], "spin_over_incidence", made)
    for find in (slip_limit, rolling_limit):
        asked.clear()
        found = find(0.3, speed=31.0, within=within)
        assert asked[0] == (31.0, [0.3], 30.0, 80.0)
        low, high = asked[-1][2:]
        if not 30.0 < limit < 80.0:
            assert found == min(max(limit, 30.0), 80.0)
            continue
        assert abs(found - limit) <= 0.5 * within + 1e-9
        step = (high - low) / 11.0
        assert step <= within < high - low
        ends = low + step * np.floor((limit - low) / step + np.array([0.0, 1.0]))
        assert found == pytest.approx(ends.mean(), abs=1e-9)


@pytest.mark.parametrize(
    ("sliding", "surface", "slips", "rolls"),
    [(1.0, 1.0, 30.0, 30.0), (1.0, -1.0, 30.0, 80.0), (0.999, 1.0, 80.0, 80.0)],
)
def test_a_ball_beyond_the_limit_slides_to_the_end_and_goes_on(
    monkeypatch, sliding, surface, slips, rolls
):
    def made(racket, ball, *, incidences, **_):
        data = {"sliding": sliding, "surface_speed": surface}
        shape = (1, len(incidences))
        return xarray.Dataset(
            {k: (("friction", "incidence"), np.full(shape, v)) for k, v in data.items()}
        )

    monkeypatch.setattr(sys.modules[slip_limit.__module__], "spin_over_incidence", made)
    assert (slip_limit(0.3), rolling_limit(0.3)) == (slips, rolls)


def test_the_section_has_what_was_fitted_and_what_was_not():
    said: list[Progress] = []
    found = spin(replace(Plan(), points=(5,)), said.append)
    assert found.values["spin.clamped"] == pytest.approx(1545.0, abs=1.0)  # kt and ct are fitted
    assert found.values["spin.held"] == pytest.approx(0.30, abs=0.001)
    assert 1207.0 < found.values["spin.nylon"] < 1803.0
    assert len(said) == 3
    assert list(found.figures) == ["over_incidence"]

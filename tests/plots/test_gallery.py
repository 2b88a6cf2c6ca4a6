"""Figures of logs and of comparisons: no text over another, none cut off, all with titles."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest
from matplotlib.figure import Figure

import drake_racket as dr
from drake_racket.compare.figures import axis_figure, hand_figure, maps_figure
from drake_racket.plots import impact_figure
from drake_racket.plots.log.figures import LOG_FIGURES
from drake_racket.plots.log.overlay import overlay_figure
from tests.compare.test_compare import made
from tests.plots.bounds import faults
from tests.plots.made_log import made_log

COARSE = dr.IntegratorSettings(accuracy=2e-3)
CASES = {
    "hand": dr.Scenario(
        racket="recreational", support="grip", point="6", incidence_deg=25.0, integrator=COARSE
    ),
    "free": dr.Scenario(integrator=COARSE),
    "clamped": dr.Scenario(support="clamped_head", point="2", after=0.012, integrator=COARSE),
    "spin": dr.Scenario(
        contact="surface", incidence_deg=40.0, spin_rpm=-1500.0, after=0.01, integrator=COARSE
    ),
    "high": dr.Scenario(tension="high", speed=33.0, integrator=COARSE),
}


@pytest.fixture(scope="module")
def logs():
    """History of a case, simulated once."""
    return functools.cache(lambda name: dr.simulate(CASES[name]).history)


_SLOW = [pytest.param(name, marks=pytest.mark.slow) for name in CASES]


@pytest.mark.parametrize("case", ["made", *_SLOW])
def test_figures_of_a_log(logs, case):
    log = made_log() if case == "made" else logs(case)
    figures = {"impact": impact_figure(log)}
    figures |= {name: draw(log) for name, draw, lacks in LOG_FIGURES if not lacks(log)}
    for name, figure in figures.items():
        assert figure.get_suptitle(), name
        assert faults(figure) == [], name


def test_logs_over_each_other():
    figure = overlay_figure({f"{label}, a log with a name": made_log() for label in "abcdef"})
    assert faults(figure) == []


@pytest.mark.parametrize("count", [2, 6])
@pytest.mark.parametrize("draw", [maps_figure, axis_figure, hand_figure])
def test_figures_of_a_comparison(draw, count):
    rackets = []
    for i in range(count):
        values = {f"restitution_{n}": 0.1 + 0.03 * n + 0.01 * i for n in range(1, 10)}
        values |= {"peak_handle_acceleration": 1500.0 + 100.0 * i, "handle_ringing": 200.0 + 10 * i}
        parts = {"frequency": {"restitution_5": 0.02, "handle_ringing": 20.0}}
        found = made(f"racket {i}, a title of the usual length", parts, **values)
        curve = 0.3 + 0.01 * i + np.array([-0.02, 0.0, 0.02])
        nominal = dataclasses.replace(found.nominal, restitution=curve, ball_speed=100 * curve)
        rackets.append(dataclasses.replace(found, nominal=nominal))
    figure = draw(rackets)
    assert figure.get_suptitle()
    assert faults(figure) == []


def test_the_check_sees_what_is_wrong():
    figure = Figure(figsize=(4.0, 3.0))
    axes = figure.subplots()
    axes.set_title("a title that is much too long for a figure of this width, and goes on and on")
    axes.text(0.5, 0.5, "one")
    axes.text(0.51, 0.5, "other")
    found = faults(figure)
    assert any("sticks out" in text for text in found)
    assert "'one' lies over 'other'" in found

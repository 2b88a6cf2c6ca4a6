"""The map of kb and cb against an independent ODE, an independent oscillator, and its own rules."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from drake_racket.io.errors import InputError
from studies.ball_calibration.calibration import (
    OTHERS,
    Bounds,
    calibration_dataset,
    nearest,
    tolerance_needed,
)
from studies.ball_calibration.figures import calibration_figure
from tests.conftest import clamped_problem
from tests.oracles.clamped_impact import simulate
from tests.oracles.damped_oscillator import Oscillator

GROWTH = {18.0: (1.0, 1.0), 33.0: (1.52, 1.97)}  # of kb and cb, printed in the source


@pytest.fixture(scope="module")
def dataset():
    return calibration_dataset(
        stiffnesses=[25e3, 45e3, 60e3], dampings=[0.0, 8.0, 14.0], points=[1, 5]
    )


def test_rebounds_equal_the_oracle(dataset):
    rebounds = {}
    for point in (1, 5):
        for speed, (by_kb, by_cb) in GROWTH.items():
            problem = clamped_problem("recreational", "high", point, speed)
            problem = replace(problem, kb=60e3 * by_kb, cb=8.0 * by_cb)
            rebounds[point, speed] = simulate(problem).rebound_speed
    place = dataset.sel(bed="recreational high", kb=60e3, cb=8.0)
    assert float(place["rebound_low"]) == pytest.approx(min(rebounds.values()), abs=1e-4)
    assert float(place["rebound_high"]) == pytest.approx(max(rebounds.values()), abs=1e-4)
    falls = [rebounds[p, 33.0] / 33.0 < rebounds[p, 18.0] / 18.0 for p in (1, 5)]
    assert float(place["falls"]) == np.mean(falls)


def test_plate_equals_the_oscillator(dataset):
    place = dataset.sel(kb=25e3, cb=14.0)
    fast = Oscillator(0.059, 25e3 * 1.52, 14.0 * 1.97, 33.0)
    slow = Oscillator(0.059, 25e3, 14.0, 18.0)
    assert float(place["peak_force"]) == pytest.approx(fast.peak()[1], rel=1e-8)
    assert float(place["restitution"]) == pytest.approx(fast.restitution(), rel=1e-8)
    longest = max(fast.contact_time(), slow.contact_time())
    assert float(place["contact_time"]) == pytest.approx(longest, rel=1e-8)
    assert float(place["drop_restitution"]) == pytest.approx(slow.restitution(), rel=1e-8)


def test_without_damping_nothing_is_lost_on_the_plate(dataset):
    assert dataset["restitution"].sel(cb=0.0).values == pytest.approx(1.0)
    assert dataset["drop_restitution"].sel(cb=0.0).values == pytest.approx(1.0)


def test_more_damping_returns_less(dataset):
    for name in ("rebound_low", "rebound_high", "restitution"):
        assert (dataset[name].diff("cb") < 0.0).all()


def test_the_itf_rule():
    low, high = Bounds().drop_restitution
    assert (low, high) == pytest.approx((0.729038, 0.760750), abs=1e-6)  # as in published.yaml
    assert Bounds().drop_speed == pytest.approx(7.058, abs=1e-3)


def test_judgement_follows_the_numbers(dataset):
    for kb in dataset["kb"].values:
        for cb in dataset["cb"].values:
            place = dataset.sel(kb=kb, cb=cb)
            agrees = {str(b): bool(place["agrees"].sel(bound=b)) for b in place["bound"].values}
            lowest, highest = float(place["rebound_low"].min()), float(place["rebound_high"].max())
            assert agrees["lowest rebound"] == (15.2 <= lowest <= 16.8)
            assert agrees["highest rebound"] == (25.65 <= highest <= 28.35)
            assert agrees[OTHERS[0]] == bool((place["falls"] == 1.0).all())
            assert agrees[OTHERS[1]] == (float(place["peak_force"]) <= 2000.0)
            assert agrees["ITF drop"] == (0.729038 <= float(place["drop_restitution"]) <= 0.76075)
            parts = [agrees[b] for b in ("lowest rebound", "highest rebound", *OTHERS)]
            assert agrees["all of the source"] == all(parts)
            needed = float(tolerance_needed(dataset).sel(kb=kb, cb=cb))
            assert needed == pytest.approx(max(abs(lowest / 16.0 - 1), abs(highest / 27.0 - 1)))


def test_a_wider_tolerance_keeps_more():
    grid = {"stiffnesses": [45e3], "dampings": [14.0], "points": [5, 7]}
    tight, wide = (
        calibration_dataset(**grid, bounds=Bounds(tolerance=t))["agrees"] for t in (0.001, 0.5)
    )
    assert not tight.sel(bound="all of the source").any()
    assert wide.sel(bound="all of the source").all()


def test_nearest_keeps_the_other_bounds(dataset):
    best = nearest(dataset)
    assert bool((best["agrees"].sel(bound=list(OTHERS)) == 1).all())
    needed = tolerance_needed(dataset)
    here = float(needed.sel(kb=best["kb"], cb=best["cb"]))
    allowed = (dataset["agrees"].sel(bound=list(OTHERS)) == 1).all("bound")
    assert here == float(needed.where(allowed).min())
    nothing = dataset.copy()
    nothing["agrees"] = 0 * dataset["agrees"]
    with pytest.raises(InputError, match=r"^grid: "):
        nearest(nothing)


def test_default_of_the_document():
    place = calibration_dataset(stiffnesses=[45e3], dampings=[14.0])
    assert (place.attrs["kb_default"], place.attrs["cb_default"]) == (45e3, 14.0)
    assert float(tolerance_needed(place).squeeze()) == pytest.approx(0.069, abs=1e-3)
    assert float(place["rebound_low"].min()) == pytest.approx(15.39, abs=0.01)
    assert float(place["rebound_high"].max()) == pytest.approx(28.86, abs=0.01)
    assert float(place["peak_force"].squeeze()) == pytest.approx(1711.0, abs=1.0)


def test_figure(dataset):
    figure = calibration_figure(dataset)
    labels = [t.get_text() for t in figure.axes[0].get_legend().get_texts()]
    assert "default" in labels


@pytest.mark.parametrize(
    ("key", "call"),
    [
        ("stiffnesses", lambda: calibration_dataset(stiffnesses=[2e4, 1e4])),
        ("stiffnesses", lambda: calibration_dataset(stiffnesses=[math.nan])),
        ("dampings", lambda: calibration_dataset(dampings=[-1.0])),
        ("dampings", lambda: calibration_dataset(dampings=[])),
        ("tolerance", lambda: Bounds(tolerance=0.0)),
        ("lowest", lambda: Bounds(lowest=30.0)),
        ("drop_high", lambda: Bounds(drop_high=3.0)),
    ],
)
def test_refuses_in_one_line(key, call):
    with pytest.raises(InputError, match=f"^{key}: ") as caught:
        call()
    assert "\n" not in str(caught.value)

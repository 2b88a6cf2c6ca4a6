"""The comparison of a sweep with Drake: its sample, its numbers, and what a difference does."""

from __future__ import annotations

import json
import math

import pytest
import xarray
from typer.testing import CliRunner

from drake_racket import InputError, Scenario
from drake_racket.cli import app
from drake_racket.sweep import make_sweep, parse_sweep, run_sweep
from drake_racket.sweep.check import ChecksFailed, compare, sample
from drake_racket.sweep.store import CaseRow

BASE = Scenario(support="clamped_head", audit=False, approach_time=1e-4, after=0.006)
SPEEDS = {"speed": {"values": [20.0, 25.0, 30.0], "unit": "m/s"}}
YAML = """
base: {support: clamped_head, audit: false, approach_time: 1e-4, after: 0.006}
axes: {speed: {values: [20, 30], unit: m/s}}
outputs: [rebound_speed, steps]
check: {tolerance: 1e-12}
"""


def rows(*values):
    return [CaseRow(case, "", [], list(own)) for case, own in enumerate(values)]


def test_a_sweep_says_how_far_it_is_from_drake(tmp_path):
    sweep = make_sweep(BASE, SPEEDS, ["rebound_speed", "steps"], check={"share": 1.0})
    ran: list[str] = []
    dataset = run_sweep(sweep, tmp_path, progress=lambda now: ran.append(now.task))
    found = json.loads(dataset.attrs["comparison"])
    assert found["cases"] == [0, 1, 2]
    assert list(found["differences"]) == ["rebound_speed"]  # steps are the engine's own
    assert 0.0 < found["differences"]["rebound_speed"] < 1e-5
    assert "comparing" in ran
    with xarray.open_dataset(tmp_path / "results.nc") as stored:
        assert stored.attrs["comparison"] == dataset.attrs["comparison"]
    # the same command again compares nothing anew, and says the same
    again: list[str] = []
    other = run_sweep(sweep, tmp_path, progress=lambda now: again.append(now.task))
    assert "comparing" not in again
    assert other.attrs["comparison"] == dataset.attrs["comparison"]


@pytest.mark.parametrize(
    ("base", "check"), [(BASE, {"most": 0}), (Scenario(**(vars(BASE) | {"engine": "drake"})), {})]
)
def test_nothing_is_compared_where_drake_runs_or_nobody_asks(base, check):
    axes = {"speed": {"values": [20.0], "unit": "m/s"}}
    dataset = run_sweep(make_sweep(base, axes, ["rebound_speed"], check=check))
    assert "comparison" not in dataset.attrs


def test_a_difference_beyond_the_tolerance_is_an_error_after_the_results(tmp_path):
    (tmp_path / "sweep.yaml").write_text(YAML)
    out = tmp_path / "out"
    ran = CliRunner().invoke(app, ["sweep", str(tmp_path / "sweep.yaml"), "--out", str(out)])
    assert isinstance(ran.exception, ChecksFailed)
    assert "\n" not in str(ran.exception)
    assert "not what Drake computes: 1 cases" in str(ran.exception)
    assert "(rebound_speed), tolerance 1e-12; the results are in" in str(ran.exception)
    with xarray.open_dataset(out / "results.nc") as stored:
        assert stored["status"].to_numpy().tolist() == [0, 0]


def test_differences_are_shares_of_the_largest_magnitude():
    sweep = make_sweep(BASE, SPEEDS, ["rebound_speed", "contact_time", "kb"])
    ours = rows([-10.0, 2.0, 1e-12], [5.0, math.nan, 0.0], [8.0, 1.0, 0.0])
    found = compare(sweep, ours, [CaseRow(1, "", [], [5.5, math.nan, 1.0])])
    assert found.differences == {"rebound_speed": pytest.approx(0.05), "contact_time": 0.0}
    assert found.worst()[0] == "rebound_speed"
    assert not found.passes()
    half = compare(sweep, ours, [CaseRow(0, "", [], [-10.0, math.nan, 0.0])])
    assert math.isnan(half.worst()[1])
    assert not half.passes()
    assert half.plain()["differences"]["contact_time"] is None
    failed = compare(sweep, ours, [CaseRow(2, "no step", [], [math.nan] * 3)])
    assert not failed.passes()
    assert "case 2 fails there (no step)" in failed.text()
    assert failed.differences == {"rebound_speed": 0.0, "contact_time": 0.0}
    assert compare(sweep, ours, [CaseRow(7, "", [], [1.0] * 3)]).differences == failed.differences
    assert compare(sweep, ours, []) is None


def test_the_sample_is_of_the_compiled_cases_and_always_the_same():
    axes = {"speed": {"from": 18.0, "to": 33.0, "count": 450, "unit": "m/s"}}
    sweep = make_sweep(BASE, axes, ["kb"])
    chosen = sample(sweep, range(0, 450, 2))
    assert chosen == sample(sweep, list(range(448, -1, -2)))
    assert len(chosen) == len(set(chosen)) == 5
    assert all(case % 2 == 0 for case in chosen)
    assert len(sample(make_sweep(BASE, SPEEDS, ["kb"]), [0, 1, 2])) == 1
    assert sample(sweep, []) == []


@pytest.mark.parametrize(
    ("check", "message"),
    [
        ("{share: 2}", r"check: share: got 2"),
        ("{most: -1}", r"check: most: got -1"),
        ("{tolerance: .nan}", r"check: tolerance: got nan"),
        ("{cases: 3}", r"check: cases: got 'an unknown key'"),
        ("all", "check: got 'all'"),
    ],
)
def test_a_wrong_check_is_refused_in_one_line(check, message):
    text = YAML.replace("check: {tolerance: 1e-12}", f"check: {check}")
    with pytest.raises(InputError, match=message) as refused:
        parse_sweep(text)
    assert "\n" not in str(refused.value)

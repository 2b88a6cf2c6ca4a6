"""`--set`, `--ball` and units, on every command with impacts."""

from __future__ import annotations

import dataclasses
import json

import pytest

import drake_racket as dr
from drake_racket.cases.keys import with_settings
from drake_racket.sweep import load_sweep


def test_units_and_settings_of_an_impact(run_well, tmp_path):
    ball = dataclasses.replace(
        dr.load_ball(), name="soft", stiffness_low=dr.Quantity(40e3, "N/m", "fitted", "a test")
    )
    dr.write_ball(ball, tmp_path / "ball.yaml")
    found = json.loads(
        run_well(
            *("impact", "--json", "--speed", "56mph", "--incidence", "0.1rad", "--after", "6ms"),
            *("--tension", "60lb", "--ball", str(tmp_path / "ball.yaml")),
            *("--set", "racket.head.mass=170g", "--set", "offset_y=10mm", "--set", "point=auto"),
            *("--set", "audit=false"),
        )
    )
    scenario = found["scenario"]
    assert scenario["speed"] == pytest.approx(25.03424)
    assert scenario["incidence_deg"] == pytest.approx(5.7296, abs=1e-4)
    assert scenario["after"] == 0.006
    assert scenario["offset_y"] == 0.01
    assert scenario["overrides"] == {"racket.head.mass": 0.17}
    assert scenario["audit"] is False
    share = (found["normal_approach_speed"] - 18.0) / 15.0
    assert found["kb"] == pytest.approx(40e3 * (1.0 + 0.52 * share))
    case = dr.resolve(
        dr.Scenario(
            **{**scenario, "integrator": dr.IntegratorSettings(), "limb": dr.LimbSettings()}
        )
    )
    again = dr.simulate(case)
    assert found["apparent_restitution"] == again.apparent_restitution


def test_settings_of_a_sweep(tmp_path):
    path = tmp_path / "sweep.yaml"
    path.write_text("base: {speed: 20}\naxes: {speed: {values: [40mph, 60 mph]}}\n")
    sweep = load_sweep(path, ["ball.mass=58g", "support=grip", "grip.torque_stiffness.x=30"])
    assert sweep.base.overrides == {"ball.mass": 0.058, "grip.torque_stiffness.x": 30.0}
    assert sweep.base.support == "grip"
    assert sweep.scenario(0).speed == pytest.approx(40 * 0.44704)
    assert sweep.axes[0].columns[0].unit == "m/s"
    path.write_text(
        "axes:\n"
        "  aim: {keys: {offset_x: , offset_y: {unit: m}}, rows: [[1cm, 0], [10 mm, 2cm]]}\n"
        "  speed: {from: 40mph, to: 60mph, count: 3}\n"
    )
    sweep = load_sweep(path)
    assert sweep.axes[0].columns[1].values == (0.0, 0.02)
    assert sweep.scenario(4).speed == pytest.approx(50 * 0.44704)


def test_keys_below_keys():
    base = dr.load_scenario("backhand")
    found = with_settings(base, ["limb.stroke.speed=50mph", "integrator.accuracy=1e-5"])
    assert found.limb.stroke.speed == pytest.approx(22.352)
    assert found.integrator.accuracy == 1e-5


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        (["speed"], "KEY=VALUE"),
        (["spede=3"], "speed"),
        (["speed=3kg"], "--set speed: got '3kg'"),
        (["audit=maybe"], "true or false"),
        (["speed=20", "speed=30"], "each key once"),
        (["speed=500"], "speed: got 500.0; allowed: 0.1 to 100 m/s"),
        (["racket.head.mass=0.17m"], "--set racket.head.mass"),
    ],
)
@pytest.mark.parametrize("command", ["impact", "compare", "customise", "sweep"])
def test_refused_before_any_work(run, command, settings, text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "sweep.yaml").write_text("axes: {point: [2, 5]}\n")
    arguments = {
        "impact": ["impact"],
        "compare": ["compare", "tour", "recreational"],
        "customise": ["customise", "tour", "--add", "5g@12"],
        "sweep": ["sweep", "sweep.yaml", "--out", "out"],
    }[command]
    options = [word for setting in settings for word in ("--set", setting)]
    status, out, err = run(*arguments, *options)
    assert (status, out) == (2, "")
    assert text in err
    assert len(err.splitlines()) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["sweep.yaml"]


def test_identify_takes_units(run, tmp_path):
    """Read before the file is: an option in a unit that fits leaves the file to complain of."""
    missing = str(tmp_path / "no.csv")
    out = ("--out", str(tmp_path / "out"))
    status, _, err = run("identify", "tension", missing, *out, "--strung-at", "70lb")
    assert (status, missing in err) == (2, True)
    status, _, err = run("identify", "tension", missing, *out, "--strung-at", "70 m")
    assert status == 2
    assert "got '70 m'; allowed: a number with its unit (N, kg, lb)" in err
    status, _, err = run("identify", "ball", missing, *out, "--mass", "58g", "--speed-low", "40mph")
    assert (status, missing in err) == (2, True)

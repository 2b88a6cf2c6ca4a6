"""`drake-racket identify impacts`, as a user types it."""

from __future__ import annotations

import pytest

from drake_racket import load_scenario

TABLE = """\
speed [m/s],offset_x [mm],point,rebound_speed [m/s],rebound_speed_sd [m/s],contact_time [ms],\
contact_time_sd [ms]
18,-30,auto,8.1,0.1,4.70,0.05
24,0,auto,9.6,0.1,4.45,0.05
30,40,auto,9.9,0.1,4.30,0.05
"""


@pytest.mark.slow
def test_the_command_writes_a_scenario_that_runs(tmp_path, run):
    table, out = tmp_path / "impacts.csv", tmp_path / "fit"
    table.write_text(TABLE)
    status, told, _ = run(
        *("identify", "impacts", str(table), "--out", str(out), "--set", "support=grip"),
        *("--set", "after=6ms", "--free", "ball.damping_low=5:40"),
    )
    assert status == 0
    assert "ball.damping_low" in told
    fitted = load_scenario(out / "scenario.yaml")
    assert fitted.support == "grip"
    assert 5.0 < fitted.overrides["ball.damping_low"] < 40.0
    assert (out / "scenario.yaml").read_text().startswith("# fitted to impacts.csv (sha256 ")
    names = {path.name for path in out.iterdir()}
    assert {"report.md", "result.json", "impacts.csv", "impacts.png", "residuals.png"} <= names
    assert len((out / "impacts.csv").read_text().splitlines()) >= 7


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("--free", "speed"), "keys that it leaves open"),
        (("--free", "ball.damping_low=5"), "LOW:HIGH"),
        (("--free", "=5:6"), "each key once"),
        (("--free", "ball.mass", "--free", "ball.mass"), "each key once"),
        (("--free", "ball.mass", "--set", "spd=3"), "speed"),
    ],
)
def test_bad_requests_end_with_one_line(tmp_path, run, options, told):
    table, out = tmp_path / "impacts.csv", tmp_path / "fit"
    table.write_text(TABLE)
    status, _, err = run("identify", "impacts", str(table), "--out", str(out), *options)
    assert status == 2
    assert told in err
    assert len(err.strip().splitlines()) == 1

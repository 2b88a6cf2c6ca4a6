"""The command line: what it prints and writes, against the same case run from Python."""

from __future__ import annotations

import csv
import json
import math
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray

from drake_racket import Scenario, cli, load_racket, load_scenario, simulate, simulation
from drake_racket.laws.bed import grid_topology
from drake_racket.sweep import load_sweep

AFTER = 0.006  # s: the contact and a little ringing

# every key of the JSON object, and the type of its value for an impact that touches and leaves
NUMBERS = (
    "apparent_restitution",
    "rebound_angle",
    "contact_time",
    "touch_time",
    "peak_normal_force",
    "peak_string_deflection",
    "normal_approach_speed",
    "kb",
    "cb",
    "peak_in_plane_angle",
    "peak_out_of_plane_angle",
    "peak_handle_acceleration",
    "energy_error",
    "momentum_error",
    "angular_momentum_error",
)
VECTORS = (
    "aim_velocity",
    "approach_velocity",
    "rebound_velocity",
    "impulse",
    "racket_velocity",
    "racket_angular_velocity",
    "spin_before",
    "spin_after",
    "angular_impulse",
)
PAIRS = ("rebound_angles", "impulse_place")
ON_SURFACE = (
    "tangential_restitution",
    "sliding_fraction",
    "grip_time",
    "overspin_time",
    "touch_place",
)
"""None with contact paper."""
COUNTS = ("point", "touches", "steps", "evaluations")
OTHERS = ("balance", "warnings", "scenario", "units")


@pytest.fixture
def no_simulation(monkeypatch):
    def refuse(scenario):
        raise AssertionError("a simulation was started")

    monkeypatch.setattr(simulation, "simulate", refuse)


@pytest.fixture(scope="module")
def expected():
    """The impact of the fixture `written`, from Python."""
    return simulate(Scenario(after=AFTER, point="4", incidence_deg=20.0))


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The output directory of one oblique impact, and its JSON."""
    out = tmp_path_factory.mktemp("impact") / "new" / "directory"
    arguments = ["impact", "--after", str(AFTER), "--point", "4", "--incidence", "20"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["drake-racket", *arguments, "--out", str(out)])
        cli.main()
    return out, json.loads((out / "impact.json").read_text(encoding="utf-8"))


# --- JSON -----------------------------------------------------------------------------------------


def test_json_is_one_object_with_every_key(run_well):
    out = run_well("impact", "--json", "--after", str(AFTER))
    value, end = json.JSONDecoder().raw_decode(out)
    assert out[end:] == "\n"  # one object, and nothing else
    assert set(value) == {*NUMBERS, *VECTORS, *PAIRS, *ON_SURFACE, *COUNTS, *OTHERS}
    assert set(value["units"]) == {*NUMBERS, *VECTORS, *PAIRS, *ON_SURFACE, "balance"}
    assert value["units"]["rebound_angle"] == "rad"
    for key in NUMBERS:
        assert isinstance(value[key], float), key
        assert math.isfinite(value[key]), key
    for key in VECTORS:
        assert [type(x) for x in value[key]] == [float] * 3, key
    for key in PAIRS:
        assert [type(x) for x in value[key]] == [float] * 2, key
    assert [value[key] for key in ON_SURFACE] == [None] * 5
    for key in COUNTS:
        assert type(value[key]) is int, key
    assert value["warnings"] == []
    assert value["approach_velocity"] == [0.0, 0.0, -25.0]
    assert value["rebound_velocity"][2] > 0.0
    assert 0.003 < value["contact_time"] < AFTER
    assert value["point"] == 5
    assert value["scenario"]["after"] == AFTER
    assert abs(value["energy_error"]) < 1e-3
    assert abs(value["momentum_error"]) < 1e-6


def test_json_of_a_ball_that_spins(run_well):
    """The tangential restitution follows from the other numbers."""
    options = "--contact surface --spin -3820 --incidence 40 --engine compiled --after 0.006"
    out = run_well("impact", "--json", *options.split())
    value = json.loads(out)
    assert value["spin_before"] == pytest.approx([400.0294, 0.0, 0.0], abs=1e-3)
    radius = 0.03425
    before = value["approach_velocity"][1] + radius * value["spin_before"][0]
    after = value["rebound_velocity"][1] + radius * value["spin_after"][0]
    assert value["tangential_restitution"] == pytest.approx(-after / before, abs=1e-12)
    assert 0.0 <= value["sliding_fraction"] <= 1.0
    assert value["touch_place"] == pytest.approx([0.0, 0.0], abs=1e-12)
    rebound = value["rebound_velocity"]
    assert value["rebound_angles"][1] == pytest.approx(math.atan2(rebound[1], rebound[2]))
    assert value["energy_error"] < 1e-4
    assert value["angular_momentum_error"] < 1e-8
    # friction, at the height of the contact point, and the normal force's place are the moment
    assert 0.0 > value["angular_impulse"][0] > -0.1


def test_json_equals_simulate(run_well, tmp_path):
    # what an option cannot say comes from the file
    path = tmp_path / "case.yaml"
    path.write_text("offset_y: 0.01\nsupport: clamped_handle\n", encoding="utf-8")
    options = "--racket recreational --tension 300 --point 2 --speed 20 --incidence 15 --azimuth 30"
    out = run_well("impact", str(path), "--json", "--after", str(AFTER), *options.split())
    scenario = Scenario(
        offset_y=0.01,
        support="clamped_handle",
        racket="recreational",
        tension="300",
        point="2",
        speed=20.0,
        incidence_deg=15.0,
        azimuth_deg=30.0,
        after=AFTER,
    )
    # runs repeat bit for bit
    assert json.loads(out) == json.loads(json.dumps(simulate(scenario).to_json()))


def test_json_where_something_is_unknown(run_well, tmp_path):
    # no release, no meter: the keys stay, with null
    path = tmp_path / "short.yaml"
    path.write_text("{approach_time: 0.01, audit: false}", encoding="utf-8")
    value = json.loads(
        run_well("impact", str(path), "--json", "--after", "0.0001", "--speed", "0.2")
    )
    # at 0.2 m/s for 0.1 ms after touch the ball is still in contact
    assert value["contact_time"] is None
    assert value["energy_error"] is None
    assert value["balance"] is None
    assert any("ended in contact" in warning for warning in value["warnings"])


@pytest.mark.parametrize(
    ("speed", "outside"), [(17.5, True), (18.0, False), (33.0, False), (33.5, True)]
)
def test_speeds_outside_the_identified_range_are_told(run_well, speed, outside):
    arguments = ("impact", "--after", str(AFTER), "--speed", str(speed))
    value = json.loads(run_well(*arguments, "--json"))
    told = [w for w in value["warnings"] if "outside the identified 18-33 m/s" in w]
    assert bool(told) == outside
    ends = {17.5: (45e3, 14.0), 33.5: (45e3 * 1.52, 14.0 * 1.97)}
    if outside:
        assert (value["kb"], value["cb"]) == pytest.approx(ends[speed], rel=1e-12)
        assert "warning: normal approach speed" in run_well(*arguments)


# --- the summary ----------------------------------------------------------------------------------


def test_summary(run_well):
    out = run_well("impact", "--after", str(AFTER))
    result = simulate(Scenario(after=AFTER))
    speed = float(np.linalg.norm(result.rebound_velocity))
    lines = {line.split("  ")[0].strip(): line for line in out.splitlines()}
    assert f"{speed:.2f} m/s" in lines["Rebound speed"]
    assert f"{result.apparent_restitution:.3f}" in lines["Apparent restitution"]
    assert f"{1e3 * result.contact_time:.2f} ms" in lines["Contact time"]
    assert f"{result.peak_normal_force:.0f} N" in lines["Peak normal force"]
    assert f"{1e3 * result.peak_string_deflection:.1f} mm" in lines["Peak string deflection"]
    assert f"{result.steps} steps, {result.evaluations} evaluations" in lines["Integrator"]
    assert "Head LM Prestige (tour), strung at 254 N, free" in out
    assert "warning" not in out
    # nine values of the racket and four of the ball are readings, and the summary says so
    assert "13 of the model's values are inferred" in out


def test_options_override_the_scenario_file(run_well, tmp_path):
    path = tmp_path / "case.yaml"
    path.write_text(
        f"{{speed: 30, point: 8, support: clamped_head, after: {AFTER}, gravity: [0, 0, -9.81]}}",
        encoding="utf-8",
    )
    plain = json.loads(run_well("impact", str(path), "--json"))["scenario"]
    assert (plain["speed"], plain["point"], plain["support"]) == (30.0, "8", "clamped_head")
    value = json.loads(run_well("impact", str(path), "--json", "--speed", "22", "--point", "5"))
    scenario = value["scenario"]
    assert (scenario["speed"], scenario["point"]) == (22.0, "5")
    # and what no option gives stays the file's
    assert (scenario["support"], scenario["after"]) == ("clamped_head", AFTER)
    assert scenario["gravity"] == [0.0, 0.0, -9.81]
    assert value["approach_velocity"] == [0.0, 0.0, -22.0]


# --- files ----------------------------------------------------------------------------------------


def test_out_writes_four_files_and_nothing_else(written):
    out, _ = written
    names = {path.name for path in out.iterdir()}
    assert names == {"impact.nc", "impact.csv", "impact.png", "impact.json"}
    assert (out / "impact.png").read_bytes().startswith(b"\x89PNG\r\n\x1a\n")
    assert all(path.stat().st_size > 1000 for path in out.iterdir())


def test_written_json_equals_simulate(written, expected):
    _, value = written
    assert value == json.loads(json.dumps(expected.to_json()))


def test_netcdf_comes_back_with_units_everywhere(written, expected):
    out, value = written
    with xarray.open_dataset(out / "impact.nc", engine="h5netcdf", decode_timedelta=False) as data:
        assert set(data.data_vars) == set(expected.history.data_vars)
        assert {"normal_force", "string_tension", "energy", "handle_acceleration"} <= set(
            data.data_vars
        )
        for name, variable in data.data_vars.items():
            assert variable.attrs["units"], name
            assert variable.attrs["long_name"], name
            assert np.array_equal(variable, expected.history[name], equal_nan=True), name
        assert data["time"].attrs["units"] == "s"
        assert data["normal_force"].attrs["units"] == "N"
        assert list(data["axis"].values) == ["x", "y", "z"]
        assert list(data["point"].values) == list(range(1, 10))
        assert list(data["spring"].values) == list(grid_topology().names)
        assert data["energy"].dims == ("time", "store")
        assert np.all(np.diff(data["time"]) >= 0.0)
        assert json.loads(data.attrs["scenario"]) == value["scenario"]
        for name in ("drake_version", "drake_racket_version", "source"):
            assert data.attrs[name], name
        # the peak in the JSON is that of the history
        assert float(data["normal_force"].max()) == pytest.approx(
            value["peak_normal_force"], rel=1e-3
        )


def test_csv_has_the_same_columns_and_numbers(written, expected):
    out, _ = written
    history = expected.history
    with (out / "impact.csv").open(encoding="utf-8", newline="") as file:
        header, *rows = list(csv.reader(file))
    columns = ["time [s]"]
    for name, variable in history.data_vars.items():
        units = variable.attrs["units"]
        if variable.ndim == 1:
            columns.append(f"{name} [{units}]")
        else:
            labels = history[variable.dims[1]].values
            columns += [f"{name}_{label} [{units}]" for label in labels]
    assert header == columns
    assert {"ball_velocity_z [m/s]", "normal_force [N]", "string_tension_tip-1 [N]"} <= set(header)
    table = np.array(rows, dtype=float)
    assert table.shape == (history.sizes["time"], len(header))
    for column, values in (
        ("time [s]", history["time"]),
        ("ball_velocity_z [m/s]", history["ball_velocity"].sel(axis="z")),
        ("string_deflection_5 [m]", history["string_deflection"].sel(point=5)),
        ("energy_lost_ball [J]", history["energy"].sel(store="lost_ball")),
    ):
        assert table[:, header.index(column)] == pytest.approx(values.to_numpy(), rel=1e-11)


def test_out_twice_replaces_the_files(run_well, written):
    out, first = written
    before = (out / "impact.nc").stat().st_ino
    arguments = ["impact", "--after", str(AFTER), "--point", "4", "--incidence", "20"]
    text = run_well(*arguments, "--out", str(out), "--json")
    assert json.loads(text) == first  # --json prints the object alone, also with --out
    assert len(list(out.iterdir())) == 4
    assert (out / "impact.nc").stat().st_ino != before


@pytest.mark.usefixtures("no_simulation")
def test_out_that_cannot_be_written_is_refused_before_the_run(run, tmp_path):
    file = tmp_path / "file"
    file.write_text("mine", encoding="utf-8")
    for out in (file, file / "below", tmp_path / ("long" * 100)):
        status, stdout, stderr = run("impact", "--out", str(out))
        assert (status, stdout) == (2, "")
        assert stderr.startswith("drake-racket: --out: got ")
        assert "a directory that can be written" in stderr
        assert stderr.count("\n") == 1
    assert file.read_text(encoding="utf-8") == "mine"
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="no /proc here")
@pytest.mark.usefixtures("no_simulation")
def test_out_where_even_root_cannot_write(run):
    # permission bits would let root through
    status, stdout, stderr = run("impact", "--out", "/proc/drake_racket")
    assert (status, stdout) == (2, "")
    assert stderr.startswith("drake-racket: --out: got '/proc/drake_racket'; allowed: a directory")


def test_out_that_fails_during_the_run(run, tmp_path):
    # a directory in the place of one of the files
    (tmp_path / "impact.csv").mkdir()
    status, stdout, stderr = run("impact", "--after", str(AFTER), "--out", str(tmp_path))
    assert (status, stdout) == (2, "")
    assert stderr.startswith("drake-racket: --out: got ")
    assert {path.name for path in tmp_path.iterdir()} == {"impact.csv", "impact.nc"}


# --- show -----------------------------------------------------------------------------------------

INFERRED = (
    "Inferred (15): throat_joint.reading, landmarks.grip, landmarks.accelerometer, string_bed.gsc, "
    "string_bed.rim_semi_axis_x, string_bed.rim_semi_axis_y, string_bed.damping, "
    "string_bed.springs, friction.points, ball.stiffness_low, ball.damping_low, "
    "ball.sliding_speed_scale, ball.sliding_distance_scale, "
    "ball.surface.inertia_factor, ball.surface.flattening"
)


def folded(out: str) -> str:
    """The text of a page without its line breaks and columns."""
    return " ".join(out.split())


def test_show_tour(run_well):
    out = folded(run_well("show", "tour"))
    assert "Head LM Prestige (tour), strung at 254 N" in out
    assert "total mass 308.9 g" in out  # 133.5 + 160.5 + 14.9
    assert "balance 336.8 mm" in out
    assert "swingweight 338.8 kg cm²" in out
    assert "154.6 Hz in plane, 128.5 Hz out of plane" in out
    assert "string_bed.initial_tension 648.2 N printed" in out
    assert "throat_joint.stiffness_in 910 N*m/rad printed Glynn et al. 2011, Table 2" in out
    assert "177000, 200000, 597000, 791000 N/m printed" in out
    assert "throat_joint.reading by_axis inferred" in out
    assert "stiffness_low 45000 N/m inferred" in out  # the ball
    assert out.endswith(INFERRED)


def test_show_recreational_high(run_well):
    out = folded(run_well("show", "recreational", "--tension", "high"))
    assert "Head LM 8 (recreational), strung at 334 N" in out
    assert "total mass 255.4 g" in out  # 106.9 + 133.6 + 14.9
    assert "swingweight 348.4 kg cm²" in out
    assert "181.3 Hz in plane, 148.6 Hz out of plane" in out
    assert "string_bed.initial_tension 967.7 N printed" in out
    assert "friction.coefficients 0.26, 0.3, 0.35 1 printed" in out
    # what the table's own contradiction is, is said
    assert "0.00392 holds a measurement error or a misprint" in out
    assert out.endswith(INFERRED)


def test_show_as_printed(run_well):
    out = folded(run_well("show", "tour", "--joint-reading", "as_printed"))
    assert "114.8 Hz in plane, 173.1 Hz out of plane" in out
    assert "throat_joint.reading as_printed inferred chosen by the caller" in out


def test_show_a_tension_between(run_well):
    out = folded(run_well("show", "tour", "--tension", "282.5"))
    assert "string_bed.initial_tension 710.55 N inferred line through the two published" in out
    assert "Inferred (17): " in out


def test_show_prints_a_users_text_as_it_is(run_well, tmp_path):
    # square brackets are markup to the printing library
    from drake_racket.io.shipped import data_directory

    text = (data_directory() / "tour_low.yaml").read_text(encoding="utf-8")
    text = text.replace("Head LM Prestige (tour), strung at 254 N", "Mine [/bold] [red]one")
    text = text.replace("Glynn et al. 2011, Table 2, tour (in)", "see [notes] [/]")
    path = tmp_path / "mine[b].yaml"
    path.write_text(text, encoding="utf-8")
    out = folded(run_well("show", str(path)))
    assert "Mine [/bold] [red]one" in out
    assert "printed see [notes] [/]" in out
    shown = run_well("impact", "--racket", str(path), "--after", str(AFTER))
    assert "Mine [/bold] [red]one" in shown
    assert f"drake-racket show {path}" in shown.replace("\n", "")


def test_a_terminal_without_the_degree_sign():
    command = [sys.executable, "-m", "drake_racket.cli", "show", "tour"]
    done = subprocess.run(
        command,
        capture_output=True,
        env={"PYTHONIOENCODING": "ascii", "PATH": ""},
        timeout=120,
    )
    assert (done.returncode, done.stderr) == (0, b"")
    assert b"swingweight   338.8 kg cm?" in done.stdout


def test_the_version_is_told(capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["drake-racket", "--version"])
    cli.main()
    told = capsys.readouterr().out
    assert re.fullmatch(r"drake-racket \d+\.\d+\.\d+\S*, Drake \d+\.\d+\.\d+\n", told)


def test_shipped_scenarios_are_there_by_name_and_as_files(tmp_path, run, run_well):
    out = tmp_path / "mine"
    run_well("examples", str(out))
    assert load_scenario(out / "backhand.yaml") == load_scenario("backhand")
    assert len(load_sweep(out / "speeds.yaml")) == 12
    assert load_racket(str(out / "tour_low.yaml")) == load_racket("tour")
    (out / "speeds.yaml").write_text("mine")
    status, _, stderr = run("examples", str(out))
    assert status == 2
    assert "a directory without" in stderr
    assert (out / "speeds.yaml").read_text() == "mine"


def test_a_result_says_what_the_command_line_prints():
    result = simulate(Scenario(after=AFTER), history=False)
    lines = result.summary().splitlines()
    assert lines[0].startswith("Rebound speed")
    assert f"{np.linalg.norm(result.rebound_velocity):.2f} m/s" in lines[0]
    assert repr(result).startswith("ImpactResult(point 5, rebound ")

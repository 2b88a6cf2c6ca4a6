"""Sweeps: what an axis becomes, what comes out, what is refused, what is kept."""

from __future__ import annotations

import json
import math
import pickle
import shutil
import sqlite3
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import typer
import xarray
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from drake_racket import (
    OUTPUTS,
    InputError,
    Scenario,
    SimulationError,
    simulate,
)
from drake_racket.cases.keys import NUMBER, scenario_keys
from drake_racket.cli.sweep import sweep as sweep_command
from drake_racket.io.files import replace_file
from drake_racket.io.fingerprint import computation, difference
from drake_racket.io.progress import Progress
from drake_racket.results.outputs import find_outputs
from drake_racket.sweep import SweepStopped, flat, load_sweep, make_sweep, parse_sweep, run_sweep
from drake_racket.sweep.cases import make_plan
from drake_racket.sweep.worker import (
    CaseSettings,
    CaseTask,
    DifferentWorker,
    each_case,
    run_chunk,
)
from tests.conftest import ROOT, clamped_problem
from tests.oracles.clamped_impact import simulate as oracle

BASE = Scenario(support="clamped_head", audit=False, approach_time=1e-4, after=0.006)
AXES = {
    "point": [8, 1],
    "stroke": {
        "keys": {"speed": {"unit": "m/s"}, "tension": {}},
        "rows": [[20.0, "low"], [30.0, "high"]],
        "labels": ["slow", "fast"],
    },
}
YAML = """
base: {support: clamped_head, audit: false, approach_time: 1e-4, after: 0.006}
axes:
  speed: {values: [20, 31], unit: m/s}
outputs: [rebound_speed]
histories: {speed: [31]}
history_formats: [nc, sto]
"""


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """A small sweep with bad cases, histories and a directory."""
    axes = {
        "mass": {"key": "ball.mass", "values": [0.9, 1.0], "relative": True},
        "aim": {
            "keys": {"speed": {"unit": "m/s"}, "offset_y": {"unit": "m"}},
            "rows": [[20.0, 0.0], [20.0, 0.15]],
        },
    }
    sweep = make_sweep(BASE, axes, ["restitution", "warning_count"], histories=[2])
    out = tmp_path_factory.mktemp("sweep")
    return sweep, out, run_sweep(sweep, out)


def test_every_value_stands_at_its_labels():
    dataset = run_sweep(make_sweep(BASE, AXES, ["rebound_speed", "rebound_velocity_z"]))
    assert dataset["rebound_speed"].dims == ("point", "stroke")
    assert dataset["speed"].dims == ("stroke",)
    assert dataset["speed"].attrs["units"] == "m/s"
    assert len(set(dataset["scenario_hash"].to_numpy().ravel())) == 4
    for point in (1, 8):
        for stroke, tension, speed in (("slow", "low", 20.0), ("fast", "high", 30.0)):
            expected = oracle(clamped_problem("tour", tension, point, speed)).rebound_speed
            at = dataset.sel(point=point, stroke=stroke)
            assert float(at["rebound_speed"]) == pytest.approx(expected, abs=3e-5)
            assert float(at["rebound_velocity_z"]) == pytest.approx(expected, abs=3e-5)
            assert (float(at["speed"]), str(at["tension"].item())) == (speed, tension)


def test_a_failed_case_is_a_row_with_its_reason(ran):
    _, _, dataset = ran
    assert dataset["status"].to_numpy().tolist() == [[0, 1], [0, 1]]
    assert np.isnan(dataset["restitution"].to_numpy()[:, 1]).all()
    assert np.isfinite(dataset["restitution"].to_numpy()[:, 0]).all()
    assert "rim" in str(dataset["failure"].sel(mass=0.9, aim=1).item())
    assert "\n" not in str(dataset["failure"].sel(mass=0.9, aim=1).item())


def test_a_run_that_fails_is_a_row_and_the_sweep_goes_on(monkeypatch):
    def breaks(scenario, system, *, history):
        if scenario.speed == 25.0:
            raise SimulationError("stopped at t = 0.001 s:\nno step is small enough")
        return simulate(scenario, system, history=history)

    monkeypatch.setattr("drake_racket.sweep.worker.simulate", breaks)
    axes = {"speed": {"values": [25.0, 26.0], "unit": "m/s"}}
    dataset = run_sweep(make_sweep(replace(BASE, engine="drake"), axes, ["kb"]))
    assert dataset["status"].to_numpy().tolist() == [1, 0]
    reason = str(dataset["failure"].to_numpy()[0])
    assert reason == "SimulationError: stopped at t = 0.001 s: no step is small enough"
    assert np.isnan(dataset["kb"].to_numpy()).tolist() == [True, False]


def test_a_worker_with_other_code_or_files_is_refused(tmp_path):
    ball = tmp_path / "ball.yaml"
    ball.write_text("mass: 1")
    kb = find_outputs(["kb"], "outputs")
    other = CaseSettings(kb, computation() | {"drake": "1.0"}, {})
    with pytest.raises(DifferentWorker, match=r"worker: drake: .* allowed: 1\.0") as error:
        run_chunk([CaseTask(0, BASE, "", other)])
    travelled = pickle.loads(pickle.dumps(error.value))
    assert str(travelled) == str(error.value)
    changed = CaseSettings(kb, computation(), {str(ball): "another hash"})
    with pytest.raises(DifferentWorker, match=r"ball\.yaml.*content it had at the start"):
        run_chunk([CaseTask(0, BASE, "", changed)])


def test_every_output_is_of_the_impact():
    base = Scenario(
        support="grip",
        point="4",
        speed=24.0,
        incidence_deg=10.0,
        after=0.006,
    )
    names = [name for name, output in OUTPUTS.items() if output.available(base)]
    loose = {"tolerance": 0.02}  # peaks are read from samples
    sweep = make_sweep(base, {"racket": ["tour"]}, names, check=loose)
    found = run_sweep(sweep).isel(racket=0)
    n = {name: float(found[name]) for name in names}
    mass = base.load_ball().mass.value
    assert math.hypot(*(n[f"approach_velocity_{a}"] for a in "xyz")) == pytest.approx(24.0)
    assert math.hypot(*(n[f"rebound_velocity_{a}"] for a in "xyz")) == pytest.approx(
        n["rebound_speed"]
    )
    for a in "xyz":
        change = n[f"rebound_velocity_{a}"] - n[f"approach_velocity_{a}"]
        assert n[f"impulse_{a}"] == pytest.approx(mass * change, abs=1e-12)
    energies = sum(value for name, value in n.items() if name.startswith("energy_"))
    energies -= n["energy_error"] + 2.0 * n["energy_couple"]  # gained, not lost
    assert energies == pytest.approx(0.5 * mass * 24.0**2, rel=2e-3)
    assert math.cos(n["rebound_angle"]) == pytest.approx(
        n["rebound_velocity_z"] / n["rebound_speed"]
    )
    assert n["restitution"] == pytest.approx(-n["rebound_velocity_z"] / n["approach_velocity_z"])
    assert (n["touched_point"], n["touches"]) == (4.0, 1.0)
    assert n["peak_normal_force"] > 0.5 * n["impulse_z"] / n["contact_time"]
    assert min(n["peak_hand_force"], n["peak_hand_torque"], n["peak_handle_acceleration"]) > 0.0
    assert set(names) >= {"kb", "cb", "steps", "evaluations", "peak_hand_torque"}
    missing = {name for name, value in n.items() if math.isnan(value)}
    assert missing == {"angular_momentum_error"}  # of a free racket only


def test_rate_and_time_left_are_of_this_run():
    now = Progress("running", done=40, total=100, before=20, seconds=10.0)
    assert (now.rate(), now.time_left()) == (2.0, 30.0)
    assert Progress("running", 20, 100, before=20, seconds=1.0).time_left() is None


def test_a_factor_multiplies_the_cases_own_parameter(ran):
    _, _, dataset = ran
    mass = BASE.load_ball().mass.value
    lighter = replace(BASE, speed=20.0, overrides={"ball.mass": 0.9 * mass})
    expected = simulate(lighter, history=False, engine="compiled").apparent_restitution
    assert float(dataset["restitution"].sel(mass=0.9, aim=0)) == expected
    assert dataset["mass"].attrs == {
        "units": "1",
        "long_name": "factor of ball.mass",
        "key": "ball.mass",
    }
    both = make_sweep(
        Scenario(),
        {
            "racket": ["tour", "recreational"],
            "head": {"key": "racket.head.mass", "values": [2.0], "relative": True},
        },
    )
    for case, racket in enumerate(("tour", "recreational")):
        own = Scenario(racket=racket).load_racket().head.mass.value
        assert both.scenario(case).overrides == {"racket.head.mass": 2.0 * own}


def test_files_are_readable_without_the_package(ran):
    _, out, dataset = ran
    with xarray.open_dataset(out / "results.nc") as stored:
        assert stored.load().identical(dataset)
    facts = json.loads((out / "sweep.json").read_text())
    assert facts["computation"]["drake-racket"] == dataset.attrs["drake_racket_version"]
    assert facts["base"]["support"] == "clamped_head"
    assert facts["content_hash"] == dataset.attrs["content_hash"]
    header, *lines = (out / "results.csv").read_text().splitlines()
    assert "speed [m/s]" in header.split(",")
    assert len(lines) == 4
    database = sqlite3.connect(out / "sweep.sqlite")
    rows = database.execute('SELECT "case", status, restitution FROM cases').fetchall()
    assert [row[:2] for row in rows] == [(0, "done"), (1, "failed"), (2, "done"), (3, "failed")]
    assert rows[2][2] == float(dataset["restitution"][1, 0])
    parquet = pytest.importorskip("pyarrow.parquet")
    table = parquet.read_table(out / "results.parquet")
    assert table.column("restitution")[0].as_py() == float(dataset["restitution"][0, 0])
    assert table.schema.field("speed").metadata[b"units"] == b"m/s"
    assert json.loads(table.schema.metadata[b"sweep"])["base"] == facts["base"]


def test_a_history_is_there_before_its_row(ran, tmp_path):
    sweep, made, dataset = ran
    out = shutil.copytree(made, tmp_path / "copy")
    with xarray.open_dataset(out / "histories" / "case_000002.nc") as history:
        assert history["normal_force"].attrs["units"] == "N"
    assert len(list((out / "histories").iterdir())) == 1
    for path in (out / "histories").iterdir():
        path.unlink()
    seen: list[int] = []
    again = run_sweep(sweep, out, progress=lambda p: seen.append(p.before))
    assert again.identical(dataset)
    assert seen[-1] == 3  # the case without its history ran again, and no other
    assert (out / "histories" / "case_000002.nc").exists()


def test_only_what_is_missing_runs_again(ran, tmp_path):
    sweep, made, dataset = ran
    out = shutil.copytree(made, tmp_path / "copy")
    database = sqlite3.connect(out / "sweep.sqlite")
    with database:
        database.execute('DELETE FROM cases WHERE "case" IN (0, 1)')
        database.execute('UPDATE cases SET restitution = 7.0 WHERE "case" = 2')
    database.close()
    again = run_sweep(sweep, out)
    assert float(again["restitution"][1, 0]) == 7.0
    assert float(again["restitution"][0, 0]) == float(dataset["restitution"][0, 0])


def test_another_sweep_is_refused_and_named(ran, tmp_path):
    sweep, out, _ = ran
    other = replace(sweep, base=replace(sweep.base, after=0.007))
    with pytest.raises(InputError, match=r"base\.after: got 0\.007; allowed: 0\.006") as error:
        run_sweep(other, out)
    assert "--fresh" in str(error.value)
    with pytest.raises(InputError, match="outputs"):
        run_sweep(replace(sweep, outputs=(OUTPUTS["kb"],)), out)


def test_a_changed_parameter_file_is_refused(tmp_path):
    from drake_racket.io.shipped import data_directory

    ball = tmp_path / "ball.yaml"
    text = (data_directory() / "ball_penn_titanium.yaml").read_text()
    ball.write_text(text)
    sweep = make_sweep(replace(BASE, ball=str(ball)), {"point": [5]}, ["kb"])
    first = run_sweep(sweep, tmp_path / "out")
    ball.write_text(text.replace("0.059", "0.060"))
    with pytest.raises(InputError, match=r"ball\.yaml"):
        run_sweep(sweep, tmp_path / "out")
    anew = run_sweep(sweep, tmp_path / "out", fresh=True)
    assert not anew.identical(first)


def test_one_process_at_a_time(ran):
    import fcntl

    sweep, out, _ = ran
    with (out / "sweep.lock").open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        with pytest.raises(InputError, match="no other sweep is running"):
            run_sweep(sweep, out)


def test_a_file_that_is_no_store_is_refused(tmp_path):
    (tmp_path / "sweep.sqlite").write_text("this is no database, but a longer text than its header")
    with pytest.raises(InputError, match="a file that a sweep can be kept in") as error:
        run_sweep(make_sweep(BASE, {"point": [5]}), tmp_path)
    assert "\n" not in str(error.value)


def test_fresh_deletes_nothing_of_the_users(tmp_path):
    sweep = make_sweep(BASE, {"point": [5]}, ["kb"])
    (tmp_path / "notes.txt").write_text("mine")
    (tmp_path / "histories").mkdir()
    mine = ["mine.nc", "case_study.txt", ".case_000000.mine.tmp.nc"]
    for name in mine:
        (tmp_path / "histories" / name).write_text("mine")
    first = run_sweep(sweep, tmp_path)
    with sqlite3.connect(tmp_path / "sweep.sqlite") as database:
        database.execute("UPDATE cases SET kb = 7.0")
    database.close()
    assert run_sweep(sweep, tmp_path, fresh=True).equals(first)
    assert (tmp_path / "notes.txt").exists()
    assert all((tmp_path / "histories" / name).exists() for name in mine)


def test_fresh_deletes_what_a_killed_sweep_was_writing(tmp_path):
    sweep = make_sweep(BASE, {"point": [5]}, ["kb"])
    run_sweep(sweep, tmp_path)
    (tmp_path / "histories").mkdir()
    begun = [
        tmp_path / "histories" / "case_000001.nc",
        tmp_path / "histories" / "case_1000000.sto",
        *(tmp_path / f"results.{suffix}" for suffix in ("nc", "csv", "parquet")),
        tmp_path / "sweep.json",
    ]

    def killed(path):
        path.write_text("a part")
        raise KeyboardInterrupt

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Path, "unlink", lambda *_, **__: None)  # nobody clears up after kill -9
        for path in begun:
            with pytest.raises(KeyboardInterrupt):
                replace_file(path, killed)
    assert len([*tmp_path.rglob(".*.tmp.*")]) == len(begun)
    run_sweep(sweep, tmp_path, fresh=True)
    assert not [*tmp_path.rglob(".*")]


def test_flat_rows_are_the_cells(ran):
    _, _, dataset = ran
    cases = flat(dataset)
    assert cases["mass"].to_numpy().tolist() == [0.9, 0.9, 1.0, 1.0]
    assert cases["offset_y"].to_numpy().tolist() == [0.0, 0.15, 0.0, 0.15]
    assert cases["status"].to_numpy().tolist() == [0, 1, 0, 1]


def test_every_number_of_a_scenario_has_a_unit():
    keys = scenario_keys()
    assert all(key.unit for key in keys.values() if key.kind == NUMBER)
    assert {"gravity.z", "limb.place.x", "limb.stroke.speed", "integrator.accuracy"} <= set(keys)


def test_nested_keys_are_set():
    axes = {
        "gravity.z": {"values": [-9.81], "unit": "m/s^2"},
        "integrator.accuracy": {"values": [1e-3], "unit": "1"},
        "limb.stroke.guess_deg.elbow": {"values": [30.0], "unit": "degrees"},
        "audit": [False],
        "racket.string_bed.spring.left-4": {"values": [1.0e5], "unit": "N/m"},
        "line": {"key": "racket.string_bed.stiffness.k3", "values": [2.0], "relative": True},
        "near": {"key": "racket.string_bed.spring.4-5", "values": [3.0], "relative": True},
    }
    scenario = make_sweep(Scenario(), axes).scenario(0)
    assert scenario.gravity == (0.0, 0.0, -9.81)
    assert scenario.integrator.accuracy == 1e-3
    assert scenario.limb.stroke.guess_deg == {"elbow": 30.0}
    assert scenario.audit is False
    k3 = Scenario().load_racket().string_bed.stiffness.value[2]
    assert scenario.overrides == {
        "racket.string_bed.spring.left-4": 1.0e5,
        "racket.string_bed.stiffness.k3": 2.0 * k3,
        "racket.string_bed.spring.4-5": pytest.approx(3.0 * 2.0 * k3),
    }


@settings(max_examples=20, deadline=None)
@given(
    design=st.sampled_from(["sobol", "latin_hypercube"]),
    power=st.integers(1, 6),
    seed=st.integers(0, 2**31),
    low=st.floats(0.5, 20.0),
    span=st.floats(0.1, 50.0),
)
def test_designs_fill_their_bounds(design, power, seed, low, span):
    count = 2**power
    axis = {
        "design": design,
        "samples": count,
        "seed": seed,
        "keys": {
            "speed": {"from": low, "to": low + span, "unit": "m/s"},
            "ball.mass": {"from": 0.5, "to": 2.0, "relative": True, "spacing": "log"},
        },
    }
    speed, mass = make_sweep(Scenario(), {"sample": axis}).axes[0].columns
    # one sample in each of `count` equal cells of every axis: what both designs promise
    cells = np.floor((np.array(speed.values) - low) / span * count - 1e-9)
    assert sorted(np.clip(cells, 0, count - 1)) == list(range(count))
    logs = np.floor((np.log2(mass.values) + 1.0) / 2.0 * count - 1e-9)
    assert sorted(np.clip(logs, 0, count - 1)) == list(range(count))
    again = make_sweep(Scenario(), {"sample": axis}).axes[0].columns[0]
    assert again.values == speed.values


@settings(max_examples=30, deadline=None)
@given(counts=st.lists(st.integers(1, 5), min_size=1, max_size=4), data=st.data())
def test_cases_are_numbered_in_row_major_order(counts, data):
    names = ["speed", "offset_x", "offset_y", "after"]
    units = {"speed": "m/s", "after": "s"}
    axes = {
        name: {"values": [0.01 * (i + 1) for i in range(n)], "unit": units.get(name, "m")}
        for name, n in zip(names, counts, strict=False)
    }
    sweep = make_sweep(Scenario(), axes)
    assert len(sweep) == math.prod(counts)
    case = data.draw(st.integers(0, len(sweep) - 1))
    assert np.ravel_multi_index(sweep.places(case), sweep.shape) == case
    scenario = sweep.scenario(case)
    for name, place in zip(names, sweep.places(case), strict=False):
        assert getattr(scenario, name) == 0.01 * (place + 1)


def test_one_topology_is_built_from_its_first_case():
    axes = {
        "racket": ["tour", "recreational"],
        "head": {"key": "racket.head.mass", "values": [1.0, 1.1], "relative": True},
        "audit": [True, False],
    }
    plan = make_plan(make_sweep(Scenario(), axes))
    assert len(plan.builders) == 4
    assert plan.order() == [0, 2, 1, 3, 4, 6, 5, 7]
    assert plan.builders[0].overrides == make_sweep(Scenario(), axes).scenario(0).overrides


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("axes: {spede: {values: [1], unit: m/s}}", "speed"),
        ("axes: {speed: []}", "an empty axis"),
        ("axes: {speed: {values: [], unit: m/s}}", "an empty axis"),
        ("axes: {}", "at least one axis"),
        ("outputs: [kb]", "at least one axis"),
        ("axes: {speed: [20]}", "m/s"),
        ("axes: {speed: {values: [20], unit: km/h}}", "m/s"),
        ("axes: {racket.head.mass: {values: [160], unit: g}}", "kg"),
        ("axes: {racket.head.mass: {values: [1.1], unit: kg, relative: true}}", "relative"),
        ("axes: {racket.head.mas: {values: [1], unit: kg}}", "racket.head.mass"),
        ("axes: {point: {values: [5], unit: m}}", "no unit for point"),
        ("axes: {support: {values: [free], relative: true}}", "no number"),
        ("axes: {speed: {values: [20, .nan], unit: m/s}}", "finite"),
        ("axes: {speed: {values: [20, 20], unit: m/s}}", "once"),
        ("axes: {audit: [1]}", "true or false"),
        ("axes: {speed: {from: 20, to: 10, count: 3, unit: m/s}}", "more than from"),
        ("axes: {speed: {from: 20, to: 30, count: 0, unit: m/s}}", "count"),
        ("axes: {speed: {from: -1, to: 30, count: 2, unit: m/s, spacing: log}}", "more than 0"),
        ("axes: {s: {rows: [[1], [2, 3]], keys: {speed: {unit: m/s}}}}", r"rows\[1\]"),
        ("axes: {s: {rows: [[1]], keys: {}}}", "keys"),
        ("axes: {s: {rows: [[1]], labels: [a, b], keys: {speed: {unit: m/s}}}}", "labels"),
        ("axes: {s: {design: halton, samples: 4, seed: 1, keys: {speed: }}}", "sobol"),
        ("axes: {s: {design: sobol, samples: 5, seed: 1, keys: {speed: }}}", "power of 2"),
        ("axes: {s: {design: sobol, samples: 4, keys: {speed: }}}", "seed"),
        ("axes: {a: {key: speed, values: [20], unit: m/s}, speed: [20]}", "."),
        ("axes: {restitution: {key: speed, values: [20], unit: m/s}}", "no output"),
        ("axes: {point: [5]}\noutputs: [kbb]", "kb"),
        ("axes: {point: [5]}\noutputs: []", "no output"),
        ("axes: {point: [5]}\nhistories: [1]", "0 to 0"),
        ("axes: {point: [5]}\nhistories: {point: [4]}", "got 4"),
        ("axes: {point: [5]}\nhistory_formats: [xlsx]", "nc, csv"),
        ("axes: {point: [5]}\nbase: {sped: 3}", "sped"),
        ("axes: {point: [5]}\nbase: nowhere.yaml", "nowhere"),
        ("axs: {point: [5]}", "unknown key"),
        ("[1, 2]", "mapping"),
        ("axes: {point: [5], point: [6]}", "repeated"),
    ],
)
def test_bad_sweeps_are_refused_in_one_line(text, said):
    with pytest.raises(InputError, match=said) as error:
        parse_sweep(text)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("axes", "outputs", "said"),
    [
        ({"point": [5, 10]}, ["kb"], "got '10'"),
        ({"speed": {"values": [20.0, 300.0], "unit": "m/s"}}, ["kb"], "300"),
        ({"point": [5]}, ["peak_hand_force"], "support grip or limb"),
        ({"point": [5]}, ["energy_error"], "audit: true"),
        ({"place": {"key": "limb.stroke.speed", "values": [2], "relative": True}}, ["kb"], "None"),
    ],
)
def test_what_no_case_can_be_is_refused_before_the_start(axes, outputs, said, tmp_path):
    with pytest.raises(InputError, match=said):
        run_sweep(make_sweep(BASE, axes, outputs), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_the_page_has_a_sweep_that_is_one():
    page = (ROOT / "docs" / "sweeps.md").read_text()
    sweep = parse_sweep(page.split("```yaml\n")[1].split("```")[0])
    assert sweep.shape == (3, 6, 3)
    assert len(sweep.histories) == 3


def test_difference_names_the_first_key():
    assert difference({"a": {"b": 1}}, {"a": {"b": 1}}) is None
    assert difference({"a": {"b": 1, "c": 2}}, {"a": {"b": 1, "c": 3}}) == ("a.c", 2, 3)
    assert difference({"a": 1}, {"a": 1, "d": 2}) == ("d", "nothing", 2)


def _command():
    app = typer.Typer()
    app.command()(sweep_command)
    return app


def test_the_command_says_what_it_does_and_quiet_says_nothing(tmp_path):
    file = tmp_path / "sweep.yaml"
    file.write_text(YAML)
    arguments = [str(file), "--out", str(tmp_path / "out")]
    result = CliRunner().invoke(_command(), arguments)
    assert result.exit_code == 0
    assert "running: 2 of 2 cases" in result.stderr
    assert "cases/s" in result.stderr
    assert "\x1b" not in result.stderr
    assert "2 cases, 0 failed" in result.stdout
    assert "results.nc" in result.stdout
    histories = sorted(path.name for path in (tmp_path / "out" / "histories").iterdir())
    assert histories == ["case_000001.nc", "case_000001.sto"]
    again = CliRunner().invoke(_command(), [*arguments, "--quiet"])
    assert (again.exit_code, again.output) == (0, "")
    assert len(load_sweep(file)) == 2


def test_ctrl_c_leaves_what_is_finished(tmp_path, monkeypatch):
    import drake_racket.sweep.runner as runner

    file = tmp_path / "sweep.yaml"
    file.write_text(YAML)

    def interrupted(tasks, threads):
        yield next(each_case(tasks))
        raise KeyboardInterrupt

    monkeypatch.setattr(runner, "each_case", interrupted)
    result = CliRunner().invoke(_command(), [str(file), "--out", str(tmp_path / "out")])
    assert result.exit_code == 130
    (line,) = [x for x in result.stderr.splitlines() if "interrupted" in x]
    assert "goes on from there" in line
    with xarray.open_dataset(tmp_path / "out" / "results.nc") as dataset:
        assert dataset["status"].to_numpy().tolist() == [0, 2]
        assert np.isfinite(dataset["rebound_speed"].to_numpy()).tolist() == [True, False]


@pytest.mark.parametrize("interrupted", [False, True])
def test_results_that_cannot_be_written_stop_the_sweep(tmp_path, monkeypatch, interrupted):
    import drake_racket.sweep.runner as runner

    sweep = make_sweep(BASE, {"point": [5, 2]}, ["kb"])
    (tmp_path / "results.nc").mkdir()

    def interrupt(tasks, threads):
        yield next(each_case(tasks))
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        if interrupted:
            patch.setattr(runner, "each_case", interrupt)
        with pytest.raises(SweepStopped, match=r"cannot be written .* goes on from there") as error:
            run_sweep(sweep, tmp_path)
    assert "\n" not in str(error.value)
    assert f"after {1 if interrupted else 2} of 2 cases" in str(error.value)
    (tmp_path / "results.nc").rmdir()
    before: list[int] = []
    run_sweep(sweep, tmp_path, progress=lambda p: before.append(p.before))
    assert max(before) == (1 if interrupted else 2)


def test_workers_and_a_scheduler_do_not_go_together(tmp_path):
    with pytest.raises(InputError, match="workers: got 2"):
        run_sweep(make_sweep(BASE, {"point": [5]}), tmp_path, workers=2, scheduler="tcp://a:1")


@pytest.fixture
def cluster():
    """A Dask scheduler in this process, without workers."""
    distributed = pytest.importorskip("distributed")
    options = {"processes": False, "protocol": "tcp", "dashboard_address": None}
    with distributed.LocalCluster(n_workers=0, threads_per_worker=1, **options) as made:
        yield made


@pytest.mark.parametrize("kind", ["client", "address"])
def test_a_cluster_without_workers_is_refused(tmp_path, monkeypatch, cluster, kind):
    from distributed import Client

    monkeypatch.setattr("drake_racket.sweep.cluster.WAIT", 0.2)
    monkeypatch.setattr("drake_racket.sweep.cluster._LOOK", 0.1)
    sweep = make_sweep(BASE, {"point": [5]}, ["kb"])
    with Client(cluster, set_as_default=False) as client:
        scheduler = client if kind == "client" else cluster.scheduler_address
        with pytest.raises(InputError, match=r"a worker within 0\.2 s"):
            run_sweep(sweep, tmp_path, scheduler=scheduler)
        assert client.status == "running"


@pytest.mark.parametrize("kind", ["client", "address"])
def test_workers_that_come_when_there_is_work_are_waited_for(tmp_path, cluster, kind):
    from distributed import Client

    cluster.adapt(minimum=0, maximum=1, interval="20ms")
    sweep = make_sweep(BASE, {"point": [5]}, ["kb"])
    with Client(cluster, set_as_default=False) as client:
        scheduler = client if kind == "client" else cluster.scheduler_address
        dataset = run_sweep(sweep, tmp_path, scheduler=scheduler)
    assert dataset["status"].to_numpy().tolist() == [0]


def test_without_dask_or_a_scheduler_one_line(tmp_path):
    pytest.importorskip("distributed")
    sweep = make_sweep(BASE, {"point": [5]})
    with pytest.raises(InputError, match="a running Dask scheduler") as error:
        run_sweep(sweep, tmp_path, scheduler="nonsense://127.0.0.1:1")
    assert "\n" not in str(error.value)

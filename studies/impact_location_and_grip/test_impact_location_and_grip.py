"""Impact location and grip tightness: the study's files, the rig, and the verdicts."""

from __future__ import annotations

import csv
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
import xarray
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_racket import InputError, Scenario, make_impact_diagram, simulate
from drake_racket.cases.case import changed
from drake_racket.io.progress import Progress
from drake_racket.parameters.stroke import face_rotation
from studies.impact_location_and_grip.case import STEP, has_impact, racket_loads
from studies.impact_location_and_grip.findings import (
    findings,
    flexion_by_impact,
    points_below,
    side_points,
)
from studies.impact_location_and_grip.runs import (
    LONGEST,
    backhand_scenario,
    grip_and_location,
    make_runs,
)

STUDY = "studies.impact_location_and_grip"
AFTER = 0.012


def run_study(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", STUDY, *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)


@pytest.fixture(scope="module")
def output(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("grip_and_location")
    options = ["--out", str(out), "--grips", "tight", "--after", str(AFTER), "--points", "5", "6"]
    done = run_study(*options)
    assert done.returncode == 0, done.stderr
    assert "points below the racket's long axis: 6" in done.stdout
    assert "3 of 3 runs" in done.stderr
    return out


@pytest.fixture(scope="module")
def dataset(output: Path) -> xarray.Dataset:
    return xarray.load_dataset(output / "grip_and_location.nc", engine="h5netcdf")


@pytest.fixture(scope="module")
def direct():
    """The same impact without the rig: tight grip, point 6."""
    scenario = changed(backhand_scenario(), grip="tight", point="6", after=AFTER + 1e-3)
    system = make_impact_diagram(scenario)
    return system, simulate(scenario, system, engine="compiled")


@pytest.mark.slow
def test_the_studys_numbers_are_those_of_a_direct_run(dataset, direct):
    _, result = direct
    case = dataset.sel(grip="tight", point=6)
    assert float(case["restitution"]) == result.apparent_restitution
    assert float(case["rebound_speed"]) == np.linalg.norm(result.rebound_velocity)
    assert float(case["contact_time"]) == result.contact_time
    assert float(case["touch_time"]) == result.touch_time
    assert abs(float(case["energy_error"])) < 1e-3
    history, time = result.history, dataset["time"].to_numpy()
    assert time[0] == 0.0
    assert time[-1] == pytest.approx(AFTER, abs=1e-12)
    assert np.diff(time) == pytest.approx(STEP)
    for joint in dataset["joint"].to_numpy():
        wanted = np.interp(time, history["time"], history["joint_position"].sel(joint=joint))
        assert np.array_equal(case["joint_position"].sel(joint=joint), wanted)
        assert float(case["applied_torque"].sel(joint=joint)) == float(
            history["joint_torque"].sel(joint=joint)[0]
        )
    after_touch = (history["time"] >= 0.0) & (history["time"] <= AFTER)
    force = history["joint_reaction_force"].sel(joint="wrist_flexion")[after_touch]
    assert float(case["peak_reaction_force"].sel(joint="wrist_flexion")) == float(force.max())


@pytest.mark.slow
def test_the_load_on_a_joint_is_the_moment_of_the_hands_wrench_about_its_axis(direct):
    system, result = direct
    limb, plant = system.limb.limb, system.plant
    history = result.history.isel(time=slice(0, None, 150))
    q = history["joint_position"].to_numpy()
    loads = racket_loads(system, q, history)
    context = plant.CreateDefaultContext()
    for sample, angles in enumerate(q):
        for joint, angle in zip(limb.joints, angles, strict=True):
            joint.set_angle(context, angle)
        X_WH = limb.hand.CalcPoseInWorld(context)
        R_WH, p_H = X_WH.rotation().matrix(), X_WH.translation()
        torque = R_WH @ history["hand_torque"].to_numpy()[sample]
        force = R_WH @ history["hand_force"].to_numpy()[sample]
        for column, joint in enumerate(limb.joints):
            X_WJ = joint.frame_on_parent().CalcPoseInWorld(context)
            axis = X_WJ.rotation().matrix() @ joint.revolute_axis()
            moment = axis @ (torque + np.cross(p_H - X_WJ.translation(), force))
            assert loads[sample, column] == pytest.approx(moment, abs=1e-9)


@pytest.mark.slow
def test_rotation_in_the_hand_is_the_angle_of_its_rotation_matrix(dataset):
    case = dataset.sel(grip="tight", point=6)
    roll, pitch, yaw = case["grip_angle"].to_numpy()[-1]

    def about(i: int, angle: float) -> np.ndarray:
        c, s = np.cos(angle), np.sin(angle)
        turn = np.eye(3)
        j, k = (i + 1) % 3, (i + 2) % 3
        turn[j, j], turn[j, k], turn[k, j], turn[k, k] = c, -s, s, c
        return turn

    R = about(2, yaw) @ about(1, pitch) @ about(0, roll)
    angle = np.arccos(0.5 * (np.trace(R) - 1.0))
    assert angle > 0.1
    # the angles and the rotation are interpolated one by one
    assert float(case["grip_rotation"][-1]) == pytest.approx(angle, rel=1e-4)


@pytest.mark.slow
def test_below_is_below_in_the_world(dataset):
    # tip to the left, face to the net: y of the racket, z x x, points up, and point 6 is on -y
    up = face_rotation(0.0, 0.0, 0.0, "left")[2, 1]
    assert up == pytest.approx(1.0)
    height = dataset["height"].sel(grip="tight")
    assert float(height.sel(point=6)) == pytest.approx(-0.0685 * up, abs=1e-4)
    assert float(height.sel(point=5)) == 0.0
    assert side_points(dataset) == (6, None)


@pytest.mark.slow
def test_without_impact_the_stroke_goes_on_from_the_same_state(dataset):
    start = dataset["joint_position"].isel(time=0) - dataset["swing_joint_position"].isel(time=0)
    assert float(abs(start).max()) < 1e-5
    # before the ball has turned the racket nothing differs; later the wrist is forced to flex
    flexion = flexion_by_impact(dataset).sel(grip="tight")
    assert float(flexion.sel(point=6)) > 2.0 * float(flexion.sel(point=5)) > 0.0
    assert float(dataset["peak_grip_rotation"].sel(grip="tight", point=6)) > 0.2


@pytest.mark.slow
def test_finished_runs_are_taken_from_the_directory(output, dataset):
    def unexpected(now: Progress) -> None:
        raise AssertionError("a run that was there")

    base, store = changed(backhand_scenario(), after=AFTER), output / "runs.sqlite"
    with closing(sqlite3.connect(store)) as database:
        assert database.execute("SELECT count(*) FROM results").fetchone() == (3,)
    again = grip_and_location(
        base=base, grips=["tight"], points=[6], store=store, progress=unexpected
    )
    for name in ("racket_load", "joint_position", "grip_angle", "rebound_velocity"):
        assert np.array_equal(again[name].sel(point=6), dataset[name].sel(point=6))
    # another stroke, or other code, is another run
    with pytest.raises(AssertionError, match="was there"):
        grip_and_location(
            base=changed(base, speed=15.1),
            grips=["tight"],
            points=[6],
            store=store,
            progress=unexpected,
        )
    with closing(sqlite3.connect(store)) as database, database:
        database.execute("UPDATE results SET fingerprint = '0'")
    with pytest.raises(AssertionError, match="was there"):
        grip_and_location(base=base, grips=["tight"], points=[6], store=store, progress=unexpected)


@pytest.mark.slow
def test_processes_and_a_store_do_not_change_the_result(tmp_path):
    base = changed(backhand_scenario(), after=0.002, audit=False)
    chosen = {"base": base, "grips": ["loose", "tight"], "points": [4]}
    alone = grip_and_location(**chosen)
    assert alone.identical(grip_and_location(**chosen, workers=2, store=tmp_path / "runs.sqlite"))
    assert alone.identical(grip_and_location(**chosen, store=tmp_path / "runs.sqlite"))


@pytest.mark.slow
def test_the_files_are_there_and_readable(output, dataset):
    for name in ("maps", "grips", "joints_tight", "loads_tight"):
        assert (output / f"{name}.png").read_bytes()[:4] == b"\x89PNG"
    rows = list(csv.DictReader((output / "points.csv").open(encoding="utf-8")))
    speed = float(dataset["rebound_speed"].sel(grip="tight", point=6))
    assert float(rows[-1]["rebound_speed [m/s]"]) == pytest.approx(speed, rel=1e-12)
    verdicts = list(csv.DictReader((output / "verdicts.csv").open(encoding="utf-8")))
    # one grip, and 12 ms: what needs several grips or 30 ms has no verdict
    by_key = {row["key"]: row["verdict"] for row in verdicts}
    assert {by_key[k] for k in ("ball", "anywhere", "hand", "early")} == {"not comparable"}
    for name, variable in dataset.data_vars.items():
        assert variable.attrs["units"], name
        assert variable.attrs["long_name"], name


def test_bad_options_are_one_line_and_write_nothing(tmp_path, refused_by_study):
    said = refused_by_study(
        "impact_location_and_grip", "--out", tmp_path / "new", "--points", 5, 10
    )
    assert "points" in said
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize(
    "options",
    [
        {"grips": ["firm"]},
        {"grips": ["loose", "loose"]},
        {"grips": []},
        {"points": [0]},
        {"workers": 0},
    ],
    ids=str,
)
def test_bad_arguments_write_nothing(tmp_path, options):
    with pytest.raises(InputError):
        grip_and_location(**options, store=tmp_path / "new")
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize(
    "base",
    [
        Scenario(),
        changed(backhand_scenario(), grip_kind="weld"),
        changed(backhand_scenario(), time_step=1e-4),
        changed(backhand_scenario(), after=LONGEST + 1e-3),
    ],
    ids=["no limb", "weld", "discrete", "long"],
)
def test_what_is_no_stroke_of_this_experiment_is_refused(base):
    with pytest.raises(InputError):
        grip_and_location(base=base)


@settings(max_examples=20, deadline=None)
@given(
    points=st.lists(st.integers(-2, 12), max_size=4),
    after=st.floats(1e-4, 0.07, allow_nan=False),
)
def test_any_points_give_their_cases_or_an_input_error(points, after):
    base = changed(backhand_scenario(), after=after)
    good = bool(points) and len(set(points)) == len(points) and set(points) <= set(range(1, 10))
    if not good:
        with pytest.raises(InputError):
            make_runs(base, ["normal"], points)
        return
    runs = make_runs(base, ["normal"], points)
    scenarios = [runs.scenario(case) for case in range(len(runs))]
    hits = [scenario for scenario in scenarios if has_impact(scenario)]
    assert [int(scenario.point) for scenario in hits] == points
    assert len(scenarios) == 1 + len(points)
    # the ball of the stroke without impact comes after the end of the histories
    assert scenarios[0].approach_time > base.approach_time + after


def synthetic(flexion: dict[str, list[float]]) -> xarray.Dataset:
    """Points 4, 5, 6 (above, on, below); wrist angles grow in 50 ms to `flexion` (deg)."""
    grips, time = list(flexion), np.linspace(0.0, 0.05, 51)
    end = np.radians([flexion[g] for g in grips])
    angle = end[..., None, None] * (time / 0.05)[:, None]
    joint = ["wrist_flexion"]
    load = np.array([[1.0, 2.0, 10.0]] * len(grips))[..., None]
    shape = ("grip", "point", "time", "joint")
    speeds = [[20.0, 30.0, 20.0 + 0.1 * n] for n in range(len(grips))]
    turns = np.radians([[30.0, 5.0, 60.0 - 20.0 * n] for n in range(len(grips))])
    return xarray.Dataset(
        {
            "joint_position": (shape, angle),
            "swing_joint_position": (("grip", "time", "joint"), np.zeros((len(grips), 51, 1))),
            "racket_load": (shape, np.repeat(load[:, :, None], 51, axis=2)),
            "peak_flexing_load": (("grip", "point", "joint"), load),
            "peak_grip_rotation": (("grip", "point"), turns),
            "rebound_speed": (("grip", "point"), speeds),
            "height": (("grip", "point"), [[0.07, 0.0, -0.07]] * len(grips)),
            "along": (("grip", "point"), np.zeros((len(grips), 3))),
        },
        {"grip": grips, "point": [4, 5, 6], "time": time, "joint": joint},
    )


def test_verdicts_follow_from_the_numbers():
    data = synthetic({"normal": [-10.0, 5.0, 35.0], "tight": [-10.0, 5.0, 20.0]})
    found = {f.key: (f.model, f.verdict()) for f in findings(data)}
    expected = {
        "order": (15.0, "agrees"),  # tight: 20 - 5 below, 0 elsewhere
        "flexion": (30.0, "differs"),
        "peak": (5.0, "agrees"),
        "ball": (0.0, "agrees"),
        "anywhere": (100.0 * 0.1 / 20.05, "agrees"),
        "hand": (20.0, "agrees"),
        "early": (18.0, "agrees"),  # three fifths of 30
    }
    assert set(found) == set(expected)
    for key, (value, verdict) in expected.items():
        assert found[key] == (pytest.approx(value, abs=1e-9), verdict), key


def test_the_side_below_follows_gravity_and_grips_are_ordered_by_stiffness():
    data = synthetic({"tight": [-10.0, 5.0, 35.0], "loose": [-10.0, 5.0, 20.0]})
    assert points_below(data) == [6]
    # here the loose grip turns less below the axis
    assert {f.key: f.verdict() for f in findings(data)}["hand"] == "differs"
    data["height"] = -data["height"]
    assert points_below(data) == [4]
    assert side_points(data) == (4, 6)
    found = {f.key: (f.model, f.verdict()) for f in findings(data)}
    assert found["order"] == (pytest.approx(-30.0), "differs")
    alone = {f.key: f.verdict() for f in findings(data.sel(point=[6]))}
    assert alone["order"] == alone["flexion"] == alone["early"] == "not comparable"

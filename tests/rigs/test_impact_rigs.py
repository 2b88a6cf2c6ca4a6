"""Head-clamped, oblique and moving-racket rigs, and their studies."""

from __future__ import annotations

import dataclasses
import math
import subprocess
import sys

import numpy as np
import pytest
import xarray

from drake_racket import InputError, Scenario, load_racket, simulate
from drake_racket.results.history import after_release
from drake_racket.rigs.head_clamped import STROKES, normal_impacts, oblique_impacts, stroke_axis
from drake_racket.rigs.restitution_map import (
    along_axis,
    axis_offsets,
    moving_racket_scenario,
    restitution_map,
)
from tests.conftest import ROOT

STUDIES = ROOT / "studies"


def run_study(name: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    place = [str(STUDIES / name)] if (STUDIES / name).is_file() else ["-m", f"studies.{name}"]
    command = [sys.executable, *place, *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)


def test_restitution_falls_with_speed_and_with_tension_at_the_centre():
    dataset = normal_impacts(rackets=["tour"], points=[5], speeds=[18.0, 24.0])
    restitution = dataset["restitution"].sel(racket="tour", point=5)
    assert (restitution.sel(speed=24.0) < restitution.sel(speed=18.0)).all()
    assert (restitution.sel(tension="high") < restitution.sel(tension="low")).all()


@pytest.fixture(scope="module")
def grazing() -> xarray.Dataset:
    return oblique_impacts(
        rackets=["recreational"],
        tensions=["high"],
        friction_readings=["velocity"],
        angle_readings=["from_plane"],
        points=[5, 4, 1],
    ).squeeze(["racket", "tension", "friction_reading", "angle_reading"])


def test_a_ball_that_slides_throughout_loses_mu_times_its_normal_impulse(grazing):
    # v_t' = v_t - mu (1 + e) v_n, whatever the strings do; mu1 centre, mu2 edge, mu3 corner
    for point, mu in ((5, 0.26), (4, 0.30), (1, 0.35)):
        for stroke, (speed, angle, _) in STROKES.items():
            at = grazing.sel(point=point, stroke=stroke)
            normal, tangential = (
                speed * math.sin(math.radians(angle)),
                speed * math.cos(math.radians(angle)),
            )
            e = float(at["restitution"])
            expected = tangential - mu * (1.0 + e) * normal
            assert float(at["tangential_velocity"]) == pytest.approx(expected, abs=1e-4)
            angle_out = math.atan2(expected, e * normal)
            assert float(at["rebound_angle"]) == pytest.approx(angle_out, abs=1e-5)
            assert float(at["rebound_speed"]) == pytest.approx(
                math.hypot(expected, e * normal), abs=1e-4
            )


def test_strokes_come_from_opposite_sides():
    drive, cut = (stroke_axis(stroke, "from_normal") for stroke in STROKES)
    assert drive == {"speed": 31.0, "incidence_deg": 17.0, "azimuth_deg": 90.0}
    assert cut == {"speed": 25.0, "incidence_deg": 16.0, "azimuth_deg": -90.0}
    assert stroke_axis("slice", "from_plane")["incidence_deg"] == 74.0
    for arguments in (("lob", "from_normal"), ("slice", "from_floor")):
        with pytest.raises(InputError):
            stroke_axis(*arguments)


def test_a_stopped_ball_sticks_by_velocity_and_is_pulled_back_by_displacement():
    dataset = oblique_impacts(
        rackets=["tour"],
        tensions=["low"],
        strokes=["topspin_drive"],
        angle_readings=["from_normal"],
        points=[5],
    )
    velocity = dataset["tangential_velocity"].squeeze()
    assert abs(float(velocity.sel(friction_reading="velocity"))) < 0.02
    assert float(velocity.sel(friction_reading="displacement")) < -5.0


@pytest.mark.slow
def test_bending_is_excited_least_at_its_node():
    # the free racket's node lies 24 mm beyond the centre (closed form: tests of the frame's modes)
    dataset = along_axis([-0.1, -0.03, 0.02, 0.1], rackets=["tour"]).squeeze("racket")
    bending = dataset["bending_angle"].to_numpy()
    assert int(np.argmin(bending)) == 2
    assert bending[2] < 0.1 * bending[0]


def test_map_reads_what_a_single_impact_gives():
    base = dataclasses.replace(moving_racket_scenario(), engine="drake")
    at = restitution_map(rackets=["tour"], supports=["free"], points=[7], base=base).squeeze()
    scenario = Scenario(point="7", approach_time=1e-4, after=0.03, audit=False)
    result = simulate(scenario)
    assert float(at["restitution"]) == result.apparent_restitution
    assert float(at["peak_handle_acceleration"]) == result.peak_handle_acceleration
    assert result.history is not None
    assert result.contact_time is not None
    rest = after_release(result.history)
    assert float(rest["time"][0]) == pytest.approx(result.contact_time, abs=1e-9)
    assert not rest["in_contact"].any()
    angle = np.abs(rest["out_of_plane_angle"].to_numpy())
    assert float(at["bending_angle"]) == angle.max()
    # evenly sampled by interpolation: another quadrature of the same mean square
    time = np.linspace(float(rest["time"][0]), float(rest["time"][-1]), 20001)
    z = np.interp(time, rest["time"], rest["handle_acceleration"].sel(axis="z"))
    assert float(at["handle_ringing"]) == pytest.approx(np.sqrt(np.mean(z**2)), rel=2e-3)


def test_maps_begin_at_the_base_case_or_the_users(monkeypatch):
    sweeps = []
    module = sys.modules[moving_racket_scenario.__module__]
    monkeypatch.setattr(module, "run_grid", lambda sweep, **_: sweeps.append(sweep))
    base = dataclasses.replace(moving_racket_scenario(), speed=21.0)
    for own in (None, base):
        restitution_map(base=own)
        along_axis([-0.02, 0.01], base=own)
    for plain, users, count in ((sweeps[0], sweeps[2], 2 * 2 * 9), (sweeps[1], sweeps[3], 2 * 2)):
        assert len(plain) == len(users) == count
        assert users.base == dataclasses.replace(plain.base, speed=21.0)
        assert (plain.base.speed, plain.base.after, plain.base.approach_time) == (25.0, 0.03, 1e-4)
        assert not plain.base.audit
    assert (sweeps[1].base.support, sweeps[1].base.point) == ("free", "auto")


def test_a_clamped_handle_does_not_move():
    dataset = restitution_map(rackets=["tour"], supports=["clamped_handle"], points=[5])
    assert float(dataset["peak_handle_acceleration"].squeeze()) == 0.0


@pytest.mark.parametrize("step", [0.01, 0.02, 0.07, 0.14])
def test_axis_offsets_are_symmetric_and_within_the_rim(step):
    offsets = axis_offsets(step)
    assert offsets == tuple(-x for x in reversed(offsets))
    assert np.allclose(np.diff(offsets), step)
    rim = load_racket("tour").string_bed.rim_semi_axis_x.value
    assert 0.13 <= offsets[-1] < rim


@pytest.mark.parametrize("step", [0.0, -0.01, 0.999e-3, 0.1401, 1.0, float("nan")])
def test_bad_axis_steps_are_refused(step):
    with pytest.raises(InputError, match="step"):
        axis_offsets(step)


@pytest.mark.slow
def test_head_clamped_study(tmp_path):
    out = tmp_path / "out"
    run = run_study(
        "head_clamped.py",
        *("--out", str(out), "--racket", "tour", "--tension", "low"),
        *("--points", "5", "--speeds", "18", "33"),
    )
    assert run.returncode == 0, run.stderr
    normal = xarray.open_dataset(out / "normal.nc", engine="h5netcdf")
    assert normal["restitution"].shape == (1, 1, 1, 2)
    oblique = xarray.open_dataset(out / "oblique.nc", engine="h5netcdf")
    assert oblique["rebound_angle"].attrs["units"] == "rad"
    assert (out / "normal.csv").read_text().splitlines()[0].startswith("racket,tension,point,speed")
    assert {p.suffix for p in out.iterdir()} == {".nc", ".csv", ".png"}


@pytest.mark.slow
def test_moving_racket_study(tmp_path):
    out = tmp_path / "out"
    run = run_study(
        "moving_racket.py",
        *("--out", str(out), "--racket", "tour", "--support", "free", "grip"),
        *("--points", "5", "--step", "0.07"),
    )
    assert run.returncode == 0, run.stderr
    assert "node of bending +2" in run.stdout
    points = xarray.open_dataset(out / "points.nc", engine="h5netcdf")
    assert points["restitution"].shape == (1, 2, 1)
    for picture in ("restitution", "mid_handle", "along_axis"):
        assert (out / f"{picture}.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("study", "arguments", "said"),
    [
        ("head_clamped.py", ["--points", "10"], "point"),
        ("head_clamped.py", ["--racket", "squash"], "racket"),
        ("head_clamped.py", ["--speeds", "nan"], "speed"),
        ("moving_racket.py", ["--support", "table"], "support"),
        ("static_stiffness.py", ["--forces", "-3"], "forces"),
        ("static_stiffness.py", ["--points", "0"], "point"),
        *(
            (study, ["--out", "/dev/null/x"], "--out")
            for study in (
                "force_plate.py",
                "frame_modes.py",
                "grip_limits.py",
                "head_clamped.py",
                "impact_hammer.py",
                "impact_location_and_grip",
                "inertia_bench.py",
                "moving_racket.py",
                "static_stiffness.py",
                "upper_limb",
            )
        ),
    ],
)
def test_bad_options_of_a_study_are_one_line(study, arguments, said, tmp_path, refused_by_study):
    out = [] if "--out" in arguments else ["--out", str(tmp_path / "out")]
    assert said in refused_by_study(study, *arguments, *out)
    assert not (tmp_path / "out").exists()

"""Synthetic measurements: the model where there is no error, and errors of the stated size."""

from __future__ import annotations

import csv
import dataclasses
import runpy
import sys

import numpy as np
import pytest
from scipy.optimize import brentq

from drake_racket.identify.ball.impacts import read_ball_impacts
from drake_racket.identify.frame.hammer_record import read_hammer_record
from drake_racket.io.errors import InputError
from drake_racket.parameters.ball import load_ball
from drake_racket.parameters.quantities import Quantities
from drake_racket.parameters.racket import load_racket
from studies.synthetic_laboratory.laboratory import (
    OBLIQUE_COLUMNS,
    RESTITUTION_COLUMNS,
    Noise,
    oblique_table,
    restitution_table,
    write_measurements,
)
from studies.synthetic_laboratory.records import (
    HAMMER_BEFORE,
    hammer_strikes,
    plate_impacts,
    write_hammer_strike,
    write_plate_impacts,
)
from tests.conftest import clamped_problem, kb_cb
from tests.oracles.clamped_impact import simulate as clamped_oracle
from tests.oracles.damped_oscillator import Oscillator

RACKET, BALL = load_racket("recreational", "high"), load_ball()


def rng(seed: int = 7) -> np.random.Generator:
    return np.random.default_rng(seed)


def without_friction():
    mu = Quantities([0.0, 0.0, 0.0], "1", "inferred", "a test")
    friction = dataclasses.replace(RACKET.friction, coefficients=mu)
    return dataclasses.replace(RACKET, friction=friction)


def table(**changes):
    return restitution_table(RACKET, BALL, rng(), **changes)


def test_without_errors_restitution_is_that_of_the_oracle():
    found = table(points=[1, 8], speeds=[30.0], repeats=1, noise=Noise.none())
    for point, speed, e in zip(
        found["point"].to_numpy(),
        found["approach_speed"].to_numpy(),
        found["restitution"].to_numpy(),
        strict=True,
    ):
        expected = clamped_oracle(clamped_problem("recreational", "high", int(point), speed))
        assert e == pytest.approx(expected.rebound_speed / speed, abs=2e-6)


def test_repeats_differ_in_truth_and_in_what_is_measured():
    noise = Noise(speed=0.1, scatter=0.5)
    found = table(points=[2, 5], speeds=[18.0, 33.0], repeats=200, noise=noise)
    true, nominal = found["true_approach_speed"], found["nominal_speed"]
    off = (true - nominal).to_numpy()
    assert np.abs(off).max() <= 0.5
    assert off.std() == pytest.approx(0.5 / np.sqrt(3.0), rel=0.1)
    errors = [
        (found[f"{name}_speed"] - found[f"true_{name}_speed"]).to_numpy()
        for name in ("approach", "rebound")
    ]
    for error in errors:
        assert error.std() == pytest.approx(0.1, rel=0.1)
        assert abs(error.mean()) < 4.0 * 0.1 / np.sqrt(len(error))
    assert abs(np.corrcoef(*errors)[0, 1]) < 4.0 / np.sqrt(len(errors[0]))
    ratio = found["rebound_speed"] / found["approach_speed"]
    assert found["restitution"].to_numpy() == pytest.approx(ratio.to_numpy(), rel=1e-15)


def test_an_error_read_as_a_limit_stays_within_it():
    noise = Noise(speed=0.1, reading="limit")
    found = table(points=[5], speeds=[25.0], repeats=400, noise=noise)
    error = (found["rebound_speed"] - found["true_rebound_speed"]).to_numpy()
    assert 0.095 < np.abs(error).max() <= 0.1
    assert error.std() == pytest.approx(noise.speed_sigma, rel=0.1)


def test_the_seed_decides_everything():
    first, again = (table(points=[5], repeats=2) for _ in range(2))
    assert first.identical(again)
    other = restitution_table(RACKET, BALL, rng(8), points=[5], repeats=2)
    assert not np.array_equal(first["restitution"], other["restitution"])


@pytest.mark.parametrize("reading", ["from_plane", "from_normal"])
def test_without_friction_the_tangential_speed_stays(reading):
    racket = without_friction()
    settings = {"angle_readings": [reading], "repeats": 1, "noise": Noise.none()}
    found = oblique_table(racket, BALL, rng(), points=[3, 5], **settings)
    slant = np.radians(found["incidence"].to_numpy())
    speed, angle = found["approach_speed"].to_numpy(), np.radians(found["rebound_angle"].to_numpy())
    tangential = found["rebound_speed"].to_numpy() * np.sin(angle)
    assert tangential == pytest.approx(speed * np.sin(slant), rel=1e-9)


def test_a_grazing_ball_slides_throughout_so_friction_takes_mu_times_the_normal_impulse():
    settings = {"points": [1, 2, 5], "repeats": 1, "noise": Noise.none()}
    found = oblique_table(RACKET, BALL, rng(), **settings)
    mu = np.array(RACKET.friction_coefficients())[found["point"].to_numpy() - 1]
    slant = np.radians(found["incidence"].to_numpy())
    speed, angle = found["approach_speed"].to_numpy(), np.radians(found["rebound_angle"].to_numpy())
    back = found["rebound_speed"].to_numpy()
    gained = back * np.cos(angle) + speed * np.cos(slant)
    lost = speed * np.sin(slant) - back * np.sin(angle)
    # the smooth law has mu v / sqrt(v^2 + s^2), s = 0.02 m/s, at 15 m/s and more
    assert lost == pytest.approx(mu * gained, rel=1e-5)


def test_a_steep_ball_stops_sliding_and_does_not_turn_back():
    settings = {"angle_readings": ["from_normal"], "points": [1, 5], "repeats": 1}
    found = oblique_table(RACKET, BALL, rng(), **settings, noise=Noise.none())
    along = found["rebound_speed"] * np.sin(np.radians(found["rebound_angle"]))
    # what the smooth friction law leaves of 7 to 9 m/s; too long a step shakes it
    assert (along >= 0.0).all()
    assert (along < 1e-3).all()


def test_angles_have_the_error_that_the_speeds_imply_or_the_one_stated():
    settings = {"points": [5], "strokes": ["slice"], "repeats": 150}
    implied = oblique_table(RACKET, BALL, rng(), **settings)
    error = np.radians((implied["rebound_angle"] - implied["true_rebound_angle"]).to_numpy())
    expected = 0.1 / implied["true_rebound_speed"].to_numpy().mean()
    assert error.std() == pytest.approx(expected, rel=0.2)
    stated = oblique_table(RACKET, BALL, rng(), **settings, noise=Noise(angle=0.03))
    error = np.radians((stated["rebound_angle"] - stated["true_rebound_angle"]).to_numpy())
    assert error.std() == pytest.approx(0.03, rel=0.2)


def test_plate_forces_are_the_oscillators(tmp_path):
    speed = 27.0
    (impact,) = plate_impacts(BALL, rng(), speeds=[speed], noise=Noise.none())
    kb, cb = kb_cb(BALL, speed)
    oracle = Oscillator(BALL.mass.value, kb, cb, speed)
    time, force = impact.force.time, impact.force.value
    first = int(np.flatnonzero(force > 0.0)[0])
    step = time[1] - time[0]
    # touch lies within the sample before; the force tells where
    touch = brentq(
        lambda t: oracle.force(time[first + 9] - t) - force[first + 9],
        -step,
        2.0 * step,
        xtol=1e-12,
    )
    assert 0.0 <= touch < step
    for i in (first + 20, first + 60, first + 120):
        assert force[i] == pytest.approx(oracle.force(time[i] - touch), rel=1e-6)
    assert impact.speed == speed
    write_plate_impacts([impact], tmp_path)
    (read,) = read_ball_impacts(tmp_path / "impacts.csv")
    assert np.array_equal(read.force.time, time)
    assert np.array_equal(read.force.value, force)
    assert read.speed == speed


def test_the_plates_sensor_has_the_noise_stated():
    (impact,) = plate_impacts(BALL, rng(), speeds=[24.0], noise=Noise(force=0.01))
    quiet = impact.force.value[impact.force.time < -1e-4]
    assert quiet.std() == pytest.approx(0.01 * impact.force.value.max(), rel=0.3)


def test_a_strike_is_read_back_and_rings(tmp_path):
    strikes = hammer_strikes(RACKET, "in_plane", rng(), strikes=2, duration=0.01)
    peaks = [force.value.max() for force, _ in strikes]
    assert peaks[0] != pytest.approx(peaks[1], rel=1e-3)
    assert all(75.0 < peak < 125.0 for peak in peaks)
    write_hammer_strike(strikes[0], tmp_path / "strike.csv")
    record = read_hammer_record(tmp_path / "strike.csv")
    assert record.pulse == pytest.approx(1e-3, rel=0.15)
    assert -0.5e-3 - 1e-9 <= record.start <= 0.1e-3
    force, acceleration = strikes[0]
    assert force.time[0] == pytest.approx(-HAMMER_BEFORE)
    late = acceleration.value[acceleration.time > 2e-3]
    assert late.std() > 5.0 * acceleration.value[acceleration.time < -1e-5].std()


def test_the_csv_files_have_the_columns_and_lose_no_digit(tmp_path):
    normal = table(points=[5], repeats=2)
    oblique = oblique_table(RACKET, BALL, rng(), points=[5], repeats=1)
    for name, data, columns in (
        ("restitution", normal, RESTITUTION_COLUMNS),
        ("oblique", oblique, OBLIQUE_COLUMNS),
    ):
        path = tmp_path / f"{name}.csv"
        write_measurements(data, columns, path)
        with path.open(newline="") as file:
            rows = list(csv.DictReader(file))
        assert list(rows[0]) == list(columns)
        assert not any("true" in column for column in columns)
        for column, variable in columns.items():
            assert [float(row[column]) for row in rows] == data[variable].to_numpy().tolist()


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"points": [0]}, "points"),
        ({"points": []}, "points"),
        ({"speeds": [float("nan")]}, "speeds"),
        ({"speeds": [5.0]}, "speeds"),
        ({"repeats": 0}, "repeats"),
    ],
)
def test_bad_requests_are_named(changes, key):
    with pytest.raises(InputError) as error:
        table(**changes)
    assert error.value.key == key


@pytest.mark.parametrize(
    "changes",
    [
        {"speed": -0.1},
        {"speed": float("nan")},
        {"reading": "guess"},
        {"angle": 1.0},
        {"force": 0.5},
        {"strikes": 1.0},
    ],
)
def test_bad_errors_are_named(changes):
    with pytest.raises(InputError) as error:
        Noise(**changes)
    assert error.value.key == next(iter(changes))


@pytest.mark.slow
def test_the_study_writes_the_same_files_for_the_same_seed(tmp_path, monkeypatch):
    study = "studies.synthetic_laboratory"
    options = ["--speeds", "18", "33", "--repeats", "1", "--strikes", "1", "--seed", "3"]
    for out in ("a", "b"):
        monkeypatch.setattr(sys, "argv", [str(study), "--out", str(tmp_path / out), *options])
        runpy.run_module(study, run_name="__main__")
    names = sorted(p.relative_to(tmp_path / "a") for p in (tmp_path / "a").rglob("*.csv"))
    assert len(names) == 1 + 2 + 2 + 3
    for name in names:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()

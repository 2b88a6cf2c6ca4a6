"""`drake-racket identify`: files, refusals, checkpoints; killed runs end with the same answer."""

from __future__ import annotations

import contextlib
import json
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray

from drake_racket.cli.identify import app
from drake_racket.io.errors import InputError
from drake_racket.parameters.ball import load_ball, read_ball
from drake_racket.parameters.racket import load_racket, read_racket
from studies.synthetic_laboratory.laboratory import (
    OBLIQUE_COLUMNS,
    RESTITUTION_COLUMNS,
    Noise,
    oblique_table,
    restitution_table,
    write_measurements,
)
from studies.synthetic_laboratory.records import (
    hammer_strikes,
    plate_impacts,
    write_hammer_strike,
    write_plate_impacts,
)


def call(*arguments: object) -> Any:
    return app([str(a) for a in arguments], standalone_mode=False)


def results(out: Path) -> dict[str, Any]:
    """What must not depend on how often a run was interrupted."""
    found = json.loads((out / "result.json").read_text())
    return {k: v for k, v in found.items() if k != "seconds"}


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two points, two speeds, three shots each, of the racket strung at 280 N."""
    path = tmp_path_factory.mktemp("data") / "restitution.csv"
    racket, rng = load_racket("tour", "280"), np.random.default_rng(5)
    made = restitution_table(
        racket, load_ball(), rng, points=[4, 5], speeds=[20.0, 30.0], repeats=3
    )
    write_measurements(made, RESTITUTION_COLUMNS, path)
    return path


def test_tension_from_a_file_and_again(measured: Path, tmp_path: Path, capsys: Any) -> None:
    out = tmp_path / "out"
    run = ("tension", measured, "--out", out, "--strung-at", 280, "--starts", 1, "--name", "mine")
    call(*run)
    printed = capsys.readouterr().out
    assert "RMS difference" in printed
    assert "95 % interval" in printed
    racket = read_racket(out / "racket.yaml")
    true = load_racket("tour", "280").string_bed.initial_tension.value
    assert racket.name == "mine"
    assert racket.string_bed.initial_tension.value == pytest.approx(true, rel=0.1)
    assert racket.string_bed.stringing_tension.value == 280.0
    data = xarray.load_dataset(out / "result.nc", engine="h5netcdf")
    low, high = data["confidence_interval"].to_numpy()[0]
    assert low < racket.string_bed.initial_tension.value < high
    assert {"measurement", "parameter"} <= set(data.sizes)
    assert len((out / "residuals.csv").read_text().splitlines()) == 5
    first = results(out)
    call(*run)  # from the checkpoint
    assert results(out) == first
    capsys.readouterr()
    # the checkpoint of other data is refused, unless it may go
    text = measured.read_text().splitlines()
    other = tmp_path / "other.csv"
    other.write_text("\n".join(text[:-1]) + "\n")
    with pytest.raises(InputError, match="--fresh"):
        call("tension", other, *run[2:])
    assert results(out) == first


REFUSED = {
    "start": (["strings", "--start", "T0:600"], "--start: got 'T0:600'"),
    "number": (["strings", "--start", "T0=high"], "--start T0: got 'high'"),
    "free": (["strings", "--free", "T0,q1"], "free: got 'q1'"),
    "method": (["strings", "--method", "luck"], "method: got 'luck'"),
    "starts": (["strings", "--starts", "0"], "--starts: got 0"),
    "polish": (["strings", "--polish"], "polish"),
    "evaluations": (["strings", "--evaluations", "0"], "--evaluations: got 0"),
    "temperature": (["strings", "--temperature", "nan"], "--temperature: got nan"),
    "racket": (["strings", "--racket", "wooden"], "racket: got 'wooden'"),
    "ball": (["strings", "--ball", "none.yaml"], "none.yaml"),
    "select": (["strings", "--select", "tension=low"], "column tension"),
    "sigma": (["strings", "--speed-sigma", "-1"], "speed_sigma: got -1.0"),
    "strung at": (["tension", "--strung-at", "5"], "--strung-at: got 5.0"),
    "reading": (["friction", "--friction-reading", "x"], "incidence"),  # the table is read first
}


@pytest.mark.parametrize("name", REFUSED)
def test_bad_options_are_refused_before_anything_is_written(
    name: str, measured: Path, tmp_path: Path
) -> None:
    (command, *options), message = REFUSED[name]
    out = tmp_path / "out"
    with pytest.raises(InputError, match=message):
        call(command, measured, "--out", out, *options)
    assert not out.exists()


def test_out_that_cannot_be_written(measured: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="--out"):
        call("tension", measured, "--out", tmp_path / "file")
    with pytest.raises(InputError, match="--in-plane"):
        call("frame", "--out", tmp_path / "x")


@pytest.mark.slow
def test_ball_frame_and_friction(tmp_path: Path) -> None:
    rng, ball, racket = np.random.default_rng(0), load_ball(), load_racket()
    table = write_plate_impacts(plate_impacts(ball, rng, speeds=[18.0, 25.0, 33.0]), tmp_path / "b")
    call("ball", table, "--out", tmp_path / "ball", "--speed-low", 18, "--speed-high", 33)
    found = read_ball(tmp_path / "ball" / "ball.yaml")
    assert found.stiffness_low.value == pytest.approx(ball.stiffness_low.value, rel=0.02)
    assert found.stiffness_low.status == "fitted"
    assert "impacts.csv and its 3 records (sha256" in found.stiffness_low.source
    assert found.mass == ball.mass
    strike = hammer_strikes(racket, "out_of_plane", rng, strikes=1)[0]
    write_hammer_strike(strike, tmp_path / "strike.csv")
    strike_options = ("--out-of-plane", tmp_path / "strike.csv", "--drake-passes", 0)
    call("frame", "--out", tmp_path / "frame", *strike_options)
    joint = read_racket(tmp_path / "frame" / "racket.yaml").throat_joint
    assert joint.stiffness_in.value == pytest.approx(910.0, rel=0.03)  # by axis: about y
    assert joint.stiffness_in.status == "fitted"
    assert joint.stiffness_out == racket.throat_joint.stiffness_out
    made = oblique_table(racket, ball, rng, points=[5, 2, 1], strokes=["slice"], noise=Noise.none())
    write_measurements(made, OBLIQUE_COLUMNS, tmp_path / "oblique.csv")
    call("friction", tmp_path / "oblique.csv", "--out", tmp_path / "mu", "--starts", 1)
    mu = read_racket(tmp_path / "mu" / "racket.yaml").friction.coefficients.value
    # the cannon's speeds scatter by nothing here, so the means are the truth
    assert mu == pytest.approx(racket.friction.coefficients.value, rel=1e-6)
    for name in ("ball", "frame", "mu"):
        assert (tmp_path / name / "report.md").stat().st_size > 500
        assert json.loads((tmp_path / name / "result.json").read_text())


def evaluations(checkpoint: Path) -> int:
    """How many values the files of a checkpoint have."""
    count = 0
    for path in checkpoint.glob("*.sqlite"):
        with contextlib.closing(sqlite3.connect(path)) as database:
            count += database.execute("SELECT count(*) FROM evaluations").fetchone()[0]
    return count


def kill_and_go_on(arguments: list[str], out: Path, log: Path) -> None:
    """Runs the command, kills it when a checkpoint has some values, and runs it to its end."""
    code = "import sys; from drake_racket.cli.identify import app; app(sys.argv[1:])"
    command = [sys.executable, "-c", code, *arguments, "--out", str(out)]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        for _ in range(12_000):
            if log.exists() and log.stat().st_size > 40_000:
                break
            assert process.poll() is None
            time.sleep(0.005)
        process.send_signal(signal.SIGKILL)
    assert process.returncode == -signal.SIGKILL
    assert not (out / "result.json").exists()
    before = evaluations(log.parent)
    assert before > 0
    subprocess.run(command, check=True, capture_output=True)
    assert evaluations(log.parent) > before


@pytest.mark.parametrize(
    "method",
    [
        pytest.param("least-squares", marks=pytest.mark.exhaustive),
        pytest.param("annealing", marks=pytest.mark.slow),
    ],
)
def test_killed_fit_ends_with_the_same_answer(method: str, measured: Path, tmp_path: Path) -> None:
    options = ["--free", "T0,k3,k4", "--start", "T0=300", "--method", method]
    if method == "annealing":
        options += ["--starts", "2", "--evaluations", "200"]
    else:
        options += ["--starts", "12", "--keep-repeats", "--span", "30"]
    arguments = ["strings", str(measured), *options]
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    call(*arguments, "--out", whole)
    name = "chain_00" if method == "annealing" else "start_02"
    kill_and_go_on(arguments, parts, parts / "checkpoint" / f"{name}.sqlite-wal")
    assert results(parts) == results(whole)
    assert (parts / "racket.yaml").read_text() == (whole / "racket.yaml").read_text()

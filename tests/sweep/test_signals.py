"""Sweeps that are ended by signals, exported while they run, or asked for what is not installed."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import xarray
from typer.testing import CliRunner

from drake_racket import InputError, Scenario
from drake_racket.cli import app
from drake_racket.io.interrupts import Terminated, terminable
from drake_racket.sweep import export_sweep, load_sweep, make_sweep, run_sweep
from drake_racket.sweep.store import read_sweep
from tests.conftest import ROOT

YAML = """
base: {support: clamped_head, audit: false, approach_time: 1e-4, after: 0.006}
axes:
  speed: {from: 18, to: 33, count: 200, unit: m/s}
outputs: [rebound_speed]
"""
BASE = Scenario(support="clamped_head", audit=False, approach_time=1e-4, after=0.002)


def start(file: Path, out: Path, *options: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "drake_racket.cli", "sweep", file, "--out", out, *options],
        cwd=ROOT,
        stderr=subprocess.PIPE,
        text=True,
    )


def count(out: Path) -> int:
    """Finished cases of a sweep that is running."""
    if not (out / "sweep.sqlite").exists():
        return 0
    try:
        with contextlib.closing(read_sweep(out)) as store:
            ((found,),) = store.read("SELECT count(*) FROM cases")
    except InputError:  # it is being made
        return 0
    return int(found)


@pytest.mark.parametrize(
    ("number", "workers", "times"),
    [
        (signal.SIGTERM, 1, 1),
        pytest.param(signal.SIGINT, 1, 1, marks=pytest.mark.slow),
        pytest.param(signal.SIGTERM, 2, 2, marks=pytest.mark.slow),
        pytest.param(signal.SIGINT, 2, 2, marks=pytest.mark.slow),
    ],
)
def test_a_signal_leaves_what_is_finished_and_says_how_to_go_on(number, workers, times, tmp_path):
    file, out = tmp_path / "sweep.yaml", tmp_path / "out"
    file.write_text(YAML)
    sweep = load_sweep(file)
    process = start(file, out, "--workers", str(workers), "--quiet")
    end = time.monotonic() + 120.0
    while count(out) < 2:
        assert process.poll() is None
        assert time.monotonic() < end
        time.sleep(0.02)
    # meanwhile another process may export what is there
    meanwhile = export_sweep(sweep, out)
    assert process.poll() is None
    for _ in range(times):
        os.kill(process.pid, number)
    _, said = process.communicate(timeout=60.0)
    assert process.returncode == 128 + number
    (line,) = said.splitlines()
    word = {signal.SIGTERM: "terminated", signal.SIGINT: "interrupted"}[number]
    assert line == (
        f"drake-racket: {word}; what is finished is in {out}: the same command goes on from there"
    )
    with xarray.open_dataset(out / "results.nc") as stored:
        dataset = stored.load()
    done = dataset["status"].to_numpy() == 0
    assert 2 <= done.sum() == count(out) < 200
    assert (dataset["status"].to_numpy()[~done] == 2).all()
    assert np.array_equal(np.isfinite(dataset["rebound_speed"].to_numpy()), done)
    before = meanwhile["status"].to_numpy() == 0
    assert 2 <= before.sum() <= done.sum()
    assert np.array_equal(
        meanwhile["rebound_speed"].to_numpy()[before], dataset["rebound_speed"].to_numpy()[before]
    )


@pytest.mark.parametrize(
    ("number", "within", "raised"),
    [
        (signal.SIGTERM, terminable, Terminated),
        (signal.SIGINT, terminable, KeyboardInterrupt),
        (signal.SIGINT, contextlib.nullcontext, KeyboardInterrupt),  # called from Python
    ],
)
def test_a_signal_is_not_the_failure_of_a_case(tmp_path, monkeypatch, number, within, raised):
    """Libraries turn an interrupt into an error of their own: the case has not failed by that."""
    (tmp_path / "sweep.yaml").write_text(YAML.replace("base: {", "base: {engine: drake, "))
    out = tmp_path / "out"

    def interrupted(*args, **kwargs):
        with contextlib.suppress(KeyboardInterrupt):
            os.kill(os.getpid(), number)
        raise RuntimeError("a callback failed")

    monkeypatch.setattr("drake_racket.sweep.worker.simulate", interrupted)
    handler = signal.getsignal(signal.SIGINT)
    with within(), pytest.raises(raised):
        run_sweep(load_sweep(tmp_path / "sweep.yaml"), out)
    assert count(out) == 0
    assert signal.getsignal(signal.SIGINT) is handler


@pytest.fixture
def half(tmp_path, monkeypatch):
    """A sweep's file, and a directory in which half of it has run."""
    monkeypatch.setattr("drake_racket.sweep.runner.TOGETHER", 0.0)
    file, out = tmp_path / "sweep.yaml", tmp_path / "out"
    file.write_text(YAML.replace("count: 200", "count: 2").replace("0.006", "0.002"))
    seen = []

    def stop(now):
        seen.append(now)
        if now.task == "running" and now.done == 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_sweep(load_sweep(file), out, progress=stop)
    return file, out


def test_the_command_exports_and_runs_nothing(half):
    file, out = half
    whole = (out / "results.nc").read_bytes()
    for name in ("results.nc", "results.csv", "sweep.json"):
        (out / name).unlink()
    done = CliRunner().invoke(app, ["sweep", str(file), "--out", str(out), "--export"])
    assert done.exit_code == 0
    assert "2 cases, 0 failed, 1 missing" in done.stdout
    with xarray.open_dataset(out / "results.nc") as dataset:
        assert dataset["status"].to_numpy().tolist() == [0, 2]
    assert (out / "results.csv").exists()
    assert len((out / "results.nc").read_bytes()) == len(whole)


def test_an_export_is_of_the_sweep_that_is_there_and_of_no_other(half, tmp_path):
    file, out = half
    with pytest.raises(InputError, match="a directory with a sweep"):
        export_sweep(load_sweep(file), tmp_path / "nowhere")
    other = make_sweep(BASE, {"speed": {"values": [18.0, 34.0], "unit": "m/s"}}, ["rebound_speed"])
    with pytest.raises(InputError, match=r"axes\.speed.*as the sweep in there") as error:
        export_sweep(other, out)
    assert "\n" not in str(error.value)
    arguments = ["sweep", str(file), "--out", str(out), "--export", "--fresh"]
    assert "--export" in str(CliRunner().invoke(app, arguments).exception)


def test_a_missing_library_is_named_before_anything_is_done(tmp_path, monkeypatch):
    monkeypatch.setattr("drake_racket.io.extras.find_spec", lambda name: None)
    sweep = make_sweep(BASE, {"point": [5]}, ["kb"])
    seen = []
    with pytest.raises(InputError, match=r"pip install 'drake-racket\[dask\]'") as error:
        run_sweep(sweep, tmp_path / "a", scheduler="tcp://127.0.0.1:9999", progress=seen.append)
    assert "\n" not in str(error.value)
    assert not seen
    file = tmp_path / "sweep.yaml"
    file.write_text(YAML)
    arguments = ["sweep", str(file), "--out", str(tmp_path / "a"), "--scheduler", "tcp://a:1"]
    assert "drake-racket[dask]" in str(CliRunner().invoke(app, arguments).exception)
    assert not (tmp_path / "a").exists()


def test_a_missing_pyarrow_is_named_before_anything_is_done(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    with pytest.raises(InputError, match=r"pip install 'drake-racket\[parquet\]'"):
        make_sweep(BASE, {"point": [5]}, ["kb"], "all", ["parquet"])


def test_a_full_disk_stops_a_sweep_in_one_line_and_keeps_what_is_finished(tmp_path, monkeypatch):
    import resource

    from drake_racket.sweep import SweepStopped

    monkeypatch.setattr("drake_racket.sweep.runner.TOGETHER", 0.0)
    sweep = make_sweep(BASE, {"point": [5, 2, 8]}, ["kb"])
    before = resource.getrlimit(resource.RLIMIT_FSIZE)

    def fill(now):
        if now.task == "running" and now.done == 1:
            resource.setrlimit(resource.RLIMIT_FSIZE, (1, before[1]))

    try:
        with pytest.raises(SweepStopped, match=r"after 1 of 3 cases; they are kept") as error:
            run_sweep(sweep, tmp_path, progress=fill)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert "\n" not in str(error.value)
    assert count(tmp_path) == 1
    assert (run_sweep(sweep, tmp_path)["status"].to_numpy() == 0).all()
